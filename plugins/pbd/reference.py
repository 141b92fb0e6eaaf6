"""The reference backend: one substep in plain NumPy float64, in the order of the method.

Positions are in the axes of the moving head, velocities are those in the world: the head's surface,
the roots and the captured shape are then constant, and float32 keeps its precision wherever the
head is. The faster backends do the same steps; tests compare them with this one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.obstacles import Bodies

from .linear_system import IMPLICIT, System
from .rods import Rods, half_binormal, midpoint_frame, next_element, split_torque, twist_between

SOFTEST = 1e-3
"""Compliance added to the lengths of nodes in contact, as a share of a free one's."""
LARGEST_SPIN = 0.3
"""Largest rotation of a frame by torsion in a substep, radians; limits the Newton step."""
FASTEST_TURN = 1.0
"""Largest rotation of a segment in a substep, radians: more than hair does, less than what linear
solves cannot follow."""
DRIFT = 0.5 - IMPLICIT**2
"""Weight of the old acceleration in the place; that of the new one is `IMPLICIT` squared."""
FASTEST_CHANGE = 500.0
"""Largest acceleration that a substep passes on to the next, m/s^2: more is a blow."""
TINY = 1e-20
"""Added to squares before a division."""


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
    frames = transport_frames(old.frames, direction)
    frames = relax_twist(rods, frames)
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
    force[:, 1:2] -= system.coupling / IMPLICIT * (root - passed[:, :1])
    free = system.inverse @ force[:, 1:]
    change = free
    pull = np.zeros_like(rods.length)
    for _ in range(iterations):
        pull = solve_tension(
            system, edge + np.diff(free, axis=1, prepend=0.0), direction, rods.length
        )
        force = pull[..., None] * direction
        change = free - system.inverse @ (force - next_element(force))
        direction = quaternion.normalize(edge + np.diff(change, axis=1, prepend=0.0))
    position, acceleration = predicted.copy(), passed
    position[:, 1:] += change
    velocity[:, 1:] += change / (IMPLICIT * h)
    acceleration[:, :1] = root
    acceleration[:, 1:] += change / (IMPLICIT * h**2)
    size = np.sqrt((acceleration * acceleration).sum(axis=-1, keepdims=True) + TINY)
    acceleration *= np.minimum(FASTEST_CHANGE / size, 1.0)
    return State(position, velocity, frames, acceleration), pull


def transform_points(motion: Float64Array, points: Float64Array) -> Float64Array:
    """Return points (..., 3) under a rigid motion (4, 4)."""
    result: Float64Array = points @ motion[:3, :3].T + motion[:3, 3]
    return result


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


def transport_frames(frames: Float64Array, direction: Float64Array) -> Float64Array:
    """Return frames parallel-transported in time to new directions."""
    turn = quaternion.shortest_arc(quaternion.third_axis(frames), direction)
    return quaternion.normalize(quaternion.product(turn, frames))


def relax_twist(rods: Rods, frames: Float64Array) -> Float64Array:
    """Return frames rotated about their segments so that torques balance (one Newton step).

    Torsional waves are much faster than the hair, so twist is quasi-static (Bergou et al. 2008);
    the system is tridiagonal.
    """
    before = rods.before(frames)
    torque = rods.twist * (twist_between(before, frames) - rods.natural_twist)
    natural = quaternion.rotate(midpoint_frame(before, frames), rods.curvature)
    direction = quaternion.third_axis(frames)
    turn = direction - quaternion.third_axis(before)
    spun = rods.bend[..., None] * np.cross(natural, turn)
    first, second = split_torque(before, frames, spun)
    gradient = (
        torque - next_element(torque) - (direction * (second + next_element(first))).sum(axis=-1)
    )
    firm = 0.25 * rods.bend * np.maximum((natural * turn).sum(axis=-1), 0.0)
    diagonal = rods.twist + next_element(rods.twist) + firm + next_element(firm)
    beside = firm[:, 1:] - rods.twist[:, 1:]
    if rods.tip_held:
        gradient[:, -1], beside[:, -1] = 0.0, 0.0
    angle = _tridiagonal(np.where(diagonal > 0, diagonal, 1.0), beside, -gradient)
    angle = np.clip(angle, -LARGEST_SPIN, LARGEST_SPIN)
    # half angles by a rational cosine and sine: exact turns, the angle right to third order
    turn_by = quaternion.normalize(
        np.concatenate([np.ones_like(angle)[..., None], 0.5 * angle[..., None] * direction], -1)
    )
    return quaternion.product(turn_by, frames)


