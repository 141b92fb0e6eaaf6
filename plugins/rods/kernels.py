"""The compiled kernels: a substep, strands side by side, float32 or float64.

Each step of the method goes along the rods, and at each node over the `LANES` strands of a block.
Compilers make vector instructions of the loops over strands, whose bodies have no branches. `s` are
the nodes' records, `x` those of work, of which two of zeros follow the tip.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hairkit.parallel import compiled_with
from hairkit.simulation import vectors as v
from hairkit.simulation.lanes import LANES, Records, four, put, put_four, stage, three
from hairkit.simulation.obstacle_kernels import Fields
from hairkit.simulation.substeps import Settings, Step, StepArrays, step_of
from hairkit.simulation.vectors import HALF, ONE, ZERO, Floats, Number, inlined

from .block import Blocks, Node, Outer, Work
from .frames import THIRD, half_way, swing_frame, twist_angle
from .kernel_contact import resolve_contacts
from .linear_system import IMPLICIT

Nodes = Sequence[Node]
Works = Sequence[Work]
AHEAD, PASSED, DRIFT = (np.float32(c) for c in (1 / IMPLICIT, 1 - IMPLICIT, 0.5 - IMPLICIT**2))
"""Weights: of a change of place in the velocity, over the step; of the old acceleration in the
velocity, and in the place, where that of the new one is `IMPLICIT` squared."""
SHARPEST = np.float32(0.3)
"""Lower bound of 1 + cosine of a turn, which limits the twist coupling beyond 134 degrees."""
SPIN = np.float32(0.3)
"""Largest rotation of a frame by torsion in a substep, radians: limits the Newton step."""
TURN = np.float32(1.0)
"""Largest rotation of a segment in a substep, radians: more than hair does, less than what linear
solves cannot follow."""
CHANGE = np.float32(500.0)
"""Largest acceleration that a substep passes on to the next, m/s^2: more is a blow."""
TINY = np.float32(1e-20)
"""Added to squares before a division."""
LEAST = np.float32(1e-6)
"""Least pivot of the lengths, as a share of the metric's diagonal."""


@compiled_with(allocates=True, fastmath=True)
def run_substeps(
    first: int,
    last: int,
    blocks: Blocks,
    work: Records,
    steps: StepArrays,
    fields: Fields,
    settings: Settings,
) -> None:
    """Advance blocks `first` to before `last` by all substeps, in place.

    `work` (1, n + 2) are zeros of `Work`.
    """
    n, h = blocks.nodes.shape[1], settings.seconds
    x, matrix = np.zeros_like(work)[0], np.empty((n, n, LANES), blocks.metric.dtype)
    for block in range(first, last):
        s, metric = blocks.nodes[block], blocks.metric[block]
        act = blocks.acting[min(block, len(blocks.acting) - 1)]
        for k in range(len(steps.turn)):
            step = step_of(steps, k)
            predict_nodes(s, x, step, settings, act)
            lead_roots(s, x, step, h)
            transport_frames(s, x, step)
            relax_twist(s, x)
            add_elastic(s, x)
            solve_banded(s, x)
            keep_linear_lengths(s, x, metric, matrix)
            move_nodes(s, x, h)
            resolve_contacts(s, x, step, fields, settings)
            keep_lengths(s, h)


