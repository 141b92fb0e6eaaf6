"""The parameters of a turn of cameras around the head.

`Turn` maps a short vector to the cameras of a turn around the head: what all views share (the
rig's tilt and place, magnification, perspective) and how each one deviates from its nominal place.
Refinement methods solve for that vector.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float64Array
from hairkit.options import option
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture

SHARED, PER_VIEW, ELEVATION = 8, 6, 1
"""Numbers of a turn that all views share, numbers of each view, and its elevation among them."""
CENTRE, LOG_MAGNIFICATION, PERSPECTIVE = slice(3, 6), 6, 7
"""Indices in the shared numbers: the turn's centre, log(pixels per metre there), 1 / distance."""
ONE_SHAPE = 0.03
"""Photos are of one shape if the logarithms of long over short sides differ by no more."""
MIN_PERSPECTIVE = 0.01
"""Cameras are at most 1 / this away, metres: there pictures are orthographic to 0.1 pixels."""


@dataclass(frozen=True)
class NominalOptions:
    """Settings of cameras at the turn's nominal places; plugins inherit them."""

    model: str = option(
        "perspective", choices=("orthographic", "perspective"), doc="Kind of the nominal cameras."
    )
    focal_equivalent: float = option(
        42.0, low=10, high=1000, unit="mm", doc="Without EXIF or capture.toml, full frame."
    )
    distance: float = option(
        0.7, low=0.1, high=20, doc="From the cameras to the turn's centre.", unit="m"
    )


