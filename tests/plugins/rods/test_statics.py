"""The plugin's rods at rest against physics: elastica, cables, arcs, springs, inverse statics.

Rods of one test differ only in numbers and are solved side by side. Tables are solutions of the
boundary value problems to 1e-5.
"""

from __future__ import annotations

import numpy as np
import pytest
from hairkit_plugins.rods.backend import Engine
from hairkit_plugins.rods.block import acting
from hairkit_plugins.rods.limits import max_stiffness
from hairkit_plugins.rods.rods import (
    Rods,
    State,
    balance_load,
    rest_state,
    transport_frames,
    twist_between,
)
from rods_bench import (
    DENSITY,
    DOWN,
    LENGTH,
    NOTHING,
    WEIGHT,
    balanced,
    cantilevers,
    clamped,
    load_of,
    naturally_bent,
    rods_of,
    settled,
    spun,
    steps_of,
    straight,
    system_of,
    tangled,
    untouched,
)
from rods_modes import linearised
from rods_reference import solve_substep, substep

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

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


def test_small_loads_bend_a_beam_as_its_linear_law() -> None:
    """Drop P L^3 / 3 EI under a load at the tip, w L^4 / 8 EI under its own weight: to 0.3 %.

    The first from a moment P (L - s), the second from w (L - s)^2 / 2, integrated twice over EI.
    """
    bending, nodes = 1e-8, 25
    rods = rods_of(straight(2, nodes), DENSITY, bending, straight=True)
    force = np.zeros_like(rods.points)
    force[0, -1, 1] = -0.02 * bending / LENGTH**2
    force[1, :, 1] = -0.02 * bending / LENGTH**2 * rods.mass[1] / rods.mass[1].sum()
    state = settled(rods, NOTHING, force=force, step=1 / 50, steps=200)
    drop = -state.position[:, -1, 1] / LENGTH
    np.testing.assert_allclose(drop, [0.02 / 3, 0.02 / 8], rtol=3e-3)


def test_cantilevers_hang_as_the_elastica() -> None:
    """Own weight, Gamma 0.1 to 1000: 0.5 % of the length with 49 nodes."""
    rods = cantilevers(np.array(list(ELASTICA)), 49)
    state = settled(rods, DOWN, drag=5.0, steps=280)
    tip = state.position[:, -1] / LENGTH
    table = np.array(list(ELASTICA.values()))
    np.testing.assert_allclose(np.stack([tip[:, 0], -tip[:, 1]], axis=1), table, atol=0.005)


def test_loaded_tips_bend_as_the_elastica() -> None:
    """A weightless rod with a tip load: 0.2 % of the length with 33 nodes."""
    loads = np.array(list(TIP_LOAD))
    bending = 1e-8
    rods = rods_of(straight(len(loads), 33), DENSITY, bending, straight=True)
    force = np.zeros_like(rods.points)
    force[:, -1, 1] = -loads * bending / LENGTH**2
    state = settled(rods, NOTHING, force=force, step=1 / 50, steps=200)
    tip = state.position[:, -1] / LENGTH
    table = np.array(list(TIP_LOAD.values()))
    np.testing.assert_allclose(np.stack([tip[:, 0], -tip[:, 1]], axis=1), table, atol=0.002)


def test_the_error_falls_with_the_square_of_the_spacing() -> None:
    """Gamma 5 with 9, 17 and 33 nodes: the order is 2, from 1.7 to 2.3."""
    x, drop = ELASTICA[5]
    errors = []
    for nodes in (9, 17, 33):
        rods = cantilevers(np.array([5.0]), nodes)
        tip = settled(rods, DOWN, step=1 / 50, drag=5.0, steps=260).position[0, -1] / LENGTH
        errors.append(np.hypot(tip[0] - x, tip[1] + drop))
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (order > 1.7).all()
    assert (order < 2.3).all()


