"""Contact of Gauss points with the head: a stiff spring outward, and Coulomb friction.

Both enter the implicit step as 3 x 3 weights of their points, so that a deep overlap or a fast head
cannot make it unstable; friction takes the normal force and the sliding speed of the last iterate.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled

from .state import Step

_SLOW = 1e-3
"""Sliding speeds below this, metres per second, are held by friction without slipping."""


@compiled
def touch(
    step: Step,
    mass: float,
    h: float,
    gap: float,
    point: Float64Array,
    before: Float64Array,
    weight: Float64Array,
    pull: Float64Array,
    scratch: Float64Array,
) -> bool:
    """Add to a point's weight and gradient what the obstacles do to it; return whether they do.

    Parameters
    ----------
    step
        The `Step`.
    mass, h
        The point's mass, kilograms; the step's effective seconds.
    gap
        Distance from the surface below which it pushes, metres.
    point, before
        (3,) where the point is, and where from it has come in `h`, world.
    weight, pull
        (3, 3) and (3,) changed in place.
    scratch
        (4, 3) anything.
    """
    local, normal, n, slide = scratch[0], scratch[1], scratch[2], scratch[3]
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            local[i] += step.head[j, i] * (point[j] - step.head[j, 3])
    depth = gap - distance_at(step.origin, step.spacing, step.distance, local, normal)
    if depth <= 0:
        return False
    speed = 0.0
    for i in range(3):
        n[i] = surface = 0.0
        for j in range(3):
            n[i] += step.head[i, j] * normal[j]
            surface += step.head_before[i, j] * local[j]
        # the surface's own motion over the whole step, as a velocity
        moved = point[i] - surface - step.head_before[i, 3]
        slide[i] = (point[i] - before[i]) - h * moved / step.seconds
    along = slide[0] * n[0] + slide[1] * n[1] + slide[2] * n[2]
    for i in range(3):
        slide[i] -= along * n[i]
        speed += slide[i] * slide[i]
    speed = math.sqrt(speed) / h
    stiff = h * h * step.contact * mass
    grip = h * step.coulomb * step.contact * mass * depth / max(speed, _SLOW)
    for i in range(3):
        pull[i] += grip * slide[i] - stiff * depth * n[i]
        weight[i, i] += grip
        for j in range(3):
            weight[i, j] += (stiff - grip) * n[i] * n[j]
    return True


@compiled
def distance_at(
    origin: Float64Array,
    spacing: float,
    values: npt.NDArray[np.float32],
    point: Float64Array,
    normal: Float64Array,
) -> float:
    """Return the trilinear distance at a point and write its unit gradient; 1 off the grid."""
    x = (point[0] - origin[0]) / spacing - 0.5
    y = (point[1] - origin[1]) / spacing - 0.5
    z = (point[2] - origin[2]) / spacing - 0.5
    if not (
        0 <= x <= values.shape[0] - 1
        and 0 <= y <= values.shape[1] - 1
        and 0 <= z <= values.shape[2] - 1
    ):
        normal[:] = 0.0
        return 1.0
    i = min(int(x), values.shape[0] - 2)
    j = min(int(y), values.shape[1] - 2)
    k = min(int(z), values.shape[2] - 2)
    u, v, w = x - i, y - j, z - k
    value, a, b, c = 0.0, 0.0, 0.0, 0.0
    for di in range(2):
        p, dp = (u, 1.0) if di else (1 - u, -1.0)
        for dj in range(2):
            q, dq = (v, 1.0) if dj else (1 - v, -1.0)
            for dk in range(2):
                r, dr = (w, 1.0) if dk else (1 - w, -1.0)
                found = float(values[i + di, j + dj, k + dk])
                value += found * p * q * r
                a += found * dp * q * r
                b += found * p * dq * r
                c += found * p * q * dr
    size = max(math.sqrt(a * a + b * b + c * c), 1e-12)
    normal[0], normal[1], normal[2] = a / size, b / size, c / size
    return value
