"""Laws of the contact sheet."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from ball import ball_evidence

from hairkit.pipeline import contact_sheet as sheets
from hairkit.pipeline.contact_sheet import (
    GAP,
    HEADER,
    TILE_WIDTH,
    contact_sheet,
    write_contact_sheet,
)
from hairkit.testing import bristle_groom, turn_capture, turn_scene
from hairkit.types.orientation import OrientationMap


def test_the_sheet_shows_every_stage_of_every_view(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eight columns and six rows, none of them blank; the file holds the same picture."""
    scene, capture, evidence = turn_scene(), turn_capture(), ball_evidence()
    sheet = contact_sheet(capture, evidence, bristle_groom())
    height = round(TILE_WIDTH * scene.cameras[0].height / scene.cameras[0].width)
    assert sheet.shape == (HEADER + 6 * (height + GAP), 8 * (TILE_WIDTH + GAP) + GAP, 3)
    for row in range(6):
        for column in range(8):
            top, left = HEADER + row * (height + GAP), GAP + column * (TILE_WIDTH + GAP)
            tile = sheet[top + 20 : top + height, left : left + TILE_WIDTH]
            assert tile.std() > 3, (row, column)
    path = tmp_path / "sheet.png"
    monkeypatch.setattr("hairkit.pipeline.contact_sheet.contact_sheet", lambda *_: sheet)
    write_contact_sheet(path, capture, evidence, bristle_groom())
    stored = cv2.imread(str(path))
    assert stored is not None
    assert (np.asarray(stored)[..., ::-1] == sheet).all()


def test_a_narrow_photo_is_not_stretched() -> None:
    """A round head stays round, in the middle of its tile, with paper beside the photo."""
    photo = cv2.circle(np.zeros((400, 200, 3), np.uint8), (100, 200), 90, (180, 180, 180), -1)
    tile = sheets._fit(photo, (160, 120), sheets.PAPER)[..., 0]
    rows, columns = np.nonzero((tile > 90) & (tile < sheets.PAPER))
    assert np.ptp(rows) == pytest.approx(np.ptp(columns), abs=1)
    assert rows.mean() == pytest.approx(59.5, abs=1)
    assert columns.mean() == pytest.approx(79.5, abs=1)
    assert (tile[:, :45] == sheets.PAPER).all()


def test_the_hue_tells_the_angle() -> None:
    """Strands at a right angle to each other have opposite hues, uncertain ones are dark."""
    camera = turn_scene().cameras[0]
    shape = (camera.height, camera.width)
    shown = [(0.0, 1.0), (np.pi / 2, 1.0), *[(0.0, 0.0)] * 6]
    maps = tuple(OrientationMap(np.full(shape, a), np.full(shape, sure)) for a, sure in shown)
    sheet = contact_sheet(turn_capture(), ball_evidence(orientations=maps), bristle_groom())
    tall = (sheet.shape[0] - HEADER) // 6
    middles = GAP + TILE_WIDTH // 2 + np.arange(3) * (TILE_WIDTH + GAP)
    level, upright, unsure = sheet[HEADER + 2 * tall + tall // 2, middles]
    assert level.argmax() != upright.argmax()
    assert level.max() > 240
    assert unsure.max() == 0


def test_more_guides_than_hairs_are_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many guides the sheet takes the first, bound to the head as they were; few stay."""
    groom = bristle_groom()
    assert sheets._with_few_guides(groom) is groom
    monkeypatch.setattr(sheets, "HAIRS", 7)
    few = sheets._with_few_guides(groom)
    assert len(few.strands) == 7
    np.testing.assert_array_equal(few.strands.roots, groom.strands.roots[:7])
    np.testing.assert_array_equal(few.root_triangle, groom.root_triangle[:7])
