"""Laws of super-helices: kinematics, mass, forces, and the two solvers of a step."""

from __future__ import annotations

import helix_reference as reference
import numpy as np
import pytest
import rod_energy
from hairkit_plugins.super_helix import element_kernels
from hairkit_plugins.super_helix.linear_time_step import Strand, newton, step_strands
from hairkit_plugins.super_helix.rods import NODES, Rods
from hairkit_plugins.super_helix.state import Body, Loads, Motion, Step
from hairkit_plugins.super_helix.statics import gravity_forces, rest_as_captured
from helix_bench import DOWN, energy, free, random_rods, rest, rod, run, step_of
from helix_kinematics import move_slopes, moves, place
from scipy.integrate import solve_ivp

from hairkit.helices.helix import mean_rotation, rotation
from hairkit.simulation.obstacle_kernels import Field


@pytest.mark.parametrize("size", [0.0, 1e-7, 1.0, 60.0])
def test_a_rod_is_the_solution_of_its_equation(size: float, rng: np.random.Generator) -> None:
    """Elements in a row agree with F' = F [q]x, r' = F e1 integrated numerically, to 1e-10."""
    one = rod(0.12, 4, q=size * rng.normal(size=(4, 3)))
    state = np.r_[np.eye(3).ravel(), np.zeros(3)]

    def slope(_: float, y: np.ndarray, q: np.ndarray) -> np.ndarray:
        frame = y[:9].reshape(3, 3)
        turned = frame @ np.cross(np.eye(3), q).T * -1
        return np.r_[turned.ravel(), frame[:, 0]]

    for q, length in zip(one.captured, one.lengths, strict=True):
        done = solve_ivp(slope, (0, length), state, "DOP853", rtol=3e-14, atol=1e-16, args=(q,))
        state = done.y[:, -1]
    placed = place(one, one.captured, np.zeros(3), np.eye(3))
    np.testing.assert_allclose(placed.frames[-1].ravel(), state[:9], rtol=0, atol=1e-10)
    np.testing.assert_allclose(placed.ends[-1], state[9:], rtol=0, atol=1e-10)


@pytest.mark.parametrize("size", [0.0, 1e-6, 0.141, 0.142, 0.499, 0.501, 0.99, 1.01, 5.0])
def test_compiled_kinematics_equal_their_twin(size: float, rng: np.random.Generator) -> None:
    """Points, slopes, rotations and mean rotations of one element, through zero curvature."""
    s = 0.03
    q = rng.normal(size=3)
    q *= size / s / np.linalg.norm(q)
    local, slope, turn, mean = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    element_kernels.node(q, s, local, slope)
    element_kernels.turns(q, s, turn, mean)
    np.testing.assert_allclose(local, moves(q, np.array(s)), rtol=0, atol=1e-16)
    np.testing.assert_allclose(slope, move_slopes(q, np.array(s)), rtol=0, atol=1e-17)
    np.testing.assert_allclose(turn, rotation(s * q), rtol=0, atol=1e-14)
    np.testing.assert_allclose(mean, s * mean_rotation(s * q), rtol=0, atol=1e-15)


def test_the_jacobian_is_the_slope_of_the_points(rng: np.random.Generator) -> None:
    """Central differences of all Gauss points by all coordinates."""
    one = random_rods(rng).one(0)
    q, step = one.captured, 1e-4
    placed = place(one, q, one.roots[0], one.frames[0])
    for e, j in np.ndindex(*q.shape):
        shift = np.zeros_like(q)
        shift[e, j] = step
        ahead, back = (
            place(one, q + sign * shift, one.roots[0], one.frames[0]).points for sign in (1, -1)
        )
        slope = (ahead - back) / (2 * step)
        np.testing.assert_allclose(placed.jacobian[:, :, :, e, j], slope, rtol=0, atol=1e-11)


def test_forces_are_minus_the_slope_of_the_potential(rng: np.random.Generator) -> None:
    """Generalised forces by finite differences; gravity's equal those of the linear recursion."""
    one = random_rods(rng).one(1)
    q, step = one.captured, 1e-3

    def potential(at: np.ndarray) -> float:
        return rod_energy.potential(one, at, place(one, at, one.roots[0], one.frames[0]), DOWN)

    expected = np.zeros_like(q)
    for e, j in np.ndindex(*q.shape):
        shift = np.zeros_like(q)
        shift[e, j] = step
        expected[e, j] = -(potential(q + shift) - potential(q - shift)) / (2 * step)
    found = rod_energy.forces(one, q, place(one, q, one.roots[0], one.frames[0]), DOWN)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(found).max())
    elastic = one.lengths[:, None] * one.stiffness * (one.natural - q)
    np.testing.assert_allclose(
        gravity_forces(one, q, DOWN), found - elastic, rtol=0, atol=1e-13 * np.abs(found).max()
    )


