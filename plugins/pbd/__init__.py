"""Position-based rods: inextensible guides that bend, twist, collide and rub, solved directly.

Each guide is a Cosserat rod that carries orientations (Kugelstadt and Schoemer 2016). A substep is
implicit: bending, drag and the pull to the captured shape by one banded matrix, all lengths of a
strand by one direct solve (after Han and Harada 2013, here with the implicit metric), so that
stiffness depends neither on iterations nor on the frame rate. The natural shape is found by inverse
statics: captured hair stays where it is under gravity.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hairkit.hookspecs import hookimpl
from hairkit.options import option

if TYPE_CHECKING:
    from hairkit.types.groom import Groom, HairPhysics

__all__ = ["Options"]


@dataclass(frozen=True)
class Options:
    """Settings of the simulation; those that are None take the groom's own value."""

    stiffness: float | None = option(
        None,
        low=0.0,
        high=1.0,
        doc="Pull to the captured place, strongest at the root: 0 none, 0.5 about 6 Hz, 1 stiff;"
        " none takes the groom's.",
    )
    bend: float | None = option(
        None,
        low=0.0,
        high=1.0,
        doc="Bending stiffness: 0 a single hair, 1 a thousand times that, as locks have; none takes"
        " the groom's.",
    )
    twist: float = option(
        0.77, low=0.01, high=1.0, doc="Torsional over bending stiffness, GJ/EI; 0.77 for fibres."
    )
    damping: float | None = option(
        None,
        low=0.0,
        high=0.9,
        doc="Share of the motion relative to the head that is lost in 1/60 s; none takes the"
        " groom's.",
    )
    drag: float = option(
        2.0, low=0.0, high=100.0, unit="1/s", doc="How fast air takes hair of mean width along."
    )
    friction: float | None = option(
        None,
        low=0.0,
        high=2.0,
        doc="Coulomb's coefficient of hair on the head; none takes the groom's.",
    )
    cohesion: float = option(
        2.0, low=0.0, high=60.0, unit="1/s", doc="How fast hair takes on its neighbours' velocity."
    )
    pressure: float = option(
        2.0,
        low=0.0,
        high=50.0,
        unit="m/s^2",
        doc="Push out of places that are twice as dense as captured.",
    )
    rounds: int = option(
        2,
        low=0,
        high=8,
        doc="Rounds of friction under the strands' own tension: 0 as if slack, 4 as ropes.",
    )
    clearance: float = option(
        0.002, low=0.0, high=0.02, unit="m", doc="Distance that hair keeps from the head."
    )
    depenetration: float = option(
        0.5, low=0.01, high=10.0, unit="m/s", doc="Fastest way out of the head after a jump."
    )
    grab_speed: float = option(
        5.0, low=0.1, high=50.0, unit="m/s", doc="Fastest pull of a grabbed point."
    )
    nodes: int = option(16, low=4, high=64, doc="Nodes of every guide; finer points ride on them.")
    substeps: int = option(4, low=1, high=64, doc="Substeps in 1/60 s.")
    iterations: int = option(1, low=1, high=8, doc="Linearisations of the lengths in a substep.")
    seed: int = option(0, low=0, doc="Seed of the gusts.")
    backend: str = option(
        "auto",
        choices=("auto", "reference", "fast", "compute"),
        doc="What computes: plain NumPy in float64, compiled float32, or compute shaders; auto"
        " takes shaders where there is a graphics card, else the compiled one.",
    )

    def resolved(self, physics: HairPhysics) -> Options:
        """Return options without None, what lacks taken from the groom and kept within bounds."""
        own: dict[str, Any] = {
            "stiffness": min(max(physics.stiffness, 0.0), 1.0),
            "bend": min(max(physics.bend_stiffness, 0.0), 1.0),
            "damping": min(max(physics.damping, 0.0), 0.9),
            "friction": min(max(physics.friction, 0.0), 2.0),
        }
        missing = {name: own[name] for name in own if getattr(self, name) is None}
        return dataclasses.replace(self, **missing)

    def pull(self) -> float:
        """Return the squared frequency of the pull to the captured place at the root, 1/s^2."""
        share = self.stiffness or 0.0
        return (40.0 * share / (1.001 - share)) ** 2

    def firmness(self) -> float:
        """Return bending stiffness over that of a single hair of the same mass."""
        return float(1000.0 ** (self.bend or 0.0))

    def damping_share(self) -> float:
        """Return the share of relative motion lost in a sixtieth of a second."""
        return self.damping or 0.0

    def rubbing(self) -> float:
        """Return Coulomb's coefficient."""
        return self.friction or 0.0


@hookimpl
def make_simulator(groom: Groom, options: Options) -> Any:
    """Return a simulator of the groom's guides, at rest."""
    from .simulator import PbdSimulator

    return PbdSimulator(groom, options)
