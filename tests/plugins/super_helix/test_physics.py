"""Super-helices against closed forms and solved references of rods and chains."""

from __future__ import annotations

import helix_reference as reference
import numpy as np
import pytest
import rod_energy
from hairkit_plugins.super_helix.statics import gravity_slopes, rest_as_captured
from helix_bench import (
    ALONG_DOWN,
    DENSITY,
    DOWN,
    free,
    rest,
    rod,
    run,
    settled,
    step_of,
    tip,
    total_forces,
)
from helix_kinematics import move_slopes, place
from scipy.linalg import eigh
from scipy.optimize import brentq, root

from hairkit.helices.helix import mean_rotation

LENGTH, WEIGHT = 0.15, DENSITY * 9.81

# self-weight cantilever, clamped level: load w L^3 / EI -> tip x/L and drop/L, from the elastica's
# boundary value problem theta'' = -G (1 - s) cos(theta) solved to 1e-8
ELASTICA = {
    0.1: (0.99991, 0.01250),
    1: (0.99125, 0.12347),
    5: (0.84666, 0.49590),
    20: (0.44523, 0.82988),
    100: (0.15922, 0.93752),
}


@pytest.mark.parametrize("load", ELASTICA)
def test_a_level_hair_sags_as_the_elastica(load: float) -> None:
    """Tip of the heavy elastica within 1 % of the length with 10 elements."""
    one = rod(LENGTH, 10, WEIGHT * LENGTH**3 / load)
    end = tip(one, settled(one)) / LENGTH
    np.testing.assert_allclose([end[0], -end[1]], ELASTICA[load], rtol=0, atol=0.01)
    assert abs(end[2]) < 1e-12


def test_the_elastica_is_met_at_second_order() -> None:
    """Twice the elements, a quarter of the error."""
    errors = []
    for elements in (4, 8, 16):
        one = rod(LENGTH, elements, WEIGHT * LENGTH**3 / 5)
        found = root(lambda q, one=one: total_forces(one, q.reshape(-1, 3)).ravel() * 1e6,
                     settled(one).ravel(), tol=1e-13)  # fmt: skip
        end = tip(one, found.x.reshape(-1, 3)) / LENGTH
        errors.append(np.hypot(end[0] - 0.84666, -end[1] - 0.49590))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.4)
    assert errors[2] < 1e-3


def test_statics_do_not_depend_on_the_step() -> None:
    """The same shape at rest whatever the time step and the iterations."""
    one = rod(LENGTH, 6, WEIGHT * LENGTH**3 / 5)
    ends = []
    for seconds, iterations in ((1e-3, 1), (4e-3, 1), (4e-3, 3)):
        motion = rest(one)
        step = step_of(seconds, two_step=False, iterations=iterations)
        run(one, motion, free(one, 12.0), step, int(5 / seconds))
        ends.append(tip(one, motion.q))
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, rtol=0, atol=1e-6 * LENGTH)


@pytest.mark.parametrize(("span", "sag"), [(0.6, 0.36278), (0.8, 0.26544)])
def test_limp_hair_held_at_both_ends_is_a_catenary(span: float, sag: float) -> None:
    """EI -> 0: sag within 1 % of the length."""
    turn = brentq(lambda turn: np.sin(turn / 2) / (turn / 2) - span, 0.1, 6)
    c, s = np.cos(turn / 2), np.sin(turn / 2)
    frame = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    one = rod(LENGTH, 17, WEIGHT * LENGTH**3 / 1e5, frame)  # starts as an arc of a circle
    one.captured[:, 2] = turn / LENGTH
    one = one._replace(natural=np.zeros((17, 3)))
    one.lengths[:] = np.r_[np.full(16, LENGTH / 16 * (1 - 1e-3)), LENGTH * 1e-3]
    loads = free(one, 12.0)
    loads.spring[-1, -1] = 1e3 * WEIGHT
    loads.anchor[-1, -1] = [span * LENGTH, 0, 0]
    q = settled(one, loads, 6.0)
    placed = place(one, q, one.roots[0], one.frames[0])
    assert placed.ends[-1, 0] / LENGTH == pytest.approx(span, abs=0.01)
    assert -placed.points[..., 1].min() / LENGTH == pytest.approx(sag, abs=0.01)


