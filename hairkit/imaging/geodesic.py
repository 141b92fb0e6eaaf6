"""Geodesic distance from seeds on an image, in which crossing a contour is expensive.

A path costs its length and the contrast along it (Criminisi, Sharp and Blake, "GeoS: geodesic image
segmentation", 2008).
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import BoolArray, Float32Array
from hairkit.parallel import compiled

FAR = np.float32(1e6)
"""Distance of pixels that no seed reaches."""
_STEPS = ((0, -1), (-1, -1), (-1, 0), (-1, 1))
"""(rows, columns) to the neighbours left, up left, up and up right, in the order of the costs."""


def edge_costs(colour: Float32Array, per_pixel: float, per_contrast: float) -> Float32Array:
    """Return the cost of a step from each pixel to four of its neighbours, (H, W, 4).

    The neighbours are those of `_STEPS`; the other four steps are the same ones backwards. A step
    costs `per_pixel` times its length plus `per_contrast` times the distance of the two colours
    (H, W, C). Steps that leave the picture cost `FAR`.
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

    Raster sweeps down and up (Toivanen 1996): every sweep lets paths turn once more, so a few are
    enough on photos; they converge to Dijkstra's distances.

    Parameters
    ----------
    costs : (H, W, 4)
        From `edge_costs`.
    seeds : (H, W)
    sweeps : int
        Pairs of sweeps, each once down and once up; stops early when nothing changes.
    """
    distance = np.where(seeds, np.float32(0), FAR)
    costs = np.ascontiguousarray(costs)
    for _ in range(sweeps):
        down = _sweep(costs, distance, True)
        if not _sweep(costs, distance, False) and not down:
            break
    return distance


@compiled
def _sweep(costs: Float32Array, distance: Float32Array, down: bool) -> bool:
    """Lower each distance (H, W) by paths through four neighbours; return whether any changed.

    Downwards the neighbours are those of `_STEPS`, upwards the opposite four.
    """
    height, width = distance.shape
    changed = False
    for row in range(height):
        y = row if down else height - 1 - row
        for column in range(width):
            x = column if down else width - 1 - column
            best = distance[y, x]
            for k in range(len(_STEPS)):
                dy, dx = _STEPS[k]
                ny, nx = (y + dy, x + dx) if down else (y - dy, x - dx)
                if 0 <= ny < height and 0 <= nx < width:
                    cost = costs[y, x, k] if down else costs[ny, nx, k]
                    best = min(best, distance[ny, nx] + cost)
            if best < distance[y, x]:
                distance[y, x] = best
                changed = True
    return changed
