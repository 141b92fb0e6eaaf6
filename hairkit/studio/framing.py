"""Whether the head in the camera's picture is where the page draws it, and seen from there.

What is drawn is what is judged: where the face is seen, it lies on the drawn one within
`OFF` and `SIZES`; where none is, the top of the person lies between the dashed line and the
outline's crown, and the person's head on the outline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import BoolArray, Float64Array
from hairkit.studio.feedback import YAW_TOLERANCE_DEG, Feedback
from hairkit.types.capture import View

OFF = 0.25
"""Distance from the drawn face up to which a face lies on it, over the width of the outline."""
SIZES = (0.5, 1.25)
"""Sizes of the face over the drawn one's between which it is neither too far nor too near. Hair
that is 20 cm high on the head fits below the dashed line at the least."""
WIDTHS = (0.5, 2.0)
"""The same of a head without a face, with its hair, whose thickness is not known: curls all around
were 1.9 times as wide as the outline at the most."""
LOW = 0.35
"""Distance of the top of such a head below the outline's crown, over the width of the outline."""
HEAD_ROWS = 0.6
"""Height of the part of a person that is taken for the head, over the width of the picture."""
LIKELY, LEAST_PERSON, LEAST_ROW = 0.5, 0.02, 0.03
"""Probability of the person in a pixel, least share of such pixels for there to be one, and that of
the topmost row of its head."""
FACED_DEG = 50.0
"""Azimuth up to which a face must be found."""


@dataclass(frozen=True, eq=False)
class Guide:
    """What the page draws over the camera's picture of one view, in shares of width and height."""

    name: str
    azimuth: float
    """Degrees."""
    elevation: float
    """Degrees."""
    silhouette: tuple[Float64Array, ...]
    """Closed curves (N, 2) around the bare head."""
    face: tuple[Float64Array, ...]
    """Open curves (N, 2): brows, nose, eyes and mouth as far as they are seen."""
    landmarks: Float64Array
    """(68, 2) of the drawn face."""
    line: float
    """Height of the dashed line below which the top of the hair stays."""

    @property
    def box(self) -> tuple[float, float, float]:
        """Left, right and top of the outline."""
        points = np.concatenate(self.silhouette)
        return float(points[:, 0].min()), float(points[:, 0].max()), float(points[:, 1].min())


def judge_view(view: View, guide: Guide) -> list[Feedback]:
    """Return what is wrong with the framing and the direction of a picture with sides 3 : 4.

    Parameters
    ----------
    view
        With face and person, where the networks for them are installed.
    guide
        What the page draws over the picture.
    """
    face = view.face if view.face is not None and view.face.sure else None
    person = None if view.person is None else view.person.alpha > LIKELY * 255
    if person is not None and person.mean() < LEAST_PERSON:
        return [Feedback.OUT_OF_FRAME]
    off = np.inf if face is None else _between(face.yaw_deg, guide.azimuth)
    found = []
    if face is not None and off <= FACED_DEG:
        found = _judge_face(face.landmarks / (view.width, view.height), guide)
    elif person is not None:
        found = _judge_head(person, guide)
    if person is not None and _top(person) < guide.line:
        found.append(Feedback.ABOVE_LINE)
    if face is not None and off > YAW_TOLERANCE_DEG:
        found.append(Feedback.WRONG_ANGLE)
    looked = view.face is not None or person is not None
    if looked and face is None and _between(guide.azimuth, 0.0) < FACED_DEG:
        found.append(Feedback.NO_FACE)
    return found


def _between(first_deg: float, second_deg: float) -> float:
    """Return the angle in [0, 180] between two directions."""
    return abs((first_deg - second_deg + 180) % 360 - 180)


def _top(person: BoolArray) -> float:
    """Return the height of the top of a person (H, W), as a share from the picture's top."""
    rows = np.flatnonzero(person.mean(axis=1) > LEAST_ROW)
    return float(rows[0] / len(person)) if len(rows) else 0.0


def _judge_face(landmarks: Float64Array, guide: Guide) -> list[Feedback]:
    """Return how the face (68, 2) lies otherwise than the drawn one, in shares."""
    left, right, _ = guide.box
    (middle, size), (drawn, full) = (_measure(points) for points in (landmarks, guide.landmarks))
    off = float(np.hypot(*(middle - drawn))) > OFF * (right - left)
    return _judge(size / full, SIZES, off)


def _measure(points: Float64Array) -> tuple[Float64Array, float]:
    """Return middle and size of a face of shares, both over the picture's width."""
    even = points * (1, 4 / 3)
    middle = even.mean(axis=0)
    return middle, float(np.linalg.norm(even - middle, axis=1).mean())


def _judge_head(person: BoolArray, guide: Guide) -> list[Feedback]:
    """Return how the head of a person (H, W) lies otherwise than the outline."""
    height, width = person.shape
    left, right, crown = guide.box
    first = round(_top(person) * height)
    rows = person[first : first + round(HEAD_ROWS * width)]
    middle = float(np.average(np.arange(width) + 0.5, weights=rows.sum(axis=0))) / width
    aside, low = abs(middle - (left + right) / 2), (first / height - crown) * height / width
    size = float(np.median(rows.sum(axis=1))) / width / (right - left)
    off = aside > OFF * (right - left) or low > LOW * (right - left)
    return _judge(size, WIDTHS, off)


def _judge(size: float, sizes: tuple[float, float], off: bool) -> list[Feedback]:
    far, near = sizes
    return [
        *([Feedback.TOO_NEAR] if size > near else []),
        *([Feedback.TOO_FAR] if size < far else []),
        *([Feedback.OUT_OF_FRAME] if off else []),
    ]
