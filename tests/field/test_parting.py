"""Laws of the parting: where it is found, and how hair is combed from it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.field.find_parting import measure_parting
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.field.parting import comb_from_parting, crown_share, root_lift
from hairkit.testing import ball_head, shell_hull, turn_capture, turn_scene
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.tie import TiedHair

BALL = 0.1
"""Radius of the head, metres."""
LINE = 0.006
"""Half of the width of the skin that a parting shows, metres."""
HEAD = ball_head(60)
CAMERAS = turn_scene().cameras


def parted_mask(camera: Camera, x: float | None) -> Mask:
    """Return the labels of a ball of hair with a line of skin at `x` on top of it."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    start, way = camera.rays(np.stack([column, row], axis=-1))
    along = -np.sum(start * way, axis=-1)
    gap = BALL**2 - np.sum(start * start, axis=-1) + along**2
    hit = start + (along - np.sqrt(np.maximum(gap, 0)))[..., None] * way
    labels = np.where(gap > 0, HAIR, BACKGROUND).astype(np.uint8)
    if x is not None:
        skin = (np.abs(hit[..., 0] - x) < LINE) & (hit[..., 1] > 0.05) & (gap > 0)
        labels[skin] = PERSON
    return Mask(labels, True)


def masks_of(x: float | None) -> list[Mask]:
    """Return the labels of all views, in pictures four times as large as those of the turn."""
    return [parted_mask(camera, x) for camera in large_cameras()]


def large_cameras() -> list[Camera]:
    """Return the cameras of the turn with pixels that resolve a parting."""
    return [camera.resized(4 * camera.width, 4 * camera.height) for camera in CAMERAS]


def measure(capture: Capture, masks: Sequence[Mask], cameras: Sequence[Camera]) -> Parting:
    """Measure the parting in views that show no directions, of hair that is not tied."""
    blank = [OrientationMap(0 * mask.labels, 0.0 * mask.labels) for mask in masks]
    hull = shell_hull(0.005)
    distance = measure_scalp_distance(HEAD, hull)
    return measure_parting(capture, masks, blank, cameras, HEAD, TiedHair(), hull, distance)


@pytest.mark.parametrize("x", [-0.03, 0.0, 0.02])
def test_the_parting_is_where_skin_shows(x: float) -> None:
    """Its place is right to half a vertex spacing, whatever side it is on."""
    parting = measure(turn_capture(), masks_of(x), large_cameras())
    assert parting.seen
    assert parting.x == pytest.approx(x, abs=0.004)


def test_a_crown_without_skin_has_no_parting() -> None:
    """Hair everywhere, or masks that do not know the person, say nothing."""
    assert not measure(turn_capture(), masks_of(None), large_cameras()).seen
    unknown = [
        Mask(np.where(mask.hair, HAIR, BACKGROUND), person_known=False) for mask in masks_of(0.0)
    ]
    assert not measure(turn_capture(), unknown, large_cameras()).seen


@pytest.mark.parametrize(("level", "above", "both"), [(-0.03, 0.02, 0.02), (0.012, 0.02, 0.016)])
def test_a_view_from_above_tells_the_parting(level: float, above: float, both: float) -> None:
    """What level views call skin elsewhere does not count once a camera looks down."""
    masks, cameras = masks_of(level), large_cameras()
    front = cameras[0]
    down = Camera.on_turn(
        0.0,
        elevation_deg=70.0,
        focal=front.focal,
        width=front.width,
        height=front.height,
    )
    masks, cameras = [*masks, parted_mask(down, above)], [*cameras, down]
    turn = turn_capture()
    capture = replace(turn, views=(*turn.views, turn.views[0]))
    found = measure(capture, masks, cameras)
    assert found.x == pytest.approx(both, abs=0.003)
    assert found.spread < 2 * LINE


def test_what_the_user_says_counts_before_the_photos() -> None:
    """A parting in the capture is returned as it is."""
    said = replace(turn_capture(), parting=Parting.named("right"))
    found = measure(said, masks_of(0.03), large_cameras())
    assert found.source == "option"
    assert found.x < 0


def test_a_stroke_draws_the_parting(tmp_path: Path) -> None:
    """The line lies on the scalp where its stroke is drawn, whatever the masks show."""
    cameras = large_cameras()
    place = np.array([[0.02, 0.096, z] for z in np.linspace(0.05, 0.0, 9)])
    shape = {
        "label": "parting",
        "shape_type": "linestrip",
        "points": cameras[0].project(place).tolist(),
    }
    file = tmp_path / "front.json"
    file.write_text(json.dumps({"shapes": [shape]}))
    capture = turn_capture()
    front = replace(
        capture.views[0],
        image=np.zeros((cameras[0].height, cameras[0].width, 3), np.uint8),
        strokes_path=file,
        photo_size=(cameras[0].width, cameras[0].height),
        landmarks=None,
    )
    capture = replace(capture, views=(front, *capture.views[1:]))
    found = measure(capture, masks_of(None), cameras)
    assert found.source == "stroke"
    assert found.x == pytest.approx(0.02, abs=0.006)