@stage
def predict_nodes(s: Nodes, x: Works, step: Step, settings: Settings, act: Sequence[Outer]) -> None:
    """Bring nodes to the new head axes, extrapolate them, and sum the forces on them."""
    head, drift, air = step.head_step, step.drift, step.air
    gravity, h, damping = (air[0][3], air[1][3], air[2][3]), settings.seconds, settings.damping
    for j in range(1, len(s)):
        outer = act[min(j, len(act) - 1)]
        node, own = s[j], x[j]
        for w in range(LANES):
            gain, speed = v.turned(head, three(node.gain, w)), v.turned(head, three(node.speed, w))
            way = v.times(h, v.plus(speed, v.times(DRIFT * h, gain)))
            place = v.plus(v.moved(head, three(node.place, w)), way)
            gain = v.times(PASSED, gain)
            speed = v.plus(speed, v.times(h, gain))
            put(node.place, w, place)
            put(node.speed, w, speed)
            put(node.gain, w, gain)
            blown = v.times(node.drag[w], v.minus(v.turned(air, three(outer.air, w)), speed))
            slowed = v.times(damping, v.minus(v.moved(drift, place), speed))
            pull = v.times(node.shape[w], v.minus(three(node.rest, w), place))
            total = v.times(node.mass[w], v.plus(v.plus(blown, slowed), v.plus(pull, gravity)))
            put(own.force, w, v.plus(total, three(outer.force, w)))


@stage
def lead_roots(s: Nodes, x: Works, step: Step, h: Number) -> None:
    """Move the roots with the head, and let them hold the next nodes back.

    The inertia between them, a sixth of the segment's mass, is a third of the root's.
    """
    head, over = step.head_step, ONE / h
    node, own, first = s[0], x[0], x[1]
    for w in range(LANES):
        rest, place = three(node.rest, w), v.moved(head, three(node.place, w))
        speed = v.times(over, v.minus(rest, place))
        gain = v.times(over, v.minus(speed, v.turned(head, three(node.speed, w))))
        jerk = v.minus(gain, v.times(PASSED, v.turned(head, three(node.gain, w))))
        put(node.place, w, rest)
        put(node.speed, w, speed)
        put(node.gain, w, gain)
        axis = v.third_axis(four(node.frame, w))
        put(own.way, w, axis)
        put(own.reach, w, axis)
        held = v.times(THIRD * AHEAD * node.mass[w], jerk)
        put(first.force, w, v.minus(three(first.force, w), held))


@stage
def transport_frames(s: Nodes, x: Works, step: Step) -> None:
    """Write the segments, and transport their frames to the new directions."""
    for j in range(1, len(s)):
        node, own, last_node = s[j], x[j], s[j - 1]
        for w in range(LANES):
            edge = v.minus(three(node.place, w), three(last_node.place, w))
            way = v.times(ONE / math.sqrt(v.dot(edge, edge)), edge)
            put(own.edge, w, edge)
            put(own.reach, w, v.times(node.over[w], edge))
            put(own.way, w, way)
            put_four(node.frame, w, swing_frame(v.product(step.turn, four(node.frame, w)), way))


@stage
def relax_twist(s: Nodes, x: Works) -> None:
    """Rotate frames about their segments until torques balance: one Newton step, tridiagonal."""
    for j in range(1, len(s)):
        node, own, last_node, last = s[j], x[j], s[j - 1], x[j - 1]
        for w in range(LANES):
            before, after = four(last_node.frame, w), four(node.frame, w)
            away, here = three(last.way, w), three(own.way, w)
            natural, quarter = half_way(before, after, three(node.curve, w))
            turn = v.minus(here, away)
            spun = v.cross(natural, turn)
            aside = v.cross(quarter, spun)
            half, twist = HALF * node.bend[w], node.twist[w]
            torque = twist * (twist_angle(before, after) - node.natural[w])
            firm = HALF * half * max(v.dot(natural, turn), ZERO)
            own.torque[w] = torque
            own.pivot[w] = twist + firm
            own.beside[w] = firm - twist
            own.value[w] = half * v.dot(here, v.plus(spun, aside)) - torque
            last.pivot[w] += twist + firm
            last.value[w] += half * v.dot(away, v.minus(spun, aside)) + torque
    solve_tridiagonal(x, len(s))
    held = x[0]
    for w in range(LANES):
        held.value[w] = ZERO
    for j in range(1, len(s)):
        node, own, last = s[j], x[j], x[j - 1]
        for w in range(LANES):
            angle = min(max(own.value[w], -SPIN), SPIN)
            own.value[w] = angle
            own.torque[w] += node.twist[w] * (angle - last.value[w])
            # half angles by a rational cosine and sine
            half = HALF * angle
            cosine = ONE / math.sqrt(ONE + half * half)
            axis = v.times(half * cosine, three(own.way, w))
            put_four(node.frame, w, v.product((cosine, *axis), four(node.frame, w)))