def test_the_mass_matrix(rng: np.random.Generator) -> None:
    """M is symmetric and positive definite, and 1/2 q'Mq' is the points' kinetic energy."""
    one = random_rods(rng).one(2)
    placed = place(one, one.captured, one.roots[0], one.frames[0])
    mass = rod_energy.mass_matrix(one, placed)
    np.testing.assert_allclose(mass, mass.T, rtol=0, atol=1e-15 * mass.max())
    assert np.linalg.eigvalsh(mass).min() > 0
    rate = rng.normal(size=one.captured.shape)
    speed = np.einsum("egiaj,aj->egi", placed.jacobian, rate)
    kinetic = 0.5 * (one.masses[..., None] * speed**2).sum()
    assert 0.5 * rate.ravel() @ mass @ rate.ravel() == pytest.approx(kinetic, rel=1e-12)


def busy(rng: np.random.Generator, rods: Rods) -> tuple[Motion, Loads, Step]:
    """Return a strand in motion with every kind of load: drag, springs, contact, a moving head."""
    motion = rest(rods)
    for array, size in zip(motion[1:], (0.1, 0.0, 1e-4, 0.05, 0.05), strict=True):
        array += size * rng.normal(size=array.shape)
    shape = (len(rods.lengths), NODES)
    held = np.where(rng.uniform(size=shape) < 0.1, 1e-4, 0.0)
    loads = Loads(
        rng.uniform(size=shape) * 1e-6,
        rng.normal(size=(*shape, 3)),
        held,
        0.1 * rng.normal(size=(*shape, 3)),
        np.full(shape, 5e-4),
    )
    line = np.linspace(-0.6, 0.6, 41)
    away = np.linalg.norm(np.stack(np.meshgrid(line, line, line, indexing="ij")), axis=0)
    head = np.eye(4)
    head[:3, :3], head[:3, 3] = rotation(np.array([0.002, 0.001, 0.003])), [1e-4, 2e-4, 0]
    field = Field(np.full(3, -0.6), 0.03, (away - 0.15).astype(np.float32))
    return (
        motion,
        loads,
        step_of(1 / 120, friction=0.02)._replace(
            head=head,
            bodies=(Body(head, np.eye(4), field), Body(np.eye(4), np.eye(4), field)),
        ),
    )


@pytest.mark.parametrize("two_step", [True, False])
def test_the_recursion_equals_the_dense_solve(two_step: bool, rng: np.random.Generator) -> None:
    """Linear-time dq is the dense system's, to 1e-8; so are conjugate gradients."""
    rods = random_rods(rng, 4)
    motion, loads, step = busy(rng, rods)
    step = step._replace(head=np.eye(4))
    for strand in range(4):
        own, one = slice(6 * strand, 6 * strand + 6), rods.one(strand)
        before = Motion(*(array[own] for array in motion))
        acting = Loads(*(array[own] for array in loads))
        now = step._replace(two_step=two_step)
        q = 2 * before.q - before.q_before
        matrix, gradient = reference.system(
            one, before, acting, now, q, one.roots[0], one.frames[0]
        )
        dense = np.linalg.solve(matrix, -gradient)
        size = np.linalg.norm(dense)
        assert np.linalg.norm(reference.change(matrix, gradient) - dense) <= 1e-8 * size
        after = before._replace(q=q.copy())
        start = (4 * before.q - before.q_before) / 3 if two_step else before.q
        whole = Strand(0, 6, one.roots[0], one.frames[0], two_step)
        newton(one, after, acting, now, whole, start)
        turned = one.lengths * np.linalg.norm(dense.reshape(-1, 3), axis=1)
        bounded = dense.reshape(-1, 3) / np.maximum(turned, 1.0)[:, None]
        assert np.linalg.norm(after.q - q - bounded) <= 1e-8 * size


def test_both_solvers_keep_the_same_state(rng: np.random.Generator) -> None:
    """Points, velocities and coordinates agree after several steps with contact and friction."""
    rods = random_rods(rng, 2)
    fast, loads, step = busy(rng, rods)
    slow = Motion(*(array.copy() for array in fast))
    for _ in range(3):
        step_strands(0, 2, rods, fast, loads, step)
        reference.step_densely(rods, slow, loads, step)
    for one, other in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-6 * np.abs(other).max())


