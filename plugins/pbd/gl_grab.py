"""Held points in the compute backend: the pulls of `grabbing.py`, found by a shader."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.simulation import Grab

from .gl_buffers import Store
from .grab import KEPT, LEARNT, MOST, SOFTEST, STRONGEST, TAUT
from .resampling import Riders


class Held:
    """The points that are held now; what each has learnt stays in a buffer of the renderer.

    True where any is. Its methods are used inside `renderer()`, but for `let_go`.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._back: Float64Array = np.eye(4)
        self._speed = 0.0
        self.let_go()

    def __bool__(self) -> bool:
        return len(self._points) > 0

    def let_go(self) -> None:
        """Forget all of them."""
        self._points: tuple[int, ...] = ()
        self._sorted: list[int] = []
        self._order: Int64Array = np.zeros(0, np.int64)
        self._nodes: npt.NDArray[np.int32] = np.zeros((0, 2), np.int32)

    def take(
        self, grabs: tuple[Grab, ...], riders: Riders, back: Float64Array, speed: float
    ) -> None:
        """Hold these points from now on; `back` (4, 4) brings the world to the head axes."""
        points = tuple(grab.point for grab in grabs)
        self._back, self._speed = back, speed
        if points != self._points:
            self._change(points, riders)
        if points:
            targets = np.array([grab.target for grab in grabs], np.float32)[self._order]
            words = np.concatenate([self._nodes, targets.view(np.int32)], axis=1)
            self._store.put_words("grabs", words)

    def pull(self, step: int, ride: Float64Array, seconds: float) -> None:
        """Write the forces of one substep, the `step`-th of those in the buffer of steps.

        `ride` (4, 4) is how the head axes move in it, `seconds` how long it is.
        """
        self._back = ride @ self._back
        self._store.read_by("grabs", "learnt")
        self._store.written_by("u_force")
        uniforms: dict[str, Any] = {
            "u_grabs": len(self._points),
            "u_step": step,
            "u_seconds": seconds,
            "u_speed": self._speed,
            "u_back": [tuple(row) for row in self._back[:3]],
            "u_softest": SOFTEST,
            "u_learnt": LEARNT,
            "u_kept": KEPT,
            "u_most": MOST,
            "u_strongest": STRONGEST,
            "u_taut": TAUT,
        }
        self._store.dispatch("pbd_grab", len(self._points), uniforms)

    def _change(self, points: tuple[int, ...], riders: Riders) -> None:
        """Hold other points; those that were held before keep what they have learnt."""
        index = np.array(points, np.int64)
        node = riders.segment[index] + (riders.share[index] >= 0.5)
        nodes = np.stack([riders.rod[index], np.maximum(node, 1)], axis=1)
        # grabs of one node stand side by side: one invocation adds them up
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
            self._store.clear_rods("u_force")
