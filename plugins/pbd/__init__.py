"""Extended position-based dynamics: guides as chains of particles, the simple method.

Mueller et al., "Position based dynamics", 2007; Macklin et al., "XPBD: position-based simulation of
compliant constrained dynamics", 2016. A node is joined to the next one rigidly, to the next but one
by a spring, which is bending. What of its weight these cannot bear at rest a force bears that goes
with the head, so that captured hair stays. `rods` is stiffer, faster at equal error, and has twist.

* `kernels`: substeps, compiled
* `options`: settings
* `simulator`: the simulator
"""

from __future__ import annotations

import logging
from typing import Any

from hairkit.hookspecs import hookimpl
from hairkit.types.groom import Groom

from .options import Options

__all__ = ["Options"]


@hookimpl
def make_simulator(groom: Groom, options: Options) -> Any:
    """Return a simulator of the groom's guides, at rest."""
    from .simulator import PbdSimulator

    logging.getLogger("hairkit").warning(
        "pbd is position-based dynamics since 0.3; what was pbd is rods, the default"
    )
    return PbdSimulator(groom, options)
