"""Signs of directions that were measured without one, settled all at once."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import cg

from hairkit.arrays import Float64Array

TOLERANCE = 1e-3
"""Relative residual of the relaxed signs, of which only the signs are used."""
ANCHOR = 1e-6
"""Weight that keeps a direction without wish or neighbours at zero."""


def relaxed_signs(wish: Float64Array, cosines: sparse.csr_matrix) -> Float64Array:
    """Return the sign (N,) of each direction: what it wishes, in agreement with its neighbours.

    Parameters
    ----------
    wish
        (N,) how much a direction should point ahead, negative where it should be turned round.
    cosines
        (N, N) weighted cosines between neighbouring directions.

    Notes
    -----
    The signs are those of the least of ``sum |w| (x - sign w)^2 + sum |c| (x - sign(c) y)^2`` over
    wishes w and pairs x, y with weighted cosines c: a linear system with the Laplacian of a signed
    graph [Kunegis et al., Spectral Analysis of Signed Graphs for Clustering, Prediction and
    Visualization, SDM 2010]. Turning one direction at a time keeps patches that are wrong together.
    """
    if not wish.any():
        return np.ones(len(wish))
    pull = 0.5 * (cosines + cosines.T)
    weight = np.asarray(abs(pull).sum(axis=1)).ravel() + np.abs(wish) + ANCHOR
    scale = sparse.diags(1 / weight)
    numbers = cg(sparse.diags(weight) - pull, wish, rtol=TOLERANCE, M=scale)[0]
    return np.where(numbers < 0, -1.0, 1.0)
