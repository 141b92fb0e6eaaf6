"""A draft goes on from what a run left, and makes again only what a change calls for."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import ball_plugin
import numpy as np
import pytest
from ball import RECIPE

from hairkit import Capture
from hairkit.errors import InputError
from hairkit.field.find_ties import measure_ties
from hairkit.manager import Manager
from hairkit.pipeline.draft import draft
from hairkit.pipeline.recipe import parse_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.progress import Silent
from hairkit.stages import NEW, ROWS
from hairkit.testing import ball_head, turn_capture, turn_scene
from hairkit.types.chosen import Chosen, ChosenHair

BALL = parse_recipe(RECIPE.encode(), "ball", "test")


class Heard(Silent):
    """Remembers which stages ended."""

    def __init__(self) -> None:
        self.ended: list[str] = []

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Remember it."""
        self.ended.append(stage)


@pytest.fixture
def manager(tmp_path: Path) -> Manager:
    """A manager with the test plugin, after a run of it into the test's folder."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    reconstruct(turn_capture(), tmp_path, BALL, manager, guides=50, head=ball_head(), sheet=False)
    return manager


def test_a_draft_follows_a_change_without_the_cameras(tmp_path: Path, manager: Manager) -> None:
    """After a stroke one view's mask and strands are made again, and hull, field and strands."""
    views = [replace(v, photo_path=Path(f"{v.name}.jpg")) for v in turn_capture().views]
    capture = replace(turn_capture(), views=tuple(views))
    ball_plugin.CALLS.clear()
    drawn = {"back-left.jpg": tmp_path / "seen"}
    quick = draft(capture, tmp_path / "work", drawn, BALL, manager, 30)
    calls = list(ball_plugin.CALLS)
    assert calls == ["segment back-left", "orient back-left", "hull", "field", "track"]
    ball_plugin.CALLS.clear()
    draft(capture, tmp_path / "work", drawn, BALL, manager, 30)
    assert ball_plugin.CALLS == []  # nothing changed since
    assert len(quick.strands) == 30
    assert quick.head.vertices.shape == ball_head().vertices.shape
    with pytest.raises(InputError, match="run all stages first"):
        draft(capture, tmp_path / "nothing", {}, BALL, manager, 30)


def test_a_draft_makes_again_what_follows_from_a_change(tmp_path: Path, manager: Manager) -> None:
    """After one draft the next one runs the stages that its change leads to, and no other."""
    capture, work = turn_capture(), tmp_path / "work"
    first = draft(capture, work, {}, BALL, manager, 30)
    calls: dict[str, list[str]] = {}
    wider = replace(capture, chosen=Chosen(hair=ChosenHair(width_mm=0.3)))
    pose = np.eye(4)
    pose[1, 3] = 0.002
    moved = replace(capture, chosen=Chosen(head=pose))
    changes: dict[str, tuple[Capture, int, tuple[str, ...]]] = {
        "look": (wider, 30, ()),
        "roots": (wider, 20, ()),
        "head": (moved, 20, ()),
        "options": (moved, 20, ("orient",)),
    }
    for name, (changed, guides, anew) in changes.items():
        ball_plugin.CALLS.clear()
        quick = draft(changed, work, {}, BALL, manager, guides, anew=anew)
        calls[name] = sorted({call.split()[0] for call in ball_plugin.CALLS})
        assert len(quick.strands) == guides
    assert "hull" not in calls["look"]
    assert calls["roots"] == ["track"]
    assert calls["head"] == ["field", "hull", "track"]
    assert "orient" in calls["options"]
    assert "hull" not in calls["options"]
    again = draft(capture, work, {}, BALL, manager, 30)
    assert np.array_equal(again.strands.points, first.strands.points)


def test_a_draft_reads_what_the_table_of_stages_says(tmp_path: Path, manager: Manager) -> None:
    """Without a touched photo only new stages run; a parting is measured where one was drawn."""
    views = [replace(v, photo_path=Path(f"{v.name}.jpg")) for v in turn_capture().views]
    heard = Heard()
    draft(Capture(tuple(views)), tmp_path / "work", {}, BALL, manager, 30, heard)
    ended = set(heard.ended)
    assert ended == {"hull", "distance", "ties", "field", "track"}
    assert ended <= {row.name for row in ROWS if row.draft is NEW}
    strokes = tmp_path / "front.json"
    line = {"label": "parting", "shape_type": "linestrip", "points": [[30, 40], [60, 42]]}
    strokes.write_text(json.dumps({"shapes": [line], "imageWidth": 96, "imageHeight": 128}))
    views[0] = replace(views[0], strokes_path=strokes)
    drawn, heard = {"front.jpg": tmp_path / "seen"}, Heard()
    draft(Capture(tuple(views)), tmp_path / "work", drawn, BALL, manager, 30, heard)
    assert set(heard.ended) == ended | {"parting"}


def test_a_draft_may_see_smaller_pictures(
    tmp_path: Path, manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a run found at full size is used at that of the draft's pictures, cameras too."""
    whole = turn_capture().views
    views = [
        replace(v, image=v.image[::2, ::2], photo_size=(v.width, v.height), photo_path=Path(f"{k}"))
        for k, v in enumerate(whole)
    ]
    seen: dict[str, Any] = {}

    def look(**values: Any) -> Any:
        seen.update(values)
        return measure_ties(**values)

    monkeypatch.setattr("hairkit.pipeline.findings.measure_ties", look)
    capture = replace(turn_capture(), views=tuple(views))
    assert len(draft(capture, tmp_path / "work", {}, BALL, manager, 30).strands) == 30
    size = views[0].image.shape[:2]
    assert {mask.labels.shape for mask in seen["masks"]} == {size}
    assert {found.angle.shape for found in seen["orientations"]} == {size}
    point = np.array([0.02, 0.03, 0.01])
    for small, camera in zip(seen["cameras"], turn_scene().cameras, strict=True):
        assert 2 * small.project(point) == pytest.approx(camera.project(point))
