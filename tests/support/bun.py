"""A bun of hair on a ball of a head and eight cameras around it, with exact orientation maps."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.types.camera import Camera, CameraModel
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.volume import Hull, VoxelGrid, symmetric_matrices

RADIUS = 0.06
CENTRE = np.array([0.0, 0.16, 0.0])
"""A bun of hair on top of the head; it is round, so that every camera sees half of it."""
SPACING = 0.008
ALONG = np.array([0.5, -0.75, 0.433])


def turn(model: CameraModel = "perspective") -> tuple[Camera, ...]:
    """Eight cameras around the bun, on two levels."""
    return tuple(
        Camera.on_turn(
            45.0 * i,
            elevation_deg=12.0 * (i % 2),
            distance=0.6,
            target=CENTRE,
            focal=540.0 if model == "perspective" else 900.0,
            width=120,
            height=120,
            model=model,
        )
        for i in range(8)
    )


def bun(spacing: float = SPACING) -> Hull:
    """The bun in a grid that is symmetric about the vertical axis; cells in metres."""
    low, high = CENTRE - 0.08, CENTRE + 0.08
    low[1] -= 0.04
    grid = VoxelGrid.around(low, high, spacing)
    centres = grid.centres().astype(np.float64)
    distance = np.linalg.norm(centres, axis=-1) - 0.1
    hair = (np.linalg.norm(centres - CENTRE, axis=-1) < RADIUS) & (distance > 0)
    return Hull(grid, hair, hair, distance.astype(np.float32))


def seen(camera: Camera, along: Float64Array = ALONG) -> OrientationMap:
    """The exact image angle of strands along `along`, which depends on the pixel alone."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    dx, dy, dz = camera.rotation @ along
    if camera.model == "perspective":
        dx = dx - dz * (x - camera.centre[0]) / camera.focal
        dy = dy - dz * (y - camera.centre[1]) / camera.focal
    angle = wrap_angle(np.arctan2(dy, dx) + 0 * x)
    return OrientationMap(angle, np.ones(x.shape, np.float32))


def all_hair(camera: Camera) -> Mask:
    """A picture full of hair: which cell is seen is the hull's affair."""
    return Mask(np.full((camera.height, camera.width), HAIR, np.uint8), True)


def off_deg(directions: Float64Array, along: Float64Array = ALONG) -> Float64Array:
    """Angles in degrees between undirected directions and one known."""
    length = np.linalg.norm(directions, axis=-1) * np.linalg.norm(along)
    cosine = np.abs(directions @ along) / length
    return np.degrees(np.arccos(np.clip(cosine, 0, 1)))


def depth_in_bun(hull: Hull) -> Float64Array:
    return np.asarray(RADIUS - np.linalg.norm(hull.grid.centres() - CENTRE, axis=-1))


def main_directions(tensors: Float32Array) -> Float64Array:
    """The eigenvectors (N, 3) of the largest eigenvalues of tensors (N, 6)."""
    vectors: Float64Array = np.linalg.eigh(symmetric_matrices(tensors))[1][:, :, 2]
    return vectors
