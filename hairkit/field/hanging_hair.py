"""The fields of tight curls, whose photos show no direction: their axes hang down along the head.

Curls leave the skin upright, run away from the crown and turn down with the head's surface. Below
the head's middle nothing but gravity is left. The tighter coils of type 4 hair carry themselves:
they stand off the head until the outline ends them, and sag with length. Strands are wound about
these axes afterwards.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, across, unit_vectors
from hairkit.field.growth_prior import WHORL_BEHIND
from hairkit.types.head import Head
from hairkit.types.volume import Hull, OrientationField, ScalpDistance, symmetric_matrices

AWAY = 0.4
"""Part of the direction away from the whorl, against 1 straight down: 0.7 leaves F at 4 mm within 1
of it on curls."""
LIFT, STANDS_OFF = 1.0, 0.05
"""Outward part of the direction at the skin, against 1 along the head, and the distance from the
head in metres at which it has fallen to 0: with 0.03 m F at 4 mm falls from 79 to 74 on curls,
without it to 32."""
SAG = 0.06
"""Least way from the scalp in metres on which coils sag as much as they stand. On a head with coils
of 15 cm along their axes F at 4 mm is 68, and their length right; halved or doubled 66."""
STIFFER, SEEN_STIFFER = (1, 2, 4, 8), 3
"""Times `SAG` of coils that carry themselves better, and by how much photos show them better than
the strands are on the whole: what is seen lies on top."""
SAMPLED = 8
"""Every so many cells are compared with the photos."""


def hang_curls(head: Head, hull: Hull, growth: Float32Array) -> OrientationField:
    """Return the signed field of the curls' axes; `growth` is the field's potential."""
    at = hull.grid.centres_of(hull.loose)
    return _field(hull, growth, hanging_axes(head, at, hull.head_distance[hull.loose]))


def stand_coils(
    hull: Hull,
    way: ScalpDistance,
    growth: Float32Array,
    tensor: Float32Array,
    certainty: Float32Array,
) -> OrientationField:
    """Return the signed field of the axes of coils; `growth` is the field's potential.

    They run away from the head's middle, and sag in proportion to the `way` from the scalp: as much
    as leaves least of what photos show along them. `tensor` (N, 6) and `certainty` (N,) are the
    directions that photos show in the loose cells; of steep coils they lie across the axes.
    """
    outward = unit_vectors(hull.grid.centres_of(hull.loose)).astype(np.float64)
    drop = way.values[hull.loose, None] * [0.0, 1.0, 0.0]
    some = slice(None, None, SAMPLED)
    tensors = certainty[some, None, None] * symmetric_matrices(tensor[some])

    def along(times: float) -> float:
        axes = unit_vectors(outward[some] - drop[some] / (SEEN_STIFFER * times * SAG))
        return float(np.einsum("ni,nij,nj->", axes, tensors, axes, optimize=True))

    return _field(hull, growth, outward - drop / (min(STIFFER, key=along) * SAG))


def _field(hull: Hull, growth: Float32Array, axes: Float64Array) -> OrientationField:
    """Return the field of axes (N, 3) in the loose cells."""
    direction = np.zeros((*hull.grid.shape, 3), np.float32)
    direction[hull.loose] = unit_vectors(axes)
    confidence = hull.loose.astype(np.float32)
    return OrientationField(hull.grid, None, confidence, growth, direction)


def hanging_axes(head: Head, points: Float32Array, height: Float32Array) -> Float64Array:
    """Return unit axes (N, 3), root to tip, at points (N, 3) that are `height` (N,) off the head.

    The head counts as a ball above its middle and as a column below: its own normals would turn
    hair inward under chin and neck.
    """
    at = np.asarray(points, np.float64)
    outward = unit_vectors(at * [1, 0, 1] + np.maximum(at, 0) * [0, 1, 0])
    top = head.vertices[np.argmax(head.vertices[:, 1])].astype(np.float64)
    away = unit_vectors((at - top + [0, 0, WHORL_BEHIND]) * [1, 0, 1])
    along = AWAY * away + [0.0, -1.0, 0.0]
    along = unit_vectors(across(outward, along))
    lift = LIFT * np.clip(1 - height.astype(np.float64) / STANDS_OFF, 0, 1)
    return unit_vectors(along + lift[:, None] * outward)
