"""Implicit Cosserat rods with direct length constraints: inextensible guides with contact.

Each guide is a discrete Cosserat rod with orientations (Kugelstadt and Schoemer 2016). A substep is
implicit and of second order: one banded system for bending, drag and the pull to the captured
shape, and one direct solve for all segment lengths of a strand (after Han and Harada 2013, here
with the metric of the implicit system). Stiffness depends neither on iterations nor on the frame
rate. The natural shape comes from inverse statics, so that captured hair stays in place under
gravity.

* `backend`: what backends share, and the compiled one
* `block`: strands side by side; constants and contact of all backends
* `frames`: turns of frames, compiled
* `kernel_contact`: contact and friction, compiled
* `kernels`: a substep, compiled
* `limits`: what stiffness rods can follow
* `linear_system`: the banded matrix of a substep
* `options`: settings
* `rods`: the discrete rod, its state and energy, inverse statics
* `simulator`: the simulator
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hairkit.hookspecs import hookimpl

from .options import Options

if TYPE_CHECKING:
    from hairkit.types.groom import Groom

__all__ = ["Options"]


@hookimpl
def make_simulator(groom: Groom, options: Options) -> Any:
    """Return a simulator of the groom's guides, at rest."""
    from .simulator import RodSimulator

    return RodSimulator(groom, options)
