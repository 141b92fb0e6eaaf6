"""The rods of pbd against physics: elastica, cables, chains, beams, buckling, friction, energy.

Rods of one test differ only in numbers and are solved side by side. Tables are solutions of the
boundary value problems to 1e-5.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.pbd.energies import elastic_energy
from hairkit_plugins.pbd.reference import (
    Contact,
    Load,
    State,
    at_rest,
    elastic_force,
    substep,
    swung,
    untwisted,
)
from hairkit_plugins.pbd.rods import Rods, loaded, make_rods
from hairkit_plugins.pbd.system import Rates, System, assemble
from scipy.special import roots_laguerre

from hairkit.simulate import rotation
from hairkit.simulate.obstacles import Obstacles
from hairkit.stored import Float64Array
from hairkit.volume import VoxelGrid

LENGTH, DENSITY, G = 0.15, 6.5e-6, 9.81
WEIGHT = DENSITY * G
DOWN = np.array([0.0, -G, 0.0])

ELASTICA = {
    0.1: (0.99991, 0.01250), 1: (0.99125, 0.12347), 2: (0.96689, 0.23851), 5: (0.84666, 0.49590),
    10: (0.65635, 0.70020), 20: (0.44523, 0.82988), 50: (0.24501, 0.90792), 100: (0.15922, 0.93752),
    200: (0.10742, 0.95677), 1000: (0.04599, 0.98114),
}  # fmt: skip
"""Gamma = w L^3 / EI of a cantilever under its own weight: the tip's x/L and drop/L."""
TIP_LOAD = {
    0.1: (0.99933, 0.03330), 1: (0.94357, 0.30172), 2: (0.83936, 0.49346), 5: (0.61237, 0.71379),
    10: (0.44500, 0.81061),
}  # fmt: skip
"""P L^2 / EI of a weightless cantilever with a load at its tip."""


def straight(
    count: int, nodes: int, direction: tuple[float, float, float] = (1, 0, 0)
) -> np.ndarray:
    """Return points of `count` straight rods."""
    along = np.linspace(0, LENGTH, nodes)[None, :, None]
    return np.repeat(along * np.array(direction, float), count, axis=0)


def system_of(rods: Rods, step: float, drag: float = 0.0, pinned_tip: bool = False) -> System:
    """Return the system of rods in air, their tips tied to where they are if asked."""
    shape = np.zeros_like(rods.mass)
    shape[:, -1] = 1e7 if pinned_tip else 0.0
    return assemble(rods, Rates(np.full_like(rods.mass, drag), 0.0, shape), step)


def settled(
    rods: Rods,
    gravity: Float64Array,
    *,
    force: Float64Array | None = None,
    air: Float64Array | None = None,
    step: float = 1 / 100,
    drag: float = 3.0,
    steps: int = 450,
    iterations: int = 2,
    pinned_tip: bool = False,
    start: State | None = None,
) -> State:
    """Return the state after so long that thick air has stopped all motion."""
    system = system_of(rods, step, drag, pinned_tip)
    state = at_rest(rods) if start is None else start
    load = Load(np.eye(4), np.eye(3), gravity, np.zeros(3) if air is None else air, force)
    for _ in range(steps):
        state = substep(rods, system, state, load, None, iterations)
    return state


def cantilevers(gamma: Float64Array, nodes: int) -> Rods:
    """Return horizontal rods of these Gamma."""
    bending = WEIGHT * LENGTH**3 / gamma[:, None]
    return make_rods(straight(len(gamma), nodes), DENSITY, bending, straight=True)


def test_cantilevers_hang_as_the_elastica() -> None:
    """Own weight, Gamma 0.1 to 1000: 0.5 % of the length with 49 nodes."""
    state = settled(cantilevers(np.array(list(ELASTICA)), 49), DOWN)
    tip = state.position[:, -1] / LENGTH
    table = np.array(list(ELASTICA.values()))
    np.testing.assert_allclose(np.stack([tip[:, 0], -tip[:, 1]], axis=1), table, atol=0.005)


def test_loaded_tips_bend_as_the_elastica() -> None:
    """A weightless rod with a tip load: 0.2 % of the length with 33 nodes."""
    loads = np.array(list(TIP_LOAD))
    bending = 1e-8
    rods = make_rods(straight(len(loads), 33), DENSITY, bending, straight=True)
    force = np.zeros_like(rods.points)
    force[:, -1, 1] = -loads * bending / LENGTH**2
    tip = settled(rods, np.zeros(3), force=force).position[:, -1] / LENGTH
    table = np.array(list(TIP_LOAD.values()))
    np.testing.assert_allclose(np.stack([tip[:, 0], -tip[:, 1]], axis=1), table, atol=0.002)


