"""A camera that orbits a target point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hairkit.types.camera import Camera

VERTICAL_ANGLE = np.radians(28.0)
"""Field of view of the shorter edge, radians."""
MARGIN = 1.12
"""Distance over the one at which the points just fit into the picture."""
NEAREST, FARTHEST = 0.05, 20.0
"""Limits of the distance from camera to target, metres."""
MAX_ELEVATION = 89.0
"""Degrees; the up direction is undefined at 90."""


@dataclass(frozen=True)
class OrbitView:
    """A view from (azimuth, elevation), in degrees, at `distance` metres from `target`, world."""

    azimuth: float = 20.0
    elevation: float = 5.0
    distance: float = 1.0
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def around(cls, points: npt.ArrayLike, aspect: float) -> OrbitView:
        """Return a view of all points (N, 3), whatever the azimuth; `aspect` is width by height."""
        cloud = np.asarray(points, np.float64)
        low, high = cloud.min(axis=0), cloud.max(axis=0)
        middle = (low + high) / 2
        radius = float(np.hypot(*(high - low)[[0, 2]])) / 2
        half = np.tan(VERTICAL_ANGLE / 2)
        aspect = max(aspect, 1.0)  # narrow pictures have this angle across
        up = (high[1] - low[1]) / 2 / half + radius
        across = radius / np.sin(np.arctan(half * aspect))
        x, y, z = middle.tolist()
        return cls(distance=float(MARGIN * max(up, across)), target=(x, y, z))

    def camera(self, width: int, height: int, free: int | None = None) -> Camera:
        """Return the camera for a picture of `width` x `height` pixels.

        The target is in the middle of its first `free` columns (None: of all), and the angle of
        view is that of the shorter edge, so that what was framed stays in view.
        """
        free = width if free is None else free
        return Camera.on_turn(
            self.azimuth,
            elevation_deg=self.elevation,
            distance=self.distance,
            target=self.target,
            focal=min(free, height) / 2 / float(np.tan(VERTICAL_ANGLE / 2)),
            width=width,
            height=height,
            centre=(free / 2, height / 2),
        )

    def orbited(self, right: float, up: float) -> OrbitView:
        """Return the view with the camera moved around the target, degrees to its right and up."""
        elevation = float(np.clip(self.elevation + up, -MAX_ELEVATION, MAX_ELEVATION))
        azimuth = (self.azimuth + right + 180.0) % 360.0 - 180.0
        return replace(self, azimuth=azimuth, elevation=elevation)

    def panned(self, right: float, down: float) -> OrbitView:
        """Return the view with the picture shifted by fractions of its height."""
        rotation = self.camera(1, 1).rotation
        whole = 2 * self.distance * np.tan(VERTICAL_ANGLE / 2)
        slid = np.array(self.target) - whole * (right * rotation[0] + down * rotation[1])
        x, y, z = slid.tolist()
        return replace(self, target=(x, y, z))

    def zoomed(self, factor: float) -> OrbitView:
        """Return the view at 1 / `factor` of the distance."""
        return replace(self, distance=float(np.clip(self.distance / factor, NEAREST, FARTHEST)))

    def centred(self, point: npt.ArrayLike) -> OrbitView:
        """Return the view with a point (3,) as its target, at the same distance."""
        x, y, z = np.asarray(point, np.float64).tolist()
        return replace(self, target=(x, y, z))
