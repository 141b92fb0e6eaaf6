"""Similarity transforms between point sets, and triangulation of points seen by cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, frozen_array
from hairkit.errors import InputError
from hairkit.types.camera import Camera
from hairkit.types.scene import Scene

MIN_LANDMARKS = 3
HOLD = 0.01
"""Weight of the start of a point, of one for each ray."""
COLLINEAR = 1e-3
"""Points whose second spread is below this share of the first lie on a line."""


@dataclass(frozen=True, eq=False)
class Similarity:
    """A similarity `x -> scale * rotation @ x + translation`."""

    scale: float
    rotation: Float64Array
    """(3, 3)."""
    translation: Float64Array
    """(3,)."""

    @classmethod
    def of(cls, matrix: Float64Array) -> Similarity:
        """Return the similarity of a matrix (4, 4)."""
        scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
        return cls(scale, matrix[:3, :3] / scale, matrix[:3, 3])

    def apply(self, points: npt.ArrayLike) -> Float64Array:
        """Return the moved points (..., 3)."""
        return self.scale * (np.asarray(points, np.float64) @ self.rotation.T) + self.translation

    def inverse(self) -> Similarity:
        """Return the similarity that undoes this one."""
        scale, rotation = 1.0 / self.scale, self.rotation.T
        return Similarity(scale, rotation, -scale * rotation @ self.translation)

    def moved_camera(self, camera: Camera) -> Camera:
        """Return the camera that sees `apply(x)` where `camera` sees `x`.

        The world grows by `scale`; so does the distance, while an orthographic camera's pixels per
        metre shrink.
        """
        matrix = np.eye(4)
        matrix[:3, :3] = camera.rotation @ self.rotation.T
        matrix[:3, 3] = self.scale * camera.translation - matrix[:3, :3] @ self.translation
        orthographic = camera.model == "orthographic"
        focal = camera.focal / self.scale if orthographic else camera.focal
        return Camera(matrix, focal, camera.centre, camera.width, camera.height, camera.model)


def move_head(scene: Scene, matrix: Float64Array) -> Scene:
    """Return the scene whose head was moved by a similarity (4, 4), in the frame of that head."""
    back = Similarity.of(matrix).inverse()
    cameras = tuple(back.moved_camera(camera) for camera in scene.cameras)
    points = None if scene.points is None else back.apply(scene.points).astype(np.float32)
    return replace(scene, cameras=cameras, points=points)


def fit_similarity(
    source: npt.ArrayLike, target: npt.ArrayLike, weights: npt.ArrayLike | None = None
) -> Similarity:
    """Return the similarity from `source` (N, 3) to `target` (N, 3) of least weighted squares.

    Umeyama, "Least-squares estimation of transformation parameters between two point patterns"
    (1991), with weights. Raises `InputError` for fewer than three points, points on one line, or
    numbers that are not finite.
    """
    first = frozen_array(source, np.float64, (None, 3), "points to fit")
    second = frozen_array(target, np.float64, (len(first), 3), "points to fit to")
    raw = np.ones(len(first)) if weights is None else np.asarray(weights, np.float64)
    if np.count_nonzero(raw > 0) < MIN_LANDMARKS:
        raise InputError(
            f"a similarity needs at least {MIN_LANDMARKS} points, got {np.count_nonzero(raw > 0)};"
            " give more landmarks"
        )
    weight = (raw / raw.sum())[:, None]
    mean_first, mean_second = (weight * first).sum(0), (weight * second).sum(0)
    centred_first, centred_second = first - mean_first, second - mean_second
    for points in (centred_first, centred_second):
        _check_spread(points * np.sqrt(weight))
    u, stretch, vt = np.linalg.svd((weight * centred_second).T @ centred_first)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u) * np.linalg.det(vt))])
    rotation = (u * sign) @ vt
    scale = float((stretch * sign).sum() / (weight * centred_first**2).sum())
    return Similarity(scale, rotation, mean_second - scale * rotation @ mean_first)


def _check_spread(centred: Float64Array) -> None:
    spread = np.linalg.svd(centred, compute_uv=False)
    if spread[1] <= COLLINEAR * max(spread[0], 1e-300):
        raise InputError(
            "the landmarks lie on one line and fix no pose; give at least three that do not"
        )


def triangulate(
    cameras: Sequence[Camera],
    pixels: npt.ArrayLike,
    weights: npt.ArrayLike | None = None,
    start: npt.ArrayLike | None = None,
) -> Float64Array:
    """Return the points (N, 3) nearest to the rays through `pixels` (V, N, 2) of all views.

    `weights` (V, N) is 0 where a view does not know the point. A point that fewer than two views
    know is NaN; with `start` (N, 3) it moves from there only as far as its ray, if any, asks for.
    """
    seen = np.asarray(pixels, np.float64)
    weight = np.ones(seen.shape[:2]) if weights is None else np.asarray(weights, np.float64)
    hold, first = (0.0, 0.0) if start is None else (HOLD, np.asarray(start, np.float64))
    normal = np.zeros((seen.shape[1], 3, 3)) + hold * np.eye(3)
    right = np.zeros((seen.shape[1], 3)) + hold * first
    for camera, view_pixels, view_weight in zip(cameras, seen, weight, strict=True):
        origin, direction = camera.rays(np.where(view_weight[:, None] > 0, view_pixels, 0.0))
        across = np.eye(3) - direction[:, :, None] * direction[:, None, :]
        across *= view_weight[:, None, None]
        normal += across
        right += np.einsum("nij,nj->ni", across, origin)
    points = np.full((seen.shape[1], 3), np.nan)
    known = (np.count_nonzero(weight > 0, axis=0) >= 2) | (hold > 0)
    if known.any():
        points[known] = np.linalg.solve(normal[known], right[known][..., None])[..., 0]
    return points
