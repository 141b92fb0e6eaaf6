"""Contact of Gauss points with head and torso: a stiff spring outward, and Coulomb friction.

Both enter the implicit step as 3 x 3 weights of their points, so that a deep overlap or a fast head
cannot make it unstable; friction takes the normal force and the sliding speed of the last iterate.
"""

from __future__ import annotations

import math

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled
from hairkit.simulation.obstacle_kernels import distance_at

from .state import Body, Step

_SLOW = 1e-3
"""Sliding speeds below this, metres per second, are held by friction without slipping."""


@compiled
def touch(
    step: Step,
    body: Body,
    mass: float,
    h: float,
    gap: float,
    point: Float64Array,
    before: Float64Array,
    weight: Float64Array,
    pull: Float64Array,
    scratch: Float64Array,
) -> bool:
    """Add to a point's weight and gradient what a body does to it; return whether it does.

    Parameters
    ----------
    step, body
        The `Step`, one of its bodies.
    mass, h
        The point's mass, kilograms; the step's effective seconds.
    gap
        Distance from the surface below which it pushes, metres.
    point, before
        (3,) where the point is, and where from it has come in `h`, world.
    weight, pull
        (3, 3) and (3,) changed in place.
    scratch
        (3, 3) anything.
    """
    local, n, slide = scratch[0], scratch[1], scratch[2]
    pose, before_pose = body.pose, body.pose_before
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            local[i] += pose[j, i] * (point[j] - pose[j, 3])
    distance, a, b, c = distance_at(body.field, local[0], local[1], local[2], gap)
    depth = gap - distance
    if depth <= 0:
        return False
    speed = 0.0
    for i in range(3):
        n[i] = pose[i, 0] * a + pose[i, 1] * b + pose[i, 2] * c
        surface = 0.0
        for j in range(3):
            surface += before_pose[i, j] * local[j]
        # the surface's own motion over the whole step, as a velocity
        moved = point[i] - surface - before_pose[i, 3]
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
