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
from typing import TYPE_CHECKING

from hairkit.hookspecs import hookimpl

from .options import Options

if TYPE_CHECKING:
    from hairkit.types.groom import Groom

    from .simulator import PbdSimulator


__all__ = ["Options"]

_log = logging.getLogger("hairkit")


@hookimpl
def make_simulator(groom: Groom, options: Options) -> PbdSimulator:
    """Return a simulator of the groom's guides, at rest."""
    from .simulator import PbdSimulator

    _log.warning("pbd is position-based dynamics since 0.3; what was pbd is rods, the default")
    return PbdSimulator(groom, options)
