"""What substeps of a frame are given: motion of head and torso, for kernels in head axes."""

from __future__ import annotations

from typing import Generic, NamedTuple, TypeVar

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.hair_cells import drift_rows
from hairkit.simulation.lanes import stage
from hairkit.simulation.rigid_motion import inverse_motion, motion_steps
from hairkit.simulation.vectors import Floats, Frame, Number, Rows, rows_of

Motion = TypeVar("Motion")
Turn = TypeVar("Turn")


class Steps(NamedTuple, Generic[Motion, Turn]):
    """Motion of head and torso in K substeps, in the head axes after each: arrays.

    In kernels, of one substep: tuples, without the first axis.
    """

    head_step: Motion
    """(K, 3, 4) rows of the motion from the head axes before."""
    drift: Motion
    """(K, 3, 4) rows of the velocity of a point that rides on the head."""
    air: Motion
    """(K, 3, 4) turn from the world's axes, and gravity, m/s^2."""
    turn: Turn
    """(K, 4) the head's turn (w, x, y, z)."""
    torso: Motion
    """(K, 3, 4) rows from the head axes to the torso's."""
    torso_drift: Motion
    """(K, 3, 4) rows of the velocity of a point that rides on the torso."""


StepArrays = Steps[Floats, Floats]
Step = Steps[Rows, Frame]
Course = tuple[Float64Array, Float64Array]
"""Motions (4, 4) since rest, world, from which and to which a body goes."""


def make_steps(
    head: Course, torso: Course, count: int, gravity: Float64Array, seconds: float
) -> StepArrays:
    """Return substeps, of so many seconds each, of head and torso under gravity (3,), world."""
    heads, head_steps = motion_steps(*head, count)
    torsos, torso_steps = motion_steps(*torso, count)
    turn = heads[:, :3, :3].swapaxes(1, 2)
    from_head = inverse_motion(torsos) @ heads
    riding = inverse_motion(from_head) @ torso_steps @ from_head
    return Steps(
        head_steps[:, :3],
        drift_rows(head_steps, seconds),
        np.concatenate([turn, turn @ gravity[:, None]], axis=2),
        np.tile(quaternion.from_matrix(head_steps[0, :3, :3]), (len(heads), 1)),
        from_head[:, :3],
        drift_rows(riding, seconds),
    )


@stage
def step_of(steps: StepArrays, k: int) -> Step:
    """Return one substep, whose numbers stay in registers."""
    return Steps(
        rows_of(steps.head_step[k]),
        rows_of(steps.drift[k]),
        rows_of(steps.air[k]),
        (steps.turn[k, 0], steps.turn[k, 1], steps.turn[k, 2], steps.turn[k, 3]),
        rows_of(steps.torso[k]),
        rows_of(steps.torso_drift[k]),
    )


class Settings(NamedTuple):
    """Numbers of a run."""

    seconds: Number
    """Of a substep."""
    damping: Number
    """1/s, of the velocity relative to the head."""
    friction: Number
    """Coulomb's coefficient."""
    fastest: Number
    """Highest speed at which a penetration is resolved, m/s."""
    rounds: int
    """Iterations in a substep."""
