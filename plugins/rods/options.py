"""Settings of the simulator."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.options import fill_options, option
from hairkit.types.groom import HairPhysics
from hairkit.types.node_options import NodeOptions


@dataclass(frozen=True)
class Options(NodeOptions):
    """Options of the simulation; None takes the value of the groom."""

    bend: float | None = option(
        None,
        low=0.0,
        high=1.0,
        doc="Bending stiffness: 0 a single hair, 1 ten times that, like a lock; by default"
        " the groom's.",
    )
    twist: float = option(
        0.77, low=0.01, high=1.0, doc="Torsional over bending stiffness, GJ/EI; 0.77 for fibres."
    )
    cohesion: float = option(
        10.0, low=0.0, high=60.0, unit="1/s", doc="Rate at which neighbours' velocities even out."
    )
    adhesion: float = option(
        200.0, low=0.0, high=1000.0, unit="1/s^2", doc="Pull to where the hair beside has gone."
    )
    pressure: float = option(
        2.0, low=0.0, high=50.0, unit="m/s^2", doc="Push out of cells twice as dense as captured."
    )
    rounds: int = option(
        2,
        low=0,
        high=8,
        doc="Friction iterations under strand tension: 0 ignores it, 4 meets Euler-Eytelwein.",
    )
    backend: str = option(
        "fast",
        choices=("fast", "reference"),
        doc="fast: compiled, float32; reference: the same in float64.",
    )

    def resolved(self, physics: HairPhysics) -> Options:
        """Return the options with None replaced by the groom's value, clamped to its bounds."""
        return fill_options(super().resolved(physics), bend=physics.bend_stiffness)
