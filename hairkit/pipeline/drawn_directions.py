"""Directions of drawn guides against those that the photos show."""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.cameras.depth_raster import HEAD_TOLERANCE, head_depth, point_depth
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap, angle_between

HEIGHT = 240
"""Height in pixels at which guides and maps are compared."""
DIRECTION_LIMIT = np.radians(20.0)
"""Angle in the picture up to which a piece of a guide runs as photographed."""
PIECES, GUIDE_RADIUS, EDGE = 39, 0.003, 3
"""Pieces of a guide, the radius in metres within which it hides others, and the pixels that are
taken off the hair: its edge has the direction of the outline."""


def compare_directions(
    groom: Groom, camera: Camera, mask: Mask, found: OrientationMap
) -> tuple[float, float]:
    """Return two lengths in pixels of one view: of guides that run as photographed, and of all.

    Counted are pieces that no other guide and no head hides, over hair away from its edge, where
    the map is surer than its median. They run as photographed within `DIRECTION_LIMIT`.
    """
    small = camera.resized(round(HEIGHT * camera.width / camera.height), HEIGHT)
    size = (small.width, small.height)
    hair, angle, sure = (
        np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_NEAREST))
        for picture in (mask.hair.astype(np.uint8), found.angle, found.confidence)
    )
    inner = cv2.erode(hair, np.ones((EDGE, EDGE), np.uint8)) > 0
    judged = inner & (sure >= (np.median(sure[inner]) if inner.any() else np.inf))
    points = groom.strands.resampled(PIECES + 1).points.reshape(-1, PIECES + 1, 3)
    surface = point_depth(small, groom.strands.resampled(4 * PIECES).points, GUIDE_RADIUS)
    surface = np.minimum(surface, head_depth(groom.head, small)) + np.float32(HEAD_TOLERANCE)
    start, end = (small.project(p).reshape(-1, 2) for p in (points[:, :-1], points[:, 1:]))
    column, row = np.nan_to_num(np.floor((start + end) / 2), nan=-1).astype(int).T
    inside = (column >= 0) & (row >= 0) & (column < size[0]) & (row < size[1])
    at = row * inside, column * inside
    depth = small.depth((points[:, :-1] + points[:, 1:]) / 2).ravel()
    seen = inside & judged[at] & (depth <= surface[at])
    way = (end - start)[seen]
    gap = angle_between(np.arctan2(way[:, 1], way[:, 0]), angle[at][seen])
    length = np.linalg.norm(way, axis=1)
    return float(length[gap <= DIRECTION_LIMIT].sum()), float(length.sum())


def share_of(part: float, whole: float) -> float:
    """Return a share; 1 of nothing."""
    return part / whole if whole else 1.0
