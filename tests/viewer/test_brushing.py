"""Laws of the brushes in the viewer: strokes by pixels, kept as edits, undone exactly."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit import Brush, Edit, Edits, Groom
from hairkit.errors import InputError, OptionError
from hairkit.grooming.brushes import BRUSHES, edit_groom
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.run_record import describe_run, hash_file
from hairkit.storage import to_arrays, write_npz
from hairkit.testing import turn_capture
from hairkit.types.edits import read_edits
from hairkit.viewer.actions.actions import perform
from hairkit.viewer.brushing import NAMES
from hairkit.viewer.session import Session


def draw(session: Session, name: str, *pixels: tuple[float, float]) -> None:
    """Take a brush and draw a stroke."""
    perform(session, "brush", {"name": name})
    for x, y in pixels:
        perform(session, "stroke", {"x": x, "y": y})
    perform(session, "lift")


def over_the_top(session: Session) -> list[tuple[float, float]]:
    """Return pixels of a way over the hair on top of the ball."""
    perform(session, "look", {"name": "top"})
    x, y = session.camera().project(np.array([0, 0.12, 0.0])).tolist()
    return [(x - 12, y), (x - 4, y), (x + 4, y), (x + 12, y)]


@pytest.mark.parametrize("name", [name for name in BRUSHES if name not in ("cut", "trim")])
def test_a_stroke_is_that_of_the_functions(session: Session, name: str) -> None:
    """What is kept beside the groom gives what is shown; put away, the hair moves on with it."""
    path, before = session.opened.path.parent / "edits.json", session.opened.groom
    draw(session, name, *over_the_top(session))
    edits = read_edits(path)
    assert [edit.setting.brush for edit in edits.strokes] == [name]
    wanted = edit_groom(before, edits)
    shown = session.guide_rows()
    perform(session, "brush", {"name": "none"})
    assert session.brushing is None
    assert len(wanted.strands) == len(shown) == len(session.body.guides)
    after = session.opened.groom.strands
    np.testing.assert_allclose(after.points, wanted.strands.points, atol=2e-5)  # as it is kept
    assert np.abs(session.guide_rows() - shown).mean() < 2e-4  # of fewer points
    changed = len(wanted.strands) != len(before.strands) or after.colours is not None
    assert changed == (name in ("add", "thin", "dye"))
    assert changed or np.abs(after.points - before.strands.points).max() > 1e-4
    session.advance(0.1)
    assert session.steps


def test_a_comb_shows_at_once_and_takes_hair_along(session: Session) -> None:
    """While the brush is down the guides under it follow, others stay to the last bit."""
    pixels = over_the_top(session)
    perform(session, "brush", {"name": "comb"})
    before = session.guide_rows()
    for x, y in pixels:
        perform(session, "stroke", {"x": x, "y": y})
    moved = np.abs(session.guide_rows() - before).max(axis=(1, 2))
    assert moved.max() > 0.003
    assert (moved == 0).mean() > 0.3
    session.advance(0.5)
    assert session.steps == 0  # nothing moves under a brush


def test_removed_strands_shrink_while_the_brush_is_down(session: Session) -> None:
    """They are stubs on their roots until the brush is lifted; then they are gone."""
    before, pixels = session.guide_rows(), over_the_top(session)
    perform(session, "brush", {"name": "thin"})
    for x, y in pixels:
        perform(session, "stroke", {"x": x, "y": y})
    shown = session.guide_rows()
    stubs = np.linalg.norm(shown[:, -1] - shown[:, 0], axis=1) < 0.002
    assert len(shown) == len(before)
    perform(session, "lift")
    assert len(session.guide_rows()) == len(before) - stubs.sum() < len(before)


def test_undo_is_exact_and_survives(session: Session, swaying_manager: object) -> None:
    """Undone, all is as it was to the last bit; done again, as it was before; strokes of an
    earlier session are undone, too."""
    perform(session, "brush", {"name": "comb"})
    plain = session.guide_rows()
    pixels = over_the_top(session)
    draw(session, "comb", *pixels)
    draw(session, "thin", *pixels[:2])
    one = session.guide_rows()
    perform(session, "undo")
    perform(session, "undo")
    np.testing.assert_array_equal(session.guide_rows(), plain)
    perform(session, "undo", {"by": 1})
    perform(session, "undo", {"by": 1})
    np.testing.assert_allclose(session.guide_rows(), one, atol=1e-4)
    other = Session(session.manager, session.opened.path, size=(160, 120), hairs=600)
    perform(other, "brush", {"name": "comb"})
    assert len(other.guide_rows()) == len(one) < len(plain)
    perform(other, "undo")
    perform(other, "undo")
    np.testing.assert_array_equal(other.guide_rows(), plain)
    with pytest.raises(InputError, match="there is no stroke to undo"):
        perform(other, "undo")
    with pytest.raises(InputError, match="no brush is taken"):
        perform(session_without_brush(other), "undo")


def session_without_brush(session: Session) -> Session:
    """Return the session with its brush put away."""
    perform(session, "brush", {"name": "none"})
    return session


def test_keys_change_the_brush(session: Session) -> None:
    """M goes through all brushes and puts the last away; size, hair and sides have keys."""
    taken = []
    for _ in range(len(NAMES)):
        perform(session, "brush", {"step": 1})
        taken.append("none" if session.brushing is None else session.brushing.setting.brush)
    assert taken == [*NAMES[1:], "none"]
    perform(session, "brush", {"name": "add"})
    for name in ("radius", "group", "mirror"):
        perform(session, "brush_option", {"name": name})
    assert session.brushing is not None
    now = session.brushing.setting
    assert now == Brush("add", now.radius, BRUSHES["add"].amount, group="brows", mirror=True)
    assert 0.033 < now.radius < 0.037
    assert "brush add, 3.5 cm on brows, both sides; 0 strokes" in session.brushing.told
    perform(session, "brush_option", {"name": "amount", "value": 0.25})
    assert session.brushing.setting.amount == 0.25
    for name, value, words in (("radius", 9.0, "radius"), ("sise", 1, "sise")):
        with pytest.raises(OptionError, match=words):
            perform(session, "brush_option", {"name": name, "value": value})
    with pytest.raises(InputError, match="no brush 'combb'"):
        perform(session, "brush", {"name": "combb"})


def test_planted_hair_is_drawn_on_the_skin(session: Session) -> None:
    """A beard is planted where the head is seen, and stroke beside the head says so."""
    perform(session, "look", {"name": "front"})
    x, y = session.camera().project(np.array([0, -0.04, 0.09])).tolist()
    perform(session, "brush", {"name": "add"})
    perform(session, "brush_option", {"name": "group", "value": "beard"})
    perform(session, "stroke", {"x": 2, "y": 2})
    assert session.message == "nothing under the brush"
    perform(session, "lift")
    perform(session, "stroke", {"x": x, "y": y})
    perform(session, "lift")
    strands = session.opened.groom.strands
    assert strands.planted.sum() > 20
    assert (strands.select(strands.planted).roots[:, 2] > 0.05).all()


def test_strokes_lie_over_the_groom_of_the_photos(session: Session, tmp_path: Path) -> None:
    """In a folder of results the hair without strokes is that of its work folder."""
    results = tmp_path / "out"
    trimmed = edit_groom(session.opened.groom, Edits((Edit(np.zeros((0, 3)), Brush("trim")),)))
    (results / "work").mkdir(parents=True)
    write_npz(results / "work" / "groom.npz", to_arrays(session.opened.groom))
    trim = Edits((Edit(np.zeros((0, 3)), Brush("trim", amount=0.01)),))
    edit_groom(trimmed, trim).save(results / "groom.npz")
    trim.write(results / "edits.json")
    other = Session(session.manager, results, size=(160, 120), hairs=600)
    perform(other, "brush", {"name": "comb"})
    perform(other, "undo")
    shown: Groom = other.opened.groom
    np.testing.assert_array_equal(shown.strands.points, session.opened.groom.strands.points)


@pytest.mark.parametrize("place", [".", "photos"])
def test_strokes_on_a_copy_leave_the_original(
    place: str, session: Session, tmp_path: Path, manager: Manager
) -> None:
    """Photos lie around or beside the results: those of the copy are found, by their content."""
    photos = tmp_path / "one" / place
    photos.mkdir(parents=True)
    photo = photos / "0_front.png"
    photo.write_bytes(b"a photo")
    results = tmp_path / "one" / "out"
    (results / "work").mkdir(parents=True)
    session.opened.groom.save(results / "groom.npz")
    recipe = load_recipe("default")
    capture = replace(turn_capture(), source=photos)
    record = describe_run(capture, None, recipe, manager, 60, 0)
    replace(record, inputs=(hash_file(photo),)).write(results / "run.json")
    shutil.copytree(tmp_path / "one", tmp_path / "two")
    copy = Session(session.manager, tmp_path / "two" / "out", size=(160, 120), hairs=600)
    draw(copy, "comb", *over_the_top(copy))
    assert [str(path.parent) for path in tmp_path.rglob("edits.json")] == [copy.layers.capture]
    assert copy.layers.capture == str(tmp_path / "two" / place)
    photo.write_bytes(b"another photo")
    assert Session(session.manager, results, size=(160, 120)).layers.capture == str(photos)
