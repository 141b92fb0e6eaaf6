"""Compiled projection of points, shared by carving, fusion and depth maps."""

from __future__ import annotations

from typing import NamedTuple

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled
from hairkit.types.camera import Camera

Vector = tuple[float, float, float]

NEAREST_DEPTH = 1e-6
"""Points less far in front of a perspective camera, metres, count as behind it."""
BEHIND_PIXEL = -1e9
"""Both pixel coordinates of points behind a perspective camera: outside every picture."""


class PackedCamera(NamedTuple):
    """A `Camera` as plain numbers, which compiled functions take and keep in registers."""

    right: Vector
    """First row of the rotation from head to camera axes: the picture's +u in head axes, unit."""
    down: Vector
    """Second row: the picture's +v."""
    forward: Vector
    """Third row: the optical axis."""
    translation: Vector
    """Camera coordinates of the head's origin, metres."""
    position: Vector
    """The camera in the head frame, metres."""
    focal: float
    """Pixels; pixels per metre of an orthographic camera."""
    centre_u: float
    """Column of the principal point, pixels."""
    centre_v: float
    """Row of the principal point, pixels."""
    height: int
    """Rows of the picture, pixels."""
    orthographic: bool


def pack_camera(camera: Camera) -> PackedCamera:
    """Return the camera's numbers for compiled functions."""
    right, down, forward = camera.rotation
    return PackedCamera(
        _vector(right),
        _vector(down),
        _vector(forward),
        _vector(camera.translation),
        _vector(camera.position),
        float(camera.focal),
        float(camera.centre[0]),
        float(camera.centre[1]),
        int(camera.height),
        camera.model == "orthographic",
    )


def _vector(values: Float64Array) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


@compiled
def project(camera: PackedCamera, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return pixel u, v and axial depth of a head-frame point; depth <= 0 means behind the camera.

    `Camera.project` and `Camera.depth` are its twins.
    """
    right, down, forward, shift = camera.right, camera.down, camera.forward, camera.translation
    cx = right[0] * x + right[1] * y + right[2] * z + shift[0]
    cy = down[0] * x + down[1] * y + down[2] * z + shift[1]
    cz = forward[0] * x + forward[1] * y + forward[2] * z + shift[2]
    if camera.orthographic:
        return camera.focal * cx + camera.centre_u, camera.focal * cy + camera.centre_v, cz
    if cz <= NEAREST_DEPTH:
        return BEHIND_PIXEL, BEHIND_PIXEL, cz
    return camera.focal * cx / cz + camera.centre_u, camera.focal * cy / cz + camera.centre_v, cz


@compiled
def perspective_divisor(camera: PackedCamera, depth: float) -> float:
    """Return what lengths across the view are divided by at an axial depth: 1 if orthographic."""
    return 1.0 if camera.orthographic else depth
