"""Prepare a groom for export: choose guides or hair, drop degenerate strands, set defaults.

Exporters inherit `ExportOptions` and write what `prepare_export` returns.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hairkit.arrays import BoolArray, Float32Array
from hairkit.errors import InputError
from hairkit.grooming.densify import densify, roots_between
from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.scalp import roots_at
from hairkit.options import option
from hairkit.simulation.posing import pose_frames
from hairkit.types.groom import Groom
from hairkit.types.head import Roots
from hairkit.types.point_cache import PointCache, read_cache
from hairkit.types.strand_blocks import colours
from hairkit.types.strands import Strands

SHORTEST = 1e-5
"""Strands shorter than this, in metres, are degenerate: they have no direction."""

_log = logging.getLogger("hairkit")


@dataclass(frozen=True)
class ExportOptions:
    """Options of every exporter: which strands go into the file."""

    strands: str = option(
        "all", choices=("all", "guides", "hair"), doc="Write guides, hair between them, or both."
    )
    hairs: int = option(
        0,
        low=0,
        high=2_000_000,
        doc="Strands in all, interpolated between the guides; 0 takes those of the groom.",
    )
    seed: int = option(0, low=0, doc="Seed of the interpolated hair.")


@dataclass(frozen=True)
class AnimationOptions:
    """Option of exporters that write animation."""

    cache: Path | None = option(None, doc="Point cache that `hairkit simulate` wrote, to animate.")


@dataclass(frozen=True, eq=False)
class PreparedGroom:
    """A groom ready to be written."""

    groom: Groom
    """`widths`, `root_uv`, `group` and `guide` of its strands are all there."""
    cache: PointCache | None
    """Frames (T, P, 3) of exactly these strands, or None for a still groom."""


def prepare_export(groom: Groom, options: ExportOptions) -> PreparedGroom:
    """Return the chosen strands, complete; strands without length are dropped with a warning.

    The cache comes from options that also inherit `AnimationOptions`.

    Raises
    ------
    InputError
        Nothing is left to write, or the cache is of another groom.
    """
    path = options.cache if isinstance(options, AnimationOptions) else None
    cache = None if path is None else read_cache(path, _guides_of(groom))
    simulated = groom
    if options.hairs > len(groom.strands):
        simulated = _guides_of(groom)
        groom = dense_groom(simulated, options.hairs, options.seed)
    groom = complete_groom(groom)
    strands = groom.strands
    frames = None if cache is None else pose_frames(simulated, strands, cache)
    keep = _chosen(strands, options.strands) & ~_degenerate(strands)
    if not keep.any():
        raise InputError(f"the groom has no strands to write with strands={options.strands}")
    if frames is not None and cache is not None:
        frames = frames[:, keep[strands.strand_of_point]]
        cache = PointCache(frames, cache.times, cache.head_from_rest)
    return PreparedGroom(groom.select(keep), cache)


def dense_groom(groom: Groom, count: int, seed: int = 0) -> Groom:
    """Return the groom with `count` strands: its own, then hair interpolated between the guides.

    Strands of the groom that are not guides are replaced.
    """
    guides = _guides_of(groom)
    if count <= len(guides.strands):
        return guides
    roots = roots_between(guides, count - len(guides.strands), seed)
    strands = densify(guides, count, seed, roots=roots)
    return replace(
        guides,
        strands=strands,
        root_triangle=np.concatenate([guides.root_triangle, roots.triangle]),
        root_barycentric=np.concatenate([guides.root_barycentric, roots.barycentric]),
    )


def complete_groom(groom: Groom) -> Groom:
    """Return the groom with widths, root uv, groups and guide flags on its strands.

    Defaults: the material's width at every point, the bound root's uv, group 0, all guides.
    """
    strands = groom.strands
    values = strands.widths, strands.root_uv, strands.group, strands.guide
    if all(value is not None for value in values):
        return groom
    uv = strands.root_uv
    if uv is None:
        uv = bound_roots(groom).uv
    widths = strands.widths
    if widths is None:
        widths = np.full(len(strands.points), groom.material.width, np.float32)
    group = np.zeros(len(strands), np.int32) if strands.group is None else strands.group
    full = replace(
        strands, widths=widths, root_uv=uv, group=group, guide=guide_mask(strands).copy()
    )
    return replace(groom, strands=full)


def bound_roots(groom: Groom) -> Roots:
    """Return the places on the head that the strands are bound to."""
    return roots_at(groom.head, groom.root_triangle, groom.root_barycentric)


def point_colours(groom: Groom) -> Float32Array:
    """Return (P, 3) linear RGB of all points."""
    return colours(groom.material, groom.strands).at()


def shorter_than(strands: Strands, length: float) -> BoolArray:
    """Return (S,) which strands are shorter, metres; most are known by their first segment."""
    first = strands.offsets[:-1]
    step = np.linalg.norm(strands.points[first + 1] - strands.points[first], axis=1)
    doubtful = np.flatnonzero(step < length)
    short = np.zeros(len(strands), bool)
    if len(doubtful):
        short[doubtful] = strands.select(doubtful).lengths() < length
    return short


def _guides_of(groom: Groom) -> Groom:
    return groom.select(guide_mask(groom.strands))


def _chosen(strands: Strands, wanted: str) -> BoolArray:
    guide = guide_mask(strands)
    if wanted == "all":
        return np.ones(len(strands), bool)
    return guide if wanted == "guides" else ~guide


def _degenerate(strands: Strands) -> BoolArray:
    short = shorter_than(strands, SHORTEST)
    if short.any():
        _log.warning("%d strands without length are not written", np.count_nonzero(short))
    return short
