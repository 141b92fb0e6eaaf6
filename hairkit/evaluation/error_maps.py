"""Pictures of a report: where strands are right and wrong, seen by the true cameras."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import UInt8Array
from hairkit.cameras.depth_raster import front_values
from hairkit.errors import HairkitError
from hairkit.evaluation.evaluation import Evaluation
from hairkit.evaluation.images import RIGHT, WRONG, orientation_gap
from hairkit.evaluation.scores import Hits
from hairkit.evaluation.truth import Truth
from hairkit.io.photos import read_photo
from hairkit.types.mask import HAIR
from hairkit.types.orientation import OrientationMap

LEVEL_COLOURS = ((20, 120, 20), (130, 190, 60), (240, 190, 40), (200, 30, 30))
"""Within 2 mm/20, 3 mm/30, 4 mm/40 degrees, and farther off."""
_RIGHT, _WRONG = (60, 210, 90), (235, 60, 60)
HEIGHT = 480
"""Pixels of the pictures."""
_BACKDROP = 24
_FOUND, _TOO_MUCH, _MISSING = (200, 200, 200), (230, 60, 60), (60, 110, 240)
"""RGB of silhouettes: drawn and true, only drawn, only true."""
_NO_HAIR = (30, 40, 60)
"""RGB where the truth has no orientation."""
_PHOTO_BRIGHTNESS = 0.4
_WORST_DEG = 45.0


def view_pictures(
    evaluation: Evaluation, truth: Truth, view: int, orientation: OrientationMap | None = None
) -> dict[str, UInt8Array]:
    """Return captioned RGB pictures (HEIGHT, W, 3) of one view."""
    evidence = evaluation.evidence
    pictures = {
        "drawn direction: right green, wrong red": _directions(evaluation, truth, view),
        "precision of the visible prediction": _levels(evidence.precision, truth, view),
        "recall of the visible truth": _levels(evidence.recall, truth, view),
        "silhouette: missing blue, too much red": _silhouette(evaluation, truth, view),
    }
    if orientation is not None:
        pictures["2D orientation error, black 0 to white 45 degrees"] = _orientation(
            orientation, truth, view
        )
    return {caption: _small(picture, HEIGHT) for caption, picture in pictures.items()}


def _directions(evaluation: Evaluation, truth: Truth, view: int) -> UInt8Array:
    """Mark the visible strand samples over the darkened photo."""
    verdict = evaluation.evidence.directions[view].verdict
    points = evaluation.evidence.samples.points
    picture = _photo(truth, view)
    shown = verdict > 0
    marks = front_values(truth.cameras[view], points[shown], verdict[shown])
    picture[marks == RIGHT] = _RIGHT
    picture[marks == WRONG] = _WRONG
    return picture


def _levels(hits: Hits, truth: Truth, view: int) -> UInt8Array:
    """Colour the front samples by the first threshold at which they have a partner."""
    values = np.minimum(hits.free, len(LEVEL_COLOURS) - 1).astype(np.uint8) + np.uint8(1)
    front = front_values(truth.cameras[view], hits.samples.points, values, truth.head)
    table = np.array([(_BACKDROP,) * 3, *LEVEL_COLOURS], np.uint8)
    return table[front]


def _silhouette(evaluation: Evaluation, truth: Truth, view: int) -> UInt8Array:
    drawn = evaluation.evidence.silhouettes[view]
    hair = truth.hair_mask(view) == HAIR
    picture = np.full((*hair.shape, 3), _BACKDROP, np.uint8)
    picture[drawn & hair] = _FOUND
    picture[drawn & ~hair] = _TOO_MUCH
    picture[~drawn & hair] = _MISSING
    return picture


def _orientation(orientation: OrientationMap, truth: Truth, view: int) -> UInt8Array:
    true = truth.orientation(view)
    gap = np.clip(orientation_gap(orientation, true) / _WORST_DEG, 0, 1)
    heat = cv2.applyColorMap((255 * gap).astype(np.uint8), cv2.COLORMAP_HOT)
    picture = np.ascontiguousarray(heat[..., ::-1])
    picture[true == 0] = _NO_HAIR
    return np.asarray(picture, np.uint8)


def _photo(truth: Truth, view: int) -> UInt8Array:
    """Return the darkened photo, or a plain ground where there is none."""
    camera = truth.cameras[view]
    plain = np.full((camera.height, camera.width, 3), _BACKDROP, np.uint8)
    photos = sorted(path for path in (truth.folder.parent / "photos").glob("*") if path.is_file())
    if view >= len(photos):
        return plain
    try:
        photo, _ = read_photo(photos[view], max_edge=max(camera.width, camera.height))
    except HairkitError:
        return plain  # the picture is only a ground; the scores never needed the photo
    sized = cv2.resize(photo, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    return (sized * _PHOTO_BRIGHTNESS).astype(np.uint8)


def _small(picture: npt.NDArray[np.uint8], height: int) -> UInt8Array:
    width = round(picture.shape[1] * height / picture.shape[0])
    return np.asarray(cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
