"""Head motion made by the user: damped turns to a target angle, and shakes that fade in and out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation.motion import AXES, turn_about

MAX_TURN = 2.0
"""Largest angle of the head about each axis, radians."""
GLIDE = 0.18
"""Time scale of a turn, seconds; a critically damped spring of rate 2 / GLIDE."""
FADE = 0.25
"""Fade-in and fade-out time of a shake, seconds."""


@dataclass
class Shake:
    """A sinusoidal rotation about one axis."""

    axis: str
    amplitude: float
    """Radians."""
    hertz: float
    seconds: float
    age: float = 0.0

    def angle(self) -> float:
        """Return the present angle, radians."""
        swell = np.clip(min(self.age, self.seconds - self.age) / FADE, 0.0, 1.0)
        smooth = swell * swell * (3 - 2 * swell)
        return float(self.amplitude * smooth * np.sin(2 * np.pi * self.hertz * self.age))


@dataclass
class HeadMotion:
    """The head's rotation about a pivot, relative to its rest pose."""

    pivot: Float64Array
    """(3,) the neck, metres."""
    shakes: list[Shake] = field(default_factory=list)
    turn: dict[str, float] = field(default_factory=lambda: dict.fromkeys(AXES, 0.0))
    """Target angle of each axis, radians."""
    _turned: dict[str, float] = field(default_factory=lambda: dict.fromkeys(AXES, 0.0))
    _speed: dict[str, float] = field(default_factory=lambda: dict.fromkeys(AXES, 0.0))

    def advance(self, seconds: float) -> None:
        """Advance by `seconds`."""
        for shake in self.shakes:
            shake.age += seconds
        self.shakes = [shake for shake in self.shakes if shake.age < shake.seconds]
        rate = 2.0 / GLIDE  # a critically damped spring, solved exactly
        for axis, goal in self.turn.items():
            gap, speed = self._turned[axis] - goal, self._speed[axis]
            decay = np.exp(-rate * seconds)
            drift = speed + rate * gap
            self._turned[axis] = float(goal + (gap + drift * seconds) * decay)
            self._speed[axis] = float((speed - rate * drift * seconds) * decay)

    def stop(self) -> None:
        """Reset the head to its rest pose."""
        self.shakes = []
        self.turn = dict.fromkeys(AXES, 0.0)
        self._turned, self._speed = dict(self.turn), dict(self.turn)

    def matrix(self) -> Float64Array:
        """Return head_from_rest (4, 4): roll first, then pitch, then yaw."""
        angles = {
            axis: turned + sum(shake.angle() for shake in self.shakes if shake.axis == axis)
            for axis, turned in self._turned.items()
        }
        return turn_about(self.pivot, *((axis, angles[axis]) for axis in ("yaw", "pitch", "roll")))
