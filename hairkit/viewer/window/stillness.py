"""When pictures need not be drawn: nothing moves, and nobody has done anything for a while."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.viewer.session import Session

AWAKE = 0.25
"""Seconds of pictures after the last event: then a still picture is worth its samples."""
CHECK = 0.5
"""Seconds between two looks at the hair."""
RESTING = 1e-4
"""Metres that no point moves farther between two looks at hair at rest: a tenth of a pixel."""


class Stillness:
    """Follows a session; times are in seconds of any clock that does not go back."""

    def __init__(self, session: Session, now: float) -> None:
        self._session = session
        self._stirred = self._looked = now
        self._seen: Float32Array = session.simulation.points
        self._resting = False

    def stir(self, now: float) -> None:
        """Stay awake for a while: something has happened."""
        self._stirred = now

    def asleep(self, now: float) -> bool:
        """Return True where the next picture would be the last one."""
        session = self._session
        busy = session.pending > 0 or session.screenshots
        if busy or session.recorder is not None:
            self._stirred = now
        if not session.paused and now - self._looked >= CHECK:
            self._look(now)
        return now - self._stirred >= AWAKE and (session.paused or self._resting)

    def _look(self, now: float) -> None:
        """Find whether head, air and hair are at rest since the last look."""
        session, before = self._session, self._seen
        self._seen = points = session.simulation.points
        self._looked = now
        driven = session.wind.blowing or session.grabbed_lock is not None or session.motion.shakes
        moved = before.shape != points.shape
        if not moved:
            moved = float(np.abs(points - before).max(initial=0.0)) > RESTING
        self._resting = not driven and not moved
