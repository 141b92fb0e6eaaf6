"""Laws of what is said about pictures: each code has its reason, its words and its line of help."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from hairkit.arrays import UInt8Array
from hairkit.studio.feedback import ADVICE, Feedback, judge_photo, judge_view
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


def person(width: float = 0.4, middle: float = 0.5, top: float = 0.2) -> Person:
    """Return a person whose head is so wide, whose middle and top are there, in shares."""
    alpha = np.zeros((HEIGHT, WIDTH), np.uint8)
    low, high = (round((middle + sign * width / 2) * WIDTH) for sign in (-1, 1))
    alpha[round(top * HEIGHT) :, max(low, 0) : high] = 255
    return Person(alpha)


def face(yaw_deg: float, presence: float = 0.99) -> Face:
    """Return a face that is seen from an azimuth."""
    return Face(presence, np.zeros((68, 2)), np.zeros(68), yaw_deg, 0.0, 0.0)


def view(person: Person | None, face: Face | None) -> View:
    """Return a picture in which these were found."""
    return View("camera", 0.0, photo(), person=person, face=face)


def test_a_good_picture_has_no_faults() -> None:
    """Light, sharpness, framing and angle that are right are not remarked on."""
    assert judge_photo(photo()) == []
    assert judge_view(view(person(), face(3.0)), 0) == []
    assert judge_view(view(person(), None), 180) == []


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
        (Feedback.TOO_NEAR, person(width=0.9), face(0), 0),
        (Feedback.TOO_FAR, person(width=0.12), face(0), 0),
        (Feedback.OUT_OF_FRAME, person(middle=0.2), face(0), 0),
        (Feedback.OUT_OF_FRAME, person(top=0.0), face(0), 0),
        (Feedback.OUT_OF_FRAME, person(width=0.0), None, 180),
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
    assert code in judge_view(view(person, face), azimuth)


@pytest.mark.parametrize(("top", "above"), [(0.05, True), (0.09, False), (0.22, False)])
def test_hair_above_the_dashed_line_is_named(top: float, above: bool) -> None:
    """Hair far above the line is called too high, hair that passes it a little is not; never
    without a line."""
    seen = view(person(top=top), face(0))
    assert (Feedback.ABOVE_LINE in judge_view(seen, 0, line=0.2)) == above
    assert judge_view(seen, 0) == []


def test_without_networks_nothing_is_held_back() -> None:
    """Where neither faces nor persons are looked for, there is no fault of framing."""
    assert judge_view(view(None, None), 0) == []


def test_every_code_has_its_words(project) -> None:  # type: ignore[no-untyped-def]
    """Code, advice and help list the same reasons with the same words."""
    assert set(ADVICE) == set(Feedback)
    help_page = (project / "docs" / "studio.md").read_text()
    for code, advice in ADVICE.items():
        assert f"| `{code.value}` | {advice.shown} |" in help_page
