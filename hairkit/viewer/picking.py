"""Picking: the guide under the mouse, and the lock of hair grabbed around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.simulation.simulator import Grab
from hairkit.types.camera import Camera
from hairkit.types.head import Head

PICK_RADIUS = 14.0
"""Largest distance from the mouse at which a guide is picked, pixels."""
LOCK_RADIUS = 0.02
"""Strands within this distance of the picked point belong to the lock, metres."""
DEPTH_PER_PIXEL = 1e-3
"""Metres of depth that a pixel of distance from the mouse counts for, so that the front wins."""
PARTS = 8
"""Parts of the segment between two points whose ends are looked at: guides have few points."""


@dataclass(frozen=True, eq=False)
class GrabbedLock:
    """A lock of hair that the user drags: one point on each of its strands."""

    points: Int64Array
    """(N,) indices of the grabbed points."""
    offsets: Float64Array
    """(N, 3) from the grab point to each of them, metres."""
    grab_point: Float64Array
    """(3,) world, metres."""
    depth: float
    """Axial depth of the grab point, metres."""

    def moved(self, camera: Camera, pixel: npt.ArrayLike) -> GrabbedLock:
        """Return the lock with the grab point at another pixel (2,), at the same depth."""
        grab_point = camera.unproject(pixel, np.float64(self.depth))
        return GrabbedLock(self.points, self.offsets, grab_point, self.depth)

    def grabs(self) -> tuple[Grab, ...]:
        """Return the grabs of the simulator: each point and its target."""
        targets = (self.grab_point + self.offsets).tolist()
        return tuple(
            Grab(int(point), (x, y, z))
            for point, (x, y, z) in zip(self.points, targets, strict=True)
        )


def nearest_point(camera: Camera, points: Float32Array, pixel: npt.ArrayLike) -> int | None:
    """Return the index of the front-most of the points (P, 3) at a pixel (2,), or None."""
    gap = np.linalg.norm(camera.project(points) - np.asarray(pixel, np.float64), axis=1)
    near = np.flatnonzero(np.nan_to_num(gap, nan=np.inf) < PICK_RADIUS)
    if not len(near):
        return None
    cost = camera.depth(points[near]) + DEPTH_PER_PIXEL * gap[near]
    return int(near[np.argmin(cost)])


def nearest_hair(
    camera: Camera, points: Float32Array, offsets: Int64Array, pixel: npt.ArrayLike
) -> tuple[int, Float32Array] | None:
    """Return the guide point that is nearest to what is seen at a pixel, and that place (3,)."""
    places, ends = _places_along(points, offsets)
    picked = nearest_point(camera, places, pixel)
    return None if picked is None else (int(ends[picked]), places[picked])


def grab_lock(
    camera: Camera, points: Float32Array, offsets: Int64Array, pixel: npt.ArrayLike
) -> GrabbedLock | None:
    """Return the lock around the place of a guide at a pixel; None if there is no hair.

    It has one point for each strand, never one of the first two, which the scalp holds.
    """
    places, ends = _places_along(points, offsets)
    picked = nearest_point(camera, places, pixel)
    if picked is None:
        return None
    grab_point = places[picked].astype(np.float64)
    distance = np.linalg.norm(places - places[picked], axis=1)
    fixed = np.zeros(len(points), bool)
    fixed[offsets[:-1]] = fixed[offsets[:-1] + 1] = True
    distance[fixed[ends]] = np.inf
    starts = (offsets[:-1] - np.arange(len(offsets) - 1)) * (PARTS + 1)
    nearest = np.minimum.reduceat(distance, starts)
    owner = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(places)))
    near = np.flatnonzero((distance == nearest[owner]) & (distance < LOCK_RADIUS))
    _, first = np.unique(owner[near], return_index=True)
    held = ends[near[first]]
    if not len(held):
        return None
    depth = float(camera.depth(grab_point))
    return GrabbedLock(held, points[held] - grab_point, grab_point, depth)


def _places_along(points: Float32Array, offsets: Int64Array) -> tuple[Float32Array, Int64Array]:
    """Return places (N, 3) along the segments of strands, and the nearer end (N,) of each."""
    first = np.delete(np.arange(len(points)), offsets[1:] - 1)
    share = np.linspace(0, 1, PARTS + 1, dtype=np.float32)
    way = points[first + 1] - points[first]
    places = points[first][:, None] + share[:, None] * way[:, None]
    ends = first[:, None] + (share >= 1 / 2)
    return places.reshape(-1, 3), ends.ravel()


def surface_point(camera: Camera, head: Head, pixel: npt.ArrayLike) -> Float64Array | None:
    """Return the front-most vertex (3,) of the head near a pixel; None if none is."""
    picked = nearest_point(camera, head.vertices, pixel)
    return None if picked is None else head.vertices[picked].astype(np.float64)
