"""Laws of views that are turned upright and brought into the order of the turn."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.types.capture import Capture, View
from hairkit.types.face import Face, turn_points
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround


def marked_view(name: str = "a") -> View:
    """Return a photo 5 wide and 3 high with one bright pixel, under a landmark."""
    image = np.zeros((3, 5, 3), np.uint8)
    image[0, 3] = 255
    points = np.full((68, 2), [3.5, 0.5])
    face = Face(1.0, points, np.ones(68), 0.0, 0.0, 0.0, quarter_turns=3)
    return View(name, 0.0, image, landmarks=points, face=face, person=Person(image[..., 0]))


@pytest.mark.parametrize("turns", range(-1, 6))
def test_everything_turns_with_the_photo(turns: int) -> None:
    """Landmarks, face and person stay on the bright pixel; the face needs so many turns less."""
    view = marked_view().turned(turns)
    row, column = np.argwhere(view.image[..., 0])[0]
    assert view.landmarks is not None
    assert view.face is not None
    assert view.person is not None
    for points in (view.landmarks, view.face.landmarks):
        assert np.allclose(points, [column + 0.5, row + 0.5])
    assert np.array_equal(view.person.alpha, view.image[..., 0])
    assert view.photo_size == (view.width, view.height)
    assert view.quarter_turns == turns % 4
    assert (view.face.quarter_turns + turns) % 4 == 3


def test_four_quarter_turns_are_none() -> None:
    """Turning in steps is turning at once."""
    points = np.random.default_rng(0).uniform(0, 100, (7, 2))
    assert np.allclose(turn_points(points, 4, 100, 60), points)
    once = turn_points(points, 1, 100, 60)
    assert np.allclose(turn_points(once, 1, 60, 100), turn_points(points, 2, 100, 60))


def test_arranged_views_have_the_turns_order_names_and_places() -> None:
    """View k of the arranged capture is the photo that the order names."""
    capture = Capture((marked_view("a"), marked_view("b")))
    turn = Turnaround(
        np.array([1, 0]), np.array([90.0, 10.0]), np.array([0.0, 60.0]),
        ("left", "above"), 2.0, "",
    )  # fmt: skip
    first, second = capture.arranged(turn).views
    assert (first.name, first.azimuth_deg, first.elevation_deg) == ("above", 10.0, 60.0)
    assert (second.name, second.azimuth_deg, second.elevation_deg) == ("left", 90.0, 0.0)
    assert first.named
    assert second.named
