"""Measures in the input views: drawn direction, silhouette, 2D orientation error, mask overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float64Array, UInt8Array
from hairkit.cameras.depth_raster import head_depth, point_depth
from hairkit.errors import InputError
from hairkit.evaluation.depth_map import Surface, first_surface
from hairkit.evaluation.scores import Samples
from hairkit.imaging.masked_filters import coherent_truth
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.orientation import OrientationMap, angle_between

DIRECTION_LIMIT_DEG = 20.0
"""A drawn strand is right when its direction is within this of the truth's."""
VISIBLE_DEPTH = 0.003
"""A drawn sample is visible at most this far behind the first surface, metres."""
DIRECTION_STEP = 1e-3
"""Metres along a strand's tangent over which its direction in the picture is taken."""
DRAWN_FOOTPRINT_PX = 9
"""Edge of the square a drawn sample hides: guides are few, and must hide those of the far side."""
HAIR_WIDTH = 0.0015
"""Width at which hair is drawn into silhouettes, metres."""
NECK_SLICE = 0.02
"""Height of the lowest part of a head's mesh whose middle is the neck's, metres."""
EDGE_PX = 4
"""The mask is eroded by this many pixels before orientation errors are taken."""
HIDDEN, RIGHT, WRONG = 0, 1, 2
"""Verdicts on a drawn sample; hidden also where the truth has no hair."""


@dataclass(frozen=True)
class OrientationError:
    """Error of a 2D orientation map over the true hair, its edge left out."""

    mean_deg: float
    """True where the truth is coherent, see `hairkit.imaging.masked_filters.coherent_truth`."""
    median_deg: float
    mean_everywhere_deg: float
    """Coherent or not."""
    confident_mean_deg: float
    """Over the half of the coherent pixels that the map is most confident of."""


@dataclass(frozen=True, eq=False)
class DrawnDirections:
    """Verdicts on the strands drawn into one view."""

    verdict: UInt8Array
    """(N,) per sample: hidden, right or wrong."""

    @property
    def right(self) -> int:
        """Number of visible samples within 20 degrees of the truth."""
        return int((self.verdict == RIGHT).sum())

    @property
    def drawn(self) -> int:
        """Number of visible samples over true hair."""
        return int((self.verdict != HIDDEN).sum())


def orientation_error(
    orientation: OrientationMap, truth: npt.NDArray[np.uint8], hair: npt.NDArray[np.bool_]
) -> OrientationError:
    """Compare a 2D orientation map with the true picture.

    Parameters
    ----------
    orientation : OrientationMap
        Of any size; it is brought to the truth's by its nearest pixels.
    truth : (H, W) uint8
        1..255 for angles in [0, pi) from +x towards +y, 0 where there is no hair.
    hair : (H, W) bool
        True hair mask; eroded by 4 pixels here.
    """
    if truth.shape != hair.shape:
        raise InputError(f"true orientation has shape {truth.shape}, the hair mask {hair.shape}")
    edge = np.ones((2 * EDGE_PX + 1, 2 * EDGE_PX + 1), np.uint8)
    inner = (cv2.erode(hair.astype(np.uint8), edge) > 0) & (truth > 0)
    coherent = inner & coherent_truth(truth_angle(truth).astype(np.float32), truth > 0)
    if not coherent.any():
        raise InputError("no pixel of true hair is left to take the orientation error over")
    error = orientation_gap(orientation, truth)
    confidence = _resize_like(orientation.confidence, truth)
    sure = coherent & (confidence >= np.median(confidence[coherent]))
    return OrientationError(
        mean_deg=float(error[coherent].mean()),
        median_deg=float(np.median(error[coherent])),
        mean_everywhere_deg=float(error[inner].mean()),
        confident_mean_deg=float(error[sure].mean()),
    )


def orientation_gap(
    orientation: OrientationMap, truth: npt.NDArray[np.uint8]
) -> npt.NDArray[np.float64]:
    """Return (H, W) degrees in [0, 90] between a map and the true picture, hair or not."""
    return np.degrees(angle_between(_resize_like(orientation.angle, truth), truth_angle(truth)))


