"""Whether a tail is braided: how its hair crosses its spine in the pictures.

Strands of a plain tail run along it, those of a braid cross it to both sides at one angle.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap

ACROSS = np.array([(u, v) for u in (-0.6, 0.0, 0.6) for v in (-0.6, 0.0, 0.6)])
"""Places in a section, in its half diameters, at which the pictures are read."""
PROBE = 0.002
"""Metres of the step along the spine whose picture is its angle."""


def measure_crossing(
    spine: Float64Array,
    spokes: Float64Array,
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    cameras: Sequence[Camera],
    head: Head,
) -> float:
    """Return the mean angle between the hair of a tail and its spine, radians, 0 to pi / 2.

    The tail is given by its spine (M, 3) and spokes (M, 2, 3). The angle is that whose double has
    the measured mean cosine, weighted by the confidence of the maps; 0 where no view shows hair.
    """
    tangent = np.gradient(spine, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    places = (spine[:, None] + np.einsum("ps,msk->mpk", ACROSS, spokes)).reshape(-1, 3)
    along = np.repeat(tangent, len(ACROSS), axis=0)
    total, weights = 0.0, 0.0
    for mask, found, camera in zip(masks, orientations, cameras, strict=True):
        column, row = np.floor(camera.project(places)).astype(np.int64).T
        height, width = mask.labels.shape
        inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
        pixel = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
        seen = inside & mask.hair[pixel]
        seen &= camera.depth(places) < head_depth(head, camera)[pixel]
        step = camera.project(places + PROBE * along) - camera.project(places)
        off = found.angle[pixel].astype(np.float64) - np.arctan2(step[:, 1], step[:, 0])
        weight = np.where(seen, found.confidence[pixel], 0.0)
        total += float((weight * np.cos(2 * off)).sum())
        weights += float(weight.sum())
    return 0.5 * float(np.arccos(np.clip(total / weights, -1, 1))) if weights else 0.0
