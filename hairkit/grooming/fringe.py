"""Strands that hang loose over the face beside tied hair.

They start at the roots nearest to the loose hair, as many as its share of the hair's volume says,
and follow the measured orientation through it, away from the scalp.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.volume import OrientationField, symmetric_matrices

STEP = 0.003
"""Metres of a step."""
ROOT_REACH = 0.035
"""Metres from its root within which a strand enters the loose hair."""
ENTRY = 0.015
"""Metres beyond the start of the loose hair in which strands enter it."""
NEIGHBOURS = 30
"""Cells from whose ways the direction away from the scalp is taken."""
TRUST, INERTIA = 0.7, 0.5
"""Share of the measured direction against that away from the scalp; share of the last one."""
OUT = 1.5
"""Cells off the loose hair at which a strand ends."""
MOST_STEPS = 150
"""Of a strand."""


def hang_fringe(
    roots: Float64Array, tied: TiedHair, field: OrientationField, count: int
) -> tuple[Int64Array, Float32Array]:
    """Return which of the roots (N, 3) bear loose hair (K,), and its strands (K, count, 3)."""
    cells = tied.fringe[:, :3].astype(np.float64)
    way = tied.fringe[:, 3].astype(np.float64)
    none = np.zeros(0, np.int64), np.zeros((0, count, 3), np.float32)
    if not len(cells):
        return none
    entries = cells[way < way.min() + ENTRY]
    away, entry = cKDTree(entries).query(roots)
    wanted = int(np.ceil(tied.fringe_share * len(roots)))
    chosen = np.argsort(away, kind="stable")[:wanted]
    chosen = chosen[away[chosen] < ROOT_REACH]
    if not len(chosen):
        return none
    paths = _follow(roots[chosen], entries[entry[chosen]], cells, way, field)
    return chosen, Strands.from_list(paths).resampled(count).points.reshape(-1, count, 3)


def _follow(
    roots: Float64Array,
    entries: Float64Array,
    cells: Float64Array,
    way: Float64Array,
    field: OrientationField,
) -> list[Float64Array]:
    """Return strands from roots (K, 3) over their entries (K, 3) through the cells (M, 3)."""
    tree = cKDTree(cells)
    away_from_scalp = _slopes(tree, cells, way)
    at, heading = entries.copy(), _unit(entries - roots)
    points = [roots, at.copy()]
    last = np.ones(len(roots), np.int64)
    going = np.arange(len(roots))
    for step in range(2, MOST_STEPS):
        distance, cell = tree.query(at[going])
        inside = distance < OUT * field.grid.spacing
        going, cell = going[inside], cell[inside]
        if not len(going):
            break
        goal = away_from_scalp[cell]
        tensor = symmetric_matrices(field.grid.sample(field.tensor, at[going]))
        measured = _unit(np.einsum("nij,nj->ni", tensor, goal))
        wanted = _unit(goal + TRUST * (measured - goal))
        heading[going] = _unit(INERTIA * heading[going] + (1 - INERTIA) * wanted)
        at[going] += STEP * heading[going]
        points.append(at.copy())
        last[going] = step
    ways = np.stack(points, axis=1)
    return [each[: end + 1] for each, end in zip(ways, last, strict=True)]


def _slopes(tree: cKDTree, cells: Float64Array, way: Float64Array) -> Float64Array:
    """Return unit directions (M, 3) in which the way from the scalp grows about each cell."""
    near = tree.query(cells, k=min(NEIGHBOURS, len(cells)))[1].reshape(len(cells), -1)
    off = cells[near] - cells[near].mean(axis=1, keepdims=True)
    rise = way[near] - way[near].mean(axis=1, keepdims=True)
    return _unit((rise[..., None] * off).sum(axis=1))


def _unit(vector: Float64Array) -> Float64Array:
    unit: Float64Array = vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-9)
    return unit
