"""The one similarity that brings a prediction into the truth's frame, and what cameras then lack.

Photos fix no absolute scale or frame. The similarity is the one with which the true cameras see the
predicted points where the predicted cameras saw them; the true strands have no part in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float32Array, Float64Array
from hairkit.cameras.similarity import Similarity
from hairkit.errors import InputError
from hairkit.types.camera import Camera
from hairkit.types.strands import Strands

ALIGNMENT_POINTS = 2000
"""Maximum number of strand points, and of head points, that the similarity is fitted to."""
_SCALES = (0.1, 0.1, 0.1, 0.1, 0.01, 0.01, 0.01)
"""Usual size of log scale, rotation vector (radians) and shift (metres), for the solver's steps."""
_LOST_PX = 1e4
"""Residual of a point that a camera cannot see because it lies behind it."""


@dataclass(frozen=True, eq=False)
class Alignment(Similarity):
    """The similarity from the prediction's frame to the truth's, metres."""

    residual_px: float = 0.0
    """Root mean square distance between the pictures of the fitted points, true pixels."""

    def moved_strands(self, strands: Strands) -> Strands:
        """Return strands in the truth's frame, widths scaled too."""
        widths = None if strands.widths is None else strands.widths * np.float32(self.scale)
        return replace(strands, points=self.apply(strands.points).astype(np.float32), widths=widths)


@dataclass(frozen=True)
class CameraError:
    """Difference between one aligned camera and the true one."""

    name: str
    azimuth_deg: float
    """Predicted minus true azimuth, in (-180, 180]."""
    elevation_deg: float
    rotation_deg: float
    """Angle of the rotation between the two cameras."""
    position_m: float
    """Distance of the camera centres; where one is orthographic, of the two axes at the hair."""
    reprojection_px: float
    """Root mean square distance between the pictures of the fitted points."""


def align(
    predicted: Sequence[Camera], true: Sequence[Camera], points: npt.NDArray[np.float32]
) -> Alignment:
    """Return the similarity whose true pictures of `points` lie nearest to the predicted ones.

    Least squares of pixel distances over all views and points (N, 3), seven unknowns, begun at the
    identity and, for perspective cameras, at the similarity between the camera centres.

    Raises `InputError` when the views do not pair up.
    """
    if len(predicted) != len(true):
        raise InputError(
            f"the prediction has {len(predicted)} cameras, the truth {len(true)}: "
            "views must pair up"
        )
    sized = [_like(mine, other) for mine, other in zip(predicted, true, strict=True)]
    middle = points.mean(axis=0, dtype=np.float64)
    wanted = [camera.project(points) for camera in sized]
    best: Alignment | None = None
    for start in _starts(sized, true, middle):
        found = _fit(start, true, wanted, points, middle)
        if best is None or found.residual_px < best.residual_px:
            best = found
    assert best is not None
    return best


def alignment_points(strands: Strands, head_vertices: npt.ArrayLike | None = None) -> Float32Array:
    """Return a fixed sample (N, 3) of the predicted strand points and head vertices."""
    chosen = [_spread(strands.points)]
    if head_vertices is not None:
        chosen.append(_spread(np.asarray(head_vertices, np.float32)))
    return np.concatenate(chosen)


def camera_errors(
    names: Sequence[str],
    predicted: Sequence[Camera],
    true: Sequence[Camera],
    similarity: Alignment,
    points: npt.NDArray[np.float32],
) -> tuple[CameraError, ...]:
    """Return the error of each view's camera after alignment; `points` as given to `align`."""
    errors = []
    moved = similarity.apply(points)
    middle = moved.mean(axis=0, dtype=np.float64)
    for name, mine, other in zip(names, predicted, true, strict=True):
        aligned = similarity.moved_camera(_like(mine, other))
        turn = (aligned.azimuth_deg - other.azimuth_deg + 180.0) % 360.0 - 180.0
        rotation = Rotation.from_matrix(aligned.rotation @ other.rotation.T).magnitude()
        offset = aligned.position - other.position
        if "orthographic" in (aligned.model, other.model):
            offset = _on_axis(aligned, middle) - _on_axis(other, middle)
        gap = aligned.project(moved) - other.project(moved)
        error = CameraError(
            name=name,
            azimuth_deg=float(turn),
            elevation_deg=float(aligned.elevation_deg - other.elevation_deg),
            rotation_deg=float(np.degrees(rotation)),
            position_m=float(np.linalg.norm(offset)),
            reprojection_px=_root_mean_square(gap),
        )
        errors.append(error)
    return tuple(errors)


def _on_axis(camera: Camera, point: Float64Array) -> Float64Array:
    """Return the point (3,) of the optical axis beside `point`."""
    return camera.position + camera.forward * camera.depth(point)


def _like(camera: Camera, other: Camera) -> Camera:
    """Bring a camera of a working picture to the size of the true picture."""
    if (camera.width, camera.height) == (other.width, other.height):
        return camera
    return camera.resized(other.width, other.height)


def _spread(points: npt.NDArray[np.float32]) -> Float32Array:
    count = min(len(points), ALIGNMENT_POINTS)
    index = np.linspace(0, len(points) - 1, count).astype(np.int64)
    return points[index]


def _starts(
    predicted: Sequence[Camera], true: Sequence[Camera], middle: Float64Array
) -> list[Float64Array]:
    """Return the identity and, where camera centres mean something, the fit between them."""
    starts = [np.zeros(7)]
    if len(true) >= 3 and all(c.model == "perspective" for c in (*predicted, *true)):
        mine = np.array([camera.position for camera in predicted])
        other = np.array([camera.position for camera in true])
        a, b = mine - mine.mean(axis=0), other - other.mean(axis=0)
        turn, _ = Rotation.align_vectors(b, a)
        scale = np.sqrt((b**2).sum() / max((a**2).sum(), 1e-20))
        shift = scale * turn.apply(middle - mine.mean(axis=0)) + other.mean(axis=0) - middle
        starts.append(np.concatenate([[np.log(scale)], turn.as_rotvec(), shift]))
    return starts


def _fit(
    start: Float64Array,
    true: Sequence[Camera],
    wanted: Sequence[Float64Array],
    points: npt.NDArray[np.float32],
    middle: Float64Array,
) -> Alignment:
    """Solve for log scale, rotation vector and shift about `middle`, where they are independent."""
    centred = points.astype(np.float64) - middle

    def residuals(unknowns: Float64Array) -> Float64Array:
        moved = np.exp(unknowns[0]) * Rotation.from_rotvec(unknowns[1:4]).apply(centred)
        moved += middle + unknowns[4:]
        gaps = [c.project(moved) - w for c, w in zip(true, wanted, strict=True)]
        return np.nan_to_num(np.concatenate(gaps).ravel(), nan=_LOST_PX)

    solution = least_squares(residuals, start, method="lm", x_scale=_SCALES)
    scale = float(np.exp(solution.x[0]))
    rotation = Rotation.from_rotvec(solution.x[1:4]).as_matrix()
    translation = middle + solution.x[4:] - scale * rotation @ middle
    return Alignment(scale, rotation, translation, _root_mean_square(solution.fun.reshape(-1, 2)))


def _root_mean_square(gap: Float64Array) -> float:
    return float(np.sqrt(np.nanmean((gap**2).sum(axis=-1))))
