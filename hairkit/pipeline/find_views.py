"""Faces, persons, frames and the turn: where each photo was taken from, and where its head is.

None of them depends on what was drawn on a photo, so that a stroke does not find them again.
Networks see heads that are small, or that lie on their side, less well. Such photos are turned
upright and cropped to the head, and faces and persons are found again, so that neither how a camera
was held nor how far away it was changes the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace

from hairkit.imaging.framing import find_framing
from hairkit.io.framed_photos import frame_view
from hairkit.pipeline.stage_runner import Given, StageRunner, gather, given_photo
from hairkit.stages import FACES, FRAMED, PERSONS, TURN
from hairkit.types.capture import Capture, View
from hairkit.types.face import Face
from hairkit.types.framing import Framing
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

FRAMED_NAME = "framed-"
"""Begins the names of the results for photos that were turned or cropped."""


def find_views(run: StageRunner, capture: Capture) -> tuple[Capture, Turnaround | None]:
    """Find heads, faces, persons and the turn; return the views upright, in the turn's order.

    The turn is None where the recipe looks for none.
    """
    faces, persons = _look(run, capture.views)
    framing = run.derive(
        FRAMED,
        find_framing,
        capture=_bare(capture),
        faces=gather(faces),
        persons=gather(persons),
    ).value
    framed = frame_photos(capture, framing)
    _tell(run, framed.views)
    pairs = enumerate(zip(framed.views, capture.views, strict=True))
    changed = [k for k, (new, old) in pairs if new is not old]
    again = _look(run, [framed.views[k] for k in changed], FRAMED_NAME)
    for k, face, person in zip(changed, *again, strict=True):
        faces[k], persons[k] = face, person
    found = zip(framed.views, faces, persons, strict=True)
    views = (v.with_findings(f.result().value, p.result().value) for v, f, p in found)
    seen = replace(framed, views=tuple(views))
    if not run.recipe.has(TURN):
        return seen, None
    turn = run.once(TURN, capture=_bare(framed), faces=gather(faces), persons=gather(persons)).value
    run.log.message(turn.summary)
    return seen.arranged(turn), turn


def frame_photos(capture: Capture, framing: Framing) -> Capture:
    """Return the capture with its photos upright and cropped to the head."""
    views = (
        frame_view(view, int(framing.quarter_turns[k]), framing.frames[k], framing.heads[k])
        for k, view in enumerate(capture.views)
    )
    return replace(capture, views=tuple(views))


def _tell(run: StageRunner, views: Sequence[View]) -> None:
    """Say how many photos are not seen as they are."""
    lying = sum(view.quarter_turns > 0 for view in views)
    cropped = sum(view.frame != (0, 0, *view.photo_size) for view in views)
    if lying:
        run.log.message(f"{lying} photos lie on their side and are turned")
    if cropped:
        run.log.message(f"{cropped} of {len(views)} photos are cropped to the head")


def _look(
    run: StageRunner, views: Sequence[View], prefix: str = ""
) -> tuple[list[Future[Given[Face]]], list[Future[Given[Person]]]]:
    """Start to look for faces and persons in photos; `prefix` begins the views' names."""
    if not views:
        return [], []
    photos = [given_bare_photo(view, prefix + view.name) for view in views]
    return list(run.every_view(FACES, photos)), list(run.every_view(PERSONS, photos))


def _bare(capture: Capture) -> Given[Capture]:
    """Return a capture without what was drawn on its photos."""
    plain = capture.plain()
    views = (replace(view, mask_path=None, strokes_path=None) for view in plain.views)
    return Given.of(replace(plain, views=tuple(views)))


def given_bare_photo(view: View, name: str) -> Given[View]:
    """Return a photo as networks see it: without what was drawn on it."""
    return given_photo(replace(view.plain(), mask_path=None, strokes_path=None, name=name))
