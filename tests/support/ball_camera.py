"""A camera around the ball of `hairkit.testing`, for laws of projection and depth."""

from __future__ import annotations

from hairkit.types.camera import Camera, CameraModel


def camera_at(azimuth: float, elevation: float, model: CameraModel, height: int = 120) -> Camera:
    """Return a camera that holds a ball of 0.1 m in a square picture of that height."""
    distance = 0.8 if model == "perspective" else 1.0
    return Camera.on_turn(
        azimuth,
        elevation_deg=elevation,
        roll_deg=7.0,
        distance=distance,
        target=(0.01, -0.02, 0.0),
        focal=height * 3.0 * distance,
        width=height,
        height=height,
        model=model,
    )
