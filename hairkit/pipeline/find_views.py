"""Faces, persons and the turn: where each photo was taken from, and which side of it is up.

None of them depends on what was drawn on a photo, so that a stroke does not find them again.
Networks see photos that lie on their side less well. Where the turn finds such photos, they are
turned upright, and faces, persons and the turn are found again, so that how a camera was held does
not change the result.
"""

from __future__ import annotations

from dataclasses import replace

from hairkit.pipeline.stage_runner import Given, StageRunner, gather, given_photo
from hairkit.stages import FACES, PERSONS, TURN, UPRIGHT_TURN, Stage
from hairkit.types.capture import Capture, View
from hairkit.types.turnaround import Turnaround

UPRIGHT = "upright-"
"""Begins the names of the results for photos that were turned upright."""


def find_views(run: StageRunner, capture: Capture) -> tuple[Capture, Turnaround | None]:
    """Find faces, persons and the turn; return the views upright, in its order, and the turn.

    The turn tells order and quarter turns of the photos as they were read; None where the recipe
    looks for no turn.
    """
    seen, found = _find_turn(run, capture, TURN)
    if found is None:
        return seen, None
    turn, lying = found.value, found.value.quarter_turns
    if lying.any():
        views = tuple(view.turned(int(n)) for view, n in zip(capture.views, lying, strict=True))
        seen, again = _find_turn(run, replace(capture, views=views), UPRIGHT_TURN, UPRIGHT)
        assert again is not None  # the recipe has the stage
        turn = run.derive(TURN, turn_as_read, lying=found, upright=again).value
        found = again
    run.log.message(turn.summary)
    return seen.arranged(found.value), turn


def turn_as_read(lying: Turnaround, upright: Turnaround) -> Turnaround:
    """Return the turn of upright photos as that of the photos as they were read."""
    return replace(upright, quarter_turns=(lying.quarter_turns + upright.quarter_turns) % 4)


def _find_turn(
    run: StageRunner, capture: Capture, stage: Stage[Turnaround], prefix: str = ""
) -> tuple[Capture, Given[Turnaround] | None]:
    """Return the capture with what is in its views, and its turn; `prefix` begins views' names."""
    plain = capture.plain()
    views = [given_bare_photo(view, prefix + view.name) for view in plain.views]
    faces, persons = run.every_view(FACES, views), run.every_view(PERSONS, views)
    found = zip(capture.views, faces, persons, strict=True)
    seen = replace(
        capture,
        views=tuple(v.with_findings(f.result().value, p.result().value) for v, f, p in found),
    )
    if not run.recipe.has(TURN):
        return seen, None
    bare = (replace(view, mask_path=None, strokes_path=None) for view in plain.views)
    photos = Given.of(replace(plain, views=tuple(bare)))
    turn = run.once(stage, capture=photos, faces=gather(faces), persons=gather(persons))
    return seen, turn


def given_bare_photo(view: View, name: str) -> Given[View]:
    """Return a photo as networks see it: without what was drawn on it."""
    return given_photo(replace(view.plain(), mask_path=None, strokes_path=None, name=name))
