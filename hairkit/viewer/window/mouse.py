"""Map mouse events to actions: orbit, pan, zoom, grab, pick."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hairkit.viewer.window.keyboard import CONTROL, SHIFT

LEFT, RIGHT, MIDDLE = 0, 1, 2
"""GLFW's button codes."""
ORBIT_DEGREES = 220.0
"""Orbit angle of a drag over the height of the picture, degrees."""
WHEEL = 1.12
"""Zoom factor of a notch of the wheel."""
ZOOM_NOTCHES = 20
"""Notches of the wheel that a drag over the height of the picture counts for."""
DOUBLE_SECONDS = 0.3
"""Longest time between the clicks of a double click."""
WIPE_PIXELS = 8.0
"""Distance from the line between photo and hair at which a drag moves it, pixels."""
STILL_PIXELS = 4.0
"""Largest motion between press and release of a click, pixels."""

Perform = Callable[[str, Mapping[str, object]], None]


@dataclass
class Mouse:
    """The state of the mouse; positions are pixels of the picture."""

    perform: Perform
    height: float
    """Height of the picture, pixels."""
    width: float = 1.0
    wipe: float | None = None
    """Share of the width left of the line between photo and hair; None: there is none."""
    brush: bool = False
    """True where the left button leads a brush; with control it orbits."""
    x: float = 0.0
    y: float = 0.0
    _drags: str | None = None
    _start: tuple[float, float] = (0.0, 0.0)
    _clicked: float = -1e9

    def press(self, button: int, mods: int) -> None:
        """Handle a pressed button."""
        self._start = (self.x, self.y)
        if button == LEFT and self.brush and not mods:
            self._drags = "stroke"
            self.perform("stroke", {"x": self.x, "y": self.y})
        elif button == LEFT and mods & CONTROL and not self.brush:
            self._drags = "grab"
            self.perform("grab", {"x": self.x, "y": self.y})
        elif button == MIDDLE or (button == LEFT and mods & SHIFT):
            self._drags = "pan"
        elif button == RIGHT:
            self._drags = "zoom"
        elif button == LEFT and self._at_wipe:
            self._drags = "wipe"
        elif button == LEFT:
            self._drags = "orbit"

    @property
    def _at_wipe(self) -> bool:
        return self.wipe is not None and abs(self.x - self.wipe * self.width) < WIPE_PIXELS

    def release(self, now: float) -> None:
        """Handle a released button, at `now` seconds."""
        drags, self._drags = self._drags, None
        if drags == "grab":
            self.perform("release", {})
        elif drags == "stroke":
            self.perform("lift", {})
        away = max(abs(self.x - self._start[0]), abs(self.y - self._start[1]))
        if drags != "orbit" or away > STILL_PIXELS:
            return
        if now - self._clicked < DOUBLE_SECONDS:
            self.perform("recentre", {"x": self.x, "y": self.y})
        else:
            self.perform("pick", {"x": self.x, "y": self.y})
        self._clicked = now

    def move(self, x: float, y: float) -> None:
        """Handle a motion to pixel (x, y)."""
        right, down = (x - self.x) / self.height, (y - self.y) / self.height
        self.x, self.y = x, y
        if self._drags == "stroke":
            self.perform("stroke", {"x": x, "y": y})
        elif self._drags == "orbit":
            self.perform("orbit", {"right": -ORBIT_DEGREES * right, "up": ORBIT_DEGREES * down})
        elif self._drags == "pan":
            self.perform("pan", {"right": right, "down": down})
        elif self._drags == "zoom":
            self.perform("zoom", {"factor": WHEEL ** (-ZOOM_NOTCHES * down)})
        elif self._drags == "grab":
            self.perform("drag", {"x": x, "y": y})
        elif self._drags == "wipe":
            self.perform("wipe", {"at": x / self.width})

    def scroll(self, notches: float) -> None:
        """Handle a turn of the wheel."""
        self.perform("zoom", {"factor": WHEEL**notches})
