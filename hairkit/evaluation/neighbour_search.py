"""Exact search for any neighbour within a distance and an angle, for millions of samples."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array, UInt8Array
from hairkit.parallel import compiled, compiled_with, parallel_for

FIRST_HIT_NONE = 255
"""Marks a sample that has a partner at no threshold."""
LEAST_BUCKETS = 1 << 10
"""Least number of buckets of a grid."""
MIN_QUERIES = 512
"""Least number of queries that are worth another thread."""
_PRIME_Y, _PRIME_Z = 19349663, 83492791
"""Multipliers of the hash of cells (Teschner et al. 2003)."""
NONE, AGAINST, ALONG = 0, 1, 2
"""Results of a search: no sample, one of opposite direction only, one of the same direction."""


class HashGrid(NamedTuple):
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
        buckets = max(LEAST_BUCKETS, 1 << len(points).bit_length())
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
    free, signed = (np.full(len(points), FIRST_HIT_NONE, np.uint8) for _ in range(2))
    parallel_for(
        _find_hits, len(points), grid, _Queries(points, directions), distances, cosines, free,
        signed, min_chunk=MIN_QUERIES,
    )  # fmt: skip
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
    shares = np.zeros(len(bounds) - 1)
    parallel_for(
        _follow_strands, len(shares), grid, owner, _Queries(points, directions), bounds,
        _Match(distance, cosine), shares,
    )  # fmt: skip
    return shares


class _Queries(NamedTuple):
    """Samples whose neighbours are looked for."""

    points: Float32Array
    """(Q, 3) metres."""
    directions: Float32Array
    """(Q, 3) unit."""


class _Match(NamedTuple):
    """When a sample matches a query."""

    distance: float
    """Up to this, metres."""
    cosine: float
    """From this on, of the angle between the directions, sign-free."""


@compiled
def _row(y: int, z: int) -> int:
    """Spread the rows of cells along x over the buckets (primes of Teschner et al. 2003)."""
    return (y * _PRIME_Y) ^ (z * _PRIME_Z)


@compiled_with(inside=True)
def _cell_of(value: float, cell: float) -> int:
    return math.floor(value / cell)


@compiled_with(allocates=True)
def _keys(points: Float32Array, cell: float, mask: int) -> Int64Array:
    """Return the bucket (N,) of each point."""
    keys = np.empty(len(points), np.int64)
    for i in range(len(points)):
        x = _cell_of(points[i, 0], cell)
        row = _row(_cell_of(points[i, 1], cell), _cell_of(points[i, 2], cell))
        keys[i] = (row + x) & mask
    return keys


@compiled_with(inside=True)
def _cosine_within(grid: HashGrid, i: int, queries: _Queries, q: int, distance: float) -> float:
    """Return the cosine between a query's and a sample's direction; 0 beyond `distance`."""
    square = 0.0
    for axis in range(3):
        gap = np.float64(grid.points[i, axis]) - np.float64(queries.points[q, axis])
        square += gap * gap
    if square > distance * distance:
        return 0.0
    cosine = 0.0
    for axis in range(3):
        cosine += np.float64(grid.directions[i, axis]) * np.float64(queries.directions[q, axis])
    return cosine


@compiled
def _find_hits(
    first: int,
    last: int,
    grid: HashGrid,
    queries: _Queries,
    distances: Float64Array,
    cosines: Float64Array,
    free: UInt8Array,
    signed: UInt8Array,
) -> None:
    """Write the ranks of `first_hits` for the queries `first` to `last`."""
    for q in range(first, last):
        for rank in range(len(distances)):
            want_free = free[q] == FIRST_HIT_NONE
            found = _search(grid, queries, q, distances[rank], cosines[rank], want_free)
            if found != NONE and want_free:
                free[q] = rank
            if found == ALONG:
                signed[q] = rank
                break


@compiled_with(inside=True)
def _search(
    grid: HashGrid, queries: _Queries, q: int, distance: float, cosine: float, want_free: bool
) -> int:
    """Return ALONG where a sample matches with its sign, AGAINST where one only against it."""
    mask = len(grid.start) - 2
    x, y, z = queries.points[q, 0], queries.points[q, 1], queries.points[q, 2]
    x_first, x_last = _cells_about(x, distance, grid.cell)
    y_first, y_last = _cells_about(y, distance, grid.cell)
    z_first, z_last = _cells_about(z, distance, grid.cell)
    best = NONE
    for iy in range(y_first, y_last + 1):
        for iz in range(z_first, z_last + 1):
            for ix in range(x_first, x_last + 1):
                key = (_row(iy, iz) + ix) & mask
                for i in range(grid.start[key], grid.start[key + 1]):
                    found = _cosine_within(grid, i, queries, q, distance)
                    if found >= cosine:
                        return ALONG
                    if want_free and found <= -cosine:
                        best = AGAINST
    return best


@compiled_with(inside=True)
def _cells_about(value: float, distance: float, cell: float) -> tuple[int, int]:
    """Return the first and the last cell along an axis within a distance of a coordinate."""
    centre = np.float64(value)
    return _cell_of(centre - distance, cell), _cell_of(centre + distance, cell)


@compiled_with(allocates=True)
def _follow_strands(
    first: int,
    last: int,
    grid: HashGrid,
    owner: Int64Array,
    queries: _Queries,
    bounds: Int64Array,
    match: _Match,
    shares: Float64Array,
) -> None:
    """Write the shares (S,) of `most_followed` for the strands `first` to `last`."""
    owners = owner.max() + 1
    followed, seen = np.zeros(owners, np.int64), np.full(owners, -1, np.int64)
    for s in range(first, last):
        followed[:] = 0
        for q in range(bounds[s], bounds[s + 1]):
            _count_owners(grid, owner, queries, q, match, followed, seen)
        shares[s] = followed.max() / (bounds[s + 1] - bounds[s])


@compiled_with(inside=True)
def _count_owners(
    grid: HashGrid,
    owner: Int64Array,
    queries: _Queries,
    q: int,
    match: _Match,
    followed: Int64Array,
    seen: Int64Array,
) -> None:
    """Add 1 to `followed` (O,) of each owner that matches a query; `seen` holds its last query."""
    mask = len(grid.start) - 2
    x, y, z = queries.points[q, 0], queries.points[q, 1], queries.points[q, 2]
    x_first, x_last = _cells_about(x, match.distance, grid.cell)
    y_first, y_last = _cells_about(y, match.distance, grid.cell)
    z_first, z_last = _cells_about(z, match.distance, grid.cell)
    for iy in range(y_first, y_last + 1):
        for iz in range(z_first, z_last + 1):
            for ix in range(x_first, x_last + 1):
                key = (_row(iy, iz) + ix) & mask
                for i in range(grid.start[key], grid.start[key + 1]):
                    if seen[owner[i]] == q:
                        continue
                    if abs(_cosine_within(grid, i, queries, q, match.distance)) >= match.cosine:
                        seen[owner[i]] = q
                        followed[owner[i]] += 1