@pytest.mark.parametrize("word", ["left", "right", "middle", "none", "back"])
def test_words_name_partings(word: str) -> None:
    """Left is the subject's left; only sides and middle have a line."""
    found = Parting.named(word)
    assert np.sign(found.x) == {"left": 1, "right": -1}.get(word, 0)
    assert found.seen == (word in ("left", "right", "middle"))
    assert found.swept_back == (word == "back")


def test_an_unknown_word_is_refused() -> None:
    """The message lists the words."""
    with pytest.raises(InputError, match=r"did you mean 'left'.*middle"):
        Parting.named("lefft")


def test_hair_swept_back_runs_back_all_over_the_crown() -> None:
    """Unit tangents that point backwards on both sides and in the middle."""
    points, normals = crown_points()
    combed = comb_from_parting(Parting.named("back"), HEAD, points, normals)
    np.testing.assert_allclose(np.sum(combed * normals, axis=1), 0, atol=1e-9)
    assert (combed[:, 2] < -0.5).all()


def test_hair_is_combed_from_a_bent_line() -> None:
    """The nearest point of a line of any number of points counts."""
    points, normals = crown_points()
    bent = Parting(np.array([[0.03, 0.09], [0.03, 0.02], [-0.03, -0.02], [-0.03, -0.09]]))
    combed = comb_from_parting(bent, HEAD, points, normals)
    front, back = points[:, 2] > 0.03, points[:, 2] < -0.03
    for part, x in ((front, 0.03), (back, -0.03)):
        beside = part & (np.abs(points[:, 0] - x) > 0.01)
        assert (np.sign(combed[beside, 0]) == np.sign(points[beside, 0] - x)).all()


def crown_points() -> tuple[Float64Array, Float64Array]:
    """Return points on top of the ball and their normals."""
    side, depth = np.meshgrid(np.linspace(-0.05, 0.05, 8), np.linspace(-0.05, 0.05, 8))
    flat = np.stack([side.ravel(), depth.ravel()], axis=1)
    height = np.sqrt(BALL**2 - np.sum(flat**2, axis=1))
    points = np.stack([flat[:, 0], height, flat[:, 1]], axis=1)
    return points, points / BALL


def test_hair_is_combed_along_the_skin_away_from_the_parting() -> None:
    """Directions are unit tangents; hair to the left of the line goes left, to its right right."""
    points, normals = crown_points()
    combed = comb_from_parting(Parting.at(0.01), HEAD, points, normals)
    np.testing.assert_allclose(np.linalg.norm(combed, axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(np.sum(combed * normals, axis=1), 0, atol=1e-9)
    beside = np.abs(points[:, 0] - 0.01) > 0.005
    assert (np.sign(combed[beside, 0]) == np.sign(points[beside, 0] - 0.01)).all()


def test_the_mirrored_parting_combs_the_mirror_image() -> None:
    """Nothing in the comb prefers a side."""
    points, normals = crown_points()
    mirror = np.array([-1.0, 1.0, 1.0])
    left = comb_from_parting(Parting.at(0.02), HEAD, points, normals)
    right = comb_from_parting(Parting.at(-0.02), HEAD, points * mirror, normals * mirror)
    np.testing.assert_allclose(left * mirror, right, atol=1e-12)


def test_the_comb_counts_on_top_and_fades_below() -> None:
    """1 at the top of the head, 0 at the ears, never growing on the way down."""
    height = np.linspace(0.1, -0.1, 50)
    share = crown_share(Parting.at(0.0), HEAD, np.stack([0 * height, height, 0 * height], axis=1))
    assert share[0] == 1
    assert share[-1] == 0
    assert (np.diff(share) <= 0).all()


def test_the_lift_fades_through_the_hair() -> None:
    """Strands stand off at the skin and lie flat on the surface of the hair."""
    hull = shell_hull(0.005)
    height = np.array([0.101, 0.108, 0.116, 0.124])
    lift = root_lift(hull, np.stack([0 * height, height, 0 * height], axis=1))
    assert lift[0] > 0.8
    assert lift[-1] < 0.2
    assert (np.diff(lift) < 0).all()
