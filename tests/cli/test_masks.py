"""Laws of `hairkit masks`: a mask for each photo, of its size, that a capture takes back."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from ball import PLUGIN_FILE, write_capture

from hairkit.cli import main
from hairkit.testing import ball_mask, turn_scene

PLUGIN = ["--plugin", str(PLUGIN_FILE), "--set", "segment=ball_plugin", "--quiet"]
PLUGIN += ["--set", "landmarks=none", "--set", "person=none"]


def test_masks_have_names_sizes_and_labels_of_the_photos(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One photo or a folder, without a turn; the preview shows all of them."""
    photos = write_capture(tmp_path / "c") / "photos"
    for photo in photos.iterdir():  # the test plugin knows views by their names
        photo.rename(photo.with_name(photo.name.partition("_")[2]))
    out, preview = tmp_path / "masks", tmp_path / "seen.png"
    assert main(["masks", str(photos), "-o", str(out), "--preview", str(preview), *PLUGIN]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 9
    assert {p.stem for p in out.iterdir()} == {p.stem for p in photos.iterdir()}
    found = cv2.imread(str(out / "front.png"), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(found, ball_mask(turn_scene().cameras[0]).labels)
    assert cv2.imread(str(preview)).std() > 3
    assert main(["masks", str(photos / "front.png"), "-o", str(tmp_path / "one"), *PLUGIN]) == 0
    assert [p.name for p in (tmp_path / "one").iterdir()] == ["front.png"]


def test_wrong_photos_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Missing photos, empty folders and two photos of one name are told before anything is done."""
    photos = write_capture(tmp_path / "c") / "photos"
    (tmp_path / "empty").mkdir()
    front = photos / "0_front.png"
    cases = {
        "gone.jpg: no such photo": [tmp_path / "gone.jpg"],
        "empty: no photos in this folder": [tmp_path / "empty"],
        "two photos are called '0_front'": [front, front],
    }
    for said, given in cases.items():
        assert main(["masks", *map(str, given), "-o", str(tmp_path / "m"), *PLUGIN]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1
    assert not (tmp_path / "m").exists()
