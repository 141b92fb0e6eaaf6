"""Actions that align the head with the photos by hand."""

from __future__ import annotations

from hairkit.errors import InputError
from hairkit.options import unknown_name
from hairkit.types.camera import Camera
from hairkit.viewer.actions.registry import action
from hairkit.viewer.head_adjustment import PLUGIN, Adjustment, PreviousView, Rerun
from hairkit.viewer.head_motion import AXES
from hairkit.viewer.session import Session

PHOTO_OPACITY = 0.5
"""Opacity of the photos during the alignment, so that both photo and head are visible."""
SCALES = (0.1, 10.0)
"""Smallest and largest factor of one `head_scale`: excludes typing errors in scripts."""


@action(A={})
def adjust(session: Session, on: bool | None = None) -> None:
    """Start or leave the manual alignment of the head with the photos."""
    wanted = session.adjustment is None if on is None else on
    if wanted == (session.adjustment is not None):
        return
    session.adjust(wanted)
    if session.adjustment is None:
        return
    shown = session.shown
    photos = "photos" in shown.layers
    session.adjustment.before = PreviousView(session.paused, photos, shown.opacity, shown.through)
    session.reset()
    session.paused = True
    shown.layers.add("photos")
    shown.opacity = PHOTO_OPACITY
    shown.through = shown.through or next(iter(session.photo_cameras))
    session.message = (
        "ctrl+arrows move the head, ctrl+J O I K T Y turn it; N next photo; O shift+O opacity;"
        " ctrl+E saves the pose, ctrl+R reconstructs from it, A leaves"
    )


@action(
    CTRL_LEFT={"right": -0.001},
    CTRL_RIGHT={"right": 0.001},
    CTRL_UP={"up": 0.001},
    CTRL_DOWN={"up": -0.001},
)
def head_move(session: Session, right: float = 0.0, up: float = 0.0, back: float = 0.0) -> None:
    """Move the head by metres along the axes of the photo's camera."""
    adjustment = _adjusting(session)
    adjustment.move(_photo_camera(session), right, up, back)
    session.update_photo_cameras()


@action(
    CTRL_J={"axis": "yaw", "degrees": -1.0},
    CTRL_O={"axis": "yaw", "degrees": 1.0},
    CTRL_I={"axis": "pitch", "degrees": -1.0},
    CTRL_K={"axis": "pitch", "degrees": 1.0},
    CTRL_T={"axis": "roll", "degrees": 1.0},
    CTRL_Y={"axis": "roll", "degrees": -1.0},
)
def head_turn(session: Session, axis: str = "yaw", degrees: float = 1.0) -> None:
    """Turn the head by degrees about its yaw, pitch or roll."""
    if axis not in AXES:
        raise InputError(unknown_name("axis", axis, AXES))
    _adjusting(session).turn(axis, degrees)
    session.update_photo_cameras()


@action(CTRL_PAGE_UP={"factor": 1.01}, CTRL_PAGE_DOWN={"factor": 1 / 1.01})
def head_scale(session: Session, factor: float) -> None:
    """Scale the head."""
    low, high = SCALES
    if not low <= factor <= high:
        raise InputError(f"head_scale: factor is {factor}, expected {low:g} to {high:g}")
    _adjusting(session).grow(factor)
    session.update_photo_cameras()


@action(CTRL_E={})
def head_save(session: Session) -> None:
    """Save the head's pose to capture.toml."""
    session.message = f"saved to {_adjusting(session).save()}"


@action(CTRL_R={})
def reconstruct(session: Session) -> None:
    """Save the head's pose and reconstruct the hair from it."""
    adjustment, results = _adjusting(session), session.opened.results
    if results is None:
        raise InputError("the groom is not in a results folder; run hairkit reconstruct first")
    if session.rerun is not None:
        raise InputError("a reconstruction is already running; wait until it ends")
    adjustment.save()
    session.rerun = Rerun.start(adjustment.folder, results, (f"scene={PLUGIN}",))


def _adjusting(session: Session) -> Adjustment:
    if session.adjustment is None:
        raise InputError("the head is not being aligned; start with the action adjust (key A)")
    return session.adjustment


def _photo_camera(session: Session) -> Camera:
    """Return the camera of the photo on screen, or the first one."""
    cameras, name = session.photo_cameras, session.shown.through
    return cameras[name] if name in cameras else next(iter(cameras.values()))
