"""A peer of the rods: extended position-based dynamics, compiled, with contact with the head.

Mueller et al. 2007, Macklin et al. 2016: each node is joined to the next one rigidly, and to the
next but one by a spring, which is bending. The first two nodes go with the head. A node that is
nearer to the head than it may be is pushed out, without friction. Strands lie side by side, so that
compilers make vector instructions of loops over them.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.parallel import compiled_with, parallel_for
from hairkit.simulation.obstacles import Obstacles

Array = npt.NDArray[Any]
BENDING = 1000.0
"""N/m for each kilogram of a node: the spring between every node and the next but one."""
CLEARANCE = 0.002
"""Metres between hair and head, as of the rods."""
DOWN = -9.81
"""m/s^2 along y."""
LANES = 64
"""Strands side by side."""
REACH, OUTSIDE = 1.0, 0.02
"""Metres from the head's origin to the farthest hair, and to the head from outside its grid."""


class Scene(NamedTuple):
    """Strands of n nodes in blocks of `LANES`, and the head, of one kind of number."""

    rest: Array
    """(B, n, 3, LANES) metres, head axes."""
    near: Array
    """(B, n, 2, LANES) rest lengths to the next node and to the next but one."""
    clear: Array
    """(B, n, LANES) least distance to the head, metres."""
    distance: Array
    """(X, Y, Z) to the head, metres."""
    place: Array
    """(4,) of the first of them; 1 / spacing."""
    numbers: Array
    """(3,) seconds of a substep, softness of the springs over its square, gravity."""


class CompiledXpbd:
    """Strands moved by substeps of Gauss-Seidel along each strand, on all cores."""

    def __init__(
        self, rest: Array, obstacles: Obstacles | None, seconds: float, iterations: int, kind: Any
    ) -> None:
        """Start at rest; without obstacles nothing is touched."""
        self._count, nodes, _ = rest.shape
        near = np.zeros((self._count, nodes, 2))
        for apart in (1, 2):
            between = rest[:, apart:] - rest[:, :-apart]
            near[:, :-apart, apart - 1] = np.linalg.norm(between, axis=-1)
        clear, values = np.full((self._count, nodes), -1.0), np.ones((2, 2, 2))
        place = [0.0, 0.0, 0.0, 1.0]
        if obstacles is not None:
            grid, values = obstacles.grid, obstacles.distance
            place = [*(grid.origin + 0.5 * grid.spacing), 1 / grid.spacing]
            own = obstacles.at(rest.reshape(-1, 3))[0].reshape(self._count, nodes)
            clear = np.minimum(own, CLEARANCE)
        numbers = [seconds, 1 / (BENDING * seconds**2), DOWN]
        parts = (_side_by_side(rest), _side_by_side(near), _side_by_side(clear), values, place)
        self._scene = Scene(*(np.ascontiguousarray(part, kind) for part in (*parts, numbers)))
        self._x, self._v = self._scene.rest.copy(), np.zeros_like(self._scene.rest)
        self._slack = np.zeros_like(self._scene.clear)
        self._head, self._iterations = np.eye(4), iterations

    @property
    def points(self) -> Array:
        """(S, n, 3) present positions, world."""
        spread: Array = np.moveaxis(self._x, -1, 1).reshape(-1, *self._x.shape[1:3])
        return spread[: self._count]

    def advance(self, heads: Array) -> None:
        """Go on by a substep for each motion (K, 4, 4) of the head, to where it is then."""
        change = np.diff(np.concatenate([self._head[None], heads]), axis=0)[:, :3]
        ways = REACH * np.linalg.norm(change[..., :3], axis=(1, 2))
        ways += np.linalg.norm(change[..., 3], axis=1)
        self._head = heads[-1]
        motions = np.ascontiguousarray(heads, self._x.dtype)
        parallel_for(
            move, len(self._x), self._x, self._v, self._slack, self._scene, motions,
            ways.astype(self._x.dtype), self._iterations,
        )  # fmt: skip


