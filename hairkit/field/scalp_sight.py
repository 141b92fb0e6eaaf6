"""Directions of the hair on the scalp, as all views see them.

The 2D orientation of a view is laid on the surface of the hair, so that the views can be compared
with models of how hair grows: towards one place, away from a parting, forward or back.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int64Array
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap

LEAST_FACING = 0.35
"""Cosine between a normal and the ray to the camera below which a view does not see the place."""
HAIR_HEIGHT = 0.008
"""Metres above the scalp at which a view sees the hair."""
NEAR_TIE = 0.03
"""Metres around a tie in which directions do not count: the bundle hides the hair there."""
CANDIDATES = 400
"""Places on the scalp at which convergence is measured, 8 mm apart."""
PROBE = 0.002
"""Metres of the step whose picture gives a direction's angle in a view."""


class ScalpSight(NamedTuple):
    """Directions of hair on the scalp, seen at N places by all views."""

    places: Float64Array
    """(N, 3) metres."""
    normals: Float64Array
    """(N, 3) unit normals."""
    directions: Float64Array
    """(N, 3) unit tangents, undirected."""
    weight: Float64Array
    """(N,) confidence times the cosine to the ray."""

    def at(self, chosen: BoolArray) -> ScalpSight:
        """Return the chosen (N,) places."""
        return ScalpSight(*(column[chosen] for column in self))

    def agreement(self, tangents: Float64Array) -> float:
        """Return the mean cosine of twice the angle to tangents (N, 3): 1 agrees, -1 is across."""
        cosine = np.einsum("ij,ij->i", tangents, self.directions)
        total = max(float(self.weight.sum()), 1e-9)
        return float((self.weight * (2 * cosine**2 - 1)).sum() / total)


def see_scalp(
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    cameras: Sequence[Camera],
    head: Head,
) -> ScalpSight:
    """Return the 2D orientations of all views, laid on the surface of the hair on the scalp."""
    places, normals = scalp_places(head)
    seen = []
    for mask, found, camera in zip(masks, orientations, cameras, strict=True):
        facing, row, column = look_at(mask, camera, places, normals, LEAST_FACING)
        chosen = (facing > 0) & mask.hair[row, column]
        pixel = row[chosen], column[chosen]
        directions = _lay_on_surface(
            camera, places[chosen], normals[chosen], found.angle[pixel].astype(np.float64)
        )
        weight = found.confidence[pixel] * facing[chosen]
        seen.append(ScalpSight(places[chosen], normals[chosen], directions, weight))
    return ScalpSight(*(np.concatenate(column) for column in zip(*seen, strict=True)))


def look_at(
    mask: Mask, camera: Camera, places: Float64Array, normals: Float64Array, least: float
) -> tuple[Float64Array, Int64Array, Int64Array]:
    """Return how places (N, 3) face a view, and rows and columns (N,) of their pixels.

    A place faces the view by the cosine between its normal and the ray to the camera; 0 where that
    is not above `least` or the place lies outside of the picture.
    """
    facing = -np.einsum("ij,ij->i", camera.view_direction(places), normals)
    column, row = np.floor(camera.project(places)).astype(np.int64).T
    height, width = mask.labels.shape
    inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    weight = np.where(inside & (facing > least), facing, 0.0)
    return weight, np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)


def scalp_places(head: Head) -> tuple[Float64Array, Float64Array]:
    """Return places (N, 3) `HAIR_HEIGHT` above the scalp and its normals (N, 3)."""
    on_scalp = head.scalp > 0.5
    normals = head.normals()[on_scalp].astype(np.float64)
    return head.vertices[on_scalp] + HAIR_HEIGHT * normals, normals


def _lay_on_surface(
    camera: Camera, places: Float64Array, normals: Float64Array, angle: Float64Array
) -> Float64Array:
    """Return unit tangents (N, 3) of the surface whose pictures have the angles (N,)."""
    first = np.cross(normals, [0.0, 1.0, 1e-3])
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
    second = np.cross(normals, first)
    here = camera.project(places)
    picture = np.stack([camera.project(places + PROBE * e) - here for e in (first, second)], axis=2)
    wanted = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    # the adjugate serves as well as the inverse: lengths do not count
    a = picture[:, 1, 1] * wanted[:, 0] - picture[:, 0, 1] * wanted[:, 1]
    b = picture[:, 0, 0] * wanted[:, 1] - picture[:, 1, 0] * wanted[:, 0]
    tangent = a[:, None] * first + b[:, None] * second
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.asarray(tangent / np.maximum(length, 1e-12))


def find_convergence(sight: ScalpSight, head: Head) -> tuple[Float64Array, float]:
    """Return the place (3,) on the scalp at which hair points best, and how well it does.

    The second is the mean cosine of twice the angle between the hair and the way to the place:
    1 where all hair points there, 0 in the mean of all places.
    """
    places, _ = scalp_places(head)
    candidates = places[:: -(-len(places) // CANDIDATES)]
    scores = np.array([_convergence(sight, at) for at in candidates])
    best = int(np.argmax(scores))
    return candidates[best], float(scores[best])


def _convergence(sight: ScalpSight, at: Float64Array) -> float:
    """Return the mean cosine of twice the angle between hair and the way to a place (3,)."""
    way = at - sight.places
    distance = np.linalg.norm(way, axis=1)
    way -= np.einsum("ij,ij->i", way, sight.normals)[:, None] * sight.normals
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    weight = np.where(distance > NEAR_TIE, sight.weight, 0.0)
    cosine = np.einsum("ij,ij->i", way, sight.directions)
    return float((weight * (2 * cosine**2 - 1)).sum() / max(float(weight.sum()), 1e-9))
