"""Lower the quality until frames keep their time: antialiasing, then resolution, then strands."""

from __future__ import annotations

from dataclasses import dataclass

SMOOTHING = 0.3
"""Weight of the newest frame in the moving average of the draw time."""
SETTLE_FRAMES = 6
"""Frames between two changes of quality."""
HEADROOM = 0.55
"""The quality is raised only below this share of the allowed time."""
RAISE_AFTER, RAISE_AFTER_MAX = 24, 1500
"""Frames to wait before raising the quality; doubled after a raise that was reverted."""
HURRIED = 1 / 60
"""Allowed time of a frame that follows a hand, seconds."""


@dataclass(frozen=True)
class Quality:
    """A level of quality."""

    smooth: bool
    """Strands are antialiased."""
    scale: float
    """Drawn over displayed resolution, along an edge."""
    share: float
    """Share of the strands that are drawn."""


LEVELS = (
    Quality(True, 1.0, 1.0),
    Quality(False, 1.0, 1.0),
    Quality(False, 0.8, 1.0),
    Quality(False, 0.65, 1.0),
    Quality(False, 0.65, 0.6),
    Quality(False, 0.5, 0.4),
    Quality(False, 0.5, 0.2),
)
"""From the best quality to the fastest."""


@dataclass
class Budget:
    """Chooses the quality of the next frame from the times of the last ones."""

    seconds: float = 1 / 20
    """Allowed time of a frame with its simulation, of which drawing gets at least half; 0: best."""
    level: int = 1
    hurried: bool = False
    """Whether a brush is led, so that frames have less time."""
    taken: float = 0.0
    """Moving average of the draw time, seconds."""
    _wait: int = SETTLE_FRAMES
    _raise_after: int = RAISE_AFTER
    _frames_until_raise: int = 0
    _frames_since_raise: int = RAISE_AFTER_MAX

    @property
    def quality(self) -> Quality:
        """Quality of the next frame."""
        return LEVELS[0] if self.seconds <= 0 else LEVELS[self.level]

    def record(self, seconds: float, simulated: float = 0.0) -> None:
        """Record how many seconds a frame took to draw and to simulate."""
        whole = min(self.seconds, HURRIED) if self.hurried else self.seconds
        allowed = max(whole - simulated, 0.5 * whole)
        self.taken += SMOOTHING * (seconds - self.taken) if self.taken else seconds
        self._wait -= 1
        self._frames_until_raise -= 1
        self._frames_since_raise += 1
        if self._wait > 0 or self.seconds <= 0:
            return
        if self.taken > allowed and self.level < len(LEVELS) - 1:
            self._lower_quality()
        elif self.taken < HEADROOM * allowed and self.level > 0 and self._frames_until_raise <= 0:
            self._change(-1)
            self._frames_since_raise = 0

    def _lower_quality(self) -> None:
        """Lower the quality; wait longer before the next raise if the last one did not last."""
        reverted = self._frames_since_raise < RAISE_AFTER
        self._raise_after = min(2 * self._raise_after, RAISE_AFTER_MAX) if reverted else RAISE_AFTER
        self._change(1)

    def _change(self, step: int) -> None:
        self.level += step
        self.taken = 0.0
        self._wait, self._frames_until_raise = SETTLE_FRAMES, self._raise_after
