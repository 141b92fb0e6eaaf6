"""What lies under the mouse: the nearest guide, and the lock of hair that is grabbed with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.simulation.simulator import Grab
from hairkit.types.camera import Camera
from hairkit.types.head import Head

REACH = 14.0
"""Pixels from the mouse within which a guide is picked."""
LOCK = 0.02
"""Strands this near to the grabbed point come along, metres."""


@dataclass(frozen=True, eq=False)
class Hold:
    """A lock of hair in the user's hand."""

    points: Int64Array
    """(N,) numbers of the held points."""
    offsets: Float64Array
    """(N, 3) from the hand to each."""
    hand: Float64Array
    """(3,) world, metres."""
    depth: float
    """Of the hand, along the camera's axis, metres."""

    def moved(self, camera: Camera, pixel: npt.ArrayLike) -> Hold:
        """Return the lock with the hand under another pixel (2,), as deep as before."""
        hand = camera.unproject(pixel, np.float64(self.depth))
        return Hold(self.points, self.offsets, hand, self.depth)

    def grabs(self) -> tuple[Grab, ...]:
        """Return where the simulator shall pull."""
        targets = (self.hand + self.offsets).tolist()
        return tuple(
            Grab(int(point), (x, y, z))
            for point, (x, y, z) in zip(self.points, targets, strict=True)
        )


def nearest_point(camera: Camera, points: Float32Array, pixel: npt.ArrayLike) -> int | None:
    """Return the number of the front-most of the points (P, 3) at a pixel (2,), None for none."""
    gap = np.linalg.norm(camera.project(points) - np.asarray(pixel, np.float64), axis=1)
    near = np.flatnonzero(np.nan_to_num(gap, nan=np.inf) < REACH)
    if not len(near):
        return None
    # a pixel aside counts as a millimetre behind, so that the front wins over the exact
    cost = camera.depth(points[near]) + 1e-3 * gap[near]
    return int(near[np.argmin(cost)])


def grab_lock(
    camera: Camera,
    points: Float32Array,
    offsets: Int64Array,
    pixel: npt.ArrayLike,
) -> Hold | None:
    """Return the lock around the guide point at a pixel, one point a strand, None for none.

    Roots stay: they are never held.
    """
    picked = nearest_point(camera, points, pixel)
    if picked is None:
        return None
    distance = np.linalg.norm(points - points[picked], axis=1)
    distance[offsets[:-1]] = np.inf
    distance[offsets[:-1] + 1] = np.inf
    nearest = np.minimum.reduceat(distance, offsets[:-1])
    owner = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    held = np.flatnonzero((distance == nearest[owner]) & (distance < LOCK))
    _, first = np.unique(owner[held], return_index=True)
    held = held[first]
    if not len(held):
        return None
    hand = points[picked].astype(np.float64)
    depth = float(camera.depth(hand))
    return Hold(held, points[held] - hand, hand, depth)


def surface_point(camera: Camera, head: Head, pixel: npt.ArrayLike) -> Float64Array | None:
    """Return the front-most vertex (3,) of the head near a pixel, None for none."""
    picked = nearest_point(camera, head.vertices, pixel)
    return None if picked is None else head.vertices[picked].astype(np.float64)
