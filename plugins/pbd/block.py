"""What the kernels work on: strands side by side; constants, contact and substeps of all backends.

A block is `LANES` strands; each field of a node holds that many numbers in a row. The same
constants, strand by strand, are the textures of the shaders. Masses, stiffness and forces are
shares of the rod's mean mass, so that stiffness is in 1/s^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.hair_cells import drift_rows
from hairkit.simulation.obstacles import Bodies
from hairkit.simulation.rigid_motion import inverse_motion, motion_steps

from .linear_system import System
from .rods import Rods, State

Records = npt.NDArray[np.void]
Floats = npt.NDArray[np.floating[Any]]
Kind = type[np.float32] | type[np.float64]
"""Precision of a backend."""
KINDS: tuple[Kind, ...] = (np.float32, np.float64)
LANES = 64
"""Strands in a block. Compilers make vector instructions of loops over so many; shorter ones they
unroll into instructions for single numbers."""

STATE = {
    "place": 3, "room": 1, "speed": 3, "aside": 1, "gain": 3, "spare": 1, "frame": 4,
    "wall": 4, "beside": 4,
}  # fmt: skip
"""Of a node: place; how far it may move before the next lookup of the head, metres; velocity; the
same of the torso; acceleration; frame (w, x, y, z) of the segment that ends there, of the root that
which the head holds; planes (normal and offset, the body's axes) of head and torso. Shaders have no
planes."""
CONSTANTS = {
    "rest": 3, "mass": 1, "drag": 1, "shape": 1, "clear": 1, "ease": 1, "first": 1, "second": 1,
    "pivot": 1, "length": 1, "bend": 1, "twist": 1, "natural": 1, "over": 1, "curve": 3, "unit": 1,
}  # fmt: skip
"""Of a node: rest place, mass, rates of drag and of the pull to rest, clearance, 1 / mass (0 at the
root); of the segment that ends there, at its bend before: the banded factor's two lower entries and
reciprocal pivot, length, stiffnesses, natural twist, 1 / length, natural turn, mean mass in kg."""
CONSTANT, PLANES = sum(STATE.values()), sum(STATE.values()) + sum(CONSTANTS.values())
"""Numbers of a node before those of `CONSTANTS`, and all."""


def lanes_of(fields: dict[str, int]) -> dict[Kind, np.dtype[Any]]:
    """Return the types of records whose fields hold `LANES` numbers, or as many vectors."""
    sizes = {name: (size, LANES) if size > 1 else (LANES,) for name, size in fields.items()}
    return {kind: np.dtype([(name, kind, sizes[name]) for name in fields]) for kind in KINDS}


NODE = lanes_of({**STATE, **CONSTANTS})
WORK = lanes_of({
    "force": 3, "edge": 3, "way": 3, "reach": 3, "pull": 3, "torque": 1, "pivot": 1, "beside": 1,
    "value": 1, "solved": 3, "normal": 3, "surface": 3, "depth": 1, "grip": 1,
})  # fmt: skip
"""Of a node: what a substep works out for it and its segment."""
ACTING = lanes_of({"air": 3, "force": 3})
"""Of a node: velocity of the air, world; force over the rod's mean mass, head axes."""


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
"""Motions (4, 4) since rest, world, from which and to which a body goes."""


def make_steps(
    head: Course, torso: Course, count: int, gravity: Float64Array, seconds: float
) -> Steps:
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


class Settings(NamedTuple):
    """Numbers of a run, see `Contact` and `Rates`."""

    seconds: np.floating[Any]
    damping: np.floating[Any]
    friction: np.floating[Any]
    fastest: np.floating[Any]
    rounds: int


def settings_of(system: System, contact: Contact, kind: Kind) -> Settings:
    """Return the numbers of a run."""
    step, damping = kind(system.step), kind(system.rates.damping)
    return Settings(step, damping, kind(contact.friction), kind(contact.fastest), contact.rounds)


def constants(rods: Rods, system: System, contact: Contact) -> tuple[Float64Array, Float64Array]:
    """Return (S, n, 20) `CONSTANTS` and (S, n (n - 1) / 2) lower rows of the metric."""
    count, nodes = rods.mass.shape
    made = np.zeros((count, nodes, sum(CONSTANTS.values())))
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
    """Return (S or 1, n or 1, 6) `ACTING`.

    `air` (3,) or (S, n, 3) is its velocity, m/s, world; `force` (S, n, 3) in newtons, head axes.
    """
    share = np.zeros(3) if force is None else force / rods.mass.mean(axis=1)[:, None, None]
    both = np.concatenate(np.broadcast_arrays(air, share), axis=-1)
    return both if both.ndim > 1 else both[None, None]


def state_rows(rods: Rods, state: State) -> Float64Array:
    """Return (S, n, 16) the fields of `STATE` before the planes."""
    rows = np.zeros((*rods.mass.shape, 16))
    rows[:, 0, 12:] = rods.root_frame
    for into, values in zip(vars(state_of(rows)).values(), vars(state).values(), strict=True):
        into[...] = values
    return rows


def state_of(rows: Any) -> State:
    """Return the state in rows (..., n, 16 or more) of `STATE`: views of them."""
    return State(rows[..., :3], rows[..., 4:7], rows[..., 1:, 12:16], rows[..., 8:11])


def pack_lanes(values: Floats, kind: Kind) -> Floats:
    """Return values (S, ...) of strands as (B, ..., LANES); the last strand fills blocks."""
    rows = np.minimum(np.arange(-(-len(values) // LANES) * LANES), len(values) - 1)
    spread = values.astype(kind)[rows].reshape(-1, LANES, *values.shape[1:])
    return np.ascontiguousarray(np.moveaxis(spread, 1, -1))


def records(values: Floats, kind: np.dtype[Any]) -> Records:
    """Return packed values (B, n, k, LANES) as records (B, n)."""
    return values.reshape(*values.shape[:2], -1).view(kind)[..., 0]
