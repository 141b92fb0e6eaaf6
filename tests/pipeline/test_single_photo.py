"""Laws of what is found in one photo: it starts before the turn, and restarts alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import ball_plugin
import numpy as np
import pytest
from ball import RECIPE

from hairkit.manager import Manager
from hairkit.pipeline.recipe import Recipe, parse_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.single_photo import see_photo
from hairkit.testing import ball_head, turn_capture
from hairkit.types.capture import Capture


@pytest.fixture
def ball() -> tuple[Recipe, Manager]:
    """A recipe and the plugin that it names."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    ball_plugin.CALLS.clear()
    return parse_recipe(RECIPE.encode(), "ball", "test"), manager


def capture(folder: Path) -> Capture:
    """The turn of eight as photos that differ, each in a file of its own."""
    views = []
    for number, view in enumerate(turn_capture().views):
        path = folder / f"{view.name}.jpg"
        path.write_bytes(bytes([number]))
        views.append(replace(view, image=np.roll(view.image, number, axis=1), photo_path=path))
    return Capture(tuple(views))


def calls() -> list[str]:
    """What was run since this was asked last."""
    found = list(ball_plugin.CALLS)
    ball_plugin.CALLS.clear()
    return found


def test_only_what_changed_is_found_again(tmp_path: Path, ball: tuple[Recipe, Manager]) -> None:
    """Strokes restart mask and strands, brightness the strands; where the photo was taken from and
    what the turn calls it restart nothing."""
    photo = capture(tmp_path).views[2]
    folder = tmp_path / "seen"
    found = see_photo(photo, folder, *ball, strands=False)
    assert found.orientation is None
    assert calls() == ["segment left"]
    first = see_photo(photo, folder, *ball)
    assert calls() == ["orient left"]
    moved = replace(photo, azimuth_deg=17.0, elevation_deg=3.0, named=False, name="view-9")
    again = see_photo(moved, folder, *ball)
    assert calls() == []
    assert first.orientation is not None
    assert again.orientation is not None
    assert np.array_equal(first.orientation.angle, again.orientation.angle)
    see_photo(replace(photo, brightness=1.2), folder, *ball)
    assert calls() == ["orient left"]
    strokes = tmp_path / "left.json"
    strokes.write_text("{}")
    see_photo(replace(photo, strokes_path=strokes), folder, *ball)
    assert calls() == ["segment left", "orient left"]


def test_a_run_takes_what_was_found_ahead_of_it(
    tmp_path: Path, ball: tuple[Recipe, Manager]
) -> None:
    """Photos that were seen while the turn was taken are not looked at again; the groom is that of
    a run which looked at all of them."""
    turn = capture(tmp_path)
    for view in turn.views[:5]:
        assert view.photo_path is not None
        folder = tmp_path / "out" / "work" / "ahead" / view.photo_path.stem
        see_photo(view, folder, *ball)
    calls()
    given = {"head": ball_head(), "guides": 20, "sheet": False}
    early = reconstruct(turn, tmp_path / "out", *ball, **given)  # type: ignore[arg-type]
    seen = {call for call in calls() if call.startswith(("segment", "orient"))}
    assert seen == {f"{stage} {v.name}" for stage in ("segment", "orient") for v in turn.views[5:]}
    late = reconstruct(turn, tmp_path / "late", *ball, **given)  # type: ignore[arg-type]
    assert np.array_equal(early.strands.points, late.strands.points)
    assert sorted(p.name for p in (tmp_path / "out" / "work").glob("*.npz")) == sorted(
        p.name for p in (tmp_path / "late" / "work").glob("*.npz")
    )
