"""The fast backend's kernel: the reference's substep, float32, strands side by side."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.parallel import compiled_with
from hairkit.simulation.obstacle_kernels import Fields

from .block import NODE, Packed, Records, Settings, State
from .kernel_contact import resolve_contacts
from .kernel_elastic import add_elastic, lead_roots, predict_nodes, relax_twist, transport_frames
from .kernel_lengths import keep_lengths, keep_linear_lengths, move_nodes, solve_banded
from .kernel_math import ONE, TWO, ZERO, put, stage
from .simd import LANES


@compiled_with(fastmath=True)
def run_substeps(
    first: int,
    last: int,
    state: State,
    packed: Packed,
    steps: Records,
    air: Float32Array,
    force: Float32Array,
    fields: Fields,
    settings: Settings,
) -> None:
    """Advance blocks `first` to before `last` by as many substeps as there are `steps`, in place.

    `air` (S, n, 3), world, and `force` (S, n, 3) per mass, head axes, may have one strand and node
    for all.
    """
    n = state.place.shape[1]
    x, matrix = np.empty(n, NODE), np.empty((n * n, LANES), np.float32)
    for block in range(first, last):
        rod, metric = packed.nodes[block], packed.metric[block]
        load_block(x, rod, block * LANES, state, air, force)
        for k in range(len(steps)):
            substep(x, rod, metric, matrix, steps[k], fields, settings)
        store_block(x, block * LANES, state)


@compiled_with(fastmath=True)
def substep(
    x: Any, rod: Any, metric: Any, matrix: Any, step: Any, fields: Any, settings: Any
) -> None:
    """Do one substep of a block, in the reference's order."""
    h = settings.seconds
    lead_roots(x, rod, step, h)
    predict_nodes(x, rod, step, h, settings.damping)
    transport_frames(x, rod, step)
    relax_twist(x, rod)
    add_elastic(x, rod)
    solve_banded(x, rod)
    keep_linear_lengths(x, rod, metric, matrix, settings.iterations)
    move_nodes(x, h)
    if settings.rounds >= 0:
        resolve_contacts(x, rod, step, fields, settings)
    keep_lengths(x, rod, h)


@stage
def load_block(
    x: Any, rod: Any, start: int, state: Any, air: Float32Array, force: Float32Array
) -> None:
    """Read the strands of a block; the last one fills lanes that are left."""
    count, n, _ = state.slack.shape
    for j in range(n):
        put(x[j].surface, (ZERO, ZERO, ZERO))
        put(x[j].wind, (air[0, 0, 0], air[0, 0, 1], air[0, 0, 2]))
        put(x[j].push, (force[0, 0, 0], force[0, 0, 1], force[0, 0, 2]))
    for w in range(LANES):
        s = min(start + w, count - 1)
        for j in range(n):
            for c in range(3):
                if air.shape[1] > 1:
                    x[j].wind[c, w] = air[s, j, c]
                if force.shape[1] > 1:
                    x[j].push[c, w] = force[s, j, c]
                x[j].place[c, w], x[j].speed[c, w] = state.place[s, j, c], state.speed[s, j, c]
                x[j].gain[c, w] = state.gain[s, j, c]
            x[j].slack[w], x[j].aside[w] = state.slack[s, j, 0], state.slack[s, j, 1]
            for c in range(4):
                x[j].frame[c, w] = state.frame[s, max(j - 1, 0), c]
        # the root's frame and its third axis
        a, b, c, d = rod[0].first[w], rod[0].second[w], rod[0].pivot[w], rod[0].length[w]
        x[0].frame[0, w], x[0].frame[1, w], x[0].frame[2, w], x[0].frame[3, w] = d, a, b, c
        x[0].way[0, w] = x[0].reach[0, w] = TWO * (a * c + d * b)
        x[0].way[1, w] = x[0].reach[1, w] = TWO * (b * c - d * a)
        x[0].way[2, w] = x[0].reach[2, w] = ONE - TWO * (a * a + b * b)


@stage
def store_block(x: Any, start: int, state: Any) -> None:
    """Write the strands of a block."""
    count, n, _ = state.slack.shape
    for w in range(min(LANES, count - start)):
        s = start + w
        for j in range(n):
            for c in range(3):
                state.place[s, j, c], state.speed[s, j, c] = x[j].place[c, w], x[j].speed[c, w]
                state.gain[s, j, c] = x[j].gain[c, w]
            state.slack[s, j, 0], state.slack[s, j, 1] = x[j].slack[w], x[j].aside[w]
            if j > 0:
                for c in range(4):
                    state.frame[s, j - 1, c] = x[j].frame[c, w]
