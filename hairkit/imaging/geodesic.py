"""Distance from seeds that counts edges crossed: near is what no contour parts (Criminisi 2008)."""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from hairkit.arrays import BoolArray, Float32Array, Float64Array

FAR = np.float32(1e6)
"""Distance of pixels that no seed reaches."""

_STEPS = ((0, -1), (-1, -1), (-1, 0), (-1, 1))


def edge_costs(colour: Float32Array, per_pixel: float, per_contrast: float) -> Float32Array:
    """Return what a step from each pixel to four of its neighbours costs, (H, W, 4).

    The neighbours are those to the left, up left, up and up right; the other four are the same
    steps seen from the other end. A step costs `per_pixel` times its length plus `per_contrast`
    times the distance of the two colours (H, W, C). Steps that leave the picture cost `FAR`.
    """
    height, width = colour.shape[:2]
    costs = np.full((height, width, 4), FAR, np.float32)
    for index, (dy, dx) in enumerate(_STEPS):
        rows = slice(-dy, height)
        columns = slice(max(-dx, 0), width - max(dx, 0))
        there = colour[rows.start + dy : height + dy, columns.start + dx : columns.stop + dx]
        difference = colour[rows, columns] - there
        contrast = np.sqrt(np.einsum("hwc,hwc->hw", difference, difference))
        costs[rows, columns, index] = per_pixel * np.hypot(dy, dx) + per_contrast * contrast
    return costs


def seed_distance(costs: Float32Array, seeds: BoolArray, sweeps: int = 4) -> Float32Array:
    """Return the (H, W) cost of the cheapest path from each pixel to any seed.

    Raster sweeps to and fro (Toivanen 1996): every sweep lets paths turn once more, so that few are
    enough for pictures; `seed_distance_exact` is what they converge to.

    Parameters
    ----------
    costs : (H, W, 4)
        From `edge_costs`.
    seeds : (H, W)
    sweeps : int
        Pairs of sweeps, each once down and once up; stops early when nothing changes.
    """
    distance = np.where(seeds, np.float32(0), FAR)
    _sweep(np.ascontiguousarray(costs), distance, sweeps)
    return distance


def seed_distance_exact(costs: Float32Array, seeds: BoolArray) -> Float64Array:
    """Return what `seed_distance` tends to, by Dijkstra's algorithm: its slow and readable twin."""
    height, width = seeds.shape
    number = np.arange(height * width).reshape(height, width)
    rows, columns, values = [], [], []
    for index, (dy, dx) in enumerate(_STEPS):
        y, x = np.nonzero(costs[..., index] < FAR)
        rows.append(number[y, x])
        columns.append(number[y + dy, x + dx])
        values.append(costs[y, x, index])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    graph = coo_matrix(entries, (number.size, number.size)).tocsr()
    start = np.flatnonzero(seeds)
    if not len(start):
        return np.full(seeds.shape, float(FAR))
    reached = dijkstra(graph, directed=False, indices=start, min_only=True)
    result: Float64Array = np.minimum(reached, float(FAR)).reshape(height, width)
    return result


@njit(cache=True)  # type: ignore[untyped-decorator, unused-ignore]
def _sweep(costs, distance, sweeps):  # type: ignore[no-untyped-def]
    height, width = distance.shape
    for _ in range(sweeps):
        changed = False
        for y in range(height):
            for x in range(width):
                best = distance[y, x]
                for k in range(4):
                    ny = y if k == 0 else y - 1
                    nx = x + 1 if k == 3 else (x if k == 2 else x - 1)
                    if ny >= 0 and 0 <= nx < width:
                        best = min(best, distance[ny, nx] + costs[y, x, k])
                if best < distance[y, x]:
                    distance[y, x] = best
                    changed = True
        for y in range(height - 1, -1, -1):
            for x in range(width - 1, -1, -1):
                best = distance[y, x]
                for k in range(4):
                    ny = y if k == 0 else y + 1
                    nx = x - 1 if k == 3 else (x if k == 2 else x + 1)
                    if ny < height and 0 <= nx < width:
                        best = min(best, distance[ny, nx] + costs[ny, nx, k])
                if best < distance[y, x]:
                    distance[y, x] = best
                    changed = True
        if not changed:
            break
