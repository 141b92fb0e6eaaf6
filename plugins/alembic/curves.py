"""Content of an Alembic file for a groom: in the file's space, within Unreal's limits."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Int32Array, Int64Array
from hairkit.errors import InputError
from hairkit.grooming.guide_weights import GuideWeights, closest_guides, guide_mask
from hairkit.grooming.prepare_export import PreparedGroom
from hairkit.io.coordinate_space import FileSpace
from hairkit.types.groom import HairMaterial
from hairkit.types.point_cache import PointCache
from hairkit.types.strand_blocks import Profile, colours
from hairkit.types.strands import GROUP_NAMES, Strands

from .options import Options

UNREAL_GROUP_CURVES, UNREAL_GROUP_POINTS = 4_194_303, 16_777_215
"""The most curves and points of one group that Unreal reads."""
_IRREGULAR = 0.01

_log = logging.getLogger("hairkit")


@dataclass(frozen=True, eq=False)
class GroomCurves:
    """One curves object and its groom attributes, in the file's axes and unit."""

    points: Float32Array
    """(P, 3) at rest."""
    counts: Int32Array
    """(S,) points of each curve."""
    widths: Float32Array
    """(P,) diameters."""
    root_uv: Float32Array
    """(S, 2)."""
    density: Float32Array
    """(S,) density of the hair about each root, 0 to 1."""
    colour: Profile
    """(P, 3) linear RGB."""
    group: Int32Array
    """(S,)."""
    group_names: list[str]
    """(S,) in words."""
    guide: BoolArray | None
    """(S,) or None where guides and hair are not distinguished."""
    closest: GuideWeights | None
    """Guides of each curve; None where there are none to follow."""
    attributes: bool
    """False: curves, widths and uv alone."""
    split: bool
    """Whether each group is an object of its own."""
    curl: tuple[float, float] | None
    """Radius and pitch of the helices that strands are wound into, in the file's unit, or None."""
    cache: PointCache | None
    """Frames (T, P, 3) in the head frame, or None for a still groom."""
    space: FileSpace
    """The file's space, for the frames."""

    def frame(self, number: int) -> Float32Array:
        """Return (P, 3) the points at a frame, in the file's space."""
        if self.cache is None:
            return self.points
        return self.space.points_to_file(self.cache.points[number])


def groom_curves(ready: PreparedGroom, options: Options) -> GroomCurves:
    """Return what is written of a prepared groom.

    Where the strands are guides and nothing else they are not marked: Unreal draws unmarked
    strands and picks its guides among them, and a reader takes them as guides again.

    Raises
    ------
    InputError
        A group has more curves or points than Unreal takes, and `axis` is Unreal's.
    """
    strands, space = ready.groom.strands, options.space
    fitted, cache = _limit_points(strands, ready.cache, options.max_points)
    guide = guide_mask(strands)
    marked, listed = options.mark_guides or not guide.all(), options.attributes
    assert fitted.widths is not None  # `prepare_export` has filled in all three
    assert fitted.root_uv is not None
    assert fitted.group is not None
    unreal, group = options.axis == "unreal", fitted.group
    _check_groups(group, fitted.counts, strict=unreal)
    _check_roots(fitted.widths[fitted.offsets[:-1]])
    return GroomCurves(
        points=space.points_to_file(fitted.points),
        counts=fitted.counts.astype(np.int32),
        widths=fitted.widths / np.float32(space.metres),
        root_uv=fitted.root_uv,
        density=ready.groom.root_density,
        colour=colours(ready.groom.material, fitted),
        # Unreal expects 0, 1, 2, ...
        group=np.unique(group, return_inverse=True)[1].astype(np.int32) if unreal else group,
        group_names=[GROUP_NAMES.get(number, f"hair_{number}") for number in group.tolist()],
        guide=guide if marked else None,
        closest=closest_guides(strands) if listed and marked and guide.any() else None,
        attributes=listed,
        split=options.split and len(np.unique(group)) > 1,
        curl=_curl(ready.groom.material, space) if listed else None,
        cache=cache,
        space=space,
    )


def _curl(material: HairMaterial, space: FileSpace) -> tuple[float, float] | None:
    if material.curl_radius <= 0:
        return None
    return material.curl_radius / space.metres, material.curl_pitch / space.metres


def _limit_points(
    strands: Strands, cache: PointCache | None, most: int
) -> tuple[Strands, PointCache | None]:
    """Return strands, and their frames, of at most so many points; longer ones are resampled."""
    if cache is not None:
        _check_times(cache)
    long = strands.counts > most
    if not long.any():
        return strands, cache
    _log.warning("%d strands of more than %d points are resampled to these", long.sum(), most)
    fitted = _shorten(strands, long, most)
    if cache is not None:
        moving = (replace(strands, points=points) for points in cache.points)
        frames = np.stack([_shorten(frame, long, most).points for frame in moving])
        cache = PointCache(frames, cache.times, cache.head_from_rest)
    return fitted, cache


def _shorten(strands: Strands, long: BoolArray, most: int) -> Strands:
    """Return the strands, those that the mask (S,) names resampled to `most` points."""
    resampled = strands.select(long).resampled(most)
    counts: Int64Array = np.minimum(strands.counts, most)
    new, old = np.repeat(long, counts), ~np.repeat(long, strands.counts)
    points = np.empty((counts.sum(), 3), np.float32)
    points[new], points[~new] = resampled.points, strands.points[old]
    widths = None
    if strands.widths is not None and resampled.widths is not None:
        widths = np.empty(len(points), np.float32)
        widths[new], widths[~new] = resampled.widths, strands.widths[old]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    return replace(strands, points=points, offsets=offsets, widths=widths)


def _check_groups(group: Int32Array, counts: Int64Array, strict: bool) -> None:
    numbers, place = np.unique(group, return_inverse=True)
    curves, points = np.bincount(place), np.bincount(place, counts)
    for name, most, have in (
        ("curves", UNREAL_GROUP_CURVES, curves),
        ("points", UNREAL_GROUP_POINTS, points),
    ):
        worst = int(have.argmax())
        if have[worst] > most:
            text = (
                f"group {numbers[worst]} has {int(have[worst])} {name}, Unreal takes {most};"
                " write fewer hairs or points, or more groups"
            )
            if strict:
                raise InputError(text)
            _log.warning("%s", text)


def _check_roots(widths: Float32Array) -> None:
    bare = np.count_nonzero(widths <= 0)
    if bare:
        _log.warning("%d strands are 0 wide at the root; Unity then ignores all widths", bare)


def _check_times(cache: PointCache) -> None:
    """Alembic's uniform sampling is what Unreal and Blender expect, so it is always written."""
    step = np.diff(cache.times) * cache.frames_per_second
    if len(step) and np.abs(step - 1).max() > _IRREGULAR:
        _log.warning(
            "the cache's frames are not evenly spaced; they are written as %g frames per second",
            cache.frames_per_second,
        )
