"""Laws of the views as a run sees them: faces, persons and the turn."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from hairkit import hookimpl
from hairkit.manager import Manager
from hairkit.pipeline.find_views import find_views
from hairkit.pipeline.recipe import parse_recipe
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.stage_runner import StageRunner
from hairkit.pipeline.work_folder import WorkFolder, digest_of
from hairkit.progress import Silent
from hairkit.types.capture import Capture, View
from hairkit.types.face import Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

RECIPE = """
[landmarks]
plugin = "seen_upright"
[person]
plugin = "seen_upright"
[turn]
plugin = "seen_upright"
"""


@hookimpl
def detect_landmarks(view: View) -> Face:
    """Find a face by what is bright; less surely in a photo that lies, whose top row is black."""
    row, column = np.argwhere(view.image[..., 0] == view.image.max())[0]
    lying = view.width > view.height
    points = np.full((68, 2), [column + 0.5, row + 0.5]) + 0.25 * lying
    sides = (view.image[0], view.image[:, 0], view.image[-1], view.image[:, -1])
    turns = int(np.argmin([side.max() for side in sides]))
    return Face(0.99 if lying else 1.0, points, np.ones(68), 5.0 * row, 0.0, 0.0, turns)


@hookimpl
def segment_person(view: View) -> Person:
    """Find a person who is darker in a photo that lies."""
    return Person(view.image[..., 0] // (2 if view.width > view.height else 1))


@hookimpl
def find_turn(capture: Capture, faces: tuple[Face, ...]) -> Turnaround:
    """Order the photos by their faces."""
    azimuths = np.array([face.yaw_deg for face in faces])
    names = tuple(f"view-{k}" for k in range(len(faces)))
    order = np.argsort(azimuths, kind="stable")
    zeros = np.zeros(len(faces))
    return Turnaround(order, azimuths, zeros, names, 2.0, "found")


def photos(rng: np.random.Generator) -> Capture:
    """Return three upright photos."""
    images = 1 + rng.permutation(6 * 4 * 3).reshape(3, 6, 4).astype(np.uint8)
    images[:, 0] = 0
    return Capture(tuple(View(f"p{k}", 0.0, np.dstack([i] * 3)) for k, i in enumerate(images)))


def find(capture: Capture, folder: Path) -> tuple[Capture, Turnaround]:
    """Return the views in the order of the turn that this module's functions find, and the turn."""
    manager = Manager()
    manager.register(sys.modules[__name__], "seen_upright")
    recipe = parse_recipe(RECIPE.encode(), "mine", "mine")
    with WorkFolder(folder) as work, ThreadPoolExecutor(1) as pool:
        run = StageRunner(recipe, manager, work, RunLog(Silent()), pool)
        seen, likeliest = find_views(run, capture)
    assert likeliest is not None
    return seen.arranged(likeliest.value), likeliest.value


@pytest.mark.parametrize("lying", [(1, 1, 1), (0, 3, 0)])
def test_how_a_camera_was_held_changes_nothing(
    lying: tuple[int, ...], rng: np.random.Generator, tmp_path: Path
) -> None:
    """Photos on their side give the views of upright ones, which tell how they lay."""
    upright = photos(rng)
    views = zip(upright.views, lying, strict=True)
    turned = tuple(
        View(view.name, 0.0, np.rot90(view.image, -turns).copy()) for view, turns in views
    )
    wanted, _ = find(upright, tmp_path / "upright")
    for _ in range(2):  # the second time from the work folder
        found, turn = find(Capture(turned), tmp_path / "lying")
        assert [found.views[k].quarter_turns for k in np.argsort(turn.order)] == [
            -turns % 4 for turns in lying
        ]
        for one, other in zip(found.views, wanted.views, strict=True):
            assert (one.name, one.azimuth_deg) == (other.name, other.azimuth_deg)
            assert np.array_equal(one.image, other.image)
            assert one.landmarks is not None
            assert one.person is not None
            assert other.landmarks is not None
            assert other.person is not None
            assert np.array_equal(one.landmarks, other.landmarks)
            assert np.array_equal(one.person.alpha, other.person.alpha)


def test_what_is_read_again_counts_as_what_was_made(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    """A face whose yaw is a float of NumPy's has the same digest once it is read: later stages of a
    run that was interrupted are not run again, and count in the same precision."""
    capture = photos(rng)
    first, again = (find(capture, tmp_path)[0] for _ in range(2))
    assert digest_of(first.views) == digest_of(again.views)
