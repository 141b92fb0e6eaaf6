"""Actions of the brushes."""

from __future__ import annotations

from dataclasses import asdict

from hairkit.errors import InputError
from hairkit.options import describe, make_options, unknown_name
from hairkit.types.edits import Brush
from hairkit.viewer.actions.registry import action
from hairkit.viewer.brushing import NAMES, Brushing
from hairkit.viewer.session import Session
from hairkit.viewer.simulation import step_value


@action(M={"step": 1}, SHIFT_M={"step": -1})
def brush(session: Session, name: str = "", step: int = 0) -> None:
    """Take the next brush, or none; left drag is a stroke then, ctrl+left drag orbits."""
    if name and name not in NAMES:
        raise InputError(unknown_name("brush", name, NAMES))
    now = NAMES[0] if session.brushing is None else session.brushing.setting.brush
    session.take_brush(name or NAMES[(NAMES.index(now) + step) % len(NAMES)])


@action(
    N4={"name": "radius", "steps": -1}, N6={"name": "radius"}, N5={"name": "group"},
    N8={"name": "mirror"},
)  # fmt: skip
def brush_option(session: Session, name: str, value: object = None, steps: int = 1) -> None:
    """Make the brush smaller, larger; its next hair; both sides."""
    now = _taken(session)
    known = asdict(now.setting)
    if value is None:
        [info] = [info for info in describe(Brush) if info.name == name]
        value = step_value(info, known[name], steps)
    now.setting = make_options(Brush, known | {name: value}, "brush")


@action()
def stroke(session: Session, x: float, y: float) -> None:
    """Lead the brush to a pixel; the first one puts it down."""
    if not _taken(session).lead(session.camera(), (x, y)):
        session.message = "nothing under the brush"


@action()
def lift(session: Session) -> None:
    """Lift the brush; the stroke is kept."""
    now = _taken(session)
    now.lift()
    if len(now.hair.points) != len(session.body.guides) or now.setting.brush == "dye":
        session.show_strokes()


@action(CTRL_Z={"by": -1}, CTRL_A={"by": 1})
def undo(session: Session, by: int = -1) -> None:
    """Take the last stroke of a brush back, or do it again."""
    if not _taken(session).step(by):
        raise InputError("there is no stroke to undo or to do again")
    session.show_strokes()


def _taken(session: Session) -> Brushing:
    if session.brushing is None:
        raise InputError("no brush is taken; M, or the action brush, takes one")
    return session.brushing
