"""How a person's torso differs from an average adult's."""

from __future__ import annotations

from dataclasses import dataclass, fields

from hairkit.errors import DataError
from hairkit.storage import Stored

LARGEST = 1e3
"""No number is larger, and no ratio smaller than its inverse."""


@dataclass(frozen=True, eq=False)
class TorsoShape(Stored):
    """Neck, shoulders and chest; ratios are to an adult's, lengths to a head of an adult's size."""

    breadth: float = 1.0
    """Ratio, of shoulders and chest."""
    depth: float = 1.0
    """Ratio, of shoulders and chest."""
    drop: float = 0.0
    """Metres that the torso lies lower."""
    slope: float = 1.0
    """Ratio of the way down from the neck to the shoulders' ends."""
    forward: float = 0.0
    """Metres that the chest lies further in front."""
    lean: float = 0.0
    """Metres further in front for each metre up."""
    sideways: float = 0.0
    """Metres that the chest lies further to the subject's left."""
    roll: float = 0.0
    """Metres that the shoulders rise for each metre to the left."""
    yaw: float = 0.0
    """Radians that the chest is turned to the subject's left."""

    def __post_init__(self) -> None:
        for field in fields(TorsoShape):
            value = float(getattr(self, field.name))
            least = 1 / LARGEST if field.default == 1 else -LARGEST
            if not least <= value <= LARGEST:
                raise DataError(f"torso {field.name} is {value}")