def test_shapes_depend_neither_on_the_time_step_nor_on_iterations() -> None:
    """Settled shapes agree to a hundred-thousandth of the length."""
    rods = cantilevers(np.array([5.0, 50.0]), 16)
    shapes = [
        settled(rods, DOWN, step=step, steps=steps, iterations=iterations, drag=10.0).position
        for step, steps, iterations in ((1 / 60, 150, 1), (1 / 60, 150, 4), (1 / 120, 300, 1))
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
    rods = rods_of(points, DENSITY, 1e-14, straight=True)
    state = settled(rods, DOWN, pinned_tip=True, step=1 / 400, drag=12.0, steps=400)
    np.testing.assert_allclose(-state.position[..., 1].min(axis=1) / LENGTH, sags, atol=0.005)


def test_a_hanging_strand_carries_the_weight_below() -> None:
    """Tension w (L - s) at the middles of the segments, to 3e-4 of the weight."""
    rods = rods_of(straight(1, 16, (0, -1, 0)), DENSITY, 1e-10, straight=True)
    _, tension = solve_substep(rods, system_of(rods, 1 / 240), rest_state(rods), load_of(DOWN))
    below = LENGTH - (np.arange(15) + 0.5) * LENGTH / 15
    np.testing.assert_allclose(tension[0], WEIGHT * below, atol=3e-4 * WEIGHT * LENGTH)


def arcs(angle: Float64Array) -> Float64Array:
    """Return the tips (S, 3) over the length of rods along X that are bent to these arcs."""
    return np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1) / angle[:, None]


def test_constant_natural_curvature_makes_an_arc() -> None:
    """A straight rod of natural curvature pi / L or 2 pi / L becomes that arc: tip to 0.5 %."""
    angle = np.array([np.pi, 2 * np.pi])
    rods = rods_of(straight(2, 33), DENSITY, 1e-8, straight=True)
    state = settled(naturally_bent(rods, angle), NOTHING, drag=10.0, step=1 / 150, steps=400)
    np.testing.assert_allclose(state.position[:, -1] / LENGTH, arcs(angle), atol=0.005)


def test_an_end_moment_makes_an_arc() -> None:
    """A pure moment M at the tip: curvature M / EI everywhere, the tip to 0.3 % of the length."""
    bending, angle = 1e-8, np.array([np.pi / 2, np.pi])
    rods = rods_of(straight(2, 33), DENSITY, bending, straight=True)
    system, state, force = (
        system_of(rods, 1 / 200, 8.0),
        rest_state(rods),
        np.zeros_like(rods.points),
    )
    for k in range(400):
        # a couple on the last segment that turns with it, brought up slowly
        way = quaternion.normalize(state.position[:, -1] - state.position[:, -2])
        couple = min(1.0, k / 150) * angle * bending / LENGTH / rods.length[:, -1]
        force[:, -1] = couple[:, None] * np.cross([0.0, 0.0, 1.0], way)
        force[:, -2] = -force[:, -1]
        state = substep(rods, system, state, load_of(force=force), None, 2)
    np.testing.assert_allclose(state.position[:, -1] / LENGTH, arcs(angle), atol=0.003)


def test_a_turned_tip_twists_the_rod_evenly() -> None:
    """Tip held turned by phi: every element has its share and the torque GJ phi / L, to 1e-6."""
    nodes, torsion, angle = 21, 5e-9, 7.0
    rods = clamped(rods_of(straight(1, nodes), DENSITY, 1e-8, torsion, straight=True))
    uneven = angle * np.linspace(0, 1, nodes - 1)[None] ** 1.5
    frames = balanced(rods, spun(rods.frames, uneven))
    twist = twist_between(rods.before(frames), frames)[0, 1:]
    np.testing.assert_allclose(twist, angle / (nodes - 2), rtol=1e-6)
    between_clamps = LENGTH * (nodes - 2) / (nodes - 1)
    np.testing.assert_allclose(
        rods.twist[0, 1:] * twist, torsion * angle / between_clamps, rtol=1e-6
    )


def test_a_coil_is_a_helical_spring() -> None:
    """k = GJ / (2 pi n R^3) where the last turn is led along the axis, to 0.5 %.

    The wire then has the torque P R and no moment; P delta = 2 pi n R (P R)^2 / GJ. With a free end
    that is pulled by the wire they are P R (1 - cos) and P R sin of the angle from there, and the
    compliance is 2 pi n R^3 (3 / 2 GJ + 1 / 2 EI). Errors fall with the square of the spacing:
    those of 10 and 20 nodes in a turn are extrapolated.
    """
    turns, radius, rise, bending, torsion = 2, 0.01, 4e-4, 1e-8, 6e-9
    wire = 2 * np.pi * turns * radius**3
    laws = np.array([wire / torsion, wire * (1.5 / torsion + 0.5 / bending)])
    errors = []
    for per_turn in (10, 20):
        place = (np.arange(per_turn * turns + 2) - 0.5) / per_turn
        round_ = 2 * np.pi * place
        helix = [radius * np.cos(round_), radius * np.sin(round_), rise * place]
        rods = clamped(rods_of(np.stack(helix, axis=-1)[None], DENSITY, bending, torsion))
        held, along_axis = np.eye(3 * rods.nodes)[:, 6:], np.zeros((3 * rods.nodes, 1))
        along_axis[[-4, -1]] = 1.0
        pull = np.zeros((rods.nodes, 3))
        pull[-1, 2] = 1.0
        led = linearised(rods, rest_state(rods), None, np.hstack([held[:, :-6], along_axis]))
        free = linearised(Rods(**vars(rods)), rest_state(rods), None, held)
        errors.append(np.array([way.yielding(pull)[-1, 2] for way in (led, free)]) / laws - 1)
    assert (np.abs(errors[1]) < 0.03).all()
    np.testing.assert_allclose((4 * errors[1] - errors[0]) / 3, 0.0, atol=0.005)


