"""Where a face is: MediaPipe's BlazeFace detectors, in four orientations of the photo.

Their networks see the photo in a square and give, for each anchor of a grid, a score, a box and six
points (Bazarevsky et al. 2019). The best anchor of an orientation is kept.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.nets.model_folder import find_model
from hairkit.nets.net_process import NetProcess

from .crops import MARGIN, Crop

SHORT_RANGE, FULL_RANGE = "face_detection_short_range", "face_detection_full_range"
_EDGES = {SHORT_RANGE: 128, FULL_RANGE: 192}
"""Pixels of the square that each network wants."""
_GRIDS = {SHORT_RANGE: ((16, 2), (8, 6)), FULL_RANGE: ((48, 1),)}
"""Cells along an edge of the grids of anchors, and anchors a cell."""
_CLEAR = 0.7
"""Score of the short range above which the full range is not asked: faces that fill the photo of a
head score 0.79 to 0.96 on ten captures, what is no face up to 0.9."""
_LARGEST_LOGIT = 80.0


@dataclass(frozen=True, eq=False)
class Detection:
    """A face in one orientation of a photo."""

    score: float
    quarter_turns: int
    """Clockwise turns of the photo in which it was found."""
    centre: Float64Array
    """(2,) pixels of the photo as it is."""
    size: float
    """Longer side of its box, pixels."""
    eyes: Float64Array
    """(2, 2) the subject's right and left eye, pixels of the photo as it is."""

    def crop(self) -> Crop:
        """Return the crop for the mesh network."""
        across = self.eyes[1] - self.eyes[0]
        angle = float(np.arctan2(across[1], across[0]))
        return Crop((float(self.centre[0]), float(self.centre[1])), MARGIN * self.size, angle)


def detect(
    image: UInt8Array, turns: Iterable[int], least: float, nets: NetProcess
) -> list[Detection]:
    """Return the best face of each orientation and network, those of `least` score, best first."""
    found = _detect(image, turns, SHORT_RANGE, nets)
    if max(detection.score for detection in found) < _CLEAR:
        found += _detect(image, turns, FULL_RANGE, nets)
    kept = [detection for detection in found if detection.score >= least]
    return sorted(kept, key=lambda detection: (-detection.score, detection.quarter_turns))


def _detect(
    image: UInt8Array, turns: Iterable[int], name: str, nets: NetProcess
) -> list[Detection]:
    """Return the best face of each orientation by one network."""
    path = find_model(name)
    if path is None:
        raise FileNotFoundError(name)
    turns = list(turns)
    square = _squared(image, _EDGES[name])
    boxes, scores = nets.run(path, np.stack([np.rot90(square, -turn) for turn in turns]))
    logits = scores.reshape(len(turns), -1).clip(-_LARGEST_LOGIT, _LARGEST_LOGIT)
    best = logits.argmax(axis=1)
    anchors = _anchors(name)
    return [
        _detection(image, turn, boxes[i, k] / _EDGES[name], anchors[k], float(logits[i, k]))
        for i, (turn, k) in enumerate(zip(turns, best, strict=True))
    ]


def _detection(
    image: UInt8Array, turn: int, box: Float32Array, anchor: Float64Array, logit: float
) -> Detection:
    """Return an anchor's box, centre, sides and points (16,) in the photo; 1 is the square."""
    height, width = image.shape[:2]
    side = max(height, width)
    points = np.concatenate([box[None, :2], box[4:].reshape(-1, 2)]).astype(np.float64)
    x, y = (points + anchor - 0.5).T
    for _ in range(turn):
        x, y = y, -x
    places = np.stack([x, y], axis=1) * side + [width / 2, height / 2]
    return Detection(
        1 / (1 + np.exp(-logit)), turn, places[0], side * float(box[2:4].max()), places[1:3]
    )


def _squared(image: UInt8Array, edge: int) -> Float32Array:
    """Return the photo in the middle of a black square, (edge, edge, 3) in -1..1."""
    height, width = image.shape[:2]
    side = max(height, width)
    above, left = (side - height) // 2, (side - width) // 2
    padded = cv2.copyMakeBorder(
        image, above, side - height - above, left, side - width - left, cv2.BORDER_CONSTANT
    )
    small = cv2.resize(padded, (edge, edge), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32) * np.float32(2 / 255) - 1


def _anchors(name: str) -> Float64Array:
    """Return the middles (A, 2) of a network's anchors in the square, in the network's order."""
    grids = []
    for cells, repeats in _GRIDS[name]:
        middles = (np.arange(cells) + 0.5) / cells
        y, x = np.meshgrid(middles, middles, indexing="ij")
        grids.append(np.repeat(np.stack([x.ravel(), y.ravel()], axis=1), repeats, axis=0))
    return np.concatenate(grids)
