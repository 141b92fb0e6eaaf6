"""The state of rods, and what acts on them in a substep.

Positions are in the axes of the moving head, velocities are those in the world: the head's surface,
the roots and the captured shape are then constant, and float32 keeps its precision wherever the
head is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.obstacles import Bodies

from .rods import Rods, elements, transport_frames


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
    deepest: Float64Array | None = None
    """(P,) least distance of the embedded points, metres; None: no limit."""
    rounds: int = 0
    """Friction iterations under the tension that restores the lengths. With 0 taut strands have too
    little friction around bends; with 4 the Euler-Eytelwein equation holds."""


class TorsoStep(NamedTuple):
    """The torso in one substep."""

    from_head: Float64Array
    """(4, 4) from the head axes after it to the torso's axes."""
    step: Float64Array
    """(4, 4) the torso's motion in it as `Load.head_step`: where its points were, head axes after
    it."""


@dataclass(frozen=True, eq=False)
class Load:
    """Head motion and external forces of one substep."""

    head_step: Float64Array
    """(4, 4) from the head axes before the substep to those after it."""
    turn: Float64Array
    """(3, 3) from the world's axes to the head's after it."""
    gravity: Float64Array
    """(3,) m/s^2, world."""
    air: Float64Array
    """(S, n, 3) or (3,) velocity of the air, m/s, world."""
    force: Float64Array | None = None
    """(S, n, 3) further force, newtons, head axes after the substep."""
    torso: TorsoStep | None = None
    """Where the torso is; None: it goes with the head, as at rest."""


def rest_state(rods: Rods) -> State:
    """Return the captured state with zero velocity."""
    still = np.zeros_like(rods.points)
    return State(rods.points.copy(), still, rods.frames.copy(), still.copy())


def transform_points(motion: Float64Array, points: Float64Array) -> Float64Array:
    """Return points (..., 3) under a rigid motion (4, 4)."""
    result: Float64Array = points @ motion[:3, :3].T + motion[:3, 3]
    return result


def elastic_energy(rods: Rods, state: State, shape: Float64Array | None = None) -> float:
    """Return the energy of bending, twist and the pull to the captured shape, joules.

    `shape` (S, n): squared frequencies of that pull, 1/s^2.
    """
    edge = np.diff(state.position, axis=1)
    frames = transport_frames(state.frames, quaternion.normalize(edge))
    turn, natural, torque = elements(rods, frames, edge / rods.length[..., None])
    energy = (rods.bend[..., None] * (turn - natural) ** 2).sum()
    energy += (torque**2 / np.where(rods.twist > 0, rods.twist, np.inf)).sum()
    if shape is not None:
        moved = ((state.position - rods.points) ** 2).sum(axis=-1)
        energy += (rods.mass * shape * moved).sum()
    return 0.5 * float(energy)
