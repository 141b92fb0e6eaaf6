"""Super-helices: guides as inextensible rods of elements with constant curvatures and twist.

Bertails et al., "Super-helices for predicting the dynamics of natural hair", 2006, with the shape
taken from the groom by floating tangents and inverse statics, so that it rests as captured, and
each implicit step solved in linear time (Bertails, "Linear time super-helices", 2009), where the
patent takes conjugate gradients. Contact with the head has Coulomb friction; hair around a
point drags and pushes it. Nothing stretches.

* `binding`: guides to rods and back
* `contact`: contact with the head and friction
* `element_kernels`: compiled kinematics of one element
* `elimination`: solve from tip to root in linear time
* `linear_time_step`: an implicit step of all strands
* `options`: settings
* `rods`: elements, natural curvatures, masses
* `simulator`: the simulator
* `state`: inputs of a step
* `statics`: natural shape by inverse statics
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hairkit.hookspecs import hookimpl
from hairkit.types.groom import Groom

from .options import Options

if TYPE_CHECKING:
    from .simulator import SuperHelices

__all__ = ["Options"]


@hookimpl
def make_simulator(groom: Groom, options: Options) -> SuperHelices:
    """Return a simulator of the guides as super-helices."""
    from .simulator import SuperHelices

    return SuperHelices(groom, options)
