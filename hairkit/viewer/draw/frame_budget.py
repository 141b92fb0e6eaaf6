"""Keeps drawing within a frame's time by drawing less: softness first, then pixels, then hairs."""

from __future__ import annotations

from dataclasses import dataclass

SMOOTHING = 0.3
"""Weight of the newest time in the running one."""
PATIENCE = 6
"""Pictures between two changes."""
HEADROOM = 0.55
"""More is drawn only when less than this share of the budget is used."""
CALM, CALMEST = 24, 1500
"""Pictures before more is drawn; twice as many each time that had to be taken back."""


@dataclass(frozen=True)
class Quality:
    """How much is drawn."""

    smooth: bool
    """Strokes have soft edges."""
    scale: float
    """Pixels drawn over pixels shown, along an edge."""
    share: float
    """Of the hairs asked for."""


LEVELS = (
    Quality(True, 1.0, 1.0),
    Quality(False, 1.0, 1.0),
    Quality(False, 0.8, 1.0),
    Quality(False, 0.65, 1.0),
    Quality(False, 0.65, 0.6),
    Quality(False, 0.5, 0.4),
    Quality(False, 0.5, 0.2),
)
"""From the best to the fastest."""


@dataclass
class Budget:
    """Chooses a level by the time that pictures take."""

    seconds: float = 1 / 20
    """A picture may take so long, simulation included (half of it at most); 0 draws the best."""
    level: int = 1
    taken: float = 0.0
    """Running time of drawing a picture, seconds."""
    _wait: int = PATIENCE
    _calm: int = CALM
    _rise_in: int = 0
    _risen: int = CALMEST

    @property
    def quality(self) -> Quality:
        """What to draw now."""
        return LEVELS[0] if self.seconds <= 0 else LEVELS[self.level]

    def spent(self, seconds: float, simulated: float = 0.0) -> None:
        """Take note of how long a picture took to draw and, before that, to simulate."""
        allowed = max(self.seconds - simulated, 0.5 * self.seconds)
        self.taken += SMOOTHING * (seconds - self.taken) if self.taken else seconds
        self._wait -= 1
        self._rise_in -= 1
        self._risen += 1
        if self._wait > 0 or self.seconds <= 0:
            return
        if self.taken > allowed and self.level < len(LEVELS) - 1:
            self._fall()
        elif self.taken < HEADROOM * allowed and self.level > 0 and self._rise_in <= 0:
            self._change(-1)
            self._risen = 0

    def _fall(self) -> None:
        """Draw less; a rise that did not last makes the next one wait longer: no popping."""
        hasty = self._risen < CALM
        self._calm = min(2 * self._calm, CALMEST) if hasty else CALM
        self._change(1)

    def _change(self, step: int) -> None:
        self.level += step
        self.taken = 0.0
        self._wait, self._rise_in = PATIENCE, self._calm
