"""A figure of a run's health, and the limits of its light."""

from __future__ import annotations

from dataclasses import dataclass

GREEN, AMBER, RED = "green", "amber", "red"


@dataclass(frozen=True)
class Figure:
    """One figure of a run."""

    stage: str
    """What it speaks of: `cameras`."""
    name: str
    value: float
    unit: str
    light: str
    """`green`, `amber` or `red`."""
    note: str = ""
    """What to look at when it is not green."""
    digits: int = 2

    def line(self) -> str:
        """Return the figure as a line of the log.

        >>> Figure("masks", "hair within the hull", 0.978, "", "green").line()
        'green  masks: hair within the hull 0.98'
        """
        advice = f"; {self.note}" if self.note and self.light != GREEN else ""
        value = f"{self.value:.{self.digits}f}{' ' if self.unit else ''}{self.unit}"
        return f"{self.light:<6} {self.stage}: {self.name} {value}{advice}"


@dataclass(frozen=True)
class Limits:
    """What a figure is called, and its limits; green may be above red or below."""

    green: float
    red: float
    stage: str = ""
    name: str = ""
    unit: str = ""
    digits: int = 2

    def light(self, value: float) -> str:
        """Return the light of a value: green or red at the limits themselves, amber between."""
        sign = 1.0 if self.green > self.red else -1.0
        if sign * value >= sign * self.green:
            return GREEN
        return RED if sign * value <= sign * self.red else AMBER

    def figure(self, value: float, note: str = "", light: str = "") -> Figure:
        """Return the figure of a value, with the light that the limits or the caller give it."""
        shown = light or self.light(value)
        return Figure(self.stage, self.name, value, self.unit, shown, note, self.digits)