def test_hanging_hair_swings_as_a_chain() -> None:
    """Periods of the first two modes of a limp hair: Bessel zeros, within 1 %, in and out of time.

    The modes are those of the linear equations; the first one, kicked, also swings at its period.
    """
    one = rest_as_captured(rod(LENGTH, 12, WEIGHT * LENGTH**3 / 1e6, ALONG_DOWN), DOWN)
    placed = place(one, one.captured, one.roots[0], one.frames[0])
    mass = rod_energy.mass_matrix(one, placed)
    pull = reference.stiffness_matrix(one) - gravity_slopes(one, DOWN).reshape(mass.shape)
    plane = np.arange(12) * 3 + 2  # curvature about the frame's third axis: in the plane x, y
    squares, modes = eigh(pull[np.ix_(plane, plane)], mass[np.ix_(plane, plane)])
    periods = 2 * np.pi / np.sqrt(squares[:2])
    unit = np.sqrt(LENGTH / 9.81)
    np.testing.assert_allclose(periods / unit, [5.22548, 2.27648], rtol=0.012)

    rate = np.zeros((12, 3))
    rate[:, 2] = modes[:, 0] / np.abs(modes[:, 0]).max() * 0.5
    motion = rest(one)
    motion.velocity[:] = np.einsum("egiaj,aj->egi", placed.jacobian, rate)
    motion.velocity_before[:] = motion.velocity
    motion.q_before[:] = motion.q - rate / 1000
    xs = []
    for _ in range(1500):
        run(one, motion, free(one), step_of(1e-3, two_step=False), 1)
        xs.append(motion.points[-1, -1, 0])
    x = np.array(xs)
    crossings = np.flatnonzero((x[1:] * x[:-1]) < 0)
    times = crossings + x[crossings] / (x[crossings] - x[crossings + 1])
    assert 2e-3 * np.diff(times).mean() == pytest.approx(periods[0], rel=0.01)


def test_a_cantilever_vibrates_at_its_frequency() -> None:
    """First two modes of a beam without gravity: 1.87510^2 and 4.69409^2 sqrt(EI / (rho A L^4))."""
    one = rod(LENGTH, 12)
    mass = rod_energy.mass_matrix(one, place(one, one.captured, np.zeros(3), np.eye(3)))
    plane = np.arange(12) * 3 + 1
    stiff = reference.stiffness_matrix(one)
    squares = eigh(stiff[np.ix_(plane, plane)], mass[np.ix_(plane, plane)], eigvals_only=True)
    unit = np.sqrt(8e-9 / (DENSITY * LENGTH**4))
    np.testing.assert_allclose(np.sqrt(squares[:2]) / unit, [1.87510**2, 4.69409**2], rtol=0.01)


def test_a_coil_is_a_helical_spring() -> None:
    """Pulled along its axis a close coil of n turns has k = GJ / (2 pi n R^3), within 0.5 %."""
    radius, turns, rise, twist = 0.004, 5, 2e-4, 5e-9
    per_turn = np.hypot(2 * np.pi * radius, rise)
    rate = 2 * np.pi / per_turn
    torsion, curvature = rate * rise / per_turn, rate * 2 * np.pi * radius / per_turn
    elements = 12 * turns
    q = np.tile([torsion, curvature, 0.0], (elements, 1))
    coil = rod(turns * per_turn, elements, 8e-9, q=q, twist=twist)
    placed = place(coil, q, np.zeros(3), np.eye(3))
    axis = (placed.frames[0] @ q[0]) / rate
    frame, end = placed.frames[-1], placed.ends[-1]
    inward = np.cross(frame @ q[0], frame[:, 0])
    centre = end + radius * inward / np.linalg.norm(inward)
    spin = placed.frames[:-1] @ (
        coil.lengths[:, None, None] * mean_rotation(coil.lengths[:, None] * q)
    )
    shift = placed.frames[:-1] @ move_slopes(q, coil.lengths)
    arm = centre - placed.ends[1:]
    lever = axis @ shift + np.einsum("eij,ei->ej", spin, np.cross(arm, axis))
    compliance = (lever**2 / (coil.lengths[:, None] * coil.stiffness)).sum()
    stiffness = twist / (2 * np.pi * turns * radius**3)
    assert 1 / compliance == pytest.approx(stiffness, rel=5e-3)


def test_a_coil_without_load_stays_a_coil() -> None:
    """A natural helix rests to rounding."""
    coil = rod(0.2, 8, q=np.tile([20.0, 60.0, 0.0], (8, 1)))
    motion = rest(coil)
    run(coil, motion, free(coil), step_of(1 / 60, gravity=np.zeros(3)), 30)
    np.testing.assert_allclose(motion.q, coil.captured, rtol=0, atol=1e-10)


def test_wind_and_gravity_act_as_one_force() -> None:
    """In steady wind limp hair hangs along g + (rate) wind: the direction of the body force."""
    one = rod(LENGTH, 10, WEIGHT * LENGTH**3 / 1000, ALONG_DOWN)
    loads = free(one, 12.0)
    loads.air[..., 0] = 9.81 / 12.0
    q = settled(one, loads)
    placed = place(one, q, one.roots[0], one.frames[0])
    direction = placed.frames[-1][:, 0]
    np.testing.assert_allclose(direction, [np.sqrt(0.5), -np.sqrt(0.5), 0], rtol=0, atol=0.02)


def test_rigid_fall_through_air_has_its_terminal_speed() -> None:
    """A head that stops in moving air: drag pulls hair at the stated rate."""
    one = rod(LENGTH, 4, 1e-3)
    motion = rest(one)
    motion.velocity[:] = 0.0
    loads = free(one, 3.0)
    loads.air[..., 1] = 9.81 / 3.0  # holds the weight up exactly
    run(one, motion, loads, step_of(1 / 100), 50)
    np.testing.assert_allclose(motion.q, 0, rtol=0, atol=1e-9)
