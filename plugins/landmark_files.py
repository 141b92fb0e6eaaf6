"""Landmarks that come with the photos, and the direction of the head that they tell.

The direction is that of the camera which sees the landmarks of the template head best
(perspective-n-point: Terzakis and Lourakis, "A consistently fast and globally optimal solution to
the perspective-n-point problem", 2020). The jaw is left out: annotators trace its outline. A
file does not say how sure its points are; options of the stage `scene` do.
"""

from __future__ import annotations

import cv2
import numpy as np

from hairkit import View, hookimpl
from hairkit.arrays import Float64Array
from hairkit.cameras.turntable import view_angles
from hairkit.head_model.template import default_head
from hairkit.types.face import Face
from hairkit.types.head import JAW_LANDMARKS

USUAL_LENS_MM = 42.0
"""Full-frame focal length where the photo does not tell, as the plugin `manual` has it."""


@hookimpl
def detect_landmarks(view: View) -> Face | None:
    """Return the given landmarks as a certain face, None when the view has none."""
    if view.landmarks is None:
        return None
    unknown = np.zeros(len(view.landmarks))
    azimuth, elevation, roll = np.degrees(_direction(view, view.landmarks))
    return Face(1.0, view.landmarks, unknown, azimuth, elevation, roll)


def _direction(view: View, landmarks: Float64Array) -> Float64Array:
    """Return azimuth, elevation and roll (3,) of the camera, radians."""
    head = default_head()
    assert head.landmark_vertices is not None  # the template has all of them
    places = head.vertices[head.landmark_vertices].astype(np.float64)[JAW_LANDMARKS:]
    focal, (right, down) = view.focal_or(USUAL_LENS_MM), view.centre
    lens = np.array([[focal, 0, right], [0, focal, down], [0, 0, 1]])
    _, rotation, _ = cv2.solvePnP(
        places, landmarks[JAW_LANDMARKS:], lens, None, flags=cv2.SOLVEPNP_SQPNP
    )
    return view_angles(cv2.Rodrigues(rotation)[0].astype(np.float64))
