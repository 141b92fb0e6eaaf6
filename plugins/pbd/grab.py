"""Forces on grabbed points that bring their nodes to the targets within two substeps."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import Grab, quaternion

from .backend import Engine
from .linear_system import System
from .reference import Load, transform_points
from .resampling import Embedding
from .rods import Rods

SOFTEST = 0.3
"""Compliance added, as a share of a free node's: limits the force along a taut strand."""
LEARNT, KEPT = 0.15, 0.99
"""Gain of the integral term on the remaining error, and its decay in a substep."""
MOST = 0.005
"""Largest error that the integral term sees in a substep, metres: anti-windup."""
STRONGEST = 1.5
"""Largest force over the one that accelerates a free node to full speed in a substep."""
AHEAD = 2.0
"""Divides what is missing two substeps ahead: a free node needs `1 + 1 / IMPLICIT`; from 1.3 on
down a held tip jitters."""
TAUT = 0.999
"""Largest distance of a target from the root, as a share of the strand's length."""


class GrabForces:
    """Forces of all grabbed points: a proportional and an integral term for each."""

    def __init__(self) -> None:
        self._held: dict[int, tuple[Float64Array, Float64Array]] = {}

    def compute(
        self,
        grabs: tuple[Grab, ...],
        engine: Engine,
        rods: Rods,
        embedding: Embedding,
        system: System,
        load: Load,
        back: Float64Array,
        speed: float,
    ) -> Float64Array:
        """Return the force (S, n, 3) on the nodes nearest to the held points, newtons.

        `back` (4, 4) transforms the world to the head axes after the substep; a node moves at no
        more than `speed`, m/s. The force is the distance to the target over the compliance of the
        rod with its length constraints, plus an integral term for other forces on the node.
        """
        force = np.zeros_like(rods.points)
        held: dict[int, tuple[Float64Array, Float64Array]] = {}
        for grab in grabs:
            rod = int(embedding.rod[grab.point])
            node = max(int(embedding.segment[grab.point] + (embedding.share[grab.point] >= 0.5)), 1)
            place, velocity = engine.rod(rod)
            carried = transform_points(load.head_step, place)
            way = system.step * velocity @ load.head_step[:3, :3].T
            expected = carried + way
            target = _reachable(
                transform_points(back, np.asarray(grab.target, np.float64)), rods, rod, node
            )
            far = float(np.linalg.norm(target - carried[node]))
            share = min(1.0, 2 * speed * system.step / max(far, 1e-12))
            # at the target a substep later: a change of place goes on as one of velocity
            ahead = share * (target - carried[node]) - 2 * way[node]
            wanted = ahead / AHEAD
            stiff = np.linalg.inv(_compliance(system, expected, rod, node))
            standing, hoped = self._held.get(grab.point, (np.zeros(3), carried[node]))
            short = hoped - carried[node]
            short *= min(1.0, MOST / max(float(np.linalg.norm(short)), 1e-12))
            free = system.inverse[rod, node - 1, node - 1]
            standing = KEPT * standing + LEARNT / free * short
            held[grab.point] = (standing, expected[node] + wanted)
            pull = stiff @ wanted + standing
            most = STRONGEST * speed * system.step / free
            force[rod, node] += pull * min(1.0, most / max(float(np.linalg.norm(pull)), 1e-30))
        self._held = held
        return force


def _reachable(target: Float64Array, rods: Rods, rod: int, node: int) -> Float64Array:
    """Return the target, or the nearest point that the strand's length allows."""
    root = rods.points[rod, 0]
    away = target - root
    most = TAUT * float(rods.length[rod, :node].sum())
    result: Float64Array = root + away * min(1.0, most / max(float(np.linalg.norm(away)), 1e-12))
    return result


def _compliance(system: System, position: Float64Array, rod: int, node: int) -> Float64Array:
    """Return the compliance (3, 3), m/N, of a node whose rod keeps its lengths."""
    inverse = system.inverse[rod]
    way = quaternion.normalize(np.diff(position, axis=0))
    free = inverse[node - 1, node - 1]
    column = inverse[:, node - 1]
    coupled = np.diff(column, prepend=0.0)[:, None] * way
    matrix = system.metric[rod] * (way @ way.T)
    held = coupled.T @ np.linalg.solve(matrix, coupled)
    result: Float64Array = (1 + SOFTEST) * free * np.eye(3) - held
    return result
