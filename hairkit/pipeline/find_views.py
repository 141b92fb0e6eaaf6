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

from hairkit.imaging.framing import find_framing, find_regions
from hairkit.io.framed_photos import frame_view
from hairkit.pipeline.stage_runner import Given, StageRunner, gather, given_photo
from hairkit.stages import FACES, FIRST_TURN, FRAMED, PERSONS, REGION, TURN
from hairkit.types.capture import Capture, View
from hairkit.types.face import Face
from hairkit.types.framing import Framing
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround


def find_views(run: StageRunner, capture: Capture) -> tuple[Capture, Given[Turnaround] | None]:
    """Find heads, faces, persons and the turn; return the views upright, in the order they came.

    The turn is None where the recipe looks for none.
    """
    faces, persons = _look(run, capture.views)
    framed = capture
    for stage, find in ((REGION, find_regions), (FRAMED, find_framing)):
        before = framed.views
        framing = run.derive(
            stage, find, capture=_bare(framed), faces=gather(faces), persons=gather(persons)
        ).value
        framed = frame_photos(capture, framing, before)
        changed = [k for k, view in enumerate(framed.views) if view is not before[k]]
        again = _look(run, [framed.views[k] for k in changed], f"{stage.name}-")
        for k, face, person in zip(changed, *again, strict=True):
            faces[k], persons[k] = face, person
    _tell(run, framed.views)
    found = zip(framed.views, faces, persons, strict=True)
    views = (v.with_findings(f.result().value, p.result().value) for v, f, p in found)
    seen = replace(framed, views=tuple(views))
    if not run.recipe.has(TURN):
        return seen, None
    return seen, run.once(
        FIRST_TURN, capture=_bare(framed), faces=gather(faces), persons=gather(persons)
    )


def frame_photos(capture: Capture, framing: Framing, known: Sequence[View] = ()) -> Capture:
    """Return the capture with its photos upright and cropped to the head.

    `known` are views of the photos that are framed already; those that stay as they are are kept.
    """
    views = []
    for k, view in enumerate(capture.views):
        turns, frame = int(framing.quarter_turns[k]), tuple(framing.frames[k].tolist())
        same = known and (known[k].quarter_turns, known[k].frame) == (turns, frame)
        views.append(known[k] if same else frame_view(view, turns, frame, framing.heads[k]))
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
