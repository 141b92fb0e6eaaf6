"""Single super-helices under load, for the physics tests of the simulator."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from hairkit_plugins.super_helix.linear_time_step import step_strands
from hairkit_plugins.super_helix.rods import NODES, Rods
from hairkit_plugins.super_helix.state import Body, Loads, Motion, Step
from hairkit_plugins.super_helix.statics import gravity_forces
from helix_kinematics import place

from hairkit.simulation.obstacle_kernels import NO_FIELDS

Array = npt.NDArray[np.float64]
DOWN = np.array([0.0, -9.81, 0.0])
ALONG_X = np.eye(3)
"""A frame whose tangent is +X."""
ALONG_DOWN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""A frame whose tangent is -Y."""
DENSITY = 6.5e-6


def rod(
    length: float = 0.15,
    elements: int = 10,
    bend: float = 8e-9,
    frame: Array = ALONG_X,
    q: Array | None = None,
    twist: float | None = None,
) -> Rods:
    """Return one rod, straight unless its coordinates q (n, 3) are given, at ease without load."""
    shape = np.zeros((elements, 3)) if q is None else np.array(q, np.float64)
    stiffness = np.tile([bend if twist is None else twist, bend, bend], (elements, 1))
    return Rods(
        np.array([0, elements]),
        np.zeros((1, 3)),
        frame[None].copy(),
        np.full(elements, length / elements),
        shape,
        shape.copy(),
        stiffness,
        np.full(elements, DENSITY),
    )


def random_rods(rng: np.random.Generator, strands: int = 3, elements: int = 6) -> Rods:
    """Return rods of random shapes and stiffnesses."""
    total = strands * elements
    frames = np.linalg.qr(rng.normal(size=(strands, 3, 3)))[0]
    frames[..., 2] *= np.sign(np.linalg.det(frames))[:, None]
    return Rods(
        np.arange(strands + 1) * elements,
        rng.normal(size=(strands, 3)) * 0.1,
        frames,
        rng.uniform(0.01, 0.03, total),
        rng.normal(size=(total, 3)) * 30,
        rng.normal(size=(total, 3)) * 30,
        8e-9 * rng.uniform(0.5, 1.5, (total, 3)),
        np.full(total, DENSITY),
    )


def rest(rods: Rods, q: Array | None = None) -> Motion:
    """Return the state without velocity at coordinates q, or as captured."""
    now = rods.captured.copy() if q is None else np.array(q, np.float64)
    points = np.concatenate(
        [
            place(
                one, now[rods.offsets[s] : rods.offsets[s + 1]], one.roots[0], one.frames[0]
            ).points
            for s, one in ((s, rods.one(s)) for s in range(len(rods.roots)))
        ]
    )
    still = np.zeros_like(points)
    return Motion(now, now.copy(), points, points.copy(), still, still.copy())


def free(rods: Rods, drag: float = 0.0) -> Loads:
    """Return loads of still air with a drag rate, per second, and nothing else."""
    shape = (len(rods.lengths), NODES)
    zero = np.zeros((*shape, 3))
    return Loads(drag * rods.masses, zero, np.zeros(shape), zero.copy(), np.zeros(shape))


def step_of(
    seconds: float,
    *,
    two_step: bool = True,
    gravity: Array = DOWN,
    friction: float = 0.0,
    iterations: int = 1,
) -> Step:
    """Return a step without head motion and obstacles."""
    nowhere = Body(np.eye(4), np.eye(4), NO_FIELDS.head)
    return Step(
        seconds,
        two_step,
        friction,
        iterations,
        np.array(gravity, np.float64),
        np.eye(4),
        600.0**2,
        0.3,
        (nowhere, nowhere),
    )


def run(rods: Rods, motion: Motion, loads: Loads, step: Step, steps: int) -> None:
    """Advance by a number of steps; the first is Euler's."""
    for k in range(steps):
        now = step if k else step._replace(two_step=False)
        step_strands(0, len(rods.roots), rods, motion, loads, now)


def settled(rods: Rods, loads: Loads | None = None, seconds: float = 4.0) -> Array:
    """Return the coordinates at which the rods come to rest under gravity."""
    motion = rest(rods)
    calm = free(rods, 12.0) if loads is None else loads
    run(rods, motion, calm, step_of(2e-3, two_step=False), int(seconds / 2e-3))
    return motion.q


def tip(rods: Rods, q: Array) -> Array:
    """Return where a single rod ends."""
    return place(rods, q, rods.roots[0], rods.frames[0]).ends[-1]


def energy(rods: Rods, motion: Motion, gravity: Array = DOWN) -> float:
    """Return kinetic, elastic and gravity's energy, joules."""
    elastic = 0.5 * (rods.lengths[:, None] * rods.stiffness * (motion.q - rods.natural) ** 2).sum()
    kinetic = 0.5 * (rods.masses[..., None] * motion.velocity**2).sum()
    return float(elastic + kinetic - (rods.masses[..., None] * motion.points * gravity).sum())


def total_forces(rods: Rods, q: Array) -> Array:
    """Return the generalised forces (n, 3) of elasticity and gravity."""
    elastic = rods.lengths[:, None] * rods.stiffness * (rods.natural - q)
    return np.asarray(elastic + gravity_forces(rods, q, DOWN))
