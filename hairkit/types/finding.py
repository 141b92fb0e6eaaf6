"""What a check of a groom's file found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Level = Literal["passed", "warning", "failed"]


@dataclass(frozen=True)
class Finding:
    """The outcome of one rule."""

    rule: str
    """Its name: `points-per-strand`."""
    level: Level
    """`failed` where the target refuses the file or shows it wrong, `warning` where it may."""
    text: str
    """What was found and, unless it passed, what to do: one line."""

    @classmethod
    def of(cls, rule: str, holds: bool, text: str, *, otherwise: Level = "failed") -> Finding:
        """Return that a rule holds, or the level `otherwise`."""
        return cls(rule, "passed" if holds else otherwise, text)