def test_inverse_statics_rests(rng: np.random.Generator) -> None:
    """With the natural shape found, forces vanish at the captured shape, and nothing moves."""
    rods = rest_as_captured(random_rods(rng), DOWN)
    motion = rest(rods)
    run(rods, motion, free(rods), step_of(1 / 60), 60)
    np.testing.assert_allclose(motion.q, rods.captured, rtol=0, atol=1e-9)
    assert np.abs(motion.velocity).max() < 1e-9


def test_rest_is_stable(rng: np.random.Generator) -> None:
    """Hair that stands up is made stiff enough not to fall over when it is pushed."""
    upright = rod(0.2, 8, frame=np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    rods = rest_as_captured(upright, DOWN)
    assert (rods.stiffness > 2 * upright.stiffness).all()
    motion = rest(rods)
    motion.velocity[:, :, 0] += 0.3
    run(rods, motion, free(rods, 5.0), step_of(2e-3, two_step=False), 1500)
    np.testing.assert_allclose(motion.q, rods.captured, rtol=0, atol=0.05)
    hanging = rod(0.2, 8, frame=np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]]))
    np.testing.assert_array_equal(rest_as_captured(hanging, DOWN).stiffness, hanging.stiffness)


def test_frames_do_not_matter(rng: np.random.Generator) -> None:
    """Root, gravity and loads turned and moved: the same motion turned and moved."""
    rods = random_rods(rng, 1)
    turn, shift = rotation(rng.normal(size=3)), rng.normal(size=3)
    other = rods._replace(roots=rods.roots @ turn.T + shift, frames=turn @ rods.frames)
    one, two = rest(rods), rest(other)
    run(rods, one, free(rods, 1.0), step_of(1 / 200, iterations=3), 20)
    run(other, two, free(rods, 1.0), step_of(1 / 200, gravity=turn @ DOWN, iterations=3), 20)
    np.testing.assert_allclose(two.q, one.q, rtol=0, atol=1e-5 * np.abs(one.q).max())
    np.testing.assert_allclose(two.points, one.points @ turn.T + shift, rtol=0, atol=1e-7)


@pytest.mark.parametrize(("two_step", "slack"), [(True, 5e-3), (False, 1e-6)])
def test_energy_is_never_gained(two_step: bool, slack: float) -> None:
    """A limp hair let go from level never holds more than at the start; BDF2 ripples by 0.5 %."""
    one = rod(0.15, 8, bend=2e-9)
    motion = rest(one)
    start, scale = energy(one, motion), 9.81 * one.masses.sum() * 0.075
    step = step_of(1 / 500, two_step=two_step, iterations=6)
    step_strands(0, 1, one, motion, free(one), step._replace(two_step=False))
    for _ in range(400):
        step_strands(0, 1, one, motion, free(one), step)
        assert energy(one, motion) <= start + slack * scale


@pytest.mark.parametrize("rate", [60, 120, 400])
def test_wild_hair_gains_no_energy(rate: int, rng: np.random.Generator) -> None:
    """Curls let go far from their natural shape, undamped, at any step, only lose energy."""
    for _ in range(3):
        rods = random_rods(rng, 1)
        motion = rest(rods)
        start = energy(rods, motion)
        step = step_of(1 / rate, iterations=6)
        step_strands(0, 1, rods, motion, free(rods), step._replace(two_step=False))
        for _ in range(rate // 3):
            step_strands(0, 1, rods, motion, free(rods), step)
            assert energy(rods, motion) <= start + 0.01 * abs(start)


def test_energy_is_kept_as_steps_get_small() -> None:
    """The second-order step loses little, and ever less."""
    lost = []
    for steps in (100, 200, 400):
        one = rod(0.15, 6)
        motion = rest(one)
        before = energy(one, motion)
        run(one, motion, free(one), step_of(0.3 / steps, iterations=3), steps)
        lost.append((before - energy(one, motion)) / (9.81 * one.masses.sum() * 0.075))
    assert 0 < lost[2] < lost[1] < lost[0]
    assert lost[2] < 0.02


@pytest.mark.parametrize(("two_step", "order"), [(True, 2.0), (False, 1.0)])
def test_order_of_convergence_in_time(two_step: bool, order: float) -> None:
    """Halving the step divides the error of a swing by 4 (BDF2) or 2 (Euler)."""

    def swung(steps: int) -> np.ndarray:
        one = rod(0.1, 4, bend=4e-8)
        motion = rest(one)
        run(one, motion, free(one), step_of(0.08 / steps, two_step=two_step, iterations=3), steps)
        return motion.points.ravel()

    results = [swung(steps) for steps in (80, 160, 320)]
    ratio = np.linalg.norm(results[1] - results[0]) / np.linalg.norm(results[2] - results[1])
    assert np.log2(ratio) == pytest.approx(order, abs=0.35)
