"""Helix arcs: curves of constant curvature and torsion, and how they move frames along.

An arc starts at a point with a tangent and turns steadily about its Darboux vector w: every
direction d fixed to it obeys d' = w x d, and w itself stays. A turn by the rotation vector x = s w
is the matrix exponential `rotation(x)`; the tangent's integral is `mean_rotation(x) t s`. Both are
power series in [x]_x whose coefficients are smooth at 0, so straight hair is no special case
(patent, step 5; Bertails et al., "Super-helices for predicting the dynamics of natural hair",
2006, section 3).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float64Array

_TERMS = 9
SERIES_BELOW = 1.0
"""Turns below this many radians take the power series, which `_TERMS` terms give to rounding."""


def turn_coefficients(squared: npt.ArrayLike) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return sin(a)/a, (1 - cos a)/a^2 and (a - sin a)/a^3 from a^2, exact through a = 0."""
    x = np.asarray(squared, np.float64)
    large = np.maximum(x, SERIES_BELOW**2)
    angle = np.sqrt(large)
    exact = (
        np.sin(angle) / angle,
        2 * np.sin(angle / 2) ** 2 / large,
        (angle - np.sin(angle)) / (large * angle),
    )
    small = np.minimum(x, SERIES_BELOW**2)
    near = x < SERIES_BELOW**2
    sine, versine, rest = (
        np.where(near, _series(small, order), value) for order, value in enumerate(exact, 1)
    )
    return sine, versine, rest


def cross_matrix(vector: npt.ArrayLike) -> Float64Array:
    """Return (..., 3, 3) the matrix of v x . for vectors (..., 3)."""
    v = np.asarray(vector, np.float64)
    zero = np.zeros(v.shape[:-1])
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    rows = [zero, -z, y, z, zero, -x, -y, x, zero]
    return np.stack(rows, axis=-1).reshape(*v.shape[:-1], 3, 3)


def rotation(vector: npt.ArrayLike) -> Float64Array:
    """Return (..., 3, 3) the rotation by |v| radians about v (Rodrigues)."""
    v = np.asarray(vector, np.float64)
    turns = Rotation.from_rotvec(v.reshape(-1, 3)).as_matrix()
    return np.asarray(turns.reshape(*v.shape, 3))


def mean_rotation(vector: npt.ArrayLike) -> Float64Array:
    """Return (..., 3, 3) the mean of `rotation(u v)` over u in [0, 1].

    It is also the left Jacobian of the rotation group: turning v by dv turns `rotation(v)` by
    `mean_rotation(v) dv`, in the fixed frame.
    """
    v = np.asarray(vector, np.float64)
    _, versine, rest = turn_coefficients(np.einsum("...i,...i->...", v, v))
    turn = cross_matrix(v)
    return np.eye(3) + versine[..., None, None] * turn + rest[..., None, None] * (turn @ turn)


def along_arc(
    point: npt.ArrayLike, tangent: npt.ArrayLike, darboux: npt.ArrayLike, arc: npt.ArrayLike
) -> tuple[Float64Array, Float64Array]:
    """Return points and unit tangents, (..., 3) each, on helix arcs.

    Parameters
    ----------
    point, tangent
        (..., 3) where the arc starts, metres, and its unit direction there.
    darboux
        (..., 3) the arc's Darboux vector in the frame of the points, radians per metre.
    arc
        (...) arc length from the start, metres.
    """
    s = np.asarray(arc, np.float64)[..., None]
    turn = s * np.asarray(darboux, np.float64)
    start = np.asarray(tangent, np.float64)[..., None]
    moved = s * (mean_rotation(turn) @ start)[..., 0]
    return np.asarray(point, np.float64) + moved, (rotation(turn) @ start)[..., 0]


def _series(x: Float64Array, order: int) -> Float64Array:
    """Return the sum of (-x)^k / (2 k + order)!."""
    total = np.zeros_like(x)
    for k in range(_TERMS, -1, -1):
        total = total * -x + 1 / math.factorial(2 * k + order)
    return total
