"""Mask files become masks: three levels, two levels, or one line that says what is wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ball import write_grey

from hairkit import Mask
from hairkit.errors import InputError, PluginError
from hairkit.manager import Manager
from hairkit.testing import ball_mask, striped_view, turn_scene
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

VIEW = striped_view(90.0)
TRUTH = ball_mask(turn_scene().cameras[0]).labels
HAIR_ONLY = TRUTH == HAIR


def segment(manager: Manager, path: Path, values: np.ndarray) -> Mask:
    """Write the values as the view's mask file and segment the view."""
    write_grey(path / "mask.png", values)
    mask = manager.call("segment", "mask_files", view=replace(VIEW, mask_path=path / "mask.png"))
    assert isinstance(mask, Mask)
    return mask


def test_three_levels_tell_the_person(manager: Manager, tmp_path: Path) -> None:
    """255, 128 and 0 come through unchanged."""
    mask = segment(manager, tmp_path, TRUTH)
    assert np.array_equal(mask.labels, TRUTH)
    assert mask.person_known


@pytest.mark.parametrize("levels", [(0, 255), (0, 1), (10, 200), (127, 128)])
def test_two_levels_tell_the_hair_only(
    manager: Manager, tmp_path: Path, levels: tuple[int, int]
) -> None:
    """The upper of two levels is hair; where the person is stays unknown."""
    mask = segment(manager, tmp_path, np.where(HAIR_ONLY, *levels[::-1]).astype(np.uint8))
    assert np.array_equal(mask.hair, HAIR_ONLY)
    assert not mask.person_known


def test_hair_and_person_without_background_are_three_labels(
    manager: Manager, tmp_path: Path
) -> None:
    """A picture filled by the person holds 255 and 128, which are labels, not two levels."""
    values = np.where(HAIR_ONLY, HAIR, PERSON).astype(np.uint8)
    mask = segment(manager, tmp_path, values)
    assert mask.person_known
    assert np.array_equal(mask.labels, values)


def test_transparency_is_a_mask(manager: Manager, tmp_path: Path) -> None:
    """A cut-out with an alpha channel of two levels is a mask of the hair."""
    alpha = np.where(HAIR_ONLY, 255, 0).astype(np.uint8)
    mask = segment(manager, tmp_path, np.dstack([VIEW.image, alpha]))
    assert np.array_equal(mask.hair, HAIR_ONLY)


def test_the_mask_has_the_size_of_the_working_picture(manager: Manager, tmp_path: Path) -> None:
    """A mask of the large photo is scaled by nearest neighbour: no level between the labels."""
    write_grey(tmp_path / "mask.png", np.kron(TRUTH, np.ones((3, 3), np.uint8)))
    size = 3 * VIEW.width, 3 * VIEW.height
    view = replace(VIEW, mask_path=tmp_path / "mask.png", photo_size=size)
    assert np.array_equal(manager.call("segment", "mask_files", view=view).labels, TRUTH)


def test_no_file_is_no_answer(manager: Manager) -> None:
    """Without a mask file another plugin may segment the view."""
    with pytest.raises(PluginError, match="no plugin has an answer"):
        manager.call_first("segment", [("mask_files", None)], view=VIEW)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (np.zeros_like(TRUTH), "no pixel is marked as hair"),
        (np.full_like(TRUTH, PERSON), "no pixel is marked as hair"),
        (np.where(HAIR_ONLY, PERSON, BACKGROUND).astype(np.uint8), "no pixel is marked as hair"),
        (np.arange(TRUTH.size, dtype=np.uint64).reshape(TRUTH.shape).astype(np.uint8), "value 1,"),
        (np.where(HAIR_ONLY, 20, 10).astype(np.uint8), "value 10,"),
        (TRUTH[:-1], "96 x 127 pixels, its photo has 96 x 128"),
    ],
)
def test_a_wrong_mask_gets_one_line(
    manager: Manager, tmp_path: Path, values: np.ndarray, reason: str
) -> None:
    """An empty mask, stray values and another size are named with the file."""
    with pytest.raises(InputError, match=reason) as caught:
        segment(manager, tmp_path, values)
    assert "mask.png" in str(caught.value)
    assert "\n" not in str(caught.value)
