"""The plugin's rods in motion against physics: chains, beams, air, turning heads, energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods.linear_system import Rates, assemble
from hairkit_plugins.rods.rods import Rods, State, elastic_energy, rest_state
from rods_bench import (
    DENSITY,
    DOWN,
    LENGTH,
    NOTHING,
    G,
    cantilevers,
    chain,
    displaced,
    inertia_of,
    let_go,
    load_of,
    modal_amplitude,
    mode_of_chain,
    rods_of,
    straight,
    system_of,
    tangled,
)
from rods_reference import Load, elastic_force, solve_substep, substep
from scipy.special import roots_laguerre

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

ACROSS, ASIDE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


def quarter_period(
    rods: Rods, shape: Float64Array, way: Float64Array, step: float, gravity: Float64Array
) -> float:
    """Return the time in which a small mode along `way` first comes to zero.

    Backward differences of second order are later than the law by (omega h)^2 / 3.
    """
    system, count, now, before = system_of(rods, step), 0, 1.0, 1.0
    state = let_go(rods, system, displaced(rods, 1e-4 * LENGTH * shape[:, None] * way), gravity)
    while now > 0:
        state = substep(rods, system, state, load_of(gravity))
        count, before = count + 1, now
        now = float(shape @ (state.position[0] - rods.points[0]) @ way)
    return step * (count - now / (now - before))


@pytest.mark.parametrize("beads", [7, 15, 31])
def test_a_chain_of_beads_swings_as_laguerre_says(beads: int) -> None:
    """omega^2 = (N g / L) x1, x1 the first zero of L_N: the quarter period to 0.02 %."""
    omega = np.sqrt(beads * G / LENGTH * roots_laguerre(beads)[0][0])
    quarter = quarter_period(chain(beads), mode_of_chain(beads), ACROSS, 2e-3, DOWN)
    assert quarter == pytest.approx(np.pi / 2 / omega, rel=2e-4)


def test_a_chain_swings_in_its_second_mode_as_laguerre_says() -> None:
    """omega^2 = (N g / L) x2, x2 the second zero of L_N: the quarter period to 0.05 %."""
    omega = np.sqrt(15 * G / LENGTH * roots_laguerre(15)[0][1])
    quarter = quarter_period(chain(15), mode_of_chain(15, 1), ACROSS, 1e-3, DOWN)
    assert quarter == pytest.approx(np.pi / 2 / omega, rel=5e-4)


@pytest.mark.parametrize(("k", "nodes"), [(1.87510407, 25), (4.69409113, 41)])
def test_a_beam_sings_at_its_tones(k: float, nodes: int) -> None:
    """omega = k^2 sqrt(EI / (rho A L^4)), cos k cosh k = -1: two quarter periods to 0.3 %."""
    bending, s = 1e-8, np.linspace(0, 1, nodes)
    rods = rods_of(straight(1, nodes), DENSITY, bending, straight=True)
    omega = k**2 * np.sqrt(bending / DENSITY / LENGTH**4)
    ratio = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    shape = np.cosh(k * s) - np.cos(k * s) - ratio * (np.sinh(k * s) - np.sin(k * s))
    quarter = quarter_period(rods, shape, ASIDE, 2 * np.pi / omega / 400, NOTHING)
    assert quarter == pytest.approx(np.pi / 2 / omega, rel=0.003)


@pytest.mark.parametrize(("drag", "damping"), [(0.0, 0.0), (3.0, 0.0), (0.0, 3.0)])
def test_swings_lose_what_air_and_damping_take(drag: float, damping: float) -> None:
    """Amplitude after a period at h = 1/240: exp(-c t / 2), to 0.2 %, c the rate of either."""
    beads, step = 15, 1 / 240
    rods, shape = chain(beads), mode_of_chain(beads)
    omega = np.sqrt(beads * G / LENGTH * roots_laguerre(beads)[0][0])
    system = assemble(
        rods, Rates(np.full_like(rods.mass, drag), damping, np.zeros_like(rods.mass)), step
    )
    state = let_go(rods, system, displaced(rods, 1e-4 * shape[:, None] * ACROSS), DOWN)
    rate, count = drag + damping, round(2 * np.pi / omega / step)
    first = modal_amplitude(state, shape, omega, rate)
    for _ in range(count):
        state = substep(rods, system, state, load_of(DOWN))
    left = modal_amplitude(state, shape, omega, rate) / first
    kept = np.exp(-rate * count * step / 2)
    assert left == pytest.approx(kept, rel=0.002)


def test_motion_converges_with_the_second_order_of_the_step() -> None:
    """A chain let go, after 0.1 s: halved steps make a quarter of the change, order 1.9 to 2.1."""
    rods, ends = chain(9), []
    for steps in (16, 32, 64, 128):
        system = system_of(rods, 0.1 / steps)
        state = let_go(
            rods, system, displaced(rods, 1e-5 * mode_of_chain(9)[:, None] * ACROSS), DOWN
        )
        for _ in range(steps):
            state = substep(rods, system, state, load_of(DOWN))
        ends.append(state.position[0, -1, 0])
    changes = np.abs(np.diff(ends))
    np.testing.assert_allclose(np.log2(changes[:-1] / changes[1:]), 2.0, atol=0.1)


def test_a_head_that_moves_in_still_air_has_wind_against_it(rng: np.random.Generator) -> None:
    """A head at constant speed in still air and wind on a still head: the same motion."""
    rods, _ = tangled(rng)
    speed, step = np.array([1.5, -0.5, 2.0]), 1 / 240
    head_step = np.eye(4)
    head_step[:3, 3] = -speed * step  # what stood still in the world goes back in the head's axes
    system, standing, going = system_of(rods, step, 4.0), rest_state(rods), rest_state(rods)
    going = replace(going, velocity=going.velocity + speed)
    for _ in range(60):
        standing = substep(rods, system, standing, load_of(DOWN, -speed))
        going = substep(rods, system, going, load_of(DOWN, head_step=head_step))
    assert np.abs(standing.position - rods.points).max() > 1e-3
    np.testing.assert_allclose(going.position, standing.position, atol=1e-9)


def test_hair_that_sinks_at_its_terminal_speed_has_no_weight() -> None:
    """A head that sinks at g / c with its hair: the air bears a level limp strand, to 1e-9 m."""
    drag, step = 4.0, 1 / 240
    rods = rods_of(straight(1, 12), DENSITY, 1e-14, straight=True)
    head_step = np.eye(4)
    head_step[:3, 3] = -DOWN / drag * step
    system, state = system_of(rods, step, drag), rest_state(rods)
    state = replace(state, velocity=state.velocity + DOWN / drag)
    for _ in range(120):
        state = substep(rods, system, state, load_of(DOWN, head_step=head_step))
    np.testing.assert_allclose(state.position, rods.points, atol=1e-9)


def test_a_chain_on_a_turning_hook_keeps_its_plane() -> None:
    """Foucault: a limp chain swings in the world as if its hook did not turn, to 1e-7 m."""
    rods, step, spin = chain(9), 1 / 240, 6.0
    start = displaced(rods, 0.01 * mode_of_chain(9)[:, None] * ACROSS)
    system, still, turning = system_of(rods, step), start, start
    for k in range(120):
        before, after = (turn_about_y(spin * step * (k + j)) for j in (0, 1))
        head_step = np.eye(4)
        head_step[:3, :3] = after.T @ before
        still = substep(rods, system, still, load_of(DOWN))
        turning = substep(rods, system, turning, Load(head_step, after.T, DOWN, NOTHING))
    np.testing.assert_allclose(turning.position @ after.T, still.position, atol=1e-7)


def test_a_whirling_strand_is_taut_by_its_mass_further_out() -> None:
    """Tension rho A omega^2 (L^2 - s^2) / 2 at the middles of the segments, to 1 % of the largest.

    What is beyond s goes round: the integral of rho A omega^2 s from there to the tip.
    """
    nodes, spin, step = 25, 20.0, 1e-4
    rods = rods_of(straight(1, nodes), DENSITY, 1e-6, straight=True)
    head_step = np.eye(4)
    head_step[:3, :3] = quaternion.to_matrix(
        quaternion.from_axis(np.array([0, 0, 1.0]), -spin * step)
    )
    system, state = system_of(rods, step), rest_state(rods)
    state = replace(state, velocity=np.cross([0.0, 0.0, spin], rods.points))
    for _ in range(20):
        state, tension = solve_substep(rods, system, state, load_of(head_step=head_step))
    s = (np.arange(nodes - 1) + 0.5) * LENGTH / (nodes - 1)
    law = DENSITY * spin**2 * (LENGTH**2 - s**2) / 2
    np.testing.assert_allclose(tension[0], law, atol=0.01 * law[0])


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
                ends.append(elastic_energy(rods, position, state.frames, 0 * rods.mass))
            slope[0, node, axis] = -(ends[0] - ends[1]) / 2e-7
    way = quaternion.normalize(np.diff(state.position, axis=1))
    np.testing.assert_allclose(
        across(force, way), across(slope, way), atol=1e-7 * np.abs(force).max()
    )


def test_motion_turns_with_the_axes(rng: np.random.Generator) -> None:
    """Rotate rods, gravity and air and the motion rotates along, to rounding."""
    rods, _ = tangled(rng)
    turn = quaternion.to_matrix(quaternion.normalize(rng.normal(size=4)))
    wind = np.array([1.0, 0.5, -2.0])
    results = []
    for r in (np.eye(3), turn):
        free = rods_of(rods.points @ r.T, DENSITY, 1e-8)
        state, system = rest_state(free), system_of(free, 1 / 240, 2.0)
        for _ in range(60):
            state = substep(free, system, state, load_of(r @ DOWN, r @ wind))
        results.append(state.position @ r)
    np.testing.assert_allclose(results[1], results[0], atol=1e-9)


def test_a_free_swing_never_has_more_energy_than_at_first() -> None:
    """Kinetic, elastic and potential energy together, for stiff and soft rods let go level."""
    rods = cantilevers(np.array([2.0, 50.0]), 16)
    system, state = system_of(rods, 1 / 240), rest_state(rods)
    start, state = energy(rods, state), let_go(rods, system, state, DOWN)
    for _ in range(300):
        state = substep(rods, system, state, load_of(DOWN))
        assert energy(rods, state) < start


def energy(rods: Rods, state: State) -> float:
    """Return kinetic, elastic and gravity's energy, joules."""
    weight = -float((rods.mass[..., None] * state.position * DOWN).sum())
    kinetic = 0.5 * float((state.velocity * (inertia_of(rods) @ state.velocity)).sum())
    return weight + kinetic + elastic_energy(rods, state.position, state.frames, 0 * rods.mass)


def across(force: Float64Array, way: Float64Array) -> Float64Array:
    """Sum of the force beyond each segment, square to it: what tension cannot carry."""
    beyond = np.cumsum(force[:, ::-1], axis=1)[:, ::-1][:, 1:]
    return beyond - (beyond * way).sum(axis=-1, keepdims=True) * way


def turn_about_y(angle: float) -> Float64Array:
    """Return the matrix of a turn about the vertical."""
    return quaternion.to_matrix(quaternion.from_axis(np.array([0.0, 1.0, 0.0]), angle))