@dataclass(frozen=True, eq=False)
class Turn:
    """The cameras of a turn around the head as functions of a vector of numbers.

    The vector has `SHARED + PER_VIEW * V` numbers.

    Shared: rotation vector of the head in the rig (3, radians), the turn's centre in the head
    frame (3, metres), log of the pixels per metre there, and 1 / distance (0 is orthographic). Per
    view: azimuth, elevation and roll off the nominal place (radians), log of the distance over the
    shared one, shift right and down (metres).
    """

    azimuths: Float64Array
    """(V,) nominal azimuths, radians."""
    sizes: npt.NDArray[np.int64]
    """(V, 2) width and height in pixels."""
    focal_ratios: Float64Array
    """(V,) focal length of each view over the first one's."""
    elevations: Float64Array
    """(V,) nominal elevations, radians."""
    centres: Float64Array
    """(V, 2) principal points, pixels."""
    aims: Float64Array
    """(V, 2) pixels that cameras are turned to: azimuth, elevation and shift are those of cameras
    whose axes go through these, as if the lens had been there."""

    @classmethod
    def of(cls, capture: Capture) -> Turn:
        """Return the nominal turn of a capture, with focal lengths by EXIF, size or shape.

        Without EXIF, photos of one shape are enlarged or reduced ones of a lens, and photos of
        several shapes are cropped: their pixels are of one size.
        """
        sizes = np.array([(view.width, view.height) for view in capture.views])
        photos = np.array([view.photo_size for view in capture.views])
        shape = photos.max(1) / photos.min(1)
        cropped = np.ptp(np.log(shape)) > ONE_SHAPE
        lens = np.ones(len(photos)) if cropped else np.hypot(*photos.T)
        focal = lens / [view.scale for view in capture.views]
        known = [view.focal_px for view in capture.views if view.focal_px is not None]
        if len(known) == len(sizes):
            focal = np.array(known, np.float64)
        azimuths = np.radians([view.azimuth_deg for view in capture.views])
        elevations = np.radians([view.elevation_deg for view in capture.views])
        centres = np.array([view.centre for view in capture.views])
        aims = np.array([view.aim for view in capture.views])
        return cls(azimuths, sizes, focal / focal[0], elevations, centres, aims)

    @property
    def size(self) -> int:
        """Length of the vector."""
        return SHARED + PER_VIEW * len(self.azimuths)

    @property
    def axes(self) -> Float64Array:
        """(V, 3, 3) nominal rotations of cameras turned to `aims`."""
        return _view_rotations(self.azimuths, self.elevations, np.zeros(len(self.azimuths)))

    def unpack(self, vector: Float64Array) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Return rotations (..., V, 3, 3), translations (..., V, 3) and focal lengths (..., V).

        Focal lengths are in pixels; of vectors (..., size).
        """
        shared = vector[..., :SHARED]
        views = vector[..., SHARED:].reshape(*vector.shape[:-1], -1, PER_VIEW)
        far = 1.0 / np.maximum(shared[..., PERSPECTIVE, None], MIN_PERSPECTIVE)
        tilt = Rotation.from_rotvec(shared[..., :3].reshape(-1, 3)).as_matrix()
        rotation = _view_rotations(
            self.azimuths + views[..., 0], self.elevations + views[..., 1], views[..., 2]
        ) @ tilt.reshape(*vector.shape[:-1], 1, 3, 3)
        aim = np.stack([views[..., 4], views[..., 5], far * np.exp(views[..., 3])], axis=-1)
        translation = aim - (rotation @ shared[..., None, CENTRE, None])[..., 0]
        focal = np.exp(shared[..., LOG_MAGNIFICATION, None]) * far * self.focal_ratios
        aside = self._aside(focal)
        return aside @ rotation, (aside @ translation[..., None])[..., 0], focal

    def _aside(self, focal: Float64Array) -> Float64Array:
        """Return rotations (..., V, 3, 3) from cameras turned to `aims`; focal lengths (..., V)."""
        offset = (self.aims - self.centres) / focal[..., None]
        ray = np.concatenate([offset, np.ones_like(offset[..., :1])], axis=-1)
        x, y, z = np.moveaxis(ray / np.linalg.norm(ray, axis=-1, keepdims=True), -1, 0)
        rows = [
            [1 - x * x / (1 + z), -x * y / (1 + z), x],
            [-x * y / (1 + z), 1 - y * y / (1 + z), y],
            [-x, -y, z],
        ]
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    def tangents(self, vector: Float64Array) -> Float64Array:
        """Return (V, 7, size): how camera motions follow the vector's numbers.

        Rows: small rotation w and move t of camera coordinates, `dx = w x x + t`, then log of the
        focal length. Differences: no two views share a number of their own, so that all views
        move at once.
        """
        step, views = 1e-6, len(self.azimuths)
        moves = np.zeros((SHARED + PER_VIEW, self.size))
        moves[:SHARED, :SHARED] = step * np.eye(SHARED)
        moves[SHARED:, SHARED:] = np.tile(step * np.eye(PER_VIEW), views)
        rotation, translation, focal = self.unpack(vector)
        turned, shifted, zoomed = self.unpack(vector + moves)
        spin = (turned - rotation) @ rotation.transpose(0, 2, 1)
        w = np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)
        move = shifted - translation - np.cross(w, translation)
        motions = np.concatenate([w, move, np.log(zoomed / focal)[..., None]], axis=-1) / step
        result = np.zeros((views, motions.shape[-1], self.size))
        result[:, :, :SHARED] = motions[:SHARED].transpose(1, 2, 0)
        own = np.arange(views)
        places = SHARED + PER_VIEW * own[:, None] + np.arange(PER_VIEW)
        result[own[:, None], :, places] = motions[SHARED:].transpose(1, 0, 2)
        return result

    def nominal(self, magnification: float, perspective: float) -> tuple[Camera, ...]:
        """Return level cameras on the nominal turn about the origin.

        `magnification` is in pixels per metre there, `perspective` is 1 / distance.
        """
        vector = np.zeros(self.size)
        vector[LOG_MAGNIFICATION], vector[PERSPECTIVE] = np.log(magnification), perspective
        return self.cameras(vector)

    def cameras(self, vector: Float64Array) -> tuple[Camera, ...]:
        """Return the cameras of a vector; `MIN_PERSPECTIVE` and less gives orthographic ones."""
        rotation, translation, focal = self.unpack(vector)
        flat = float(vector[PERSPECTIVE]) <= MIN_PERSPECTIVE
        cameras = []
        each = zip(rotation, translation, focal, self.sizes, self.centres, strict=True)
        for r, t, f, (width, height), centre in each:
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = r, t
            if flat:
                cameras.append(
                    Camera(matrix, f / t[2], centre, int(width), int(height), "orthographic")
                )
            else:
                cameras.append(Camera(matrix, float(f), centre, int(width), int(height)))
        return tuple(cameras)

    def vector_of(self, cameras: Sequence[Camera]) -> Float64Array:
        """Return a vector that `cameras` turns into these, with the head not tilted in the turn.

        Views keep the focal ratios of the turn: what differs from them becomes distance.
        """
        rotation = np.stack([camera.rotation for camera in cameras])
        translation = np.stack([camera.translation for camera in cameras])
        focal = np.array([camera.focal for camera in cameras])
        flat = cameras[0].model == "orthographic"
        if flat:  # nearer views have more pixels a metre
            zoom = focal / self.focal_ratios
            translation[:, 2] = np.exp(np.log(zoom).mean()) / zoom / MIN_PERSPECTIVE
            focal = focal * translation[:, 2]
        aside = self._aside(focal).transpose(0, 2, 1)
        rotation, translation = aside @ rotation, (aside @ translation[..., None])[..., 0]
        across = rotation[:, :2].reshape(-1, 3)
        centre = np.linalg.lstsq(across, -translation[:, :2].ravel(), rcond=None)[0]
        offset = translation + rotation @ centre
        far = 1 / MIN_PERSPECTIVE if flat else np.exp(np.log(offset[:, 2]).mean())
        angles = np.array([view_angles(each) for each in rotation])
        angles -= np.stack([self.azimuths, self.elevations, 0 * self.azimuths], axis=1)
        angles[:, 0] = (angles[:, 0] + np.pi) % (2 * np.pi) - np.pi
        vector = np.zeros(self.size)
        vector[CENTRE], vector[PERSPECTIVE] = centre, 1 / far
        vector[LOG_MAGNIFICATION] = np.log(focal / self.focal_ratios / far).mean()
        views = [angles, np.log(offset[:, 2:] / far), offset[:, :2]]
        vector[SHARED:] = np.concatenate(views, axis=1).ravel()
        return vector


def view_angles(rotation: Float64Array) -> Float64Array:
    """Return azimuth, elevation and roll (3,) in radians of a camera's rotation (3, 3).

    The inverse of the per-view rotation of a `Turn`, for elevations below 90 degrees.
    """
    back = -rotation[2]
    azimuth = np.arctan2(back[0], back[2])
    elevation = np.arcsin(np.clip(back[1], -1, 1))
    level = _view_rotations(np.array([azimuth]), np.array([elevation]), np.zeros(1))[0]
    roll = np.arctan2(-rotation[0] @ level[1], rotation[0] @ level[0])
    return np.array([azimuth, elevation, roll])


def _view_rotations(
    azimuth: Float64Array, elevation: Float64Array, roll: Float64Array
) -> Float64Array:
    """Return (..., 3, 3), as `Camera.on_turn` sets its axes, of angles (...) in radians."""
    sin_a, cos_a = np.sin(azimuth), np.cos(azimuth)
    sin_e, cos_e = np.sin(elevation), np.cos(elevation)
    back = np.stack([sin_a * cos_e, sin_e, cos_a * cos_e], axis=-1)
    right = np.stack([cos_a, np.zeros_like(azimuth), -sin_a], axis=-1)
    down = np.stack([sin_a * sin_e, -cos_e, cos_a * sin_e], axis=-1)
    cosine, sine = np.cos(roll)[..., None], np.sin(roll)[..., None]
    return np.stack([cosine * right - sine * down, sine * right + cosine * down, -back], axis=-2)


def nominal_cameras(capture: Capture, options: NominalOptions) -> tuple[Camera, ...]:
    """Return the cameras of a capture's nominal turn, at the scale of the first photo's lens."""
    scale = capture.views[0].focal_or(options.focal_equivalent) / options.distance
    orthographic = options.model == "orthographic" or capture.orthographic
    perspective = 0.0 if orthographic else 1 / options.distance
    return Turn.of(capture).nominal(scale, perspective)
