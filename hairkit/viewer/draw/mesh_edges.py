"""Smooth the outlines of meshes in a picture that was drawn with one sample a pixel.

Persson 2011, "Geometry buffer anti-aliasing" and "Geometric post-process anti-aliasing": where the
outline of a mesh crosses a pixel, it tells exactly how much of the pixel the mesh covers; what the
pixel lacks is taken from its neighbour across the outline.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Int32Array, Int64Array, UInt8Array
from hairkit.simulation.lanes import stage
from hairkit.simulation.vectors import HALF, ONE, ZERO, Number, inlined
from hairkit.viewer.draw.mesh_kernels import area

_TINY = np.float32(1e-6)
MOST_SMOOTHED = 16
"""Pixels of outlines that are smoothed, over the larger edge of the picture."""
_STEEP = np.float32(8)
"""Where the picture beside an outline is nearer than it by more than so many times the depth of the
outline's face, another mesh is before it."""


class Replaced(NamedTuple):
    """Pixels as they were before outlines were smoothed."""

    at: Int32Array
    """(N, 2) column and row."""
    colours: UInt8Array
    """(N, 3)."""
    used: Int64Array
    """(1,) how many."""

    @classmethod
    def for_picture(cls, picture: UInt8Array) -> Replaced:
        """Return an empty list for outlines in a picture (H, W, 4)."""
        most = MOST_SMOOTHED * max(picture.shape)
        return cls(np.empty((most, 2), np.int32), np.empty((most, 3), np.uint8), np.zeros(1, int))


def list_edges(vertices: Float32Array, faces: Int32Array) -> Int32Array:
    """Return the edges (E, 4) of a mesh: ends a and b, and opposite corners c and d.

    The one face is (a, b, c), the other (b, a, d); d is -1 where there is no second face. Vertices
    (V, 3) of the same place are one vertex.
    """
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    corners = np.concatenate([np.roll(faces, -turn, axis=1) for turn in range(3)])
    ends = np.sort(same.reshape(-1)[corners[:, :2]], axis=1).astype(np.int64)
    keys = ends[:, 0] * len(vertices) + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    _, starts, counts = np.unique(keys[order], return_index=True, return_counts=True)
    edges = np.full((len(starts), 4), -1, np.int32)
    edges[:, :3] = corners[order[starts]]
    paired = counts == 2
    edges[paired, 3] = corners[order[starts[paired] + 1], 2]
    return edges


@stage
def select_outlines(edges: Int32Array, seen: Float32Array, outlines: Int32Array) -> int:
    """Write the edges of which one face alone is seen: ends and the corner of that face.

    `seen` (V, 4) is that of `MeshState`, `outlines` (E, 3); returns how many there are.
    """
    count = 0
    for e in range(len(edges)):
        a, b, c, d = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        if min(seen[a, 3], seen[b, 3]) <= ZERO:
            continue
        one, other = _faces_camera(seen, a, b, c), d >= 0 and _faces_camera(seen, b, a, d)
        if one != other:
            outlines[count, 0], outlines[count, 1], outlines[count, 2] = a, b, c if one else d
            count += 1
    return count


@stage
def smooth_outlines(
    outlines: Int32Array,
    seen: Float32Array,
    meshes: UInt8Array,
    depth: Float32Array,
    picture: UInt8Array,
    replaced: Replaced,
) -> None:
    """Smooth outlines (N, 3) of a mesh in `picture` (H, W, 4), unless hair is before them.

    `meshes` (H, W, 4) is the picture without hair, and `depth` (W, H) its depth. What is
    overwritten is added to `replaced`; outlines stay as they are where that is full.
    """
    for n in range(len(outlines)):
        a, b, c = outlines[n, 0], outlines[n, 1], outlines[n, 2]
        _smooth(seen, a, b, c, meshes, depth, picture, replaced)


@inlined
def _faces_camera(seen: Float32Array, a: int, b: int, c: int) -> bool:
    return bool(seen[c, 3] > ZERO and area(seen, a, b, c) < ZERO)


@stage
def _smooth(
    seen: Float32Array,
    a: int,
    b: int,
    c: int,
    meshes: UInt8Array,
    depth: Float32Array,
    picture: UInt8Array,
    replaced: Replaced,
) -> None:
    """Smooth the outline from vertex a to b of a face with the corner c.

    x runs along the longer side of the outline's box, y along the other.
    """
    steep = abs(seen[b, 1] - seen[a, 1]) > abs(seen[b, 0] - seen[a, 0])
    u, v = (1, 0) if steep else (0, 1)
    if seen[b, u] < seen[a, u]:
        a, b = b, a
    ax, ay, az = seen[a, u], seen[a, v], seen[a, 2]
    pace = ONE / max(seen[b, u] - ax, _TINY)
    dy, dz = seen[b, v] - ay, seen[b, 2] - az
    side = 1 if seen[c, v] > ay + (seen[c, u] - ax) * pace * dy else -1  # of the mesh
    behind = _STEEP * abs(seen[c, 2] - az) + _TINY
    wide, high = (depth.shape[1], depth.shape[0]) if steep else depth.shape
    first = int(np.ceil(_within(ax - HALF, wide)))
    last = int(np.ceil(_within(seen[b, u] - HALF, wide)))
    for x in range(first, last):
        t = (np.float32(x) + HALF - ax) * pace
        y = ay + t * dy
        line = int(np.floor(_within(y, high)))
        covered = np.float32(line + 1) - y if side > 0 else y - np.float32(line)
        inner, outer = line, line - side  # the two pixels next to the outline, by their middles
        if covered < HALF:
            inner, outer = line + side, line
        if y < ZERO or min(inner, outer) < 0 or max(inner, outer) >= high:
            continue
        i, j, u, v = (inner, x, outer, x) if steep else (x, inner, x, outer)
        z = az + t * dz
        if depth[u, v] <= z or depth[i, j] < z - behind or replaced.used[0] >= len(replaced.at):
            continue
        if picture[j, i, 0] != meshes[j, i, 0] or picture[j, i, 1] != meshes[j, i, 1]:
            continue  # hair before the mesh
        if line == inner:
            _blend(picture, i, j, u, v, ONE - covered, replaced)
        else:
            _blend(picture, u, v, i, j, covered, replaced)


@inlined
def _within(x: Number, size: int) -> Number:
    return min(max(x, ZERO), np.float32(size))


@inlined
def _blend(
    picture: UInt8Array, x: int, y: int, i: int, j: int, share: Number, replaced: Replaced
) -> None:
    """Mix a share of the pixel in column i and row j into that in column x and row y."""
    at = replaced.used[0]
    replaced.at[at, 0], replaced.at[at, 1] = x, y
    for c in range(3):
        before = np.float32(picture[y, x, c])
        replaced.colours[at, c] = picture[y, x, c]
        mixed = before + share * (np.float32(picture[j, i, c]) - before)
        picture[y, x, c] = np.uint8(mixed + HALF)
    replaced.used[0] = at + 1


@stage
def put_back(picture: UInt8Array, replaced: Replaced) -> None:
    """Undo `smooth_outlines`, and forget what was replaced."""
    for at in range(replaced.used[0] - 1, -1, -1):
        x, y = replaced.at[at, 0], replaced.at[at, 1]
        for c in range(3):
            picture[y, x, c] = replaced.colours[at, c]
    replaced.used[0] = 0
