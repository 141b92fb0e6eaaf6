"""Actions of the scene: light, backdrop, lens, and the photo beside the hair."""

from __future__ import annotations

import numpy as np

from hairkit.errors import InputError
from hairkit.options import unknown_name
from hairkit.viewer.actions.registry import action
from hairkit.viewer.draw.backdrop import BACKDROPS
from hairkit.viewer.session import Session

APERTURES = (0.0, 10.0, 25.0, 50.0)
"""Diameters of the lens that its key goes through, millimetres."""
WIDEST_LENS = 200.0
"""Largest diameter, millimetres."""


@action(Q={"by": 30.0}, SHIFT_Q={"by": -30.0})
def light(session: Session, degrees: float | None = None, by: float = 0.0) -> None:
    """Turn the lights round the head."""
    now = session.shown.light if degrees is None else degrees
    session.shown.light = (now + by + 180.0) % 360.0 - 180.0


@action(Z={})
def backdrop(session: Session, name: str = "") -> None:
    """Show the next backdrop: grey, white, dark, warm, green for keying."""
    names = list(BACKDROPS)
    if name and name not in BACKDROPS:
        raise InputError(unknown_name("backdrop", name, names))
    following = names[(names.index(session.shown.backdrop) + 1) % len(names)]
    session.shown.backdrop = name or following


@action(F={})
def lens(session: Session, aperture: float | None = None) -> None:
    """Give still pictures depth of field: the next lens, or its diameter in mm."""
    now = 1e3 * session.shown.aperture
    following = next((wider for wider in APERTURES if wider > now), APERTURES[0])
    wanted = float(np.clip(following if aperture is None else aperture, 0.0, WIDEST_LENS))
    session.shown.aperture = 1e-3 * wanted
    session.message = f"lens of {wanted:g} mm" if wanted else "no depth of field"


@action(C={})
def wipe(session: Session, at: float | None = None, on: bool | None = None) -> None:
    """Compare with a photo, shown left of a line that the mouse drags."""
    shown = session.shown
    if on is False or (on is None and at is None and shown.wipe is not None):
        shown.wipe = None
        return
    session.layers.check("photos")
    name = shown.through or next(iter(session.layers.cameras))
    if name not in session.layers.photos:
        raise InputError(f"the capture has no photo {name!r}; pass its folder with --capture")
    shown.through = name
    middle = 0.5 if shown.wipe is None else shown.wipe
    shown.wipe = float(np.clip(middle if at is None else at, 0.0, 1.0))
