"""The readable twin of the rods' kernels and shaders: a substep in NumPy float64, in their order.

`TwinSimulator` is the plugin's simulator with substeps by this.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from hairkit_plugins.rods import kernel_contact, kernels
from hairkit_plugins.rods.backend import Engine
from hairkit_plugins.rods.block import Contact
from hairkit_plugins.rods.linear_system import IMPLICIT, System
from hairkit_plugins.rods.rods import Rods, State, midpoint_frame, transport_frames, twist_between
from hairkit_plugins.rods.simulator import RodSimulator

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.rigid_motion import transform_points
from hairkit.simulation.substeps import Steps

DRIFT = 0.5 - IMPLICIT**2
"""Weight of the old acceleration in the place; that of the new one is `IMPLICIT` squared."""
SOFTEST = float(kernel_contact.SOFTEST) - 1
"""Compliance added to the lengths of nodes in contact, as a share of a free one's."""
SPIN, TURN, CHANGE, TINY = map(float, (kernels.SPIN, kernels.TURN, kernels.CHANGE, kernels.TINY))
SHARPEST = float(kernels.SHARPEST)


@dataclass(frozen=True, eq=False)
class ClampedRods(Rods):
    """Rods whose last frames are fixed; the caller holds their last two nodes."""


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


def load_of_step(
    steps: Steps, k: int, seconds: float, air: Float64Array, force: Float64Array
) -> Load:
    """Return what acts in substep k of so many seconds."""
    turn, down = steps.air[k, :, :3], steps.air[k, :, 3]
    torso_step = np.eye(4)
    torso_step[:3] -= seconds * steps.torso_drift[k]
    torso = TorsoStep(_motion(steps.torso[k]), torso_step)
    return Load(_motion(steps.head_step[k]), turn, turn.T @ down, air, force, torso)


def _motion(rows: Float64Array) -> Float64Array:
    """Return a motion (4, 4) of its upper rows."""
    return np.concatenate([rows, [[0.0, 0.0, 0.0, 1.0]]])


class TwinEngine(Engine):
    """The twin as an engine."""

    def __init__(self, rods: Rods, contact: Contact) -> None:
        super().__init__(rods, contact, np.float64)

    def run(self, system: System, steps: Steps, outer: Float64Array) -> None:
        """Do the substeps."""
        air = outer[..., :3]
        force = self.rods.mass.mean(axis=1)[:, None, None] * outer[..., 3:]
        for k in range(len(steps.turn)):
            load = load_of_step(steps, k, system.step, air, force)
            self.state = substep(self.rods, system, self.state, load, self.contact)


class TwinSimulator(RodSimulator):
    """The simulator with the twin as its engine."""

    def _make_engine(self, contact: Contact) -> Engine:
        return TwinEngine(self.rods, contact)


def substep(
    rods: Rods,
    system: System,
    state: State,
    load: Load,
    contact: Contact | None = None,
    iterations: int = 1,
) -> State:
    """Return the state one substep later.

    `iterations` linearise the lengths anew about the last solution; the default is enough at the
    default substeps, since positions and directions are predicted to second order.
    """
    new, _ = solve_substep(rods, system, state, load, iterations)
    if contact is not None:
        new, _ = resolve_contacts(rods, new, contact, load, system.step)
    return keep_lengths(rods, new, system.step)