def test_the_error_falls_with_the_square_of_the_spacing() -> None:
    """Gamma 5 with 9, 17 and 33 nodes: the order is 2, from 1.7 to 2.3."""
    x, drop = ELASTICA[5]
    errors = []
    for nodes in (9, 17, 33):
        tip = settled(cantilevers(np.array([5.0]), nodes), DOWN).position[0, -1] / LENGTH
        errors.append(np.hypot(tip[0] - x, tip[1] + drop))
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (order > 1.7).all()
    assert (order < 2.3).all()


def test_shapes_depend_neither_on_the_time_step_nor_on_iterations() -> None:
    """Settled shapes agree to a hundred-thousandth of the length."""
    rods = cantilevers(np.array([5.0, 50.0]), 16)
    shapes = [
        settled(rods, DOWN, step=step, steps=steps, iterations=iterations, drag=10.0).position
        for step, steps, iterations in ((1 / 60, 400, 1), (1 / 60, 400, 4), (1 / 300, 1600, 1))
    ]
    for other in shapes[1:]:
        np.testing.assert_allclose(other, shapes[0], atol=1e-5 * LENGTH)


def test_a_cable_hangs_as_a_catenary() -> None:
    """Both ends held, no stiffness: the sag of four spans to 0.5 % of the length."""
    spans, sags = np.array([0.3, 0.6, 0.8, 0.9]), np.array([0.45245, 0.36278, 0.26544, 0.19071])
    nodes, s = 33, np.linspace(-0.5, 0.5, 33)
    # start as a V of the right length between the ends
    points = np.zeros((4, nodes, 3))
    points[..., 0] = spans[:, None] * s * LENGTH
    points[..., 1] = (np.abs(s) - 0.5) * np.sqrt(1 - spans**2)[:, None] * LENGTH
    rods = make_rods(points, DENSITY, 1e-14, straight=True)
    state = settled(rods, DOWN, pinned_tip=True, step=1 / 800, drag=10.0, steps=1000)
    np.testing.assert_allclose(-state.position[..., 1].min(axis=1) / LENGTH, sags, atol=0.005)


@pytest.mark.parametrize("beads", [7, 15, 31])
def test_a_chain_of_beads_swings_as_laguerre_says(beads: int) -> None:
    """omega^2 = (N g / L) x1, x1 the first zero of L_N: the quarter period to 0.3 %."""
    points = straight(1, beads + 1, (0, -1, 0))
    rods = make_rods(points, DENSITY, 1e-18, straight=True)
    rods = replace(rods, mass=np.full_like(rods.mass, WEIGHT / G * LENGTH / beads))
    first = roots_laguerre(beads)[0][0]
    omega = np.sqrt(beads * G / LENGTH * first)
    shape = mode_of_chain(beads)
    state = displaced(rods, 2e-4 * shape[:, None] * np.array([1.0, 0, 0]))
    step = 2e-4
    system, load = system_of(rods, step), Load(np.eye(4), np.eye(3), DOWN, np.zeros(3))
    time, before = 0.0, state.position[0, -1, 0]
    while True:
        state = substep(rods, system, state, load)
        time, now = time + step, state.position[0, -1, 0]
        if now <= 0:
            break
        before = now
    crossing = time - step * now / (now - before)
    # Implicit Euler's frequency is lower by its damping only; the quarter period is longer by h/2.
    assert crossing - step / 2 == pytest.approx(np.pi / 2 / omega, rel=0.003)


def test_swings_lose_what_implicit_steps_take() -> None:
    """Amplitude after two periods at h = 1/240: exp(-omega^2 h t / 2) to 2 %."""
    beads, step = 15, 1 / 240
    rods = make_rods(straight(1, beads + 1, (0, -1, 0)), DENSITY, 1e-18, straight=True)
    rods = replace(rods, mass=np.full_like(rods.mass, WEIGHT / G * LENGTH / beads))
    omega = np.sqrt(beads * G / LENGTH * roots_laguerre(beads)[0][0])
    shape = mode_of_chain(beads)
    state = displaced(rods, 1e-4 * shape[:, None] * np.array([1.0, 0, 0]))
    system, load = system_of(rods, step), Load(np.eye(4), np.eye(3), DOWN, np.zeros(3))
    energy = []
    for _ in range(round(4 * np.pi / omega / step)):
        energy.append(modal_amplitude(rods, state, shape, omega))
        state = substep(rods, system, state, load)
    time = step * len(energy)
    left = modal_amplitude(rods, state, shape, omega) / energy[0]
    assert left == pytest.approx(np.exp(-(omega**2) * step * time / 2), rel=0.02)