@stage
def solve_tridiagonal(x: Works, n: int) -> None:
    """Solve the system of `pivot`, `beside` (this row and the one before) and `value`, in place."""
    first = x[1]
    for w in range(LANES):
        first.pivot[w] = ONE / first.pivot[w]
    for j in range(2, n):
        own, last = x[j], x[j - 1]
        for w in range(LANES):
            factor = own.beside[w] * last.pivot[w]
            own.pivot[w] = ONE / (own.pivot[w] - factor * own.beside[w])
            own.value[w] -= factor * last.value[w]
    for j in range(n - 1, 0, -1):
        own, next_ = x[j], x[j + 1]
        for w in range(LANES):
            known = next_.beside[w] * next_.value[w]
            own.value[w] = (own.value[w] - known) * own.pivot[w]


@stage
def add_elastic(s: Nodes, x: Works) -> None:
    """Add the node forces of bending and twist: minus the energy's gradient."""
    for j in range(1, len(s)):
        node, own, last_node, last = s[j], x[j], s[j - 1], x[j - 1]
        for w in range(LANES):
            away, here = three(last.way, w), three(own.way, w)
            before, after = four(last_node.frame, w), four(node.frame, w)
            natural, quarter = half_way(before, after, three(node.curve, w))
            turn, bend = v.minus(three(own.reach, w), three(last.reach, w)), node.bend[w]
            spun = v.times(HALF * bend, v.cross(natural, turn))
            aside = v.cross(quarter, spun)
            cosine = max(ONE + v.dot(away, here), SHARPEST)
            twisting = v.times(own.torque[w] / cosine, v.cross(away, here))
            moment = v.times(bend, v.minus(natural, turn))
            put(own.pull, w, v.plus(v.minus(moment, twisting), v.cross(v.plus(spun, aside), here)))
            to_before = v.minus(v.cross(v.minus(spun, aside), away), v.plus(moment, twisting))
            put(last.pull, w, v.plus(three(last.pull, w), to_before))
    for j in range(1, len(s)):
        node, own, last = s[j], x[j], x[j - 1]
        for w in range(LANES):
            pull = v.times(node.over[w], three(own.pull, w))
            put(last.force, w, v.minus(three(last.force, w), pull))
            put(own.force, w, v.plus(three(own.force, w), pull))


@stage
def solve_banded(s: Nodes, x: Works) -> None:
    """Write `solved`, A^-1 `force` of the free nodes, by the factor L D L^T of two bands."""
    n = len(s)
    for j in range(1, n):
        eliminate_node(s[j], x[j], x[j - 1], x[max(j - 2, 0)])
    for j in range(n - 1, 0, -1):
        # the entries below row j stand in the two rows after it
        next_, further = s[min(j + 1, n - 1)], s[min(j + 2, n - 1)]
        substitute_node(s[j], next_, further, x[j], x[j + 1], x[j + 2])


@inlined
def eliminate_node(s: Node, x: Work, before: Work, beyond: Work) -> None:
    """Solve a row of L."""
    for w in range(LANES):
        known = v.times(s.first[w], three(before.solved, w))
        known = v.plus(known, v.times(s.second[w], three(beyond.solved, w)))
        put(x.solved, w, v.minus(three(x.force, w), known))


@inlined
def substitute_node(
    s: Node, next_: Node, further: Node, x: Work, after: Work, beyond: Work
) -> None:
    """Solve a row of D L^T."""
    for w in range(LANES):
        known = v.times(next_.first[w], three(after.solved, w))
        known = v.plus(known, v.times(further.second[w], three(beyond.solved, w)))
        put(x.solved, w, v.minus(v.times(s.pivot[w], three(x.solved, w)), known))