def test_a_soft_strand_points_along_all_body_forces() -> None:
    """Gravity with wind through drag: the strand lies along g + drag * wind, to 0.2 degrees."""
    rods = rods_of(straight(1, 16, (0, -1, 0)), DENSITY, 1e-16, straight=True)
    wind, drag = np.array([1.0, 0.0, 0.4]), 12.0
    state = settled(rods, DOWN, air=wind, drag=drag, step=1 / 240, steps=400)
    way = quaternion.normalize(state.position[0, -1] - state.position[0, 1])
    cosine = way @ quaternion.normalize(DOWN + drag * wind)
    assert np.degrees(np.arccos(min(cosine, 1.0))) < 0.2


def test_natural_curls_come_back() -> None:
    """A rod with the natural shape of a helix, drawn almost straight, winds itself up again."""
    t = np.linspace(0, 2.5, 20)
    helix = np.stack([0.02 * np.cos(t) - 0.02, 0.02 * np.sin(t), 0.008 * t], axis=-1)[None]
    rods = rods_of(helix, DENSITY, 1e-8)
    edge = np.diff(helix, axis=1)
    flat = quaternion.normalize(0.3 * edge + 0.7 * edge[:, :1]) * rods.length[..., None]
    position = np.concatenate([helix[:, :1], helix[:, :1] + np.cumsum(flat, axis=1)], axis=1)
    frames = transport_frames(rods.frames, quaternion.normalize(flat))
    start = State(position, 0 * position, frames, 0 * position)
    state = settled(rods, NOTHING, start=start, drag=5.0, steps=300)
    np.testing.assert_allclose(state.position, helix, atol=1e-4)


def test_the_natural_shape_rests_to_rounding(rng: np.random.Generator) -> None:
    """Without load a curled rod stays as it is made: 1e-12 m in a quarter of a second."""
    rods = rods_of(tangled(rng)[0].points, DENSITY, DENSITY * 0.05)
    state, system = rest_state(rods), system_of(rods, 1 / 240)
    for _ in range(60):
        state = substep(rods, system, state, load_of())
    assert np.abs(state.position - rods.points).max() < 1e-12


def test_inverse_statics_keeps_any_shape(rng: np.random.Generator) -> None:
    """A curled rod loaded by gravity stays where it is for a second, to 2 micrometres."""
    rods, _ = tangled(rng)
    state, system = rest_state(rods), system_of(rods, 1 / 240)
    for _ in range(240):
        state = substep(rods, system, state, load_of(DOWN))
    assert np.abs(state.position - rods.points).max() < 2e-6


@pytest.mark.parametrize("curl", [0.1, 0.3, 0.7])
@pytest.mark.parametrize("spacing", [1e-3, 6e-3])
def test_short_stiff_coils_stay_at_rest(curl: float, spacing: float) -> None:
    """As stiff as `max_stiffness` lets them be, coils of any size and turn keep their shape."""
    angle = curl * np.arange(15)
    edges = spacing * np.stack([np.sin(angle), -np.cos(angle), 0.2 + 0 * angle], axis=1)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(edges, axis=0)])[None]
    bending = max_stiffness(points, 1 / 240)[:, None]
    plain = rods_of(points, 1.0, bending)
    rods = balance_load(plain, plain.mass[..., None] * DOWN)
    engine, still = Engine(rods, untouched(rods)), acting(rods, NOTHING, None)
    engine.run(system_of(rods, 1 / 240), steps_of(load_of(DOWN), 240, 1 / 240), still)
    assert np.abs(engine.state.position - points).max() < 1e-3 * spacing