def test_a_beam_sings_at_its_first_tone() -> None:
    """omega_1 = 1.8751^2 sqrt(EI / (rho A L^4)) without gravity: the quarter period to 0.5 %."""
    bending, nodes = 1e-8, 25
    rods = make_rods(straight(1, nodes), DENSITY, bending, straight=True)
    omega = 1.87510407**2 * np.sqrt(bending / DENSITY / LENGTH**4)
    s, k = np.linspace(0, 1, nodes), 1.87510407
    ratio = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    shape = np.cosh(k * s) - np.cos(k * s) - ratio * (np.sinh(k * s) - np.sin(k * s))
    state = displaced(rods, 1e-4 * shape[:, None] * np.array([0, 1.0, 0]))
    step = 2 * np.pi / omega / 4000
    system, load = system_of(rods, step), Load(np.eye(4), np.eye(3), np.zeros(3), np.zeros(3))
    count = 0
    while state.position[0, -1, 1] > 0:
        state, count = substep(rods, system, state, load), count + 1
    assert (count - 0.5) * step == pytest.approx(np.pi / 2 / omega, rel=0.005)


def test_a_beam_sings_at_its_second_tone() -> None:
    """omega_2 = 4.69409^2 sqrt(EI / (rho A L^4)) without gravity: the quarter period to 1.5 %."""
    bending, nodes, k = 1e-8, 41, 4.69409113
    rods = make_rods(straight(1, nodes), DENSITY, bending, straight=True)
    omega, s = k**2 * np.sqrt(bending / DENSITY / LENGTH**4), np.linspace(0, 1, nodes)
    ratio = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    shape = np.cosh(k * s) - np.cos(k * s) - ratio * (np.sinh(k * s) - np.sin(k * s))
    state = displaced(rods, 1e-4 * shape[:, None] * np.array([0, 1.0, 0]))
    step = 2 * np.pi / omega / 4000
    system, load = system_of(rods, step), Load(np.eye(4), np.eye(3), np.zeros(3), np.zeros(3))
    count = 0
    while float(shape @ state.position[0, :, 1]) > 0:
        state, count = substep(rods, system, state, load), count + 1
    assert (count - 0.5) * step == pytest.approx(np.pi / 2 / omega, rel=0.015)


def test_a_chain_swings_in_its_second_mode_as_laguerre_says() -> None:
    """omega^2 = (N g / L) x2, x2 the second zero of L_N: the quarter period to 0.5 %."""
    beads, step = 15, 1e-4
    rods = make_rods(straight(1, beads + 1, (0, -1, 0)), DENSITY, 1e-18, straight=True)
    rods = replace(rods, mass=np.full_like(rods.mass, WEIGHT / G * LENGTH / beads))
    omega, shape = (
        np.sqrt(beads * G / LENGTH * roots_laguerre(beads)[0][1]),
        mode_of_chain(beads, 1),
    )
    state = displaced(rods, 1e-4 * shape[:, None] * np.array([1.0, 0, 0]))
    system, load = system_of(rods, step), Load(np.eye(4), np.eye(3), DOWN, np.zeros(3))
    count, now, before = 0, 1.0, 1.0
    while now > 0:
        state, count, before = substep(rods, system, state, load), count + 1, now
        now = float(shape @ state.position[0, :, 0])
    crossing = step * (count - now / (now - before))
    assert crossing - step / 2 == pytest.approx(np.pi / 2 / omega, rel=0.005)


@pytest.mark.parametrize("turn", [0.5, 1.0])
def test_constant_natural_curvature_makes_an_arc(turn: float) -> None:
    """A straight rod of natural curvature 2 pi turn / L becomes that arc: tip to 0.5 % of L."""
    nodes, angle = 33, 2 * np.pi * turn
    rods = make_rods(straight(1, nodes), DENSITY, 1e-8, straight=True)
    # an element turns by its share of the arc; the chord of the turn is 2 sin(half of it)
    span = np.append(0.5, np.ones(nodes - 2)) / (nodes - 1)
    bent = rotation.rotated(rods.frames[:, :1] * [1, -1, -1, -1], np.array([0.0, 1.0, 0.0]))
    rods = replace(rods, curvature=bent * (2 * np.sin(angle * span / 2))[None, :, None])
    tip = settled(rods, np.zeros(3), drag=8.0, step=1 / 200, steps=600).position[0, -1] / LENGTH
    arc = np.array([np.sin(angle), 1 - np.cos(angle), 0.0]) / angle
    np.testing.assert_allclose(tip, arc, atol=0.005)


