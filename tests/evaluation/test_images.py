"""Laws of the measures in the input views."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.evaluation.images import (
    direction_share,
    hair_silhouette,
    judge_drawn_directions,
    mask_iou,
    orientation_error,
)
from hairkit.evaluation.scores import sample_strands
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.strands import Strands

CAMERA = Camera.on_turn(0.0, distance=1.0, focal=400.0, width=120, height=100)
UPRIGHT = np.full((100, 120), 128, np.uint8)
HAIR = np.ones((100, 120), bool)


def picture_of(angle_deg: float, shape: tuple[int, int] = (100, 120)) -> OrientationMap:
    return OrientationMap(wrap_angle(np.full(shape, np.radians(angle_deg))), np.ones(shape))


def rows(z: float, across: bool = False) -> Strands:
    """Strands side by side in a plane that faces the camera, down or across."""
    steps = np.linspace(-0.05, 0.05, 60)
    ends = [[[s, 0.05, z], [s, -0.05, z]] for s in steps]
    return Strands.from_list([np.array(e)[:, [1, 0, 2]] if across else e for e in ends])


@pytest.mark.parametrize(("angle", "error"), [(90, 0), (100, 10), (80, 10), (0, 90), (180, 90)])
def test_the_error_is_the_angle_between_undirected_lines(angle: float, error: float) -> None:
    """A map that is off by an angle everywhere has that error, at most 90 degrees."""
    found = orientation_error(picture_of(angle), UPRIGHT, HAIR)
    assert found.mean_deg == pytest.approx(error, abs=0.5)
    assert found.mean_everywhere_deg == pytest.approx(error, abs=0.5)


def test_a_smaller_map_is_compared_at_the_truths_size() -> None:
    """Half-size maps are judged as whole ones."""
    assert orientation_error(picture_of(90, (50, 60)), UPRIGHT, HAIR).mean_deg < 0.5


def test_the_edge_and_crossing_hair_are_left_out() -> None:
    """Errors near the mask's edge, and where the truth runs several ways, do not count."""
    hair = np.zeros_like(HAIR)
    hair[20:80, 20:100] = True
    angle = np.full(hair.shape, np.pi / 2)
    angle[:24] = 0
    found = orientation_error(OrientationMap(wrap_angle(angle), np.ones(hair.shape)), UPRIGHT, hair)
    assert found.mean_deg < 0.5
    crossing = UPRIGHT.copy()
    crossing[:, 60:][np.indices((100, 60)).sum(axis=0) % 2 == 0] = 1
    found = orientation_error(picture_of(90), crossing, hair)
    assert found.mean_deg < 1.0
    assert found.mean_everywhere_deg > 15.0


def test_confidence_that_ranks_errors_shows() -> None:
    """Where the surer half is right, its error is less than the whole's."""
    angle = np.full(HAIR.shape, np.pi / 2)
    angle[:, :60] = np.radians(60)
    sure = np.ones(HAIR.shape)
    sure[:, :60] = 0.2
    found = orientation_error(OrientationMap(wrap_angle(angle), sure), UPRIGHT, HAIR)
    assert found.confident_mean_deg < 1.0 < found.mean_deg


def test_no_hair_is_one_line() -> None:
    """A truth without hair, or of another size than its mask, is refused."""
    with pytest.raises(InputError, match="no pixel of true hair"):
        orientation_error(picture_of(90), np.zeros_like(UPRIGHT), HAIR)
    with pytest.raises(InputError, match="the hair mask"):
        orientation_error(picture_of(90), UPRIGHT[:50], HAIR)


def test_drawn_strands_are_right_along_the_truth_and_wrong_across() -> None:
    """Strands straight down are right on upright hair, strands across it wrong."""
    shares = [
        direction_share(
            [judge_drawn_directions(CAMERA, sample_strands(rows(0.15, a)), ball_head(), UPRIGHT)]
        )
        for a in (False, True)
    ]
    assert shares == [1.0, 0.0]


def test_hidden_strands_are_not_judged() -> None:
    """Wrong strands behind right ones, or behind the head, or where no hair is, change nothing."""
    right, wrong = rows(0.15), rows(0.14, across=True)
    both = sample_strands(
        Strands.from_list([*right.points.reshape(-1, 2, 3), *wrong.points.reshape(-1, 2, 3)])
    )
    assert direction_share([judge_drawn_directions(CAMERA, both, ball_head(), UPRIGHT)]) > 0.97
    behind = sample_strands(rows(0.0, across=True))
    assert judge_drawn_directions(CAMERA, behind, ball_head(), UPRIGHT).drawn == 0
    bald = np.zeros_like(UPRIGHT)
    assert judge_drawn_directions(CAMERA, sample_strands(right), ball_head(), bald).drawn == 0


def test_overlap_of_masks() -> None:
    """Equal masks overlap wholly, disjoint ones not at all, halves by half."""
    half = HAIR.copy()
    half[:50] = False
    assert mask_iou(HAIR, HAIR) == 1.0
    assert mask_iou(half, ~half) == 0.0
    assert mask_iou(half, HAIR) == 0.5
    assert mask_iou(half[::2, ::2], half) == 1.0
    assert mask_iou(~HAIR, ~HAIR) == 1.0


def test_the_silhouette_shows_what_stands_before_the_head() -> None:
    """A plane of hair before the head covers its picture; behind the head it does not show."""
    before = hair_silhouette(CAMERA, sample_strands(rows(0.15)), ball_head())
    behind = hair_silhouette(CAMERA, sample_strands(rows(-0.15)), ball_head())
    assert before.sum() == pytest.approx((0.1 * 400 / 0.85) ** 2, rel=0.1)
    assert not behind.any()


def test_clothes_hide_hair_behind_the_neck() -> None:
    """Where the true mask has the person but the head's mesh is not, far hair does not show."""
    beside = np.array([0.2, 0.0, 0.0], np.float32)
    for z, shown in ((-0.15, False), (0.15, True)):
        strands = rows(z)
        samples = sample_strands(Strands(strands.points + beside - [0.08, 0, 0], strands.offsets))
        everywhere = hair_silhouette(CAMERA, samples, ball_head())
        clothed = hair_silhouette(CAMERA, samples, ball_head(), clothes=HAIR)
        assert everywhere.any()
        assert clothed.any() == shown