@stage
def keep_linear_lengths(s: Nodes, x: Works, metric: Floats, matrix: Floats) -> None:
    """Let tensions act, by which segments keep their lengths, and solve anew."""
    for j in range(1, len(s)):
        node, own, last = s[j], x[j], x[j - 1]
        for w in range(LANES):
            change = v.minus(three(own.solved, w), three(last.solved, w))
            reach = v.dot(v.plus(three(own.edge, w), change), three(own.way, w))
            own.value[w] = reach - node.length[w]
    solve_lengths(x, metric, matrix, len(s))
    for j in range(1, len(s)):
        own, next_ = x[j], x[j + 1]
        for w in range(LANES):
            pull = v.times(own.value[w], three(own.way, w))
            after = v.times(next_.value[w], three(next_.way, w))
            put(own.force, w, v.plus(three(own.force, w), v.minus(after, pull)))
    solve_banded(s, x)


@stage
def solve_lengths(x: Works, metric: Floats, matrix: Floats, n: int) -> None:
    """Solve metric * (d d^T) for `value`, in place, by elimination; `matrix` (n, n) is work.

    Rows of its upper triangle are eliminated from those below; what stays is D L^T.
    """
    pair = 0
    for j in range(1, n):
        for i in range(1, j + 1):
            entry, share, one, other = matrix[i, j], metric[pair], x[i], x[j]
            for w in range(LANES):
                entry[w] = share[w] * v.dot(three(one.way, w), three(other.way, w))
            pair += 1
    for j in range(1, n):
        own, diagonal, least = x[j], matrix[j, j], metric[(j - 1) * (j + 2) // 2]
        for w in range(LANES):
            own.pivot[w] = ONE / max(diagonal[w], LEAST * least[w])
        for i in range(j + 1, n):
            entry, row = matrix[j, i], x[i]
            for w in range(LANES):
                row.beside[w] = own.pivot[w] * entry[w]
                row.value[w] -= row.beside[w] * own.value[w]
            for k in range(i, n):
                into, out = matrix[i, k], matrix[j, k]
                for w in range(LANES):
                    into[w] -= row.beside[w] * out[w]
    for j in range(n - 1, 0, -1):
        own = x[j]
        for i in range(j + 1, n):
            entry, row = matrix[j, i], x[i]
            for w in range(LANES):
                own.value[w] -= entry[w] * row.value[w]
        for w in range(LANES):
            own.value[w] *= own.pivot[w]


@stage
def move_nodes(s: Nodes, x: Works, h: Number) -> None:
    """Move nodes by the solution, which adds to their velocity and acceleration."""
    over = ONE / h
    for j in range(1, len(s)):
        node, own = s[j], x[j]
        for w in range(LANES):
            move = three(own.solved, w)
            added = v.times(over * AHEAD, move)
            put(node.place, w, v.plus(three(node.place, w), move))
            put(node.speed, w, v.plus(three(node.speed, w), added))
            gain = v.plus(three(node.gain, w), v.times(over, added))
            share = min(CHANGE / math.sqrt(v.dot(gain, gain) + TINY), ONE)
            put(node.gain, w, v.times(share, gain))


@stage
def keep_lengths(s: Nodes, h: Number) -> None:
    """Give segments their exact lengths, from the root to the tip; bound how fast they turn."""
    over = ONE / h
    for j in range(1, len(s)):
        node, last_node = s[j], s[j - 1]
        for w in range(LANES):
            edge, length = v.minus(three(node.place, w), three(last_node.place, w)), node.length[w]
            way = v.times(length / math.sqrt(v.dot(edge, edge) + TINY) - ONE, edge)
            put(node.place, w, v.plus(three(node.place, w), way))
            before = three(last_node.speed, w)
            apart = v.minus(v.plus(three(node.speed, w), v.times(over, way)), before)
            share = min(TURN * over * length / math.sqrt(v.dot(apart, apart) + TINY), ONE)
            put(node.speed, w, v.plus(before, v.times(share, apart)))
