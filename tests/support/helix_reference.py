"""The same step formed densely and solved by conjugate gradients, as in the patent.

Readable twin of `hairkit_plugins.super_helix.linear_time_step`, one strand at a time. Mass matrix
and forces are those of Bertails et al. 2006, section 4: M = J' m J, K = diag(l GJ, l EI, l EI). The
step is implicit (Euler or BDF2) in place of the text's semi-implicit one: its Coriolis forces arise
from the Gauss points' own velocities.
"""

from __future__ import annotations

import numpy as np
from hairkit_plugins.super_helix.contact import Point, touch
from hairkit_plugins.super_helix.rods import NODES, Rods
from hairkit_plugins.super_helix.state import CLOSE, FAR, Loads, Motion, Step
from helix_kinematics import place
from scipy.sparse.linalg import LinearOperator, cg

from hairkit.arrays import Float64Array

_MOST_ROUNDS = 40
"""Conjugate gradient steps per unknown: without rounding one would do."""


def stiffness_matrix(rod: Rods) -> Float64Array:
    """Return K (3n, 3n), diagonal."""
    return np.diag((rod.lengths[:, None] * rod.stiffness).ravel())


def system(
    rod: Rods,
    motion: Motion,
    loads: Loads,
    step: Step,
    q: Float64Array,
    root: Float64Array,
    frame: Float64Array,
) -> tuple[Float64Array, Float64Array]:
    """Return matrix A (3n, 3n) and gradient (3n,) of a Newton iteration at q: A dq = -gradient.

    `motion` holds the strand's state before the step; `root` and `frame` are its clamped end after
    it.
    """
    placed = place(rod, q, root, frame)
    h, back_q, back, rate = _history(motion, step)
    weight, pull = _point_loads(rod, loads, step, h, placed.points, back, rate)
    flat = placed.jacobian.reshape(-1, 3, 3 * len(q))
    matrix = np.einsum("pia,pij,pjb->ab", flat, weight.reshape(-1, 3, 3), flat)
    gradient = np.einsum("pia,pi->a", flat, pull.reshape(-1, 3))
    stiff = stiffness_matrix(rod)
    matrix += h * (h + step.friction) * stiff
    elastic = h * (q - rod.natural) + step.friction * (q - back_q)
    return matrix, gradient + h * stiff @ elastic.ravel()


def change(matrix: Float64Array, gradient: Float64Array) -> Float64Array:
    """Return dq (3n,) by conjugate gradients, preconditioned by the diagonal."""
    scale = 1 / np.diag(matrix)
    precondition = LinearOperator(matrix.shape, lambda v: scale * v)
    found, _ = cg(
        matrix, -gradient, rtol=1e-12, maxiter=_MOST_ROUNDS * len(gradient), M=precondition
    )
    return np.asarray(found)


def step_densely(rods: Rods, motion: Motion, loads: Loads, step: Step) -> None:
    """Advance all strands by one step as `linear_time_step.step_strands` does, slowly."""
    for strand in range(len(rods.offsets) - 1):
        own = slice(rods.offsets[strand], rods.offsets[strand + 1])
        rod = rods.one(strand)
        before = Motion(*(array[own].copy() for array in motion))
        acting = Loads(*(array[own] for array in loads))
        root = step.head[:3, :3] @ rod.roots[0] + step.head[:3, 3]
        frame = step.head[:3, :3] @ rod.frames[0]
        q, converged = _iterate(rod, before, acting, step, step.iterations, root, frame)
        taken = step
        if not converged:
            taken = step._replace(two_step=False)
            calm = before._replace(q_before=before.q)
            q, _ = _iterate(rod, calm, acting, taken, 2 * step.iterations, root, frame)
        h, _, back, _ = _history(before, taken)
        points = place(rod, q, root, frame).points
        new = (q, before.q, points, before.points, (points - back) / h, before.velocity)
        for array, values in zip(motion, new, strict=True):
            array[own] = values


def _iterate(
    rod: Rods,
    before: Motion,
    loads: Loads,
    step: Step,
    iterations: int,
    root: Float64Array,
    frame: Float64Array,
) -> tuple[Float64Array, bool]:
    """Return coordinates after Newton iterations from extrapolated ones; whether they converged."""
    q = 2 * before.q - before.q_before
    most = 0.0
    for _ in range(iterations):
        dq = change(*system(rod, before, loads, step, q, root, frame)).reshape(q.shape)
        size = rod.lengths * np.linalg.norm(dq, axis=1)
        q = q + dq / np.maximum(size, 1.0)[:, None]
        most = float(size.max())
        if most < CLOSE:
            break
    return q, most < FAR


def _history(motion: Motion, step: Step) -> tuple[float, Float64Array, Float64Array, Float64Array]:
    """Return the effective step, and the q, points and velocities that it starts from."""
    if not step.two_step:
        return step.seconds, motion.q, motion.points, motion.velocity
    pairs = (
        (motion.q, motion.q_before),
        (motion.points, motion.points_before),
        (motion.velocity, motion.velocity_before),
    )
    q, points, velocity = ((4 * now - before) / 3 for now, before in pairs)
    return step.seconds * 2 / 3, q, points, velocity


def _point_loads(
    rod: Rods,
    loads: Loads,
    step: Step,
    h: float,
    points: Float64Array,
    back: Float64Array,
    rate: Float64Array,
) -> tuple[Float64Array, Float64Array]:
    """Return weights (n, NODES, 3, 3) and gradients (n, NODES, 3) of the Gauss points."""
    mass = rod.masses[..., None]
    drag, spring = h * loads.drag[..., None], h * h * loads.spring[..., None]
    pull = mass * (points - back - h * rate - h * h * step.gravity)
    pull += drag * (points - back - h * loads.air) + spring * (points - loads.anchor)
    weight = (mass + drag + spring)[..., None] * np.eye(3)
    for body in step.bodies:
        for e, g in np.ndindex(len(points), NODES if len(body.field.distance) else 0):
            touch(
                step,
                body,
                float(mass[e, g, 0]),
                h,
                float(loads.gap[e, g]),
                Point(points[e, g], back[e, g], weight[e, g], pull[e, g]),
                np.empty((3, 3)),
            )
    return weight, pull
