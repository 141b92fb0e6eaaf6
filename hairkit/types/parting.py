"""The parting of the hair, as the photos show it."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.storage import Stored


@dataclass(frozen=True)
class Parting(Stored):
    """A line on the crown from front to back, from which hair is combed to both sides."""

    x: float = 0.0
    """Where it is, towards the subject's left, metres in the head frame."""
    skin_share: float = 0.0
    """Share of the crown that the views see as skin; 0 where no parting shows."""
    seen: bool = False
    """True when the crown shows enough skin for a parting."""
