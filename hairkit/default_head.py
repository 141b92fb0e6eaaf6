"""The default head: a procedural average adult, made wholly by code when it is asked for."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial import cKDTree

from hairkit.head import Capsules, Head
from hairkit.head_shape import head_surface, scalp_weight
from hairkit.stored import Float64Array, Int32Array

FREQUENCY = 32
"""Edges along a side of the icosahedron: 10 * 32^2 + 2 = 10,242 vertices."""
_FACE_DIRECTION = np.array([0.0, -0.45, 0.9])
_CROWDING = 0.45

# The iBUG landmarks of the right half in mm, head frame; the left half is its mirror image.
_JAW = [
    (-72, -35, 26), (-71, -56, 29), (-67, -75, 34), (-63, -93, 40), (-55, -113, 49),
    (-41, -129, 60), (-29, -135.5, 73), (-14, -138.5, 87), (0, -141, 89),
]  # fmt: skip
_BROW = [(-57, -20, 66), (-48, -12, 77), (-37, -9, 85), (-23, -9.5, 91), (-11, -12, 93)]
_NOSE_RIDGE = [(0, -34, 92), (0, -44.5, 100.5), (0, -55, 108), (0, -66, 115)]
_NOSE_BASE = [(-12, -81.5, 93), (-6, -81.5, 98.5), (0, -82, 100)]
_EYE = [(-43, -36, 71.5), (-37, -31.5, 78.5), (-27, -31, 80.5),
        (-18, -37.5, 77.5), (-26.5, -39.5, 79.5), (-37, -39.5, 77.5)]  # fmt: skip
_MOUTH = [(-23.5, -103, 86.5), (-16, -96.5, 95.5), (-7, -93, 100.5), (0, -94, 101.5)]
_LOWER_LIP = [(-16.5, -108.5, 92.5), (-9.5, -111, 97), (0, -111.5, 98)]
_INNER_MOUTH = [(-20, -103, 85.5), (-9.5, -102, 94), (0, -102, 95.5)]
_INNER_LOWER = [(-10, -102.5, 94), (0, -102.5, 95)]

_JOINTS = np.array([[0, -250, -18], [0, -150, -15], [0, -60, -5]])
_CAPSULES = np.array(
    [  # first sphere x y z radius, second sphere x y z radius, mm
        [0, -8, 12, 76, 0, -12, -14, 77],
        [0, -75, 25, 62, 0, -103, 52, 38],
        [0, -95, -12, 53, 0, -250, -20, 58],
        [0, -250, -22, 62, 150, -275, -30, 58],
        [0, -250, -22, 62, -150, -275, -30, 58],
    ]
)


@cache
def default_head() -> Head:
    """Return the average adult head, about 10,000 vertices, breadth 0.155 m, watertight.

    Its texture coordinates are the azimuthal projection from the crown (radius 0.5 at the cut of the
    neck, the face below the middle), so they are injective. Same head, same object, every call.
    """
    directions, faces = _sphere(FREQUENCY)
    directions = _crowded(directions)
    polar = np.arccos(directions[:, 1].clip(-1, 1))
    azimuth = np.arctan2(directions[:, 0], directions[:, 2])
    vertices = head_surface(polar, azimuth)
    radius = 0.5 * polar / np.pi
    uv = np.stack([0.5 + radius * np.sin(azimuth), 0.5 - radius * np.cos(azimuth)], axis=1)
    nearest = cKDTree(vertices).query(_landmarks())[1]
    spheres = _CAPSULES * 1e-3
    capsules = Capsules(spheres[:, :3], spheres[:, 4:7], spheres[:, [3, 7]])
    return Head(
        vertices,
        faces,
        uv,
        scalp_weight(vertices),
        nearest.astype(np.int32),
        _JOINTS * 1e-3,
        capsules,
    )


def _landmarks() -> Float64Array:
    """(68, 3) metres, in iBUG order: subject's right to left, upper before lower."""

    def across(points: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
        return points + [(-x, y, z) for x, y, z in points[::-1] if x]

    left_eye = [(-_EYE[i][0], *_EYE[i][1:]) for i in (3, 2, 1, 0, 5, 4)]
    lower = [(-x, y, z) for x, y, z in _LOWER_LIP if x] + _LOWER_LIP[::-1]
    inner_lower = [(-x, y, z) for x, y, z in _INNER_LOWER if x] + _INNER_LOWER[::-1]
    ordered = [
        *across(_JAW), *across(_BROW), *_NOSE_RIDGE, *across(_NOSE_BASE),
        *_EYE, *left_eye, *across(_MOUTH), *lower, *across(_INNER_MOUTH), *inner_lower,
    ]  # fmt: skip
    return np.array(ordered, np.float64) * 1e-3


def _crowded(directions: Float64Array) -> Float64Array:
    """Move directions (N, 3) towards the face without folds: the aberration of a moving observer."""
    to_face = _FACE_DIRECTION / np.linalg.norm(_FACE_DIRECTION)
    cosine = directions @ to_face
    across = directions - cosine[:, None] * to_face
    scale = np.sqrt(1 - _CROWDING**2) / (1 + _CROWDING * cosine)
    moved: Float64Array = (
        scale[:, None] * across
        + ((cosine + _CROWDING) / (1 + _CROWDING * cosine))[:, None] * to_face
    )
    return moved


def _sphere(frequency: int) -> tuple[Float64Array, Int32Array]:
    """Unit directions (N, 3) and faces (F, 3) of the icosahedron with `frequency` edges a side."""
    corners, triangles = _icosahedron()
    steps = [(i, j) for i in range(frequency + 1) for j in range(frequency + 1 - i)]
    weights = np.array([(frequency - i - j, i, j) for i, j in steps], np.float64) / frequency
    points = np.einsum("kc,tcx->tkx", weights, corners[triangles]).reshape(-1, 3)
    rank = {step: k for k, step in enumerate(steps)}
    local = [
        (rank[i, j], rank[i + 1, j], rank[i, j + 1])
        for i, j in steps if i + j < frequency
    ] + [
        (rank[i + 1, j], rank[i + 1, j + 1], rank[i, j + 1])
        for i, j in steps if i + j < frequency - 1
    ]  # fmt: skip
    faces = (np.array(local)[None] + (np.arange(20) * len(steps))[:, None, None]).reshape(-1, 3)
    keys = np.round(points * 1e6).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    unique = points[first]
    directions = unique / np.linalg.norm(unique, axis=1, keepdims=True)
    return directions, inverse.reshape(-1)[faces].astype(np.int32)


def _icosahedron() -> tuple[Float64Array, Int32Array]:
    """Corners (12, 3) and faces (20, 3), counter-clockwise from outside, no corner at the crown."""
    from scipy.spatial import ConvexHull

    golden = (1 + np.sqrt(5)) / 2
    corners = np.array([(0, a, b * golden) for a in (-1, 1) for b in (-1, 1)], np.float64)
    corners = np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)])
    triangles = ConvexHull(corners).simplices
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return corners, triangles.astype(np.int32)
