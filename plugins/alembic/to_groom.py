"""A groom of the curves of an Alembic file, in the head frame."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import BoolArray, Float32Array
from hairkit.errors import FormatError
from hairkit.grooming.adopt_strands import adopt, pack_strands
from hairkit.io.coordinate_space import FileSpace
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.strands import Strands

from .curve_sets import CurveSet, read_curve_sets
from .options import Options

_FARTHEST = 1e6
_log = logging.getLogger("hairkit")


def read_groom(path: Path, options: Options) -> Groom:
    """Return all curves of a file as one groom, at the first frame.

    Raises
    ------
    FormatError
        The file is damaged or has no curves of two or more points.
    InputError
        The file is missing, or its unit cannot be right.
    """
    sets = read_curve_sets(path)
    _say_what_is_left_out(sets, path)
    strands, kept = _strands(sets, options.space, path)
    colour = _together([part.colour for part in sets])
    material = _material(strands, None if colour is None else colour[kept])
    return adopt(strands, options, path, material)


def _say_what_is_left_out(sets: list[CurveSet], path: Path) -> None:
    frames = max(part.frames for part in sets)
    if frames > 1:
        _log.warning("%s: animated, %d frames; the first is read", path, frames)
    if not all(part.plain for part in sets):
        _log.warning(
            "%s: closed or Hermite curves; their control points are taken as open polylines", path
        )


def _strands(sets: list[CurveSet], space: FileSpace, path: Path) -> tuple[Strands, BoolArray]:
    """Return the strands and which points (P,) of all sets they kept."""
    counts = np.concatenate([part.counts for part in sets])
    with np.errstate(over="ignore", invalid="ignore"):
        points = space.points_to_head(np.concatenate([part.points for part in sets]))
    if not np.abs(points).max(initial=0) < _FARTHEST:
        raise FormatError(f"{path}: points lie farther away than {_FARTHEST:g} m; give its unit")
    strands, index = pack_strands(points, counts, path)
    kept = np.repeat(counts >= 2, counts)
    widths = _together([part.widths for part in sets])
    group = _fill(sets, lambda part: part.group)
    guide = _fill(sets, lambda part: part.guide)
    uv = _together([part.root_uv for part in sets])
    return replace(
        strands,
        widths=None if widths is None else _widths(widths[kept], space, path),
        root_uv=None if uv is None else uv[index],
        group=None if group is None else _int32(group[index], path),
        guide=None if guide is None else guide[index] != 0,
    ), kept


def _together(parts: list[Any]) -> Any:
    """Return the parts as one array; None where a part lacks it."""
    return None if any(part is None for part in parts) else np.concatenate(parts)


def _fill(sets: list[CurveSet], part_of: Callable[[CurveSet], Any]) -> Any:
    """Return numbers (S,) of all sets, 0 in sets without; None where no set has them."""
    parts = [part_of(one) for one in sets]
    if all(part is None for part in parts):
        return None
    zeros = (np.zeros(len(one.counts), np.int64) for one in sets)
    pairs = zip(parts, zeros, strict=True)
    return np.concatenate([zero if part is None else part for part, zero in pairs])


def _widths(widths: Float32Array, space: FileSpace, path: Path) -> Float32Array:
    with np.errstate(over="ignore"):
        metres: Float32Array = widths * np.float32(space.metres)
    if not (metres.min() >= 0 and metres.max() < _FARTHEST):
        raise FormatError(f"{path}: widths from {metres.min():g} to {metres.max():g} m")
    return metres


def _int32(numbers: Any, path: Path) -> Any:
    if np.abs(numbers).max() > np.iinfo(np.int32).max:
        raise FormatError(f"{path}: a groom_group_id of {np.abs(numbers).max()}")
    return numbers.astype(np.int32)


def _material(strands: Strands, colour: Float32Array | None) -> HairMaterial | None:
    """Return the mean colours of roots and tips; None leaves the look to `adopt`."""
    if colour is None:
        return None
    ends = [colour[strands.offsets[:-1]], colour[strands.offsets[1:] - 1]]
    root, tip = (end.mean(axis=0, dtype=np.float64).clip(0.0, 1.0) for end in ends)
    material = HairMaterial(root.astype(np.float32), tip.astype(np.float32))
    if strands.widths is not None and (strands.widths > 0).any():
        material = replace(material, width=float(strands.widths[strands.widths > 0].mean()))
    return material
