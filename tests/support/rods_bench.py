"""Rods of the plugin set up, loaded and left to settle, for the physics tests of the simulator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from hairkit_plugins.rods.block import Contact
from hairkit_plugins.rods.linear_system import IMPLICIT, Rates, System, assemble
from hairkit_plugins.rods.rods import (
    Rods,
    State,
    balance_load,
    make_rods,
    rest_state,
    transport_frames,
)
from rods_reference import ClampedRods, Load, relax_twist, solve_substep, substep

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.hair_cells import drift_rows
from hairkit.simulation.obstacles import NO_BODIES
from hairkit.simulation.substeps import Steps

LENGTH, DENSITY, G = 0.15, 6.5e-6, 9.81
WEIGHT = DENSITY * G
DOWN = np.array([0.0, -G, 0.0])
NOTHING = np.zeros(3)


def straight(count: int, nodes: int, direction: Sequence[float] = (1, 0, 0)) -> Float64Array:
    """Return points of `count` straight rods."""
    along = np.linspace(0, LENGTH, nodes)[None, :, None]
    return np.repeat(along * np.array(direction, float), count, axis=0)


def rods_of(
    points: npt.ArrayLike,
    density: npt.ArrayLike,
    bending: npt.ArrayLike,
    torsion: npt.ArrayLike | None = None,
    *,
    straight: bool = False,
) -> Rods:
    """Return unloaded rods whose natural shape is `points` (S, n, 3), or straight.

    Mass per length in kg/m, EI and GJ in N m^2: numbers or (S, 1); GJ is EI / 1.3 where None (a
    round fibre of Poisson's ratio 0.3).
    """
    ei, gj = np.array(bending), np.array(bending) / 1.3 if torsion is None else np.array(torsion)
    rods = make_rods(np.array(points, np.float64), np.array(density), ei, gj)
    return rods if straight else balance_load(rods, np.zeros_like(rods.points))


def inertia_of(rods: Rods) -> Float64Array:
    """Return (S, n, n) the mass matrix: a rigid bar has thirds and sixths of its mass."""
    at = np.arange(rods.nodes)
    matrix = np.zeros((len(rods.mass), rods.nodes, rods.nodes))
    matrix[:, at, at] = rods.mass
    for ends in ((at[:-1], at[1:]), (at[1:], at[:-1])):
        matrix[:, ends[0], ends[0]] -= rods.bars / 6
        matrix[:, ends[0], ends[1]] += rods.bars / 6
    return matrix


def untouched(rods: Rods) -> Contact:
    """Return contact with nothing."""
    return Contact(NO_BODIES, np.zeros_like(rods.mass), 0.0, 0.5)


def steps_of(load: Load, count: int, seconds: float) -> Steps:
    """Return that many substeps of one load; the torso goes with the head."""
    head, turn = load.head_step, load.turn
    air = np.concatenate([turn, (turn @ load.gravity)[:, None]], axis=1)
    drift, rotation = drift_rows(head, seconds), quaternion.from_matrix(head[:3, :3])
    one = Steps(head[:3], drift, air, rotation, np.eye(4)[:3], drift)
    return Steps(*(np.repeat(part[None], count, axis=0) for part in one))


def cantilevers(gamma: Float64Array, nodes: int) -> Rods:
    """Return horizontal rods of these Gamma = weight per length L^3 / EI."""
    bending = WEIGHT * LENGTH**3 / gamma[:, None]
    return rods_of(straight(len(gamma), nodes), DENSITY, bending, straight=True)


def system_of(rods: Rods, step: float, drag: float = 0.0, pinned_tip: bool = False) -> System:
    """Return the system of rods in air, their tips tied to where they are if asked."""
    shape = np.zeros_like(rods.mass)
    shape[:, -1] = 1e7 if pinned_tip else 0.0
    return assemble(rods, Rates(np.full_like(rods.mass, drag), 0.0, shape), step)


def load_of(
    gravity: Float64Array = NOTHING,
    air: Float64Array = NOTHING,
    force: Float64Array | None = None,
    head_step: Float64Array | None = None,
) -> Load:
    """Return what acts on rods; the head stands still unless it rides."""
    return Load(np.eye(4) if head_step is None else head_step, np.eye(3), gravity, air, force)


def settled(
    rods: Rods,
    gravity: Float64Array,
    *,
    force: Float64Array | None = None,
    air: Float64Array = NOTHING,
    step: float = 1 / 100,
    drag: float = 3.0,
    steps: int = 450,
    iterations: int = 2,
    pinned_tip: bool = False,
    start: State | None = None,
) -> State:
    """Return the state after so long that thick air has stopped all motion."""
    system = system_of(rods, step, drag, pinned_tip)
    state = rest_state(rods) if start is None else start
    load = load_of(gravity, air, force)
    for _ in range(steps):
        state = substep(rods, system, state, load, None, iterations)
    return state


def displaced(rods: Rods, shift: Float64Array) -> State:
    """Return rods at rest with their nodes shifted a little."""
    position = rods.points + shift
    frames = transport_frames(rods.frames, quaternion.normalize(np.diff(position, axis=1)))
    return State(position, 0 * position, frames, 0 * position)


def let_go(rods: Rods, system: System, state: State, gravity: Float64Array = NOTHING) -> State:
    """Return a state off equilibrium with the acceleration that it starts with.

    A substep from none gains `IMPLICIT` of it.
    """
    later, _ = solve_substep(rods, system, state, load_of(gravity))
    gained = (later.velocity - state.velocity) / system.step
    return replace(state, acceleration=gained / IMPLICIT)


def tangled(rng: np.random.Generator) -> tuple[Rods, State]:
    """Return a curled rod that carries its weight, and a disturbed state of it."""
    s = np.linspace(0, 1, 12)
    points = 0.2 * np.stack([s, 0.3 * np.sin(5 * s), 0.3 * np.cos(4 * s)], axis=-1)[None]
    rods = rods_of(points, DENSITY, DENSITY * 0.05)
    rods = balance_load(rods, rods.mass[..., None] * DOWN)
    way = quaternion.normalize(np.diff(points, axis=1) + 0.003 * rng.normal(size=(1, 11, 3)))
    moved = points[:, :1] + np.cumsum(way * rods.length[..., None], axis=1)
    position = np.concatenate([points[:, :1], moved], axis=1)
    frames = balanced(rods, transport_frames(rods.frames, way))
    return rods, State(position, 0 * position, frames, 0 * position)


def balanced(rods: Rods, frames: Float64Array) -> Float64Array:
    """Return frames spun until torsion is in balance."""
    for _ in range(200):
        before, frames = frames, relax_twist(rods, frames)
        if np.abs(frames - before).max() < 1e-14:
            break
    return frames


def spun(frames: Float64Array, angle: Float64Array) -> Float64Array:
    """Return frames turned about their segments by angles, radians."""
    return quaternion.product(quaternion.from_axis(quaternion.third_axis(frames), angle), frames)


def clamped(rods: Rods) -> Rods:
    """Return rods whose first and last segments do not spin; something else holds their nodes."""
    firm = np.ones_like(rods.twist)
    firm[:, 0] = 1e6
    return ClampedRods(**{**vars(rods), "twist": firm * rods.twist})


def naturally_bent(rods: Rods, angle: Float64Array) -> Rods:
    """Return straight rods along X whose natural shapes are arcs of these angles towards Y."""
    # an element turns by its share of the arc; the chord of the turn is 2 sin(half of it)
    span = np.append(0.5, np.ones(rods.nodes - 2)) / (rods.nodes - 1)
    side = quaternion.rotate(quaternion.inverse(rods.frames[:, :1]), np.array([0.0, 1.0, 0.0]))
    return replace(rods, curvature=side * 2 * np.sin(angle[:, None, None] * span[:, None] / 2))


def chain(beads: int) -> Rods:
    """Return a chain without stiffness that hangs: beads alike, the first node is the hook."""
    rods = rods_of(straight(1, beads + 1, (0, -1, 0)), DENSITY, 1e-18, straight=True)
    mass = np.full_like(rods.mass, DENSITY * LENGTH / beads)
    return replace(rods, mass=mass, bars=np.zeros_like(rods.bars))


def mode_of_chain(beads: int, number: int = 0) -> Float64Array:
    """Return a mode (beads + 1,), the slowest first, of a chain hanging from its first node."""
    tension = np.arange(beads, 0, -1.0)
    stiffness = np.diag(tension + np.append(tension[1:], 0)) - np.diag(tension[1:], 1)
    values, vectors = np.linalg.eigh(stiffness - np.diag(tension[1:], -1))
    mode = vectors[:, np.argsort(values)[number]]
    return np.concatenate([[0.0], mode / mode[-1]])


def modal_amplitude(state: State, shape: Float64Array, omega: float, rate: float = 0.0) -> float:
    """Return the amplitude of a mode along X from its place and speed; `rate` damps it, 1/s."""
    place = float(shape @ state.position[0, :, 0]) / float(shape @ shape)
    speed = float(shape @ state.velocity[0, :, 0]) / float(shape @ shape)
    # x = exp(-c t / 2) cos(w t), so that x' + c x / 2 is a quarter period apart from it
    around = np.sqrt(omega**2 - rate**2 / 4)
    return float(np.hypot(place, (speed + rate * place / 2) / around))
