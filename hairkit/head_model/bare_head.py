"""Where a photo shows parts of the head that bear no hair (face, ears, neck), and no clothes."""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from hairkit.arrays import Float32Array
from hairkit.cameras.depth_raster import HEAD_TOLERANCE, head_depth, mesh_depth
from hairkit.types.camera import Camera
from hairkit.types.head import Head

FULL, NONE = 0.015, 0.035
"""Metres off the drawn head up to which a pixel belongs to its nearest part, and from which to
none: the head is an average one, and beards stand off it."""
POSE_BLUR = 0.004
"""Gaussian in metres over which the border of the scalp is uncertain."""
UPPER = 0.7
"""Share of the scalp's height above which a head wears nothing."""
COVERED, BESIDE = 0.03, 0.06
"""Metres off that part up to which a pixel may show its hair, and from which it does not."""


def mark_bare_head(head: Head, camera: Camera) -> Float32Array:
    """Return (H, W) 1 where the camera sees face, ears or neck, 0 on scalp and far off the head.

    Pixels near the head's outline take the value of its nearest pixel: ears, glasses and a beard
    stick out of an average head, and so does the head of the person.
    """
    depth = head_depth(head, camera)
    bare = head.faces[(head.scalp[head.faces] < 0.5).all(axis=1)]
    first = mesh_depth(head.vertices, bare, camera) < depth + np.float32(HEAD_TOLERANCE)
    drawn = np.isfinite(depth)
    if not drawn.any():
        return np.zeros(depth.shape, np.float32)
    away, (row, column) = ndimage.distance_transform_edt(~drawn, return_indices=True)
    metre = camera.pixels_per_metre
    fade = np.clip((NONE - away / metre) / (NONE - FULL), 0, 1)
    marked = ((first & drawn)[row, column] * fade).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(marked, (0, 0), max(POSE_BLUR * metre, 1e-3)), np.float32)


def mark_upper_head(head: Head, camera: Camera) -> Float32Array:
    """Return (H, W) 1 where the camera sees the head above the brows or its hair, 0 far off it.

    Neither a beard nor clothes are there.
    """
    heights = head.vertices[head.scalp > 0.5, 1]
    upper = head.vertices[head.vertices[:, 1] > heights.min() + UPPER * np.ptp(heights)]
    outline = cv2.convexHull(camera.project(upper).astype(np.float32)).astype(np.int32)
    beside = np.ones((camera.height, camera.width), np.uint8)
    cv2.fillConvexPoly(beside, outline, 0)
    away = cv2.distanceTransform(beside, cv2.DIST_L2, cv2.DIST_MASK_5) / camera.pixels_per_metre
    return np.asarray(np.clip((BESIDE - away) / (BESIDE - COVERED), 0, 1), np.float32)
