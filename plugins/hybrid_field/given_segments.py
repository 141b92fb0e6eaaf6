"""Oriented 3D segments from another program in the place of those found in the photos.

The patent takes them from "existing techniques". They are metres in the head frame, the frame of
the cameras in the scene.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hairkit import Hull, Strands
from hairkit.arrays import BoolArray, Float32Array, Int64Array, check_reach
from hairkit.errors import DataError, FormatError, InputError
from hairkit.io.byte_reader import finite
from hairkit.io.ply_elements import columns, read_elements, strand_order, vertex_points
from hairkit.storage import read_bytes, read_npz

from .photo_lines import STEP

_ALONG = (-1.0, 0.0, 1.0)
"""Points of the segment at a point with a direction, in steps."""


def read_segments(path: Path) -> Strands:
    """Return the polylines of a file, points `STEP` apart, metres.

    * .ply: vertices x y z with edges or an element `strand` (`nsegs`); or a cloud of points whose
      normals nx ny nz hold the direction of hair
    * .npz: `points` (P, 3) with `offsets` (S + 1,); or with `directions` (P, 3)

    Which way a segment points does not matter. Raises `FormatError` for other content.
    """
    points, directions, counts = _read_npz(path) if path.suffix == ".npz" else _read_ply(path)
    check_reach(finite(points, path, "points"), path, "points")
    if directions is not None:
        length = np.linalg.norm(finite(directions, path, "directions"), axis=1)
        known = length > 0
        unit = directions[known] / length[known, None]
        steps = STEP * np.array(_ALONG, np.float32)
        points = (points[known, None] + steps[:, None] * unit[:, None]).reshape(-1, 3)
        counts = np.full(np.count_nonzero(known), len(_ALONG))
    offsets = np.concatenate([[0], np.cumsum(counts)])
    try:
        lines = Strands(points.astype(np.float32), offsets)
    except DataError as error:
        raise FormatError(f"{path}: {error}") from error
    lines = lines.select((lines.counts > 1) & (lines.lengths() > 0))
    if not len(lines):
        raise FormatError(f"{path}: holds no segments")
    return lines.resampled_by_length(STEP)


def segments_in_hair(lines: Strands, hull: Hull, path: Path) -> Strands:
    """Return the lines of which at least half of the points lie in the loose hull.

    Raises `InputError` if fewer than half of the lines do: they are in another frame or unit.
    """
    at = np.floor((lines.points - hull.grid.origin) / hull.grid.spacing).astype(np.int64)
    inside: BoolArray = np.all((at >= 0) & (at < hull.grid.shape), axis=1)
    inside[inside] = hull.loose[tuple(at[inside].T)]
    share = np.add.reduceat(inside.astype(float), lines.offsets[:-1]) / lines.counts
    kept = lines.select(share >= 0.5)
    if 2 * len(kept) < len(lines):
        raise InputError(
            f"{path}: {len(kept)} of {len(lines)} segments lie in the hair of the photos; they must"
            " be in metres in the head frame, that of the cameras in scene.json"
        )
    return kept


_Read = tuple[Float32Array, Float32Array | None, Int64Array]
"""Points (P, 3), directions (P, 3) or None, and the points (S,) of each polyline."""


def _read_npz(path: Path) -> _Read:
    arrays = read_npz(path)
    points = _rows_of_three(arrays.get("points"), path, "points")
    if "offsets" in arrays:
        offsets = arrays["offsets"]
        if offsets.ndim != 1 or offsets.dtype.kind not in "iu" or not len(offsets):
            raise FormatError(f"{path}: offsets are {offsets.dtype} {offsets.shape}, expected (S,)")
        whole = offsets.astype(np.int64)
        counts = whole[1:] - whole[:-1]
        if offsets[0] != 0 or (counts < 0).any() or offsets[-1] != len(points):
            raise FormatError(f"{path}: offsets do not rise from 0 to {len(points)}, the points")
        return points, None, counts
    directions = _rows_of_three(arrays.get("directions"), path, "offsets or directions")
    if len(directions) != len(points):
        raise FormatError(f"{path}: {len(directions)} directions of {len(points)} points")
    return points, directions, np.zeros(0, np.int64)


def _read_ply(path: Path) -> _Read:
    elements = read_elements(read_bytes(path), path)
    points = vertex_points(elements, path)
    directions = columns(elements["vertex"], ("nx", "ny", "nz"))
    if directions is not None and "edge" not in elements:
        return points, directions, np.zeros(0, np.int64)
    order, counts = strand_order(elements, len(points), path)
    return points[order], None, counts


def _rows_of_three(array: object, path: Path, name: str) -> Float32Array:
    if not (isinstance(array, np.ndarray) and array.dtype.kind in "fiu" and array.ndim == 2):
        raise FormatError(f"{path}: has no {name}, expected an array of (N, 3) numbers")
    if array.shape[1] != 3:
        raise FormatError(f"{path}: {name} has shape {array.shape}, expected (N, 3)")
    with np.errstate(over="ignore"):
        result: Float32Array = array.astype(np.float32)
    return result
