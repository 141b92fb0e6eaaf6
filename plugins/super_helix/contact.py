"""Contact of Gauss points with head and torso: a stiff spring outward, and Coulomb friction.

Both enter the implicit step as 3 x 3 weights of their points, so that a deep overlap or a fast head
cannot make it unstable; friction takes the normal force and the sliding speed of the last iterate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled
from hairkit.simulation.obstacle_kernels import distance_at

from .state import Body, Step

_SLOW = 1e-3
"""Sliding speeds below this, metres per second, are held by friction without slipping."""


class Point(NamedTuple):
    """A Gauss point during an iteration."""

    place: Float64Array
    """(3,) metres, world."""
    before: Float64Array
    """(3,) where from it has come in the step's effective seconds."""
    weight: Float64Array
    """(3, 3) of its displacement in the implicit step, kilograms."""
    pull: Float64Array
    """(3,) its part of the gradient, kilogram metres."""


@compiled
def touch(
    step: Step, body: Body, mass: float, h: float, gap: float, point: Point, scratch: Float64Array
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
    point
        The point, whose weight and pull are changed in place.
    scratch
        (3, 3) anything.
    """
    local, n, slide = scratch[0], scratch[1], scratch[2]
    place, before, weight, pull = point
    pose, before_pose = body.pose, body.pose_before
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            local[i] += pose[j, i] * (place[j] - pose[j, 3])
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
        moved = place[i] - surface - before_pose[i, 3]
        slide[i] = (place[i] - before[i]) - h * moved / step.seconds
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
