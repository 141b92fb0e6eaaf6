"""Laws of what is said about pictures: each code has its reason, its words and its line of help."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from hairkit.arrays import UInt8Array
from hairkit.studio.capture_guides import HAIR_ABOVE, guide_at
from hairkit.studio.feedback import ADVICE, Feedback, judge_photo
from hairkit.studio.framing import judge_view
from hairkit.types.capture import View
from hairkit.types.face import Face
from hairkit.types.person import Person

HEIGHT, WIDTH = 480, 360


def photo(grey: float = 128, contrast: float = 40, blur: float = 0.8) -> UInt8Array:
    """Return a picture of noise with a mean, a contrast and a sharpness."""
    noise = np.random.default_rng(3).normal(size=(HEIGHT, WIDTH))
    for size in (1, 4):
        noise += cv2.GaussianBlur(noise, (0, 0), size) * 4 * size
    smooth = cv2.GaussianBlur(noise, (0, 0), blur)
    levels = np.clip(grey + contrast * smooth / smooth.std(), 0, 255).astype(np.uint8)
    return np.repeat(levels[..., None], 3, axis=2)


def person(width: float = 0.4, middle: float = 0.5, top: float = 0.3) -> Person:
    """Return a person whose head is so wide, whose middle and top are there, in shares."""
    alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
    low, high = (round((middle + sign * width / 2) * WIDTH) for sign in (-1, 1))
    alpha[round(top * HEIGHT) :, max(low, 0) : high] = 255
    return Person(alpha)


def face(
    yaw_deg: float, presence: float = 0.99, size: float = 1.0, aside: float = 0.0, up: float = 0.0
) -> Face:
    """Return a face of the view's drawn one, larger about its middle, moved by so many pixels."""
    drawn = guide_at(45 * round(yaw_deg / 45) % 360, 0.0).landmarks * (WIDTH, HEIGHT)
    points = (drawn - drawn.mean(axis=0)) * size + drawn.mean(axis=0) + (aside, -up)
    return Face(presence, points, np.zeros(68), yaw_deg, 0.0, 0.0)


def judge(person: Person | None, face: Face | None, azimuth: float = 0.0) -> list[Feedback]:
    """Return what is wrong where these were found in the picture of a view."""
    return judge_view(view(person, face), guide_at(azimuth % 360, 0.0))


def view(person: Person | None, face: Face | None) -> View:
    """Return a picture in which these were found."""
    return View("camera", 0.0, photo(), person=person, face=face)


def test_a_good_picture_has_no_faults() -> None:
    """Light, sharpness, framing and angle that are right are not remarked on."""
    assert judge_photo(photo()) == []
    assert judge(person(), face(3.0)) == []
    assert judge(person(), None, 180) == []


@pytest.mark.parametrize(
    ("code", "picture"),
    [
        (Feedback.TOO_DARK, photo(grey=25, contrast=12)),
        (Feedback.TOO_BRIGHT, photo(grey=245, contrast=30)),
        (Feedback.BLURRED, photo(blur=9)),
    ],
)
def test_faults_of_light_are_named(code: Feedback, picture: UInt8Array) -> None:
    """Dark, bright and blurred pictures are called so."""
    assert code in judge_photo(picture)


@pytest.mark.parametrize(
    ("code", "person", "face", "azimuth"),
    [
        (Feedback.TOO_NEAR, person(), face(0, size=1.3), 0),
        (Feedback.TOO_FAR, person(), face(0, size=0.5), 0),
        (Feedback.TOO_NEAR, person(width=0.9), None, 180),
        (Feedback.TOO_FAR, person(width=0.12), None, 180),
        (Feedback.OUT_OF_FRAME, person(), face(0, aside=50), 0),
        (Feedback.OUT_OF_FRAME, person(), face(0, up=-60), 0),
        (Feedback.OUT_OF_FRAME, person(middle=0.2), None, 180),
        (Feedback.OUT_OF_FRAME, person(top=0.5), None, 180),
        (Feedback.OUT_OF_FRAME, person(width=0.0), None, 180),
        (Feedback.ABOVE_LINE, person(top=0.0), face(0), 0),
        (Feedback.WRONG_ANGLE, person(), face(40), 0),
        (Feedback.WRONG_ANGLE, person(), face(-40), 45),
        (Feedback.WRONG_ANGLE, person(), face(5), 180),
        (Feedback.NO_FACE, person(), None, 315),
        (Feedback.NO_FACE, person(), face(0, presence=0.4), 0),
    ],
)
def test_faults_of_framing_are_named(
    code: Feedback, person: Person, face: Face | None, azimuth: float
) -> None:
    """A head that is too near, far, aside or turned otherwise is called so."""
    assert code in judge(person, face, azimuth)


@pytest.mark.parametrize("azimuth", [0, 45, 90, 180, 315])
def test_what_is_drawn_is_what_is_right(azimuth: float) -> None:
    """The drawn head itself has no fault with usual hair; 80 pixels above the outline it has, with
    and without a face."""
    guide = guide_at(azimuth, 0.0)
    alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
    for curve in guide.silhouette:
        cv2.fillPoly(alpha, [np.rint(curve * (WIDTH, HEIGHT)).astype(np.int32)], 255)
    hair = round((guide.box[2] - guide.line) * HEIGHT) - 2
    alpha = cv2.dilate(alpha, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * hair + 1,) * 2))
    faced = azimuth in (0, 45, 315)
    for up in (0, 80):
        moved = Person(np.asarray(np.roll(alpha, -up, axis=0), np.uint8))
        seen = face((azimuth + 180) % 360 - 180, up=up) if faced else None
        assert bool(judge(moved, seen, azimuth)) == (up > 0)


@pytest.mark.parametrize("height_cm", [0.0, 5.0, 10.0, 20.0])
def test_hair_of_any_height_can_be_right(height_cm: float) -> None:
    """Whoever steps back until the hair is below the dashed line is not called too far."""
    guide = guide_at(0.0, 0.0)
    middle, crown = guide.landmarks.mean(axis=0)[1], guide.box[2]
    per_metre = (crown - guide.line) / HAIR_ABOVE
    whole = middle - crown + height_cm / 100 * per_metre  # from the face to the top of the hair
    size = min(1.0, (middle - guide.line) / whole)
    assert judge(person(top=middle - size * whole + 0.003), face(0.0, size=size)) == []


@pytest.mark.parametrize(("below", "above"), [(-0.02, True), (0.02, False)])
def test_hair_above_the_dashed_line_is_named(below: float, above: bool) -> None:
    """The line that is drawn is the one that counts."""
    seen = person(top=guide_at(0.0, 0.0).line + below)
    assert (Feedback.ABOVE_LINE in judge(seen, face(0))) == above


def test_without_networks_nothing_is_held_back() -> None:
    """Where neither faces nor persons are looked for, there is no fault of framing."""
    assert judge(None, None) == []


def test_every_code_has_its_words(project) -> None:  # type: ignore[no-untyped-def]
    """Code, advice and help list the same reasons with the same words."""
    assert set(ADVICE) == set(Feedback)
    help_page = (project / "docs" / "studio.md").read_text()
    for code, advice in ADVICE.items():
        assert f"| `{code.value}` | {advice.shown} |" in help_page
