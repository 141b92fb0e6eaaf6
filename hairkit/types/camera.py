"""Pinhole and orthographic cameras in the head frame, OpenCV axes (docs/conventions.md)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, frozen_array
from hairkit.errors import DataError, InputError
from hairkit.storage import Stored

CameraModel = Literal["perspective", "orthographic"]


@dataclass(frozen=True, eq=False)
class Camera(Stored):
    """A camera that sees the head: +x right, +y down, +z forward.

    Pixel (0, 0) is the outer corner of the first pixel.

    Perspective: `u = focal x / z + centre_x`; orthographic: `u = focal x + centre_x`.
    """

    camera_from_head: Float64Array
    """(4, 4) rigid transform, metres."""
    focal: float
    """Perspective: focal length in pixels; orthographic: pixels per metre."""
    centre: Float64Array
    """(2,) principal point (x, y) in pixels."""
    width: int
    """Image width in pixels."""
    height: int
    """Image height in pixels."""
    model: CameraModel = "perspective"

    def __post_init__(self) -> None:
        matrix = frozen_array(self.camera_from_head, np.float64, (4, 4), "camera_from_head")
        rotation = matrix[:3, :3]
        if (
            not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
            or np.linalg.det(rotation) < 0
        ):
            raise DataError(
                "camera_from_head is not a rigid transform (its 3x3 part is no rotation)"
            )
        if self.model not in get_args(CameraModel):
            raise DataError(
                f"camera model is {self.model!r}, expected one of {get_args(CameraModel)}"
            )
        if not (np.isfinite(self.focal) and self.focal > 0 and self.width > 0 and self.height > 0):
            raise DataError(
                f"camera needs focal, width and height above 0, got"
                f" {self.focal}, {self.width}, {self.height}"
            )
        object.__setattr__(self, "camera_from_head", matrix)
        object.__setattr__(self, "centre", frozen_array(self.centre, np.float64, (2,), "centre"))

    @property
    def rotation(self) -> Float64Array:
        """(3, 3) rotation part of `camera_from_head`."""
        return self.camera_from_head[:3, :3]

    @property
    def translation(self) -> Float64Array:
        """(3,) translation part of `camera_from_head`, metres."""
        return self.camera_from_head[:3, 3]

    @property
    def position(self) -> Float64Array:
        """(3,) camera centre in the head frame (for an orthographic camera a point on its axis)."""
        return np.asarray(-self.rotation.T @ self.translation)

    @property
    def forward(self) -> Float64Array:
        """(3,) unit optical axis in the head frame, away from the camera."""
        return np.asarray(self.rotation[2])

    @property
    def azimuth_deg(self) -> float:
        """Azimuth of the camera seen from the head: 0 in front, positive to the subject's left."""
        x, _, z = -self.forward
        return float(np.degrees(np.arctan2(x, z)))

    @property
    def elevation_deg(self) -> float:
        """Elevation of the camera seen from the head, positive above."""
        return float(np.degrees(np.arcsin(np.clip(-self.forward[1], -1, 1))))

    @property
    def pixels_per_metre(self) -> float:
        """Size in pixels of a metre across at the head frame's origin."""
        if self.model == "orthographic":
            return self.focal
        return self.focal / max(float(self.translation[2]), 1e-9)

    def to_camera(self, points: npt.ArrayLike) -> Float64Array:
        """Transform head-frame points (..., 3) to camera coordinates (..., 3), metres."""
        return np.asarray(points, np.float64) @ self.rotation.T + self.translation

    def project(self, points: npt.ArrayLike) -> Float64Array:
        """Project head-frame points (..., 3) to pixels (..., 2).

        Points behind a perspective camera give NaN.

        >>> camera = Camera.on_turn(0.0, distance=1.0, focal=1000.0, width=800, height=600)
        >>> camera.project([0.1, 0.0, 0.0]).tolist()  # the subject's left is on the image's right
        [500.0, 300.0]
        """
        local = self.to_camera(points)
        if self.model == "orthographic":
            return self.focal * local[..., :2] + self.centre
        depth = np.where(local[..., 2:] > 1e-9, local[..., 2:], np.nan)
        return np.asarray(self.focal * local[..., :2] / depth + self.centre)

    def depth(self, points: npt.ArrayLike) -> Float64Array:
        """Distance of points (..., 3) along the optical axis, (...,), metres."""
        result: Float64Array = (
            np.asarray(points, np.float64) @ self.rotation[2] + self.translation[2]
        )
        return result

    def unproject(self, pixels: npt.ArrayLike, depth: npt.ArrayLike) -> Float64Array:
        """Return head-frame points (..., 3) at `pixels` (..., 2) and axial `depth` (...,)."""
        xy = (np.asarray(pixels, np.float64) - self.centre) / self.focal
        z = np.asarray(depth, np.float64)[..., None]
        local = np.concatenate([xy * z if self.model == "perspective" else xy + 0 * z, z], axis=-1)
        return np.asarray((local - self.translation) @ self.rotation)

    def rays(self, pixels: npt.ArrayLike) -> tuple[Float64Array, Float64Array]:
        """Return origins and unit directions, both (..., 3), of rays through `pixels` (..., 2)."""
        near = self.unproject(pixels, np.zeros(np.shape(pixels)[:-1]))
        far = self.unproject(pixels, np.ones(np.shape(pixels)[:-1]))
        return near, (far - near) / np.linalg.norm(far - near, axis=-1, keepdims=True)

    def view_direction(self, points: npt.ArrayLike) -> Float64Array:
        """Return the unit direction (..., 3) from the camera to each point (..., 3), head frame."""
        if self.model == "orthographic":
            return np.broadcast_to(self.forward, np.shape(points)).copy()
        toward = np.asarray(points, np.float64) - self.position
        return np.asarray(toward / np.linalg.norm(toward, axis=-1, keepdims=True))

    def resized(self, width: int, height: int) -> Camera:
        """Return the same camera for its picture scaled to `width` x `height` px (equal aspect)."""
        scale = width / self.width
        size = np.array([width / self.width, height / self.height])
        return replace(
            self, focal=self.focal * scale, centre=self.centre * size, width=width, height=height
        )

    def fitted(self, width: int, height: int) -> Camera:
        """Return the camera for a picture of another aspect, in which the whole photo is shown."""
        scale = min(width / self.width, height / self.height)
        spare = np.array([width - self.width * scale, height - self.height * scale]) / 2
        centre = self.centre * scale + spare
        return replace(self, focal=self.focal * scale, centre=centre, width=width, height=height)

    def mirrored(self) -> Camera:
        """Return the camera that sees what is mirrored at the plane x = 0 in the mirrored picture.

        >>> camera = Camera.on_turn(0.5, distance=1.0, focal=1000.0, width=800, height=600)
        >>> x, y = camera.project([0.1, 0.05, 0.0])
        >>> bool(np.allclose(camera.mirrored().project([-0.1, 0.05, 0.0]), [800 - x, y]))
        True
        """
        flip = np.diag([-1.0, 1.0, 1.0, 1.0])
        centre = np.array([self.width - self.centre[0], self.centre[1]])
        return replace(self, camera_from_head=flip @ self.camera_from_head @ flip, centre=centre)

    def on_photo(self, frame: Sequence[int], size: tuple[int, int]) -> Camera:
        """Return the camera of a whole photo of `size` whose part `frame` this one's picture is.

        `frame` is the left, top, right and bottom edge of the part, pixels of the photo.
        """
        left, top, right, bottom = frame
        part = self.resized(right - left, bottom - top)
        centre = part.centre + np.array([left, top])
        return replace(part, centre=centre, width=size[0], height=size[1])

    def to_json(self, name: str) -> dict[str, Any]:
        """Return the camera in the form of `truth.json`: R, t, fx, fy, cx, cy or scale_px_per_m."""
        pose = {
            "R": self.rotation.tolist(),
            "t": self.translation.tolist(),
            "position": self.position.tolist(),
        }
        size = {
            "width": self.width,
            "height": self.height,
            "cx": self.centre[0],
            "cy": self.centre[1],
        }
        focal = (
            {"fx": self.focal, "fy": self.focal}
            if self.model == "perspective"
            else {"scale_px_per_m": self.focal}
        )
        angles = {"azimuth": self.azimuth_deg, "elevation": self.elevation_deg}
        return {"name": name, **pose, **size, "model": self.model, **focal, **angles}

    @classmethod
    def from_json(cls, entry: dict[str, Any]) -> Camera:
        """Read one view of a `truth.json` or `scene.json`; `InputError` where a key is missing."""
        try:
            matrix = np.eye(4)
            matrix[:3, :3] = entry["R"]
            matrix[:3, 3] = entry["t"]
            model = entry.get("model", "perspective")
            focal = entry["fx"] if model == "perspective" else entry["scale_px_per_m"]
            centre = np.array([entry["cx"], entry["cy"]], np.float64)
            return cls(
                matrix, float(focal), centre, int(entry["width"]), int(entry["height"]), model
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"not a camera: {error}") from error

    @classmethod
    def on_turn(
        cls,
        azimuth_deg: float,
        *,
        elevation_deg: float = 0.0,
        roll_deg: float = 0.0,
        distance: float = 1.0,
        target: npt.ArrayLike = (0.0, 0.0, 0.0),
        focal: float,
        width: int,
        height: int,
        centre: npt.ArrayLike | None = None,
        model: CameraModel = "perspective",
    ) -> Camera:
        """Return the camera at (azimuth, elevation) that looks at `target` from `distance` metres.

        `roll_deg` turns the camera about its axis; positive turns the picture's content clockwise.
        """
        azimuth, elevation, roll = np.radians([azimuth_deg, elevation_deg, roll_deg])
        back = np.array(
            [
                np.sin(azimuth) * np.cos(elevation),
                np.sin(elevation),
                np.cos(azimuth) * np.cos(elevation),
            ]
        )
        right = np.array([np.cos(azimuth), 0.0, -np.sin(azimuth)])
        down = -np.cross(back, right)
        turned_right = np.cos(roll) * right - np.sin(roll) * down
        turned_down = np.sin(roll) * right + np.cos(roll) * down
        matrix = np.eye(4)
        matrix[:3, :3] = [turned_right, turned_down, -back]
        matrix[:3, 3] = -matrix[:3, :3] @ (np.asarray(target, np.float64) + distance * back)
        middle = (
            np.array([width / 2, height / 2]) if centre is None else np.asarray(centre, np.float64)
        )
        return cls(matrix, focal, middle, width, height, model)
