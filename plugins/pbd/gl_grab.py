"""Grabbed points in the compute backend: the forces of `grab.py`, computed by a shader."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.simulation import Grab

from .gl_buffers import Store
from .grab import AHEAD, KEPT, LEARNT, MOST, SOFTEST, STRONGEST, TAUT
from .resampling import Embedding


class GpuGrabs:
    """The grabbed points; their integral terms are kept in a GPU buffer.

    True if there is any. Use its methods, except `clear`, inside `renderer()`.
    """

    def __init__(self, store: Store, nodes: int) -> None:
        self._store, self._segments = store, nodes - 1
        self._back: Float64Array = np.eye(4)
        self._speed = 0.0
        self.clear()

    def __bool__(self) -> bool:
        return len(self._points) > 0

    def clear(self) -> None:
        """Release all points."""
        self._points: tuple[int, ...] = ()
        self._sorted: list[int] = []
        self._order: Int64Array = np.zeros(0, np.int64)
        self._nodes: npt.NDArray[np.int32] = np.zeros((0, 2), np.int32)

    def take(
        self, grabs: tuple[Grab, ...], embedding: Embedding, back: Float64Array, speed: float
    ) -> None:
        """Set the grabbed points; `back` (4, 4) transforms the world to the head axes."""
        points = tuple(grab.point for grab in grabs)
        self._back, self._speed = back, speed
        if points != self._points:
            self._change(points, embedding)
        if points:
            targets = np.array([grab.target for grab in grabs], np.float32)[self._order]
            words = np.concatenate([self._nodes, targets.view(np.int32)], axis=1)
            self._store.put_words("grabs", words)

    def pull(self, step: int, head_step: Float64Array, seconds: float) -> None:
        """Write the forces of one substep, the `step`-th of those in the buffer of steps.

        `head_step` (4, 4) is how the head axes move in it, `seconds` how long it is.
        """
        self._back = head_step @ self._back
        self._store.read_by("grabs", "learnt", "factors")
        self._store.written_by("u_force")
        uniforms: dict[str, Any] = {
            "u_grabs": len(self._points),
            "u_step": step,
            "u_seconds": seconds,
            "u_speed": self._speed,
            "u_back": [tuple(row) for row in self._back[:3]],
            "u_ahead": AHEAD,
            "u_softest": SOFTEST,
            "u_learnt": LEARNT,
            "u_kept": KEPT,
            "u_most": MOST,
            "u_strongest": STRONGEST,
            "u_taut": TAUT,
        }
        self._store.dispatch("pbd_grab", len(self._points), uniforms)

    def _change(self, points: tuple[int, ...], embedding: Embedding) -> None:
        """Replace the grabbed points; those grabbed before keep their integral term."""
        index = np.array(points, np.int64)
        node = embedding.segment[index] + (embedding.share[index] >= 0.5)
        nodes = np.stack([embedding.rod[index], np.maximum(node, 1)], axis=1)
        # grabs of one node are adjacent: one invocation adds them
        self._order = np.lexsort((nodes[:, 1], nodes[:, 0]))
        self._nodes = nodes[self._order].astype(np.int32)
        learnt = np.zeros((len(points), 8), np.float32)
        if self._points and points:
            known = dict(zip(self._sorted, self._store.words("learnt").reshape(-1, 8), strict=True))
            for row, point in enumerate(index[self._order].tolist()):
                learnt[row] = known.get(point, 0.0)
        self._points, self._sorted = points, index[self._order].tolist()
        if points:
            self._store.put_words("learnt", learnt)
            entries = self._segments * (self._segments - 1) // 2
            self._store.make_words("factors", len(points) * entries)
            self._store.clear_rods("u_force")
