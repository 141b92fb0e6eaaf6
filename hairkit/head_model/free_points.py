"""Points that keep a distance from each other, taken in turn: a step of the dart throwing of roots.

McCool and Fiume 1992.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array, Int64Array


def take_free(
    points: Float64Array, apart: Float64Array, radius: float, taken: Int64Array, found: int
) -> int:
    """Append to `taken` in turn the points (M, 3) that have no taken one within the radius.

    Parameters
    ----------
    apart
        (M,) distance to some taken point, infinite where none is known, 0 for taken ones; updated.
    taken
        (N,) indices of taken points, `found` of them known; ends when it is full.

    Returns
    -------
    How many are taken now.
    """
    some = np.flatnonzero(apart >= radius)
    if found and len(some):
        apart[some] = cKDTree(points[taken[:found]]).query(points[some])[0]
        some = some[apart[some] >= radius]
    if not len(some):
        return found
    # what is left can only be too near to what is taken before it here
    pairs = cKDTree(points[some]).query_pairs(np.nextafter(radius, 0), output_type="ndarray")
    pairs = pairs[np.argsort(pairs[:, 0])]
    begins = np.searchsorted(pairs[:, 0], np.arange(len(some) + 1))
    free = np.ones(len(some), np.bool_)
    for i in range(len(some)):
        if free[i]:
            free[pairs[begins[i] : begins[i + 1], 1]] = False
    new = some[free][: len(taken) - found]
    apart[new] = 0.0
    taken[found : found + len(new)] = new
    return found + len(new)
