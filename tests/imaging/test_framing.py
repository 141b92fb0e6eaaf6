"""Laws of the frames around heads: found small, big, lying, with and without a face."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from hairkit.imaging import framing, hair_network
from hairkit.imaging.framing import find_framing, find_regions
from hairkit.io.framed_photos import frame_view, on_photo
from hairkit.types.capture import Capture, View
from hairkit.types.face import Face
from hairkit.types.framing import Framing
from hairkit.types.person import Person

WIDTH, HEIGHT, RADIUS = 600, 800, 30
"""Of the photos, and half of the head's width, pixels."""
Seen = tuple[View, Face, Person]


def shoot(x: float, y: float, radius: float = RADIUS, face: bool = False) -> Seen:
    """Return a photo of a person whose head has its middle at x, y."""
    alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
    middle = (round(x), round(y))
    cv2.ellipse(alpha, middle, (round(radius), round(1.2 * radius)), 0, 0, 360, 255, -1)
    body = [round(x - 2 * radius), round(y + 1.6 * radius), round(4 * radius), round(7 * radius)]
    cv2.rectangle(alpha, body, 255, -1)
    cv2.rectangle(
        alpha,
        (middle[0] - round(radius / 2), middle[1]),
        (middle[0] + round(radius / 2), body[1]),
        255,
        -1,
    )
    found = Face.absent()
    if face:
        points = np.tile([float(x), float(y)], (68, 1))
        points[48:68, 1] += 0.7 * radius
        found = Face(1.0, points, np.ones(68), 0.0, 0.0, 0.0)
    return View("x", 0.0, np.dstack([alpha // 2] * 3)), found, Person(alpha)


def find(*seen: Seen) -> Framing:
    """Return the framing of photos in which nothing is hair."""
    views, faces, persons = zip(*seen, strict=True)
    return find_framing(Capture(views), faces, persons)


def find_again(view: View, face: Face, person: Person) -> tuple[Framing, Framing]:
    """Return the region and the framing of a photo that may lie."""
    region = find_regions(Capture((view,)), (face,), (person,))
    turns, frame = int(region.quarter_turns[0]), region.frames[0]
    part = frame_view(view, turns, frame, region.heads[0])
    alpha = frame_view(
        replace(view, image=np.dstack([person.alpha] * 3)), turns, frame, region.heads[0]
    )
    upright = face.turned(turns, view.width, view.height)
    points = part.from_photo(upright.landmarks)
    return region, find((part, replace(upright, landmarks=points), Person(alpha.image[..., 0])))


@pytest.fixture(autouse=True)
def _bald(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the network find no hair."""
    nothing = np.zeros((8, 8, 3), np.float32)
    monkeypatch.setattr(framing, "hair_probability", lambda *_: nothing)
    monkeypatch.setattr(hair_network, "find_hair", lambda *_: nothing)


def test_small_heads_are_framed_alike() -> None:
    """Frames hold the head, its upper half above their middle, and are of one size, even where a
    silhouette is wrong, or a head lies at the edge."""
    shots = [shoot(300, 200), shoot(100, 250, face=True), shoot(45, 300), shoot(300, 200, 50)]
    found = find(*shots)
    sizes = found.frames[:, 2:] - found.frames[:, :2]
    assert (sizes == sizes[0]).all()
    assert (found.quarter_turns == 0).all()
    for (left, top, right, bottom), head, (x, y) in zip(
        found.frames, found.heads, [(300, 200), (100, 250), (45, 300), (300, 200)], strict=True
    ):
        assert left < x < right
        assert top < y < (top + bottom) / 2
        assert np.hypot(*(head - [x, y])) < RADIUS
        assert right - left < 8 * RADIUS


def test_shoulders_without_their_head_are_no_head() -> None:
    """A silhouette that begins at the collar has its head where the other photos have theirs."""
    view, face, person = shoot(300, 200)
    alpha = person.alpha.copy()
    alpha[:260] = 0
    found = find(shoot(300, 200), shoot(310, 204), (view, face, Person(alpha)), shoot(290, 196))
    assert found.heads[2] == pytest.approx(found.heads[0], abs=12)
    assert np.abs(found.frames[2] - found.frames[0]).max() < 12


def test_a_head_that_fills_the_photo_is_left_alone() -> None:
    """Portraits, and photos in which nobody is found, stay whole."""
    nobody = (View("x", 0.0, np.zeros((60, 80, 3), np.uint8)), Face.absent(), Person.absent())
    for seen in (shoot(300, 300, 130), nobody):
        found = find(seen)
        view = seen[0]
        assert found.frames.tolist() == [[0, 0, view.width, view.height]]
        assert frame_view(view, 0, found.frames[0], found.heads[0]) is view


def test_borders_of_one_colour_are_cropped() -> None:
    """A photo on a canvas is cropped to it; a person before a wall of one colour is not."""
    rng = np.random.default_rng(0)
    canvas = np.full((HEIGHT, WIDTH, 3), 200, np.uint8)
    canvas[200:700, 100:560] = rng.integers(0, 120, (500, 460, 3))
    canvas[:, :, 0] += rng.integers(0, 3, (HEIGHT, WIDTH)).astype(np.uint8)
    view = View("x", 0.0, canvas)
    found = find_regions(Capture((view,)), (Face.absent(),), (Person.absent(),))
    assert found.frames.tolist() == [[100, 200, 560, 700]]
    view, face, person = shoot(300, 200, 60)
    plain = replace(view, image=np.dstack([200 - person.alpha // 2] * 3))
    found = find_regions(Capture((plain,)), (face,), (person,))
    assert found.frames.tolist() == [[0, 0, WIDTH, HEIGHT]]


def test_a_head_found_without_its_body_is_cropped_as_the_others() -> None:
    """One photo of a turn is no smaller a part than the median one, inside its picture."""
    shots = [shoot(300, 200, 60) for _ in range(3)]
    view, face, person = shoot(300, 200, 60)
    alone = person.alpha.copy()
    alone[290:] = 0
    views, faces, persons = zip(*shots, (view, face, Person(alone)), strict=True)
    frames = find_regions(Capture(views), faces, persons).frames
    sizes = (frames[:, 2:] - frames[:, :2]).max(axis=1)
    assert sizes[3] > 0.6 * sizes[0]
    single = find_regions(Capture(views[3:]), faces[3:], persons[3:]).frames[0]
    assert (single[2:] - single[:2]).max() < 0.4 * sizes[0]
    assert (frames >= 0).all()
    assert (frames[:, 2:] <= [WIDTH, HEIGHT]).all()


def test_a_person_in_the_border_and_a_face_of_a_few_pixels_crop_nothing() -> None:
    """What cannot be the head leaves the photo as it is, or the picture inside its border."""
    canvas = np.full((HEIGHT, WIDTH, 3), 200, np.uint8)
    canvas[400:700, 100:400] = np.random.default_rng(0).integers(0, 120, (300, 300, 3))
    alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
    alpha[20:120, 450:560] = 255
    seen = View("x", 0.0, canvas), Face.absent(), Person(alpha)
    found = find_regions(Capture(seen[:1]), seen[1:2], seen[2:])
    assert found.frames.tolist() == [[100, 400, 400, 700]]
    face = replace(shoot(300, 200, 2, face=True)[1], presence=0.9)
    frames = find((View("x", 0.0, canvas), face, Person.absent())).frames
    assert frames.tolist() == [[0, 0, WIDTH, HEIGHT]]


def test_faces_are_believed_where_the_silhouette_is_of_somebody_else() -> None:
    """A face far from the largest person's head is the head; so it is without any silhouette."""
    view, face, _ = shoot(480, 500, face=True)
    for person in (shoot(150, 120)[2], Person.absent()):
        (left, top, right, bottom), *_ = find((view, face, person)).frames
        assert left < 480 < right
        assert top < 500 < bottom


def test_photos_that_lie_are_framed_as_upright_ones() -> None:
    """Frames and heads are those of the upright photo, however the camera was held."""
    view, face, person = shoot(220, 200, face=True)
    upright = find((view, face, person))
    for turns in (1, 2, 3):
        lying = view.turned(turns)
        region, found = find_again(
            View("x", 0.0, lying.image),
            replace(face.turned(turns, WIDTH, HEIGHT), quarter_turns=-turns % 4),
            Person(np.rot90(person.alpha, -turns)),
        )
        assert region.quarter_turns.tolist() == found.quarter_turns.tolist() == [-turns % 4]
        assert np.abs(found.frames - upright.frames).max() <= 4
        assert np.abs(found.heads - upright.heads).max() <= 4


def test_a_person_far_away_is_cropped_first() -> None:
    """A person who fills little of the photo is cropped with room around, others are not."""
    view, face, person = shoot(300, 200, 20)
    region, found = find_again(view, face, person)
    rows, columns = np.nonzero(person.alpha)
    left, top, right, bottom = region.frames[0]
    assert left < columns.min() < columns.max() < right < WIDTH
    assert top < rows.min() < rows.max() < bottom < HEIGHT
    assert (found.frames[0, :2] >= region.frames[0, :2]).all()
    assert np.hypot(*(found.heads[0] - [300, 200])) < 20
    view, face, person = shoot(300, 200, 60)
    assert find_again(view, face, person)[0].frames.tolist() == [[0, 0, WIDTH, HEIGHT]]


def test_long_hair_makes_frames_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where hair crosses the lower edge of most photos, all frames reach farther down."""
    shots = [shoot(300, 150), shoot(250, 150), shoot(280, 150)]
    short = find(*shots).frames
    hairy = iter([True, True, False, False, False, False])
    answer = np.ones((8, 8, 3), np.float32)
    monkeypatch.setattr(framing, "hair_probability", lambda *_: answer * next(hairy))
    long = find(*shots).frames
    assert (long[:, 3] > short[:, 3] + RADIUS).all()
    assert (long[:, :3] == short[:, :3]).all()


def test_a_framed_photo_keeps_the_pixels_of_its_file(tmp_path: Path) -> None:
    """A crop of a photo that was read small has the file's own pixels; its points are theirs, and
    the lens's axis stays in the middle of the photo."""
    rng = np.random.default_rng(0)
    whole = rng.integers(0, 256, (1600, 1200, 3)).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "a.png"), np.ascontiguousarray(np.rot90(whole)[..., ::-1]))
    small = cv2.resize(whole, (900, 1200), interpolation=cv2.INTER_AREA)
    lying = View(
        "a", 0.0, np.rot90(small), focal_px=1000.0, photo_path=tmp_path / "a.png",
        photo_size=(1600, 1200), landmarks=np.tile([50.0, 300.0], (68, 1)),
    )  # fmt: skip
    view = frame_view(lying, 1, (100, 200, 1000, 1100), np.array([500.0, 600.0]))
    assert np.array_equal(view.image, whole[200:1100, 100:1000])
    assert np.allclose(view.centre, [500, 600])
    assert np.allclose(view.aim, [400, 400])
    assert view.focal_px == pytest.approx(1000 * 1600 / 1200)
    assert view.landmarks is not None
    assert np.allclose(
        view.to_photo(view.landmarks), lying.turned(1).to_photo(lying.turned(1).landmarks)
    )
    again = on_photo(view.image, view.frame, view.photo_size)
    assert np.array_equal(again[200:1100, 100:1000], view.image)
    assert not again[:200].any()


@pytest.mark.parametrize("turns", range(4))
def test_points_of_a_part_are_points_of_the_photo(turns: int) -> None:
    """`to_photo` and `from_photo` are inverse to each other, and follow quarter turns."""
    view = View(
        "a", 0.0, np.zeros((40, 30, 3), np.uint8), photo_size=(200, 300), cropped=(10, 20, 70, 100),
        head=(40.0, 60.0),
    ).turned(turns)  # fmt: skip
    points = np.random.default_rng(1).uniform(0, 30, (9, 2))
    assert np.allclose(view.from_photo(view.to_photo(points)), points)
    assert view.scale == pytest.approx(2)
    assert np.allclose(view.aim, [view.width / 2, view.height / 2])
    assert view.turned(-turns).frame == (10, 20, 70, 100)
