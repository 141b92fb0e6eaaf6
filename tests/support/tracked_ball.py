"""Made-up fields around a ball of a head, for the laws of the certainty tracker."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hairkit_plugins.certainty_tracker import Options, track

from hairkit.arrays import BoolArray, Float64Array
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.testing import scalp_roots, turn_scene
from hairkit.types.head import Roots
from hairkit.types.parting import Parting
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.volume import Hull, OrientationField, VoxelGrid, outer_products
from hairkit.types.waves import Waves

BALL = 0.1
SPACING = 0.01
GRID = VoxelGrid.around(np.full(3, -0.27), np.full(3, 0.27), SPACING)
CENTRES = GRID.centres().astype(np.float64)
DISTANCE = np.linalg.norm(CENTRES, axis=-1) - BALL
UP = np.array([0.0, 1.0, 0.0])
FREE = Options(waves=False, slide_sine=0.0, u_share=1.0, smoothing=0, max_length=0.13)
"""Nothing but the walk through the field."""


def roots_where(keep: Callable[[Float64Array], BoolArray]) -> Roots:
    """Roots of the ball's scalp whose normals pass."""
    roots = scalp_roots(turn_scene().head)
    picked = keep(roots.normals.astype(np.float64))
    return Roots(
        roots.positions[picked] * (BALL / np.linalg.norm(roots.positions[picked], axis=1))[:, None],
        roots.normals[picked],
        roots.uv[picked],
        roots.triangle[picked],
        roots.barycentric[picked],
    )


def with_normals(normals: Float64Array) -> Roots:
    """Roots on the ball with these normals."""
    count = len(normals)
    weights = np.full((count, 3), 1 / 3, np.float32)
    uv, triangle = np.zeros((count, 2), np.float32), np.zeros(count, np.int32)
    return Roots((BALL * normals).astype(np.float32), normals, uv, triangle, weights)


def filled(hair: BoolArray | None = None) -> Hull:
    """Hair everywhere outside of the head, or where it is told."""
    outside = DISTANCE > -SPACING
    return Hull(
        GRID, outside if hair is None else hair & outside, outside, DISTANCE.astype(np.float32)
    )


def field_along(directions: Float64Array, growth: Float64Array) -> OrientationField:
    """The field of unit directions (3,) or (X, Y, Z, 3), and its growth (X, Y, Z)."""
    everywhere = np.broadcast_to(directions, CENTRES.shape)
    tensor = outer_products(everywhere).astype(np.float32)
    sure = np.ones(GRID.shape, np.float32)
    return OrientationField(GRID, tensor, sure, growth.astype(np.float32))


def constant(direction: Float64Array) -> OrientationField:
    """One direction everywhere, in which hair also grows."""
    unit = direction / np.linalg.norm(direction)
    return field_along(unit, CENTRES @ unit)


def run(
    field: OrientationField, hull: Hull, roots: Roots, options: Options, waves: Waves | None = None
) -> Strands:
    """Track; straight hair unless waves are given."""
    scene = turn_scene()
    distance = measure_scalp_distance(scene.head, hull)
    return track(
        scene, hull, field, roots, waves or Waves(), distance, Parting(), TiedHair(), options
    )


def polylines(strands: Strands) -> Float64Array:
    """Points (S, M, 3) of strands with equal counts."""
    return strands.points.astype(np.float64).reshape(len(strands), -1, 3)


def crown(normals: Float64Array) -> BoolArray:
    return np.asarray(normals[:, 1] > 0.93)