def test_upright_hair_falls_over_beyond_the_critical_length() -> None:
    """Gamma_c = 7.8373: at 7.5 a small lean heals, at 8.2 it grows."""
    gamma = np.array([7.5, 8.2])
    bending = WEIGHT * LENGTH**3 / gamma[:, None]
    rods = make_rods(straight(2, 33, (0, 1, 0)), DENSITY, bending, straight=True)
    lean = 1e-3 * LENGTH * np.linspace(0, 1, 33)[:, None] ** 2 * np.array([1.0, 0, 0])
    start = displaced(rods, lean)
    tip = settled(rods, DOWN, start=start, drag=1.0, step=0.02).position[:, -1, 0]
    assert abs(tip[0]) < 0.5 * lean[-1, 0]
    assert tip[1] > 10 * lean[-1, 0]


def test_a_soft_strand_points_along_all_body_forces() -> None:
    """Gravity with wind through drag: the strand lies along g + drag * wind, to 0.2 degrees."""
    rods = make_rods(straight(1, 16, (0, -1, 0)), DENSITY, 1e-16, straight=True)
    wind, drag = np.array([3.0, 0.0, 1.0]), 4.0
    state = settled(rods, DOWN, air=wind, drag=drag, step=1 / 240, steps=800)
    way = rotation.unit(state.position[0, -1] - state.position[0, 1])
    cosine = way @ rotation.unit(DOWN + drag * wind)
    assert np.degrees(np.arccos(min(cosine, 1.0))) < 0.2


def test_natural_curls_come_back() -> None:
    """A rod with the natural shape of a helix, drawn almost straight, winds itself up again."""
    t = np.linspace(0, 2.5, 20)
    helix = np.stack([0.02 * np.cos(t) - 0.02, 0.02 * np.sin(t), 0.008 * t], axis=-1)[None]
    rods = make_rods(helix, DENSITY, 1e-8)
    edge = np.diff(helix, axis=1)
    flat = rotation.unit(0.3 * edge + 0.7 * edge[:, :1]) * rods.length[..., None]
    position = np.concatenate([helix[:, :1], helix[:, :1] + np.cumsum(flat, axis=1)], axis=1)
    frames = swung(rods.frames, rotation.unit(flat))
    start = State(position, np.zeros_like(position), frames)
    state = settled(rods, np.zeros(3), start=start, drag=5.0, steps=400)
    np.testing.assert_allclose(state.position, helix, atol=1e-4)


def test_hair_on_a_slope_slides_when_the_slope_beats_friction() -> None:
    """tan(alpha) = mu: a strand across the slope stays at mu above it and goes at mu below it."""
    alpha, moved = np.radians(30.0), []
    gravity = G * np.array([0.0, -np.cos(alpha), -np.sin(alpha)])
    grid = VoxelGrid.around(np.full(3, -0.2), np.full(3, 0.2), 0.02)
    plane = Obstacles(grid, grid.centres()[..., 1])
    rods = make_rods(straight(1, 12), DENSITY, 1e-16, straight=True)
    for share in (1.1, 0.9):
        contact = Contact(plane, np.zeros_like(rods.mass), share * np.tan(alpha), 0.5)
        system, state = system_of(rods, 1 / 240), at_rest(rods)
        load = Load(np.eye(4), np.eye(3), gravity, np.zeros(3))
        for _ in range(48):
            state = substep(rods, system, state, load, contact)
        moved.append(-state.position[0, -1, 2])
    free_fall = 0.5 * 0.1 * G * np.sin(alpha) * 0.2**2
    assert moved[0] < 1e-6
    assert moved[1] == pytest.approx(free_fall, rel=0.15)


def test_forces_are_the_slope_of_the_energy(rng: np.random.Generator) -> None:
    """Square to the segments, bending and twist forces equal the energy's finite difference."""
    rods, state = tangled(rng)
    force = elastic_force(rods, np.diff(state.position, axis=1), state.frames)
    slope = np.zeros_like(force)
    for node in range(rods.nodes):
        for axis in range(3):
            ends = []
            for side in (1e-7, -1e-7):
                position = state.position.copy()
                position[0, node, axis] += side
                ends.append(elastic_energy(rods, replace(state, position=position)))
            slope[0, node, axis] = -(ends[0] - ends[1]) / 2e-7
    way = rotation.unit(np.diff(state.position, axis=1))
    np.testing.assert_allclose(
        across(force, way), across(slope, way), atol=1e-7 * np.abs(force).max()
    )


