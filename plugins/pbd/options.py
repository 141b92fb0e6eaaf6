"""Settings of the simulator."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.options import option
from hairkit.types.node_options import NodeOptions


@dataclass(frozen=True)
class Options(NodeOptions):
    """Options of the simulation; None takes the value of the groom."""

    bend: float = option(
        1000.0, low=1.0, high=1e6, unit="1/s2", doc="Bending stiffness over a node's mass."
    )
    borne: float = option(1.0, low=0.0, high=1.0, doc="Share of the weight borne at rest; 0 sags.")
    substeps: int = option(32, low=1, high=512, doc="Substeps in 1/60 s.")
    iterations: int = option(2, low=1, high=64, doc="Iterations in a substep.")
