"""What the kernels work on: strands side by side; constants, contact and substeps of all backends.

A block is `LANES` strands; each field of a node holds that many numbers in a row. The same
constants, strand by strand, are the textures of the shaders. Masses, stiffness and forces are
shares of the rod's mean mass, so that stiffness is in 1/s^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation.contact_kernels import Moving, Touch
from hairkit.simulation.lanes import Four, Kind, One, Records, Three, lanes_of, sizes_of
from hairkit.simulation.obstacles import Bodies
from hairkit.simulation.substeps import Settings
from hairkit.simulation.vectors import Floats

from .linear_system import System
from .rods import Rods, State


class NodeState(Moving, Protocol):
    """State of a node, in head axes; shaders have no planes."""

    gain: Three
    """Acceleration, m/s^2."""
    spare: One
    """Fills a row of the shaders' texture."""
    frame: Four
    """(w, x, y, z) of the segment that ends there; of the root that which the head holds."""
    wall: Four
    """Plane (unit normal and offset, metres) that stands for the head, its axes."""
    beside: Four
    """As `wall`, of the torso."""


class Node(NodeState, Protocol):
    """A record of a node: its state, and constants of it and of the segment that ends there."""

    rest: Three
    """Captured place, metres."""
    mass: One
    drag: One
    """Rate of air drag, 1/s."""
    shape: One
    """Squared frequency of the pull to rest, 1/s^2."""
    clear: One
    """Least distance from obstacles, metres."""
    ease: One
    """1 / mass; 0 at the root."""
    first: One
    """Entry of the banded factor beside its diagonal."""
    second: One
    """The entry beside `first`."""
    pivot: One
    """Reciprocal pivot of the banded factor, s^2."""
    length: One
    """Metres."""
    bend: One
    """Bending stiffness of the element before, m^2/s^2."""
    twist: One
    """Its torsional stiffness, m^2/s^2."""
    natural: One
    """Its natural twist, radians."""
    over: One
    """1 / length, 1/m."""
    curve: Three
    """Its natural turn, in its midpoint frame."""
    unit: One
    """Mean mass of the rod's nodes, kg."""


class Work(Touch, Protocol):
    """A record of what a substep works out for a node and the segment that ends there."""

    force: Three
    """m/s^2."""
    edge: Three
    """The segment, metres."""
    way: Three
    """Its direction."""
    reach: Three
    """`edge` over the length at rest."""
    pull: Three
    """Force of the energy on `reach`, m^2/s^2."""
    torque: One
    """Of torsion, m^2/s^2."""
    pivot: One
    """Diagonal of the system at hand, then its reciprocal pivot."""
    beside: One
    """Entry beside the diagonal."""
    solved: Three
    """Solution of the banded system, metres."""


class Outer(Protocol):
    """A record of what acts on a node from outside."""

    air: Three
    """Velocity of the air, m/s, world."""
    force: Three
    """m/s^2, head axes."""


NODE, WORK, ACTING = lanes_of(Node), lanes_of(Work), lanes_of(Outer)
PLANES = sum(sizes_of(Node).values())
CONSTANT = sum(sizes_of(NodeState).values())
"""Numbers of a node before its constants; `PLANES` are all."""


class Blocks(NamedTuple):
    """B blocks of rods of n nodes, and what acts on them."""

    nodes: Records
    """(B, n) of `Node`."""
    metric: Floats
    """(B, n (n - 1) / 2, LANES) lower rows of the metric of the lengths, s^2."""
    acting: Records
    """(B, n) of `Outer`; one block and one node may stand for all."""


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


def settings_of(system: System, contact: Contact, kind: Kind) -> Settings:
    """Return the numbers of a run."""
    step, damping = kind(system.step), kind(system.rates.damping)
    return Settings(step, damping, kind(contact.friction), kind(contact.fastest), contact.rounds)


def constants(rods: Rods, system: System, contact: Contact) -> tuple[Float64Array, Float64Array]:
    """Return (S, n, 20) the constants of `Node` and (S, n (n - 1) / 2) lower rows of the metric."""
    count, nodes = rods.mass.shape
    made = np.zeros((count, nodes, PLANES - CONSTANT))
    mean = rods.mass.mean(axis=1, keepdims=True)
    lower = np.linalg.cholesky(system.matrix / mean[..., None])
    pivot = lower.diagonal(axis1=1, axis2=2)
    made[..., :3], made[..., 3] = rods.points, rods.mass / mean
    made[..., 4], made[..., 5] = system.rates.drag, system.rates.shape
    made[..., 6] = contact.clearance
    made[:, 1:, 7] = mean / rods.mass[:, 1:]
    for below in (1, 2):  # the factor's bands: made[:, :, 8] and made[:, :, 9]
        band = lower.diagonal(-below, axis1=1, axis2=2) / pivot[:, :-below]
        made[:, 1 + below :, 7 + below] = band
    made[:, 1:, 10], made[:, 1:, 11] = pivot**-2, rods.length
    made[:, 1:, 12], made[:, 1:, 13] = rods.bend / mean, rods.twist / mean
    made[:, 1:, 14], made[:, 1:, 15] = rods.natural_twist, 1.0 / rods.length
    made[:, 1:, 16:19], made[..., 19] = rods.curvature, mean
    row, column = np.tril_indices(nodes - 1)
    return made, system.metric[:, row, column] * mean


def acting(rods: Rods, air: Float64Array, force: Float64Array | None) -> Float64Array:
    """Return (S or 1, n or 1, 6) the fields of `Outer`.

    `air` (3,) or (S, n, 3) is its velocity, m/s, world; `force` (S, n, 3) in newtons, head axes.
    """
    share = np.zeros(3) if force is None else force / rods.mass.mean(axis=1)[:, None, None]
    both = np.concatenate(np.broadcast_arrays(air, share), axis=-1)
    return both if both.ndim > 1 else both[None, None]


def state_rows(rods: Rods, state: State) -> Float64Array:
    """Return (S, n, 16) the fields of `NodeState` before the planes."""
    rows = np.zeros((*rods.mass.shape, 16))
    rows[:, 0, 12:] = rods.root_frame
    for into, values in zip(vars(state_of(rows)).values(), vars(state).values(), strict=True):
        into[...] = values
    return rows


def state_of(rows: Any) -> State:
    """Return the state in rows (..., n, 16 or more) of `NodeState`: views of them."""
    return State(rows[..., :3], rows[..., 4:7], rows[..., 1:, 12:16], rows[..., 8:11])


def records(values: Floats, kind: np.dtype[Any]) -> Records:
    """Return packed values (B, n, k, LANES) as records (B, n)."""
    return values.reshape(*values.shape[:2], -1).view(kind)[..., 0]