def test_inverse_statics_keeps_any_shape(rng: np.random.Generator) -> None:
    """A curled rod loaded by gravity stays where it is for a second, to 0.1 micrometres."""
    rods, _ = tangled(rng)
    state, system = at_rest(rods), system_of(rods, 1 / 240)
    for _ in range(240):
        state = substep(rods, system, state, Load(np.eye(4), np.eye(3), DOWN, np.zeros(3)))
    assert np.abs(state.position - rods.points).max() < 1e-7


def test_motion_turns_with_the_axes(rng: np.random.Generator) -> None:
    """Rotate rods, gravity and air and the motion rotates along, to rounding."""
    rods, _ = tangled(rng)
    turn = rotation.to_matrix(rotation.unit(rng.normal(size=4)))
    wind = np.array([1.0, 0.5, -2.0])
    results = []
    for r in (np.eye(3), turn):
        points = rods.points @ r.T
        free = make_rods(points, DENSITY, 1e-8)
        state, system = at_rest(free), system_of(free, 1 / 240, 2.0)
        for _ in range(60):
            state = substep(free, system, state, Load(np.eye(4), np.eye(3), r @ DOWN, r @ wind))
        results.append(state.position @ r)
    np.testing.assert_allclose(results[1], results[0], atol=1e-9)


def test_a_free_swing_never_gains_energy() -> None:
    """Kinetic, elastic and potential energy together only fall, for stiff and soft rods."""
    rods = cantilevers(np.array([2.0, 50.0]), 16)
    system, state, before = system_of(rods, 1 / 240), at_rest(rods), np.inf
    load = Load(np.eye(4), np.eye(3), DOWN, np.zeros(3))
    for _ in range(300):
        state = substep(rods, system, state, load)
        weight = -float((rods.mass[..., None] * state.position * DOWN).sum())
        kinetic = 0.5 * float((rods.mass[..., None] * state.velocity**2).sum())
        total = weight + kinetic + elastic_energy(rods, state)
        assert total <= before + 1e-9 * abs(weight)
        before = total


def tangled(rng: np.random.Generator) -> tuple[Rods, State]:
    """Return a curled rod that carries its weight, and a disturbed state of it."""
    s = np.linspace(0, 1, 12)
    points = 0.2 * np.stack([s, 0.3 * np.sin(5 * s), 0.3 * np.cos(4 * s)], axis=-1)[None]
    rods = make_rods(points, DENSITY, DENSITY * 0.05)
    rods = loaded(rods, rods.mass[..., None] * DOWN)
    way = rotation.unit(np.diff(points, axis=1) + 0.003 * rng.normal(size=(1, 11, 3)))
    moved = points[:, :1] + np.cumsum(way * rods.length[..., None], axis=1)
    position = np.concatenate([points[:, :1], moved], axis=1)
    frames = swung(rods.frames, way)
    for _ in range(200):
        frames = untwisted(rods, frames)
    return rods, State(position, np.zeros_like(position), frames)


def across(force: Float64Array, way: Float64Array) -> Float64Array:
    """Sum of the force beyond each segment, square to it: what tension cannot carry."""
    beyond = np.cumsum(force[:, ::-1], axis=1)[:, ::-1][:, 1:]
    return beyond - (beyond * way).sum(axis=-1, keepdims=True) * way


def displaced(rods: Rods, shift: Float64Array) -> State:
    """Return rods at rest with their nodes shifted a little."""
    position = rods.points + shift
    frames = swung(rods.frames, rotation.unit(np.diff(position, axis=1)))
    return State(position, np.zeros_like(position), frames)


def mode_of_chain(beads: int, number: int = 0) -> Float64Array:
    """Return a mode (beads + 1,), the slowest first, of a chain hanging from its first node."""
    tension = np.arange(beads, 0, -1.0)
    stiffness = np.diag(tension + np.append(tension[1:], 0)) - np.diag(tension[1:], 1)
    values, vectors = np.linalg.eigh(stiffness - np.diag(tension[1:], -1))
    mode = vectors[:, np.argsort(values)[number]]
    return np.concatenate([[0.0], mode / mode[-1]])


def modal_amplitude(rods: Rods, state: State, shape: Float64Array, omega: float) -> float:
    """Amplitude of a mode from its displacement and velocity."""
    place = float(shape @ state.position[0, :, 0]) / float(shape @ shape)
    speed = float(shape @ state.velocity[0, :, 0]) / float(shape @ shape)
    return float(np.hypot(place, speed / omega))