def _side_by_side(values: Array) -> Array:
    """Return values (S, ...) as (B, ..., LANES), filled up with the last strand."""
    blocks = -(-len(values) // LANES)
    which = np.minimum(np.arange(blocks * LANES), len(values) - 1)
    return np.moveaxis(values[which].reshape(blocks, LANES, *values.shape[1:]), 1, -1)


@compiled_with(allocates=True, fastmath=True)
def move(  # type: ignore[no-untyped-def]
    first, last, x, v, slack, scene, heads, ways, iterations
) -> None:  # pragma: no cover - compiled
    """Do all substeps of blocks `first` to before `last`."""
    n, h, soft, fall = x.shape[1], scene.numbers[0], scene.numbers[1], scene.numbers[2]
    old, pull = np.empty(x.shape[1:], x.dtype), np.empty((n, 2, LANES), x.dtype)
    for block in range(first, last):
        p, speed, near, clear = x[block], v[block], scene.near[block], scene.clear[block]
        for k in range(heads.shape[0]):
            _predict(p, old, speed, scene.rest[block], heads[k], h, fall)
            pull[:] = 0
            for _ in range(iterations):
                for j in range(n - 1):
                    if j > 0:
                        _join(p, near, pull, 0 * h, j, 1)
                    if j + 2 < n:
                        _join(p, near, pull, soft, j, 2)
            _touch(p, old, slack[block], clear, scene.distance, scene.place, heads[k], ways[k])
            for j in range(n):
                for c in range(3):
                    for w in range(LANES):
                        speed[j, c, w] = (p[j, c, w] - old[j, c, w]) / h


@compiled_with(fastmath=True)
def _predict(p, old, speed, rest, head, h, fall) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Move nodes by their velocity, and the first two with the head."""
    for j in range(p.shape[0]):
        for c in range(3):
            faster = h * fall if c == 1 else 0 * h
            for w in range(LANES):
                old[j, c, w] = p[j, c, w]
                p[j, c, w] += h * (speed[j, c, w] + faster)
    for j in range(2):
        for c in range(3):
            for w in range(LANES):
                p[j, c, w] = (
                    head[c, 0] * rest[j, 0, w] + head[c, 1] * rest[j, 1, w]
                    + head[c, 2] * rest[j, 2, w] + head[c, 3]
                )  # fmt: skip


@compiled_with(fastmath=True)
def _join(p, near, pull, soft, j, apart) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Move both ends of constraints (equations 17 and 18 of XPBD); rigid where `soft` is 0."""
    one = 0 * soft + 1
    a = 0 * soft if j < 2 else one
    over = one / (a + one + soft)
    start, end, size, force = p[j], p[j + apart], near[j, apart - 1], pull[j, apart - 1]
    for w in range(LANES):
        d0, d1, d2 = end[0, w] - start[0, w], end[1, w] - start[1, w], end[2, w] - start[2, w]
        reach = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        change = (reach - size[w] - soft * force[w]) * over
        force[w] += change
        share = change / reach
        start[0, w] += a * share * d0
        start[1, w] += a * share * d1
        start[2, w] += a * share * d2
        end[0, w] -= share * d0
        end[1, w] -= share * d1
        end[2, w] -= share * d2


@compiled_with(fastmath=True)
def _touch(p, old, slack, clear, values, place, head, way) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    """Push nodes out that may have moved by their distance since it was last read."""
    for j in range(2, p.shape[0]):
        for w in range(LANES):
            d0, d1, d2 = (
                p[j, 0, w] - old[j, 0, w],
                p[j, 1, w] - old[j, 1, w],
                p[j, 2, w] - old[j, 2, w],
            )
            slack[j, w] -= np.sqrt(d0 * d0 + d1 * d1 + d2 * d2) + way
        for w in range(LANES):
            if slack[j, w] <= 0:
                slack[j, w] = _push_out(p, j, w, clear[j, w], values, place, head)


@compiled_with(fastmath=True)
def _push_out(p, n, t, clear, values, place, head):  # type: ignore[no-untyped-def] # pragma: no cover
    """Push a node out of the head along the slope of the distance; return how far off it is."""
    d0, d1, d2 = p[n, 0, t] - head[0, 3], p[n, 1, t] - head[1, 3], p[n, 2, t] - head[2, 3]
    u = (head[0, 0] * d0 + head[1, 0] * d1 + head[2, 0] * d2 - place[0]) * place[3]
    v = (head[0, 1] * d0 + head[1, 1] * d1 + head[2, 1] * d2 - place[1]) * place[3]
    w = (head[0, 2] * d0 + head[1, 2] * d1 + head[2, 2] * d2 - place[2]) * place[3]
    s0, s1, s2 = values.shape
    if not (0 <= u < s0 - 1 and 0 <= v < s1 - 1 and 0 <= w < s2 - 1):
        return p.dtype.type(OUTSIDE)
    i, j, k = int(u), int(v), int(w)
    a, b, c = u - p.dtype.type(i), v - p.dtype.type(j), w - p.dtype.type(k)
    l00, l01, l10, l11 = values[i, j], values[i, j + 1], values[i + 1, j], values[i + 1, j + 1]
    e00, e01, e10, e11 = (
        l00[k + 1] - l00[k],
        l01[k + 1] - l01[k],
        l10[k + 1] - l10[k],
        l11[k + 1] - l11[k],
    )
    v00, v01, v10, v11 = l00[k] + c * e00, l01[k] + c * e01, l10[k] + c * e10, l11[k] + c * e11
    low, high = v00 + b * (v01 - v00), v10 + b * (v11 - v10)
    depth = clear - (low + a * (high - low))
    if depth <= 0:
        return -depth
    near, far = e00 + b * (e01 - e00), e10 + b * (e11 - e10)
    n0, n1, n2 = high - low, (v01 - v00) + a * ((v11 - v10) - (v01 - v00)), near + a * (far - near)
    out = depth / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + p.dtype.type(1e-20))
    for axis in range(3):
        p[n, axis, t] += out * (head[axis, 0] * n0 + head[axis, 1] * n1 + head[axis, 2] * n2)
    return 0 * depth
