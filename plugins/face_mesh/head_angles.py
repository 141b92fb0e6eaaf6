"""Yaw, pitch and roll of a head from its landmarks in space."""

from __future__ import annotations

from functools import cache

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.cameras.similarity import fit_similarity
from hairkit.head_model.template import default_head
from hairkit.types.head import JAW_LANDMARKS

OVERSHOOT = 0.0023
"""Share of the yaw that the mesh turns too far, for each degree of yaw: near faces are turned
towards perspective cameras, which the network does not know. Measured by
`benchmarks/face_landmarks.py` on rendered heads."""


def measure_angles(points: Float64Array) -> tuple[float, float, float]:
    """Return yaw, pitch and roll in degrees of landmarks (68, 3) in an upright photo.

    Yaw is the camera's azimuth (positive on the subject's left), pitch its elevation; a positive
    roll is clockwise in the photo. The landmarks without the jaw are turned on to those of the
    default head; x is right, y down, z away from the camera.
    """
    seen = fit_similarity(_average(), points[JAW_LANDMARKS:]).rotation
    towards, up = -seen[2], seen[:, 1]
    yaw = np.degrees(np.arctan2(towards[0], towards[2]))
    pitch = np.degrees(np.arcsin(np.clip(towards[1], -1, 1)))
    roll = np.degrees(np.arctan2(up[0], -up[1]))
    return float(yaw * (1 - OVERSHOOT * abs(yaw))), float(pitch), float(roll)


@cache
def _average() -> Float64Array:
    """Return the landmarks of the default head without the jaw, (51, 3) metres."""
    head = default_head()
    marked = np.asarray(head.landmark_vertices)
    return np.asarray(head.vertices[marked[JAW_LANDMARKS:]], np.float64)
