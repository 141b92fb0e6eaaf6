"""State, loads and settings of a step: arrays that the compiled code and its twin share."""

from __future__ import annotations

from typing import NamedTuple

from hairkit.arrays import Float64Array
from hairkit.simulation.obstacle_kernels import Field

CLOSE = 0.03
"""Largest rotation of an element in an iteration, radians, at which a step has converged."""
FAR = 0.1
"""Rotation in the last iteration, radians, above which a step is redone with backward Euler."""


class Motion(NamedTuple):
    """The hair's state, changed in place."""

    q: Float64Array
    """(E, 3) coordinates now."""
    q_before: Float64Array
    """(E, 3) one step ago."""
    points: Float64Array
    """(E, NODES, 3) Gauss points now, world."""
    points_before: Float64Array
    """(E, NODES, 3) one step ago."""
    velocity: Float64Array
    """(E, NODES, 3) metres per second."""
    velocity_before: Float64Array
    """(E, NODES, 3) one step ago."""


class Loads(NamedTuple):
    """Forces on the Gauss points during a step."""

    drag: Float64Array
    """(E, NODES) kilograms per second."""
    air: Float64Array
    """(E, NODES, 3) velocity of the medium that drags, metres per second."""
    spring: Float64Array
    """(E, NODES) newton per metre, 0 where nothing holds the point."""
    anchor: Float64Array
    """(E, NODES, 3) where springs pull to, world."""
    gap: Float64Array
    """(E, NODES) distance from obstacles below which a point is pushed out, metres."""


class Body(NamedTuple):
    """An obstacle during a step."""

    pose: Float64Array
    """(4, 4) its motion since rest at the step's end."""
    pose_before: Float64Array
    """(4, 4) at its start."""
    field: Field
    """Its distances, rest axes; empty for none."""


class Step(NamedTuple):
    """One step, the same for all strands."""

    seconds: float
    """Its length."""
    two_step: bool
    """True for the second-order formula, which looks back two steps (BDF2); else Euler's."""
    friction: float
    """Internal friction, seconds: force per stiffness and rate of change of shape."""
    iterations: int
    """Newton iterations at most; a strand needs one where it moves as extrapolated."""
    gravity: Float64Array
    """(3,) metres per second squared."""
    head: Float64Array
    """(4, 4) head_from_rest at the step's end."""
    contact: float
    """Square of the rate at which obstacles push points out, per square second."""
    coulomb: float
    """Coefficient of friction on obstacles."""
    bodies: tuple[Body, Body]
    """Head and torso."""