def elastic_force(rods: Rods, edge: Float64Array, frames: Float64Array) -> Float64Array:
    """Return the node force (S, n, 3) of bending and twist, minus the energy gradient."""
    before = rods.before(frames)
    reach = edge / rods.length[..., None]
    held = quaternion.third_axis(rods.root_frame)[:, None]
    turn = reach - np.concatenate([held, reach[:, :-1]], axis=1)
    natural = quaternion.rotate(midpoint_frame(before, frames), rods.curvature)
    moment = rods.bend[..., None] * (natural - turn)
    spun = rods.bend[..., None] * np.cross(natural, turn)
    torque = rods.twist * (twist_between(before, frames) - rods.natural_twist)
    twisting = torque[..., None] * half_binormal(before, frames)
    first, second = split_torque(before, frames, spun)
    direction = quaternion.third_axis(frames)
    pull = moment - twisting - next_element(moment + twisting)
    pull += np.cross(second + next_element(first), direction)
    pull /= rods.length[..., None]
    force = np.zeros((*edge.shape[:1], edge.shape[1] + 1, 3))
    force[:, 1:] += pull
    force[:, :-1] -= pull
    return force


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

    They turn by no more than `FASTEST_TURN` in a substep. Linear solves leave little to do here;
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
        share = np.minimum(FASTEST_TURN * rods.length[:, j, None] / (step * speed), 1.0)
        velocity[:, j + 1] = velocity[:, j] + share * apart
    return replace(state, position=position, velocity=velocity)


def restore_lengths(
    rods: Rods, position: Float64Array, normal: Float64Array
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return positions with restored lengths, the pulls used and their contact pressure.

    One tridiagonal solve (Han and Harada 2013). A node in contact moves only perpendicular to
    `normal` (S, n, 3), which is 0 for free nodes; the root does not move. The pulls (S, n - 1) are
    in kg m; the pressure (S, n) is how far they would press nodes into the obstacles, metres.
    """
    ease = 1.0 / rods.mass
    ease[:, 0] = 0.0
    edge = np.diff(position, axis=1)
    reach = np.linalg.norm(edge, axis=-1)
    direction = edge / reach[..., None]

    def mobility(nodes: slice) -> Float64Array:
        """Displacement of the start or end node by a unit pull of each segment."""
        across = (normal[:, nodes] * direction).sum(axis=-1, keepdims=True) * normal[:, nodes]
        moved_by: Float64Array = ease[:, nodes, None] * (direction - across)
        return moved_by

    start, end = mobility(slice(None, -1)), mobility(slice(1, None))
    diagonal = (direction * (start + end)).sum(axis=-1)
    diagonal += SOFTEST * (ease[:, :-1] + ease[:, 1:])
    beside = -(end[:, :-1] * direction[:, 1:]).sum(axis=-1)
    pull = _tridiagonal(diagonal, beside, reach - rods.length)
    fixed = position.copy()
    fixed[:, :-1] += pull[..., None] * start
    fixed[:, 1:] -= pull[..., None] * end
    push = pull[..., None] * direction
    push = push - next_element(push)
    pressed = np.zeros_like(ease)
    pressed[:, 1:] = ease[:, 1:] * (push * normal[:, 1:]).sum(axis=-1)
    return fixed, pull, pressed


def _tridiagonal(diagonal: Float64Array, beside: Float64Array, right: Float64Array) -> Float64Array:
    """Solve symmetric tridiagonal systems (S, m) by elimination along the rods (Thomas)."""
    count = diagonal.shape[1]
    pivot, value = diagonal.copy(), right.copy()
    for j in range(1, count):
        factor = beside[:, j - 1] / pivot[:, j - 1]
        pivot[:, j] -= factor * beside[:, j - 1]
        value[:, j] -= factor * value[:, j - 1]
    value[:, -1] /= pivot[:, -1]
    for j in range(count - 2, -1, -1):
        value[:, j] = (value[:, j] - beside[:, j] * value[:, j + 1]) / pivot[:, j]
    return value


def elastic_energy(rods: Rods, state: State, shape: Float64Array | None = None) -> float:
    """Return the energy of bending, twist and the pull to the captured shape, joules.

    `shape` (S, n): squared frequencies of that pull, 1/s^2.
    """
    edge = np.diff(state.position, axis=1)
    frames = transport_frames(state.frames, quaternion.normalize(edge))
    before = rods.before(frames)
    reach = edge / rods.length[..., None]
    held = quaternion.third_axis(rods.root_frame)[:, None]
    turn = reach - np.concatenate([held, reach[:, :-1]], axis=1)
    off = turn - quaternion.rotate(midpoint_frame(before, frames), rods.curvature)
    energy = 0.5 * float((rods.bend[..., None] * off**2).sum())
    twist = twist_between(before, frames) - rods.natural_twist
    energy += 0.5 * float((rods.twist * twist**2).sum())
    if shape is not None:
        moved = ((state.position - rods.points) ** 2).sum(axis=-1)
        energy += 0.5 * float((rods.mass * shape * moved).sum())
    return energy
