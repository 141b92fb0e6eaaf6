"""What the studio says about a photo or a camera's picture: one list for code, pages and help."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import UInt8Array

DARK, BRIGHT = 45.0, 225.0
"""Mean grey levels below and above which hair shows no strands."""
SHARP = 18.0
"""Variance of the Laplacian of a grey picture `MEASURED_WIDTH` wide below which it is blurred; a
blur of two pixels brings rendered photos from above 100 to below it."""
STILL = 6.0
"""Mean difference of grey levels between two pictures a third of a second apart."""
MEASURED_WIDTH = 160
"""Width in pixels to which pictures are scaled before they are measured."""
YAW_TOLERANCE_DEG = 14.0
"""Difference of the face's yaw, or of the compass, from the view's that is taken for right."""


class Feedback(enum.StrEnum):
    """Reasons for which a picture is not taken by itself."""

    TOO_DARK = "too_dark"
    TOO_BRIGHT = "too_bright"
    BLURRED = "blurred"
    MOVING = "moving"
    TOO_NEAR = "too_near"
    TOO_FAR = "too_far"
    OUT_OF_FRAME = "out_of_frame"
    ABOVE_LINE = "above_line"
    WRONG_ANGLE = "wrong_angle"
    NO_FACE = "no_face"
    NO_HAIR = "no_hair"


@dataclass(frozen=True)
class Advice:
    """What a page shows, and what it says aloud."""

    shown: str
    spoken: str


ADVICE = {
    Feedback.TOO_DARK: Advice("Too dark: turn on a light or go to a window", "More light, please"),
    Feedback.TOO_BRIGHT: Advice("Too bright: turn away from the lamp", "Less light, please"),
    Feedback.BLURRED: Advice("Blurred: wipe the lens, hold still", "Not sharp"),
    Feedback.MOVING: Advice("Moving: hold still", "Hold still"),
    Feedback.TOO_NEAR: Advice("Too near: take a step back", "A step back"),
    Feedback.TOO_FAR: Advice("Too far: come closer", "Come closer"),
    Feedback.OUT_OF_FRAME: Advice("Put the head into the outline", "Head into the outline"),
    Feedback.ABOVE_LINE: Advice(
        "Hair above the dashed line: lower the head or step back", "A little lower"
    ),
    Feedback.WRONG_ANGLE: Advice("Turn on to the drawn direction", "Turn a little more"),
    Feedback.NO_FACE: Advice("No face found: look at the camera", "Look at the camera"),
    Feedback.NO_HAIR: Advice("No hair found: mark it on the Mask page", "No hair found"),
}
"""Text for each kind of feedback."""


EXAMPLES = (
    "good",
    *map(str, (Feedback.TOO_DARK, Feedback.TOO_BRIGHT, Feedback.BLURRED, Feedback.TOO_NEAR)),
    *map(str, (Feedback.TOO_FAR, Feedback.OUT_OF_FRAME, Feedback.ABOVE_LINE)),
    str(Feedback.WRONG_ANGLE),
)
"""Pictures beside the pages that show a right photo and faults: `example-NAME.jpg`."""


def judge_photo(image: UInt8Array) -> list[Feedback]:
    """Return what is wrong with the light and the sharpness of a photo (H, W, 3)."""
    height, width = image.shape[:2]
    size = (MEASURED_WIDTH, max(1, round(MEASURED_WIDTH * height / width)))
    grey = cv2.cvtColor(cv2.resize(image, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY)
    mean = float(grey.mean())
    found = []
    if mean < DARK:
        found.append(Feedback.TOO_DARK)
    if mean > BRIGHT:
        found.append(Feedback.TOO_BRIGHT)
    if float(cv2.Laplacian(grey.astype(np.float32), cv2.CV_32F).var()) < SHARP:
        found.append(Feedback.BLURRED)
    return found


def for_pages() -> dict[str, object]:
    """Return texts and limits for the pages, which judge the camera's picture alike."""
    return {
        "advice": {code.value: [advice.shown, advice.spoken] for code, advice in ADVICE.items()},
        "examples": list(EXAMPLES),
        "limits": {
            "dark": DARK, "bright": BRIGHT, "sharp": SHARP, "still": STILL,
            "width": MEASURED_WIDTH, "yaw": YAW_TOLERANCE_DEG,
        },
    }  # fmt: skip
