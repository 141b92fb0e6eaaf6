"""Settings that all simulators have whose guides are chains of nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from hairkit.options import fill_options, option
from hairkit.types.groom import HairPhysics

_Options = TypeVar("_Options", bound="NodeOptions")


@dataclass(frozen=True)
class NodeOptions:
    """Options of the simulation; None takes the value of the groom."""

    stiffness: float | None = option(
        None,
        low=0.0,
        high=1.0,
        doc="Pull of the first centimetres to the captured shape: 0 off, 0.5 about 6 Hz, 1 stiff;"
        " by default the groom's.",
    )
    damping: float | None = option(
        None,
        low=0.0,
        high=0.9,
        doc="Share of the velocity relative to the head lost in 1/60 s; by default the groom's.",
    )
    drag: float = option(
        2.0, low=0.0, high=100.0, unit="1/s", doc="Air drag rate of hair of mean width."
    )
    friction: float | None = option(
        None, low=0.0, high=2.0, doc="Coulomb friction of hair on the head; by default the groom's."
    )
    clearance: float = option(
        0.002, low=0.0, high=0.02, unit="m", doc="Least distance between hair and head."
    )
    depenetration: float = option(
        0.5, low=0.01, high=10.0, unit="m/s", doc="Highest speed that resolves penetrations."
    )
    grab_speed: float = option(
        5.0, low=0.1, high=50.0, unit="m/s", doc="Highest speed of a grabbed point."
    )
    nodes: int = option(
        16, low=4, high=64, doc="Nodes of each guide; its own finer points are embedded."
    )
    substeps: int = option(4, low=1, high=64, doc="Substeps in 1/60 s.")
    seed: int = option(0, low=0, doc="Seed of the gusts.")

    def resolved(self: _Options, physics: HairPhysics) -> _Options:
        """Return the options with None replaced by the groom's value, clamped to its bounds."""
        return fill_options(
            self, stiffness=physics.stiffness, damping=physics.damping, friction=physics.friction
        )