def solve_substep(
    rods: Rods, system: System, state: State, load: Load, iterations: int = 1
) -> tuple[State, Float64Array]:
    """Return the state one substep later where nothing is touched, and the tension in newtons.

    The tension (S, n - 1) of the segments is what kept their lengths in this substep.
    """
    h, rates = system.step, system.rates
    old, root = to_new_head_axes(state, load.head_step, rods, h)
    # what the old acceleration contributes to the new velocity and place
    passed = (1 - IMPLICIT) * old.acceleration
    predicted = old.position + h * old.velocity + DRIFT * h**2 * old.acceleration
    velocity = old.velocity + h * passed
    predicted[:, 0], velocity[:, 0] = rods.points[:, 0], old.velocity[:, 0]
    edge = np.diff(predicted, axis=1)
    direction = quaternion.normalize(edge)
    frames = relax_twist(rods, transport_frames(old.frames, direction))
    force = elastic_force(rods, edge, frames)
    # Velocity of a point that rides on the head, in the world: where it is less where it was.
    head_velocity = (predicted - transform_points(load.head_step, predicted)) / h
    force += rods.mass[..., None] * (
        load.turn @ load.gravity
        + rates.drag[..., None] * (load.air @ load.turn.T - velocity)
        + rates.damping * (head_velocity - velocity)
        + rates.shape[..., None] * (rods.points - predicted)
    )
    if load.force is not None:
        force += load.force
    force[:, 1:2] -= rods.bars[:, :1, None] / 6 / IMPLICIT * (root - passed[:, :1])
    free = np.linalg.solve(system.matrix, force[:, 1:])
    change = free
    pull = np.zeros_like(rods.length)
    for _ in range(iterations):
        pull = solve_tension(
            system, edge + np.diff(free, axis=1, prepend=0.0), direction, rods.length
        )
        force = pull[..., None] * direction
        change = free - np.linalg.solve(system.matrix, force - next_element(force))
        direction = quaternion.normalize(edge + np.diff(change, axis=1, prepend=0.0))
    position, acceleration = predicted.copy(), passed
    position[:, 1:] += change
    velocity[:, 1:] += change / (IMPLICIT * h)
    acceleration[:, :1] = root
    acceleration[:, 1:] += change / (IMPLICIT * h**2)
    size = np.sqrt((acceleration * acceleration).sum(axis=-1, keepdims=True) + TINY)
    acceleration *= np.minimum(CHANGE / size, 1.0)
    return State(position, velocity, frames, acceleration), pull


def to_new_head_axes(
    state: State, head_step: Float64Array, rods: Rods, step: float
) -> tuple[State, Float64Array]:
    """Return the state in the head axes at the end of the substep; roots follow the head.

    Beside it, (S, 1, 3) the roots' acceleration in it.
    """
    position = transform_points(head_step, state.position)
    velocity = state.velocity @ head_step[:3, :3].T
    frames = quaternion.product(quaternion.from_matrix(head_step[:3, :3]), state.frames)
    acceleration = state.acceleration @ head_step[:3, :3].T
    led = (rods.points[:, :1] - position[:, :1]) / step
    root = (led - velocity[:, :1]) / step
    velocity[:, :1] = led
    return State(position, velocity, frames, acceleration), root


