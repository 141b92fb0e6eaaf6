"""Substeps in head axes, compiled; strands lie side by side (see `hairkit.simulation.lanes`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from hairkit.parallel import compiled_with
from hairkit.simulation import vectors as v
from hairkit.simulation.contact_kernels import Touch, Touching, touch
from hairkit.simulation.lanes import LANES, One, Records, Three, Two, lanes_of, put, stage, three
from hairkit.simulation.obstacle_kernels import Fields
from hairkit.simulation.substeps import Settings, Step, StepArrays, step_of
from hairkit.simulation.vectors import ONE, ZERO, Number

TINY = np.float32(1e-12)
"""Metres: keeps coincident nodes from a division by zero."""


class Node(Touching, Touch, Protocol):
    """A record of a node: its state, what acts on it, and what a substep works out."""

    reach: Two  # rest lengths to the next node and to the next but one
    force: Two  # multipliers of these constraints
    rest: Three  # place to which it is pulled
    pull: One  # squared frequency of that pull
    drag: One  # 1/s
    steady: Three  # acceleration by air and hands, and by what bears the hair at rest
    start: Three  # place before the substep


NODE = lanes_of(Node)


@compiled_with(fastmath=True)
def move(
    first: int, last: int, hair: Records, path: StepArrays, body: Fields, run: Settings, soft: float
) -> None:
    """Do all substeps of blocks `first` to before `last` (XPBD, algorithm 1).

    `soft` is the compliance of bending over seconds^2, times a node's mass (XPBD, equation 4).
    """
    for block in range(first, last):
        s = hair[block]
        for k in range(len(path.turn)):
            step = step_of(path, k)
            predict(s, step, run)
            for _ in range(run.rounds):
                for j in range(len(s) - 1):
                    join(s, j, 1, ZERO)
                    if j + 2 < len(s):
                        join(s, j, 2, soft)
            for j in range(len(s)):
                take_velocity(s[j], step, ONE / run.seconds)
                if j > 1:
                    touch(s[j], s[j], step, body, run)


@stage
def predict(s: Sequence[Node], step: Step, run: Settings) -> None:
    """Move nodes by velocity and forces; drag, damping and pull are implicit.

    Two nodes stay on the head. None goes farther than a segment is long.
    """
    h, gravity = run.seconds, (step.air[0][3], step.air[1][3], step.air[2][3])
    for j in range(len(s)):
        node, before = s[j], s[max(j - 1, 0)]
        for w in range(LANES):
            at, k = three(node.place, w), node.pull[w]
            put(node.start, w, at)
            node.force[0, w] = node.force[1, w] = ZERO
            ride, firm = v.moved(step.drift, at), h * k + run.damping
            pull = v.plus(v.times(k, v.minus(three(node.rest, w), at)), v.times(firm, ride))
            more = v.times(h, v.plus(v.plus(gravity, three(node.steady, w)), pull))
            fast = v.plus(v.turned(step.head_step, three(node.speed, w)), more)
            way = v.minus(v.times(ONE / (ONE + h * (node.drag[w] + firm)), fast), ride)
            far = before.reach[0, w] / (h * math.sqrt(v.dot(way, way)) + TINY)
            put(node.place, w, v.plus(at, v.times(h * min(ONE, far) * np.float32(j > 1), way)))


@stage
def join(s: Sequence[Node], j: int, apart: int, soft: Number) -> None:
    """Move both ends of constraints (equations 17 and 18 of XPBD); rigid where `soft` is 0."""
    start, end, size, force = s[j], s[j + apart], s[j].reach[apart - 1], s[j].force[apart - 1]
    a, b = np.float32(j > 1), np.float32(j + apart > 1)
    over = ONE / (a + b + soft + TINY)
    for w in range(LANES):
        way = v.minus(three(end.place, w), three(start.place, w))
        reach = math.sqrt(v.dot(way, way)) + TINY
        change = (reach - size[w] - soft * force[w]) * over
        force[w] += change
        put(start.place, w, v.plus(three(start.place, w), v.times(a * change / reach, way)))
        put(end.place, w, v.minus(three(end.place, w), v.times(b * change / reach, way)))


@stage
def take_velocity(s: Node, step: Step, over: Number) -> None:
    """Set velocities, in the world, to the way of the substep over its time."""
    for w in range(LANES):
        way = v.times(over, v.minus(three(s.place, w), three(s.start, w)))
        put(s.pace, w, v.plus(way, v.moved(step.drift, three(s.start, w))))
        put(s.speed, w, three(s.pace, w))
