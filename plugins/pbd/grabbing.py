"""Pulls of held points: the force that brings a node to the hand within one substep."""

from __future__ import annotations

import numpy as np

from hairkit.simulate import Grab, rotation
from hairkit.stored import Float64Array

from .engine import Engine
from .guides import Riders
from .reference import Load, moved
from .rods import Rods
from .system import System

SOFTEST = 0.05
"""Compliance added, as a share of a free node's: where a taut strand cannot go, the pull ends."""


def pulls(
    grabs: tuple[Grab, ...],
    engine: Engine,
    rods: Rods,
    riders: Riders,
    system: System,
    load: Load,
    back: Float64Array,
    speed: float,
) -> Float64Array:
    """Return the force (S, n, 3) on the nodes nearest to the held points, newtons.

    `back` (4, 4) brings the world to the head axes after the substep; a node is drawn at most at
    `speed`, m/s. The force sees the lengths: it is the target's distance through the compliance of
    the rod as its segments allow it to move.
    """
    force = np.zeros_like(rods.points)
    for grab in grabs:
        rod = int(riders.rod[grab.point])
        node = max(int(riders.segment[grab.point] + (riders.share[grab.point] >= 0.5)), 1)
        place, velocity = engine.rod(rod)
        expected = moved(load.ride, place) + system.step * velocity @ load.ride[:3, :3].T
        wanted = moved(back, np.asarray(grab.target, np.float64)) - expected[node]
        far = float(np.linalg.norm(wanted))
        wanted *= min(1.0, speed * system.step / max(far, 1e-12))
        force[rod, node] += np.linalg.solve(_compliance(system, expected, rod, node), wanted)
    return force


def _compliance(system: System, position: Float64Array, rod: int, node: int) -> Float64Array:
    """(3, 3) metres per newton of a node whose rod keeps its lengths."""
    inverse = system.inverse[rod]
    way = rotation.unit(np.diff(position, axis=0))
    free = inverse[node - 1, node - 1]
    column = inverse[:, node - 1]
    coupled = np.diff(column, prepend=0.0)[:, None] * way
    matrix = system.metric[rod] * (way @ way.T)
    held = coupled.T @ np.linalg.solve(matrix, coupled)
    result: Float64Array = (1 + SOFTEST) * free * np.eye(3) - held
    return result
