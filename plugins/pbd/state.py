"""The state of rods, and what acts on them in substeps.

Positions are in the axes of the moving head, velocities are those in the world: the head's surface,
the roots and the captured shape are then constant, and float32 keeps its precision wherever the
head is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.hair_cells import drift_rows
from hairkit.simulation.obstacles import Bodies
from hairkit.simulation.rigid_motion import inverse_motion

from .rods import Rods


@dataclass(frozen=True, eq=False)
class State:
    """Positions, velocities and frames of rods; head axes."""

    position: Float64Array
    """(S, n, 3) metres."""
    velocity: Float64Array
    """(S, n, 3) m/s in the world."""
    frames: Float64Array
    """(S, n - 1, 4) of the segments."""
    acceleration: Float64Array
    """(S, n, 3) of the last substep before contact, m/s^2 in the world; 0 in equilibrium."""


@dataclass(frozen=True, eq=False)
class Contact:
    """Parameters of contact between nodes and obstacles."""

    bodies: Bodies
    clearance: Float64Array
    """(S, n) least distance of the nodes, metres; less where the captured hair is nearer."""
    friction: float
    """Coulomb's coefficient."""
    fastest: float
    """Highest speed at which a penetration is resolved, m/s."""
    rounds: int = 0
    """Friction iterations under the tension that restores the lengths. With 0 taut strands have too
    little friction around bends; with 4 the Euler-Eytelwein equation holds."""


class Steps(NamedTuple):
    """Motion of head and torso in K substeps, in the head axes after each."""

    head_step: Any
    """(K, 3, 4) rows of the motion from the head axes before."""
    drift: Any
    """(K, 3, 4) rows of the velocity of a point that rides on the head."""
    air: Any
    """(K, 3, 4) turn from the world's axes, and gravity, m/s^2."""
    turn: Any
    """(K, 4) the head's turn (w, x, y, z)."""
    torso: Any
    """(K, 3, 4) rows from the head axes to the torso's."""
    torso_drift: Any
    """(K, 3, 4) rows of the velocity of a point that rides on the torso."""


Course = tuple[Float64Array, Float64Array]
"""Of `motion_steps`: (K, 4, 4) motions after each of K steps, and the changes of axes."""


def make_steps(head: Course, torso: Course, gravity: Float64Array, seconds: float) -> Steps:
    """Return the substeps, of so many seconds each, of head and torso under gravity (3,), world."""
    (heads, head_steps), (torsos, torso_steps) = head, torso
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


def rest_state(rods: Rods) -> State:
    """Return the captured state with zero velocity."""
    still = np.zeros_like(rods.points)
    return State(rods.points.copy(), still, rods.frames.copy(), still.copy())
