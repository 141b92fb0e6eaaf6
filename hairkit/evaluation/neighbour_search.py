"""Exact search for any neighbour within a distance and an angle, for millions of samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit, prange

from hairkit.arrays import Float32Array, Float64Array, Int64Array, UInt8Array

FIRST_HIT_NONE = 255
"""Marks a sample that has a partner at no threshold."""


@dataclass(frozen=True, eq=False)
class HashGrid:
    """Directed samples sorted by the hashed grid cell they lie in.

    Cells in a row along x fall into neighbouring buckets, so that a search reads runs of memory.
    Two cells may share a bucket: a search then looks at samples too far away, and the distance
    test drops them.
    """

    points: Float32Array
    """(N, 3) metres, in bucket order."""
    directions: Float32Array
    """(N, 3) unit, in bucket order."""
    source: Int64Array
    """(N,) number of each sample before sorting."""
    start: Int64Array
    """(B + 1,) first sample of each bucket; B is a power of two."""
    cell: float
    """Edge of a cell, metres."""

    @staticmethod
    def build(
        points: npt.NDArray[np.float32], directions: npt.NDArray[np.float32], cell: float
    ) -> HashGrid:
        """Sort samples (N, 3) with unit directions (N, 3) into cells of edge `cell` metres."""
        buckets = 1 << max(10, len(points).bit_length())
        key = _keys(points, cell, buckets - 1)
        order = np.argsort(key, kind="stable")
        start = np.zeros(buckets + 1, np.int64)
        np.cumsum(np.bincount(key, minlength=buckets), out=start[1:])
        return HashGrid(points[order], directions[order], order, start, cell)


def first_hits(
    grid: HashGrid,
    points: npt.NDArray[np.float32],
    directions: npt.NDArray[np.float32],
    distances: npt.NDArray[np.float64],
    cosines: npt.NDArray[np.float64],
) -> tuple[UInt8Array, UInt8Array]:
    """Return for each query the first threshold at which any sample of `grid` matches it.

    Parameters
    ----------
    points, directions : (Q, 3) arrays
        Queries, metres and unit vectors.
    distances, cosines : (T,) arrays
        Growing distances in metres with the cosines of growing angles.

    Returns
    -------
    free, signed : (Q,) uint8 arrays
        Rank of the threshold, 255 where none matches; `free` allows opposite directions.
    """
    free: UInt8Array
    signed: UInt8Array
    free, signed = _first_hits(
        grid.points, grid.directions, grid.start, grid.cell, points, directions, distances, cosines
    )
    return free, signed


def first_hits_by_hand(
    targets: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]],
    queries: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]],
    distances: npt.NDArray[np.float64],
    cosines: npt.NDArray[np.float64],
) -> tuple[UInt8Array, UInt8Array]:
    """Compare every query with every target: the readable twin of `first_hits` for small sets."""
    gap = queries[0][:, None].astype(np.float64) - targets[0][None].astype(np.float64)
    squared = (gap**2).sum(axis=2)
    cosine = queries[1].astype(np.float64) @ targets[1].astype(np.float64).T
    free = np.full(len(queries[0]), FIRST_HIT_NONE, np.uint8)
    signed = free.copy()
    for rank in reversed(range(len(distances))):
        close = squared <= distances[rank] ** 2
        free[(close & (np.abs(cosine) >= cosines[rank])).any(axis=1)] = rank
        signed[(close & (cosine >= cosines[rank])).any(axis=1)] = rank
    return free, signed


def most_followed(
    grid: HashGrid,
    owner: Int64Array,
    points: npt.NDArray[np.float32],
    directions: npt.NDArray[np.float32],
    bounds: Int64Array,
    distance: float,
    cosine: float,
) -> Float64Array:
    """Return for each query strand the largest share of its samples that one owner matches.

    Strand s is the samples `bounds[s]:bounds[s + 1]`; `owner` (N,) are the strands of the grid's
    samples, in the grid's order; matches are sign-free.
    """
    result: Float64Array = _most_followed(
        grid.points, grid.directions, grid.start, grid.cell, owner,
        points, directions, bounds, distance, cosine,
    )  # fmt: skip
    return result


@njit(cache=True)
def _row(y: int, z: int) -> int:  # pragma: no cover - compiled
    """Spread the rows of cells along x over the buckets (primes of Teschner et al. 2003)."""
    return (y * 19349663) ^ (z * 83492791)


@njit(cache=True)
def _cell_of(value: float, cell: float) -> int:  # pragma: no cover - compiled
    return int(np.floor(value / cell))


@njit(cache=True)
def _keys(
    points: npt.NDArray[np.float32], cell: float, mask: int
) -> Int64Array:  # pragma: no cover - compiled
    keys = np.empty(len(points), np.int64)
    for i in range(len(points)):
        x = _cell_of(points[i, 0], cell)
        row = _row(_cell_of(points[i, 1], cell), _cell_of(points[i, 2], cell))
        keys[i] = (row + x) & mask
    return keys


@njit(cache=True, parallel=True)
def _first_hits(
    points: npt.NDArray[np.float32],
    directions: npt.NDArray[np.float32],
    start: Int64Array,
    cell: float,
    queries: npt.NDArray[np.float32],
    headings: npt.NDArray[np.float32],
    distances: Float64Array,
    cosines: Float64Array,
) -> tuple[UInt8Array, UInt8Array]:  # pragma: no cover - compiled
    free = np.full(len(queries), 255, np.uint8)
    signed = np.full(len(queries), 255, np.uint8)
    for q in prange(len(queries)):
        for rank in range(len(distances)):
            found = _search(
                points, directions, start, cell, queries[q], headings[q],
                distances[rank], cosines[rank], free[q] == 255,
            )  # fmt: skip
            if found > 0 and free[q] == 255:
                free[q] = rank
            if found == 2:
                signed[q] = rank
                break
    return free, signed


@njit(cache=True)
def _search(
    points: npt.NDArray[np.float32],
    directions: npt.NDArray[np.float32],
    start: Int64Array,
    cell: float,
    query: npt.NDArray[np.float32],
    heading: npt.NDArray[np.float32],
    distance: float,
    cosine: float,
    want_free: bool,
) -> int:  # pragma: no cover - compiled
    """Return 2 when a sample matches with its sign, 1 when only against it, 0 when none does."""
    mask = len(start) - 2
    limit = distance * distance
    qx, qy, qz = np.float64(query[0]), np.float64(query[1]), np.float64(query[2])
    hx, hy, hz = np.float64(heading[0]), np.float64(heading[1]), np.float64(heading[2])
    x0, x1 = _cell_of(qx - distance, cell), _cell_of(qx + distance, cell)
    best = 0
    for y in range(_cell_of(qy - distance, cell), _cell_of(qy + distance, cell) + 1):
        for z in range(_cell_of(qz - distance, cell), _cell_of(qz + distance, cell) + 1):
            row = _row(y, z)
            for x in range(x0, x1 + 1):
                key = (row + x) & mask
                for i in range(start[key], start[key + 1]):
                    dx, dy, dz = points[i, 0] - qx, points[i, 1] - qy, points[i, 2] - qz
                    if dx * dx + dy * dy + dz * dz > limit:
                        continue
                    dot = directions[i, 0] * hx + directions[i, 1] * hy + directions[i, 2] * hz
                    if dot >= cosine:
                        return 2
                    if want_free and dot <= -cosine:
                        best = 1
    return best


@njit(cache=True, parallel=True)
def _most_followed(
    points: npt.NDArray[np.float32],
    directions: npt.NDArray[np.float32],
    start: Int64Array,
    cell: float,
    owner: Int64Array,
    queries: npt.NDArray[np.float32],
    headings: npt.NDArray[np.float32],
    bounds: Int64Array,
    distance: float,
    cosine: float,
) -> Float64Array:  # pragma: no cover - compiled
    mask = len(start) - 2
    result = np.zeros(len(bounds) - 1)
    owners = owner.max() + 1
    for s in prange(len(bounds) - 1):
        followed = np.zeros(owners, np.int64)
        last = np.full(owners, -1, np.int64)
        for q in range(bounds[s], bounds[s + 1]):
            qx, qy, qz = queries[q, 0], queries[q, 1], queries[q, 2]
            for y in range(_cell_of(qy - distance, cell), _cell_of(qy + distance, cell) + 1):
                for z in range(_cell_of(qz - distance, cell), _cell_of(qz + distance, cell) + 1):
                    row = _row(y, z)
                    x_last = _cell_of(qx + distance, cell)
                    for x in range(_cell_of(qx - distance, cell), x_last + 1):
                        key = (row + x) & mask
                        for i in range(start[key], start[key + 1]):
                            if last[owner[i]] == q:
                                continue
                            gap = points[i] - queries[q]
                            dot = abs(np.sum(directions[i] * headings[q]))
                            if np.sum(gap * gap) <= distance * distance and dot >= cosine:
                                last[owner[i]] = q
                                followed[owner[i]] += 1
        result[s] = followed.max() / (bounds[s + 1] - bounds[s])
    return result