def truth_angle(truth: npt.NDArray[np.uint8]) -> Float64Array:
    """Return (H, W) radians in [0, pi): the middle of the bin that each value 1..255 stands for."""
    return (truth.astype(np.float64) - 0.5) / 255 * np.pi


def mask_iou(first: npt.NDArray[np.bool_], second: npt.NDArray[np.bool_]) -> float:
    """Return intersection over union of two masks (H, W); the first may have another size."""
    resized = _resize_like(first.astype(np.uint8), second) > 0
    union = int((resized | second).sum())
    return int((resized & second).sum()) / union if union else 1.0


def hair_silhouette(
    camera: Camera, samples: Samples, head: Head, *, clothes: npt.NDArray[np.bool_] | None = None
) -> BoolArray:
    """Return (H, W) where hair drawn `HAIR_WIDTH` wide stands before the head.

    `clothes` (H, W) are pixels of the person. A truth has no mesh of the body below the neck; where
    a pixel of `clothes` misses the head, hair farther away than the neck's middle is hidden.
    """
    depth = point_depth(camera, samples.points, HAIR_WIDTH / 2)
    hidden = head_depth(head, camera)
    if clothes is not None:
        hidden = np.where(clothes, np.minimum(hidden, camera.depth(_neck(head))), hidden)
    return np.isfinite(depth) & (depth <= hidden)


def _neck(head: Head) -> Float64Array:
    """Return the middle (3,) of the lowest part of the head's mesh."""
    height = head.vertices[:, 1]
    lowest = head.vertices[height < height.min() + NECK_SLICE].astype(np.float64)
    return np.asarray(lowest.mean(axis=0))


def judge_drawn_directions(
    camera: Camera, samples: Samples, head: Head | None, truth: npt.NDArray[np.uint8]
) -> DrawnDirections:
    """Judge the visible samples of strands drawn into a view by the true orientation there.

    A sample is visible at most 3 mm behind the first surface of the strands themselves and `head`;
    it is judged where the truth has hair.
    """
    surface = first_surface(camera, samples.points, head, footprint=DRAWN_FOOTPRINT_PX)
    return judge_directions(surface, samples, truth)


def judge_directions(
    surface: Surface, samples: Samples, truth: npt.NDArray[np.uint8]
) -> DrawnDirections:
    """Judge samples against a true orientation picture of the surface's size."""
    camera = surface.camera
    if truth.shape != surface.depth.shape:
        raise InputError(
            f"true orientation has shape {truth.shape}, its camera {surface.depth.shape}"
        )
    verdict = np.full(len(samples.points), HIDDEN, np.uint8)
    seen = np.flatnonzero(surface.behind(samples.points) <= VISIBLE_DEPTH)
    points = samples.points[seen].astype(np.float64)
    start = camera.project(points)
    columns, rows = start.astype(np.int64).T
    way = camera.project(points + DIRECTION_STEP * samples.directions[seen]) - start
    gap = np.degrees(
        angle_between(np.arctan2(way[:, 1], way[:, 0]), truth_angle(truth[rows, columns]))
    )
    judged = np.where(gap <= DIRECTION_LIMIT_DEG, RIGHT, WRONG)
    verdict[seen] = np.where(truth[rows, columns] == 0, HIDDEN, judged)
    return DrawnDirections(verdict)


def direction_share(views: Sequence[DrawnDirections]) -> float:
    """Return the share of visible samples over all views whose direction is right."""
    drawn = sum(view.drawn for view in views)
    return sum(view.right for view in views) / drawn if drawn else 0.0


def _resize_like(
    image: npt.NDArray[Any], like: npt.NDArray[np.uint8] | npt.NDArray[np.bool_]
) -> npt.NDArray[Any]:
    if image.shape == like.shape:
        return image
    size = (like.shape[1], like.shape[0])
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_NEAREST_EXACT))
