"""Kernels of contact: penetration, Coulomb friction, then the lengths of what has moved."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hairkit.simulation import vectors as v
from hairkit.simulation.contact_kernels import rub, touch
from hairkit.simulation.lanes import LANES, put, stage, three
from hairkit.simulation.obstacle_kernels import Fields
from hairkit.simulation.substeps import Settings, Step
from hairkit.simulation.vectors import HALF, ONE, Number, inlined

from .block import Node, Work

SOFTEST = np.float32(1.001)
"""1 and the compliance added to the lengths of nodes in contact, as a share of a free one's."""


@stage
def resolve_contacts(
    s: Sequence[Node], x: Sequence[Work], step: Step, fields: Fields, settings: Settings
) -> None:
    """Push nodes out of the obstacles, then rub and restore the lengths by turns."""
    touching, half = False, HALF * settings.seconds
    for j in range(1, len(s)):
        node, own = s[j], x[j]
        for w in range(LANES):
            put(own.pace, w, v.minus(three(node.speed, w), v.times(half, three(node.gain, w))))
        touching |= touch(node, own, step, fields, settings)
    restore_lengths(s, x, settings, False)
    # without contact, one more iteration is enough
    for _ in range(settings.rounds if touching else min(settings.rounds, 1)):
        restore_lengths(s, x, settings, touching)


@stage
def restore_lengths(s: Sequence[Node], x: Sequence[Work], settings: Settings, rubs: bool) -> None:
    """Restore the lengths; a touching node moves only along the obstacle, and is pressed on it.

    One tridiagonal solve, eliminated on the way to the tip; the root, which does not move, takes no
    part. Nodes that touch rub before where `rubs`.
    """
    for j in range(1, len(s)):
        here, own, before, last = s[j], x[j], s[j - 1], x[j - 1]
        if rubs:
            rub(here, own, settings.seconds)
        for w in range(LANES):
            edge = v.minus(three(here.place, w), three(before.place, w))
            square = v.dot(edge, edge)
            size = ONE / math.sqrt(square)
            along, way = v.times(size, edge), three(last.way, w)
            normal, wall = three(last.normal, w), three(own.normal, w)
            start, end = v.dot(along, normal), v.dot(along, wall)
            beside = before.ease[w] * (v.dot(way, normal) * start - v.dot(way, along))
            factor = beside * last.pivot[w]
            firm = before.ease[w] * (SOFTEST - start * start)
            firm += here.ease[w] * (SOFTEST - end * end)
            put(own.way, w, along)
            own.beside[w] = beside
            own.pivot[w] = ONE / (firm - factor * beside)
            own.value[w] = square * size - here.length[w] - factor * last.value[w]
    for j in range(len(s) - 1, 0, -1):
        pull_node(s[j], x[j], x[j + 1], ONE / settings.seconds, settings.friction)


@inlined
def pull_node(s: Node, x: Work, after: Work, over: Number, friction: Number) -> None:
    """Move a node by the pulls of its segments, the one that ends there and the one after."""
    for w in range(LANES):
        value = (x.value[w] - after.beside[w] * after.value[w]) * x.pivot[w]
        x.value[w] = value
        pull = v.times(after.value[w], three(after.way, w))
        pull = v.minus(pull, v.times(value, three(x.way, w)))
        ease, normal = s.ease[w], three(x.normal, w)
        away = v.dot(pull, normal)
        change = v.times(ease, v.minus(pull, v.times(away, normal)))
        put(s.place, w, v.plus(three(s.place, w), change))
        put(s.speed, w, v.plus(three(s.speed, w), v.times(over, change)))
        x.grip[w] -= friction * over * ease * away
