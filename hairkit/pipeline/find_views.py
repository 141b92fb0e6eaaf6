"""Faces, persons and the turn: where each photo was taken from, and which side of it is up.

None of them depends on what was drawn on a photo, so that a stroke does not find them again.
Networks see photos that lie on their side less well. Where the turn finds such photos, they are
turned upright, and faces, persons and the turn are found again, so that how a camera was held does
not change the result.
"""

from __future__ import annotations

from dataclasses import replace

from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.single_photo import given_bare_photo
from hairkit.pipeline.stage_runner import Given, StageRunner
from hairkit.types.capture import Capture
from hairkit.types.face import Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

UPRIGHT = "upright-"
"""Begins the names of the results for photos that were turned upright."""


def find_views(
    run: StageRunner, capture: Capture, log: RunLog
) -> tuple[Capture, Turnaround | None]:
    """Find faces, persons and the turn; return the views upright, in its order, and the turn.

    The turn tells order and quarter turns of the photos as they were read; None where the recipe
    looks for no turn.
    """
    seen, found = _find_turn(run, capture, "")
    if found is None:
        return seen, None
    turn, lying = found.value, found.value.quarter_turns
    if lying.any():
        views = tuple(view.turned(int(n)) for view, n in zip(capture.views, lying, strict=True))
        seen, again = _find_turn(run, replace(capture, views=views), UPRIGHT)
        assert again is not None  # the recipe has the stage
        turn = run.derive("turn", Turnaround, of_lying_photos, lying=found, upright=again).value
        found = again
    log.message(turn.summary)
    return seen.arranged(found.value), turn


def of_lying_photos(lying: Turnaround, upright: Turnaround) -> Turnaround:
    """Return the turn of upright photos as that of the photos as they were read."""
    return replace(upright, quarter_turns=(lying.quarter_turns + upright.quarter_turns) % 4)


def _find_turn(
    run: StageRunner, capture: Capture, kind: str
) -> tuple[Capture, Given[Turnaround] | None]:
    """Return the capture with what is in its views, and its turn; `kind` begins results' names."""
    plain = capture.plain()
    views = [given_bare_photo(view, kind + view.name) for view in plain.views]
    faces = run.every_view("landmarks", Face, views, absent=Face.absent)
    persons = run.every_view("person", Person, views, absent=Person.absent)
    found = zip(capture.views, faces, persons, strict=True)
    seen = replace(
        capture,
        views=tuple(v.with_findings(f.result().value, p.result().value) for v, f, p in found),
    )
    if not run.has("turn"):
        return seen, None
    bare = (replace(view, mask_path=None, strokes_path=None) for view in plain.views)
    photos = Given.of(replace(plain, views=tuple(bare)))
    turn = run.once("turn", Turnaround, f"{kind}turn", capture=photos, faces=faces, persons=persons)
    return seen, turn
