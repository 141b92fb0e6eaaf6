"""The smooth surface of a volume of cells, as a mesh.

Surface nets (Gibson 1998, "Constrained Elastic Surface Nets"): every 2 x 2 x 2 block of cells that
is neither all inside nor all outside gets one vertex, at the mean of the crossings on its twelve
edges; every pair of neighbouring cells with the surface between them gets the quad of the four
vertices around it.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array
from hairkit.types.volume import VoxelGrid

BLUR = 1.0
"""Standard deviation of the smoothing, cells."""
LEVEL = 0.35
"""Share of occupied cells at the surface; below a half, so that a sheet of one cell stays."""
_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
_EDGES = [
    (a, b)
    for a, b in itertools.combinations(range(8), 2)
    if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1
]


def volume_surface(
    grid: VoxelGrid, occupied: BoolArray, step: int = 1
) -> tuple[Float32Array, Int32Array, Float32Array]:
    """Return vertices (V, 3) in metres, triangles (F, 3) seen counter-clockwise, normals (V, 3).

    With a `step` above 1 the smoothed volume is taken at every so many cells: a coarser mesh.
    """
    low, high = _bounds(occupied)
    cells = occupied[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    margin = 4 * step
    smooth = gaussian_filter(np.pad(cells, margin).astype(np.float32), BLUR, truncate=3.0)
    values = np.ascontiguousarray(smooth[::step, ::step, ::step])
    blocks, places = _vertices(values)
    faces = _faces(values > LEVEL, blocks)
    normals = _normals(values, places)
    positions = grid.origin + (step * places + low - margin + 0.5) * grid.spacing
    return positions.astype(np.float32), faces, normals


def _bounds(occupied: BoolArray) -> tuple[list[int], list[int]]:
    low, high = [], []
    for axis in range(3):
        others = tuple(other for other in range(3) if other != axis)
        along = np.nonzero(occupied.any(axis=others))[0]
        low.append(int(along[0]))
        high.append(int(along[-1]) + 1)
    return low, high


def _vertices(values: Float32Array) -> tuple[Int32Array, Float64Array]:
    """Return the blocks (V, 3) that the surface passes and where in them it does, in cells."""
    inside = values > LEVEL
    shape = np.array(values.shape) - 1
    count = np.zeros(shape, np.uint8)
    for x, y, z in _CORNERS:
        count += inside[x : x + shape[0], y : y + shape[1], z : z + shape[2]]
    blocks = np.argwhere((count > 0) & (count < 8)).astype(np.int32)
    corner = np.stack([values[tuple((blocks + c).T)] for c in _CORNERS], axis=1)
    total, crossings = np.zeros((len(blocks), 3)), np.zeros(len(blocks))
    for a, b in _EDGES:
        crossed = (corner[:, a] > LEVEL) != (corner[:, b] > LEVEL)
        step = np.where(crossed, corner[:, b] - corner[:, a], 1.0)
        share = (LEVEL - corner[:, a]) / step
        place = _CORNERS[a] + share[:, None] * (_CORNERS[b] - _CORNERS[a])
        total += crossed[:, None] * place
        crossings += crossed
    return blocks, blocks + total / crossings[:, None]


def _faces(inside: BoolArray, blocks: Int32Array) -> Int32Array:
    index = np.full(np.array(inside.shape) - 1, -1, np.int32)
    index[tuple(blocks.T)] = np.arange(len(blocks), dtype=np.int32)
    faces = []
    for axis in range(3):
        ahead = np.moveaxis(inside, axis, 0)
        u, v = (axis + 1) % 3, (axis + 2) % 3
        crossed = np.moveaxis(ahead[:-1] != ahead[1:], 0, axis)
        cell = np.argwhere(crossed)
        first, second = np.eye(3, dtype=np.int64)[u], np.eye(3, dtype=np.int64)[v]
        ring = [cell, cell - first, cell - first - second, cell - second]
        quad = np.stack([index[tuple(at.T)] for at in ring], axis=1)
        leaving = inside[tuple(cell.T)]  # the surface faces along +axis
        quad = np.where(leaving[:, None], quad, quad[:, ::-1])
        faces += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return np.concatenate(faces).astype(np.int32)


def _normals(values: Float32Array, places: Float64Array) -> Float32Array:
    """Return unit vectors (V, 3) down the slope of the smoothed volume."""
    slopes = []
    for step in np.eye(3):
        ahead, behind = (
            map_coordinates(values, (places + sign * step).T, order=1) for sign in (1, -1)
        )
        slopes.append(behind - ahead)
    normals = np.stack(slopes, axis=1)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray((normals / np.maximum(length, 1e-9)).astype(np.float32))
