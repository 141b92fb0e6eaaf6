"""Pulls of held points: the force that brings a node to the hand within one substep."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import Grab, quaternion

from .backend import Engine
from .linear_system import System
from .reference import Load, moved
from .resampling import Riders
from .rods import Rods

SOFTEST = 0.3
"""Compliance added, as a share of a free node's: where a taut strand cannot go, the pull ends."""
LEARNT, KEPT = 0.3, 0.99
"""Of what a node fell short by, the share that is added to the standing force; what stays of it."""
MOST = 0.005
"""Metres fallen short that are learnt from at once: a blocked node does not wind the hand up."""
STRONGEST = 1.5
"""Times the force that would bring a free node to the fastest pull within a substep."""
TAUT = 0.999
"""A target is taken as at most this share of the strand's length away from its root."""


class Hand:
    """Pulls of all held points; it learns the force that holds each where it is wanted."""

    def __init__(self) -> None:
        self._held: dict[int, tuple[Float64Array, Float64Array]] = {}

    def pulls(
        self,
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

        `back` (4, 4) brings the world to the head axes after the substep; a node is drawn at most
        at `speed`, m/s. The force sees the lengths: it is the target's distance through the
        compliance of the rod as its segments allow it to move, and a standing part that carries
        what else acts on the node.
        """
        force = np.zeros_like(rods.points)
        held: dict[int, tuple[Float64Array, Float64Array]] = {}
        for grab in grabs:
            rod = int(riders.rod[grab.point])
            node = max(int(riders.segment[grab.point] + (riders.share[grab.point] >= 0.5)), 1)
            place, velocity = engine.rod(rod)
            carried = moved(load.ride, place)
            expected = carried + system.step * velocity @ load.ride[:3, :3].T
            target = _reachable(moved(back, np.asarray(grab.target, np.float64)), rods, rod, node)
            wanted = target - expected[node]
            far = float(np.linalg.norm(wanted))
            wanted *= min(1.0, speed * system.step / max(far, 1e-12))
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
    """Return the target, or the place nearest to it that the strand's length allows."""
    root = rods.points[rod, 0]
    away = target - root
    most = TAUT * float(rods.length[rod, :node].sum())
    result: Float64Array = root + away * min(1.0, most / max(float(np.linalg.norm(away)), 1e-12))
    return result


def _compliance(system: System, position: Float64Array, rod: int, node: int) -> Float64Array:
    """(3, 3) metres per newton of a node whose rod keeps its lengths."""
    inverse = system.inverse[rod]
    way = quaternion.normalize(np.diff(position, axis=0))
    free = inverse[node - 1, node - 1]
    column = inverse[:, node - 1]
    coupled = np.diff(column, prepend=0.0)[:, None] * way
    matrix = system.metric[rod] * (way @ way.T)
    held = coupled.T @ np.linalg.solve(matrix, coupled)
    result: Float64Array = (1 + SOFTEST) * free * np.eye(3) - held
    return result