def elements(
    rods: Rods, frames: Float64Array, way: Float64Array
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the elements' turns and natural turns (S, n - 1, 3), and torques (S, n - 1).

    The turns are those between the segments `way` (S, n - 1, 3), over their lengths.
    """
    before, held = rods.before(frames), quaternion.third_axis(rods.root_frame)[:, None]
    turn = way - np.concatenate([held, way[:, :-1]], axis=1)
    natural = quaternion.rotate(midpoint_frame(before, frames), rods.curvature)
    return turn, natural, rods.twist * (twist_between(before, frames) - rods.natural_twist)


def half_binormal(before: Float64Array, after: Float64Array) -> Float64Array:
    """Return a x b / (1 + a.b) of directions a, b: the gradient of twist with respect to either."""
    first, second = quaternion.third_axis(before), quaternion.third_axis(after)
    cosine = (first * second).sum(axis=-1, keepdims=True)
    result: Float64Array = np.cross(first, second) / np.maximum(1.0 + cosine, SHARPEST)
    return result


def split_torque(
    before: Float64Array, after: Float64Array, torque: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Split a torque on the midpoint frames into torques on the frames before and after.

    The midpoint frame rotates by half the sum of both rotations, plus the tangent of a quarter of
    the angle between them times their difference.
    """
    step = quaternion.product(after, quaternion.inverse(before))
    sign = np.where(step[..., :1] < 0, -1.0, 1.0)
    quarter = sign * step[..., 1:] / (1.0 + sign * step[..., :1])
    aside = np.cross(quarter, torque)
    return 0.5 * (torque - aside), 0.5 * (torque + aside)


def next_element(values: Float64Array) -> Float64Array:
    """Return the values of the next element, 0 beyond the tip."""
    return np.concatenate([values[:, 1:], np.zeros_like(values[:, :1])], axis=1)


def frame_torques(rods: Rods, frames: Float64Array, spun: Float64Array) -> Float64Array:
    """Return the torques (S, n - 1, 3) on the segments' frames of those on the elements."""
    first, second = split_torque(rods.before(frames), frames, spun)
    return second + next_element(first)


def relax_twist(rods: Rods, frames: Float64Array) -> Float64Array:
    """Return frames rotated about their segments so that torques balance (one Newton step).

    Torsional waves are much faster than the hair, so twist is quasi-static (Bergou et al. 2008);
    the system is tridiagonal.
    """
    direction = quaternion.third_axis(frames)
    turn, natural, torque = elements(rods, frames, direction)
    turning = frame_torques(rods, frames, rods.bend[..., None] * np.cross(natural, turn))
    gradient = torque - next_element(torque) - (direction * turning).sum(axis=-1)
    firm = 0.25 * rods.bend * np.maximum((natural * turn).sum(axis=-1), 0.0)
    diagonal = rods.twist + next_element(rods.twist) + firm + next_element(firm)
    beside = firm[:, 1:] - rods.twist[:, 1:]
    if isinstance(rods, ClampedRods):
        gradient[:, -1], beside[:, -1] = 0.0, 0.0
    at, matrix = np.arange(diagonal.shape[1]), np.zeros((*diagonal.shape, diagonal.shape[1]))
    matrix[:, at, at] = np.where(diagonal > 0, diagonal, 1.0)
    matrix[:, at[1:], at[:-1]] = matrix[:, at[:-1], at[1:]] = beside
    angle = -np.linalg.solve(matrix, gradient[..., None])
    half = 0.5 * np.clip(angle, -SPIN, SPIN)
    # half angles by a rational cosine and sine: exact turns, the angle right to third order
    turn_by = np.concatenate([np.ones_like(half), half * direction], axis=-1)
    return quaternion.product(quaternion.normalize(turn_by), frames)


def elastic_force(rods: Rods, edge: Float64Array, frames: Float64Array) -> Float64Array:
    """Return the node force (S, n, 3) of bending and twist, minus the energy gradient."""
    reach = edge / rods.length[..., None]
    turn, natural, torque = elements(rods, frames, reach)
    turning = frame_torques(rods, frames, rods.bend[..., None] * np.cross(natural, turn))
    moment = rods.bend[..., None] * (natural - turn)
    twisting = torque[..., None] * half_binormal(rods.before(frames), frames)
    pull = moment - twisting - next_element(moment + twisting)
    pull += np.cross(turning, quaternion.third_axis(frames))
    return -along_segments(pull / rods.length[..., None])


def along_segments(pull: Float64Array) -> Float64Array:
    """Return the node forces (S, n, 3) of segments (S, n - 1, 3): towards and from the tip."""
    return np.pad(pull, ((0, 0), (0, 1), (0, 0))) - np.pad(pull, ((0, 0), (1, 0), (0, 0)))


def solve_tension(
    system: System, edge: Float64Array, direction: Float64Array, length: Float64Array
) -> Float64Array:
    """Return the tension (S, n - 1) that restores the segments' lengths, newtons."""
    excess = (edge * direction).sum(axis=-1) - length
    matrix = system.metric * (direction @ direction.transpose(0, 2, 1))
    result: Float64Array = np.linalg.solve(matrix, excess[..., None])[..., 0]
    return result


def resolve_contacts(
    rods: Rods, state: State, contact: Contact, load: Load, step: float
) -> tuple[State, Float64Array]:
    """Return the state with penetrations resolved, with Coulomb friction, and a tension.

    The tension (S, n - 1), newtons, restores the lengths, in addition to that of the substep
    before: both press a taut strand onto an obstacle.
    """
    pose = None if load.torso is None else load.torso.from_head
    distance, normal, on_torso = contact.bodies.at(state.position, pose)
    depth = contact.clearance - distance
    depth[:, 0] = 0.0
    normal = (depth > 0)[..., None] * normal
    surface = (state.position - transform_points(load.head_step, state.position)) / step
    if load.torso is not None:
        beside = (state.position - transform_points(load.torso.step, state.position)) / step
        surface = np.where(on_torso[..., None], beside, surface)
    inward = np.maximum(-((state.velocity - surface) * normal).sum(axis=-1), 0.0)
    # Depth of this substep is removed at once, older depth at a limited speed.
    out = np.clip(depth, 0.0, (inward + contact.fastest) * step)
    velocity = state.velocity + inward[..., None] * normal
    position = state.position + out[..., None] * normal
    grip, taut = contact.friction * inward, np.zeros_like(rods.length)
    for _ in range(1 + contact.rounds):
        brake = friction_change(velocity - surface, normal, grip)
        # a change over the substep moves a node by half of it, as that of its other forces
        position, velocity = position + 0.5 * step * brake, velocity + brake
        fixed, pull, pressed = restore_lengths(rods, position, normal)
        velocity, position = velocity + (fixed - position) / step, fixed
        taut += pull / step**2
        grip += contact.friction * pressed / step - np.linalg.norm(brake, axis=-1)
    return replace(state, position=position, velocity=velocity), taut


def friction_change(
    relative: Float64Array, normal: Float64Array, grip: Float64Array
) -> Float64Array:
    """Return the change (S, n, 3) of velocities along the obstacle, at most `grip` (S, n), m/s.

    Coulomb: the change along is at most the coefficient times the change across.
    """
    along = relative - (relative * normal).sum(axis=-1, keepdims=True) * normal
    speed = np.linalg.norm(along, axis=-1)
    slowed = np.clip(grip, 0.0, speed) / np.maximum(speed, 1e-12)
    result: Float64Array = -slowed[..., None] * along
    return result


def keep_lengths(rods: Rods, state: State, step: float) -> State:
    """Return a state whose segments have their exact lengths, from the root to the tip.

    They turn by no more than `TURN` in a substep. Linear solves leave little to do here;
    after jumps this is what keeps hair whole.
    """
    position, velocity = state.position.copy(), state.velocity.copy()
    for j in range(rods.nodes - 1):
        edge = position[:, j + 1] - position[:, j]
        size = np.sqrt((edge * edge).sum(axis=1, keepdims=True) + TINY)
        way = (rods.length[:, j, None] / size - 1.0) * edge
        position[:, j + 1] += way
        apart = velocity[:, j + 1] + way / step - velocity[:, j]
        speed = np.sqrt((apart * apart).sum(axis=1, keepdims=True) + TINY)
        share = np.minimum(TURN * rods.length[:, j, None] / (step * speed), 1.0)
        velocity[:, j + 1] = velocity[:, j] + share * apart
    return replace(state, position=position, velocity=velocity)


def restore_lengths(
    rods: Rods, position: Float64Array, normal: Float64Array
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return positions with restored lengths, the pulls used and their contact pressure.

    One solve (Han and Harada 2013). A node in contact moves only perpendicular to `normal`
    (S, n, 3), which is 0 for free nodes; the root does not move. The pulls (S, n - 1) are in kg m;
    the pressure (S, n) is how far they would press nodes into the obstacles, metres.
    """
    ease = 1.0 / rods.mass
    ease[:, 0] = 0.0
    edge = np.diff(position, axis=1)
    reach = np.linalg.norm(edge, axis=-1)
    at = np.arange(rods.nodes - 1)
    # unit pulls of each segment on each node (S, n - 1, n, 3), and how these move
    pulled = np.zeros((*reach.shape, *position.shape[1:]))
    pulled[:, at, at] = edge / reach[..., None]
    pulled[:, at, at + 1] = -pulled[:, at, at]
    pressed = (pulled * normal[:, None]).sum(axis=-1)
    moved = ease[:, None, :, None] * (pulled - pressed[..., None] * normal[:, None])
    matrix = np.einsum("sinc,sjnc->sij", pulled, moved)
    matrix[:, at, at] += SOFTEST * (ease[:, :-1] + ease[:, 1:])
    pull = np.linalg.solve(matrix, (reach - rods.length)[..., None])[..., 0]
    fixed = position + np.einsum("si,sinc->snc", pull, moved)
    return fixed, pull, -ease * np.einsum("si,sin->sn", pull, pressed)
