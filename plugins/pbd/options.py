"""Settings of the simulator."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.options import option


@dataclass(frozen=True)
class Options:
    """Options of the simulation; None takes the value of the groom."""

    stiffness: float | None = option(
        None, low=0.0, high=1.0, doc="Pull of the first centimetres to the captured shape."
    )
    bend: float = option(
        1000.0, low=1.0, high=1e6, unit="1/s2", doc="Bending stiffness over a node's mass."
    )
    damping: float | None = option(
        None, low=0.0, high=0.9, doc="Share of the velocity relative to the head lost in 1/60 s."
    )
    drag: float = option(2.0, low=0.0, high=100.0, unit="1/s", doc="Rate of air drag.")
    friction: float | None = option(None, low=0.0, high=2.0, doc="Coulomb friction on the head.")
    borne: float = option(1.0, low=0.0, high=1.0, doc="Share of the weight borne at rest; 0 sags.")
    nodes: int = option(16, low=4, high=64, doc="Nodes of each guide.")
    substeps: int = option(32, low=1, high=512, doc="Substeps in 1/60 s.")
    iterations: int = option(2, low=1, high=64, doc="Iterations in a substep.")
