"""Extended position-based dynamics: guides as chains of particles, the simple method.

Mueller et al., "Position based dynamics", 2007; Macklin et al., "XPBD: position-based simulation of
compliant constrained dynamics", 2016. A node is joined to the next one rigidly, to the next but one
by a spring, which is bending. What of its weight these cannot bear at rest a force bears that goes
with the head, so that captured hair stays. `rods` is stiffer, faster at equal error, and has twist.

* `kernels`: substeps, compiled
* `simulator`: the simulator
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hairkit.hookspecs import hookimpl
from hairkit.options import option
from hairkit.simulation.node_options import NodeOptions

if TYPE_CHECKING:
    from hairkit.types.groom import Groom


@dataclass(frozen=True)
class Options(NodeOptions):
    """Options of the simulation; None takes the value of the groom."""

    bend: float = option(
        1000.0, low=1.0, high=1e6, unit="1/s2", doc="Bending stiffness over a node's mass."
    )
    borne: float = option(1.0, low=0.0, high=1.0, doc="Share of the weight borne at rest; 0 sags.")
    substeps: int = option(32, low=1, high=512, doc="Substeps in 1/60 s.")
    iterations: int = option(2, low=1, high=64, doc="Iterations in a substep.")


@hookimpl
def make_simulator(groom: Groom, options: Options) -> Any:
    """Return a simulator of the groom's guides, at rest."""
    from .simulator import PbdSimulator

    logging.getLogger("hairkit").warning(
        "pbd is position-based dynamics since 0.3; what was pbd is rods, the default"
    )
    return PbdSimulator(groom, options)
