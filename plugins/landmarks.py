"""Cameras fixed at the nominal turntable angles; only the head's pose is fitted, to landmarks.

Landmarks of two or more views are intersected in space by least squares, with cameras exactly on
the nominal turn (orthographic as in the thesis, or perspective); a weighted similarity (Umeyama
1991) brings the head's landmarks to them; the cameras are then expressed in the head's frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit import Capture, Head, Mask, Scene, hookimpl
from hairkit.cameras.similarity import fit_similarity, triangulate
from hairkit.cameras.turntable import NominalOptions, nominal_cameras
from hairkit.errors import InputError
from hairkit.options import option
from hairkit.types.head import JAW_LANDMARKS, LANDMARKS


@dataclass(frozen=True)
class Options(NominalOptions):
    """Settings of the landmark pose."""

    model: str = option(
        "orthographic", choices=("orthographic", "perspective"), doc="Kind of the nominal cameras."
    )
    jaw_weight: float = option(
        0.25, low=0, high=1, doc="Weight of the 17 jaw points; others have 1."
    )


@hookimpl
def estimate_scene(
    capture: Capture, masks: tuple[Mask, ...], head: Head, options: Options
) -> Scene:
    """Return the nominal turn in the frame of the head, which landmarks place in it."""
    seen = [i for i, view in enumerate(capture.views) if view.landmarks is not None]
    if len(seen) < 2:
        raise InputError(
            f"landmarks are known in {len(seen)} views, the plugin 'landmarks' needs 2"
            " or more; add landmarks.json or use the plugin 'silhouette'"
        )
    if head.landmark_vertices is None:
        raise InputError(
            "the head has no landmark_vertices for the plugin 'landmarks'; use the plugin 'manual'"
        )
    pixels = np.stack([np.asarray(capture.views[i].landmarks) for i in seen])
    cameras = nominal_cameras(capture, options)
    weights = np.where(np.arange(LANDMARKS) < JAW_LANDMARKS, options.jaw_weight, 1.0)
    points = triangulate([cameras[i] for i in seen], pixels)
    to_head = fit_similarity(head.vertices[head.landmark_vertices], points, weights).inverse()
    fitted = tuple(to_head.moved_camera(camera) for camera in cameras)
    gap = np.stack([fitted[i].project(to_head.apply(points)) for i in seen]) - pixels
    residual = float(np.sqrt(np.mean(np.sum(gap**2, axis=-1))))
    return Scene(tuple(view.name for view in capture.views), fitted, head, residual)
