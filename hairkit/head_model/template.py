"""The default head: a procedural average adult, made wholly by code when it is asked for."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.spatial import ConvexHull, cKDTree

from hairkit.arrays import Float64Array, Int32Array
from hairkit.head_model.template_shape import head_surface, scalp_weight
from hairkit.types.head import Capsules, Head

FREQUENCY = 34
"""Edges along a side of the icosahedron: 10 * 34^2 + 2 = 11,562 vertices."""
_CROWDED = np.array(
    [  # where vertices gather: direction, how much nearer they come, and within what angle
        [0.0, -0.40, 0.92, 0.45, 0.75],
        [0.93, -0.36, -0.10, 0.45, 0.26],
        [-0.93, -0.36, -0.10, 0.45, 0.26],
    ]
)

# The iBUG landmarks of the right half in mm, head frame; the left half is its mirror image.
_Points = list[tuple[float, float, float]]
_JAW: _Points = [
    (-72, -35, 26), (-71, -56, 29), (-67, -75, 34), (-63, -93, 40), (-55, -113, 49),
    (-41, -129, 60), (-29, -135.5, 73), (-14, -138.5, 87), (0, -141, 89),
]  # fmt: skip
_BROW: _Points = [(-57, -20, 66), (-48, -12, 77), (-37, -9, 85), (-23, -9.5, 91), (-11, -12, 93)]
_NOSE_RIDGE: _Points = [(0, -34, 92), (0, -44.5, 100.5), (0, -55, 108), (0, -66, 115)]
_NOSE_BASE: _Points = [(-12, -81.5, 93), (-6, -81.5, 98.5), (0, -82, 100)]
_EYE: _Points = [(-43, -36, 71.5), (-37, -31.5, 78.5), (-27, -31, 80.5),
        (-18, -37.5, 77.5), (-26.5, -39.5, 79.5), (-37, -39.5, 77.5)]  # fmt: skip
_MOUTH: _Points = [(-23.5, -103, 86.5), (-16, -96.5, 95.5), (-7, -93, 100.5), (0, -94, 101.5)]
_LOWER_LIP: _Points = [(-16.5, -108.5, 92.5), (-9.5, -111, 97), (0, -111.5, 98)]
_INNER_MOUTH: _Points = [(-20, -103, 85.5), (-9.5, -102, 94), (0, -102, 95.5)]
_INNER_LOWER: _Points = [(-10, -102.5, 94), (0, -102.5, 95)]

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
    """Return the average adult head, 11,562 vertices, breadth 0.155 m, watertight.

    Its texture coordinates are the azimuthal projection from the crown (radius 0.5 at the middle
    of the neck's cut, the face below the middle), so they are injective. Every call gives the same
    object.
    """
    directions, faces = _sphere(FREQUENCY)
    directions = _crowded(directions)
    vertices = head_surface(*_angles(directions))
    targets = _landmarks()
    landmarks = cKDTree(vertices).query(targets)[1]
    directions[landmarks] = _to_landmarks(directions[landmarks], targets)
    polar, azimuth = _angles(directions)
    vertices[landmarks] = head_surface(polar[landmarks], azimuth[landmarks])
    radius = 0.5 * polar / np.pi
    uv = np.stack([0.5 + radius * np.sin(azimuth), 0.5 - radius * np.cos(azimuth)], axis=1)
    spheres = (_CAPSULES * 1e-3).astype(np.float32)
    return Head(
        vertices.astype(np.float32),
        faces,
        uv.astype(np.float32),
        scalp_weight(vertices).astype(np.float32),
        landmarks.astype(np.int32),
        (_JOINTS * 1e-3).astype(np.float32),
        Capsules(spheres[:, :3], spheres[:, 4:7], spheres[:, [3, 7]]),
    )


def _landmarks() -> Float64Array:
    """(68, 3) metres, in iBUG order: subject's right to left, upper before lower."""

    left_eye = [(-_EYE[i][0], _EYE[i][1], _EYE[i][2]) for i in (3, 2, 1, 0, 5, 4)]
    lower = [(-x, y, z) for x, y, z in _LOWER_LIP if x] + _LOWER_LIP[::-1]
    inner_lower = [(-x, y, z) for x, y, z in _INNER_LOWER if x] + _INNER_LOWER[::-1]
    ordered = [
        *_across(_JAW), *_across(_BROW), *_NOSE_RIDGE, *_across(_NOSE_BASE),
        *_EYE, *left_eye, *_across(_MOUTH), *lower, *_across(_INNER_MOUTH), *inner_lower,
    ]  # fmt: skip
    return np.array(ordered, np.float64) * 1e-3


def _across(points: _Points) -> _Points:
    """The right half from its outer end to the middle, then its mirror image back."""
    return points + [(-x, y, z) for x, y, z in points[::-1] if x]


def _crowded(directions: Float64Array) -> Float64Array:
    """Turn directions (N, 3) towards the face and the ears; shares under 1 make no folds."""
    for *centre, share, reach in _CROWDED:
        middle = np.array(centre) / np.linalg.norm(centre)
        angle = np.arccos((directions @ middle).clip(-1, 1))
        turned = angle * (1 - share * np.exp(-0.5 * (angle / reach) ** 2))
        across = directions - np.cos(angle)[:, None] * middle
        across /= np.maximum(np.sin(angle), 1e-9)[:, None]
        directions = np.cos(turned)[:, None] * middle + np.sin(turned)[:, None] * across
    return directions


def _to_landmarks(directions: Float64Array, targets: Float64Array) -> Float64Array:
    """Slide directions (L, 3) until their surface points are nearest to targets (L, 3), metres.

    Gauss-Newton on the two angles, from the nearest vertices; steps that gain nothing are left out.
    """
    angles = np.stack(_angles(directions), axis=1)
    missed = head_surface(*angles.T) - targets
    for _ in range(6):
        columns = [
            (head_surface(*(angles + step).T) - targets - missed) / 1e-5
            for step in np.eye(2) * 1e-5
        ]
        jacobian = np.stack(columns, axis=2)
        normal = np.einsum("lxi,lxj->lij", jacobian, jacobian) + 1e-9 * np.eye(2)
        step = -np.linalg.solve(normal, np.einsum("lxi,lx->li", jacobian, missed)[..., None])[
            ..., 0
        ]
        step *= np.minimum(1, 0.02 / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12))
        moved = head_surface(*(angles + step).T) - targets
        better = (moved**2).sum(axis=1) < (missed**2).sum(axis=1)
        angles = np.where(better[:, None], angles + step, angles)
        missed = np.where(better[:, None], moved, missed)
    polar, azimuth = angles.T
    return np.stack(
        [np.sin(polar) * np.sin(azimuth), np.cos(polar), np.sin(polar) * np.cos(azimuth)], axis=1
    )


def _angles(directions: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Polar angle from the crown and azimuth from the front of unit directions (N, 3)."""
    polar = np.arccos(directions[:, 1].clip(-1, 1))
    return polar, np.arctan2(directions[:, 0], directions[:, 2])


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
    golden = (1 + np.sqrt(5)) / 2
    corners = np.array([(0, a, b * golden) for a in (-1, 1) for b in (-1, 1)], np.float64)
    corners = np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)])
    triangles = ConvexHull(corners).simplices
    a, b, c = (corners[triangles[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return corners, triangles.astype(np.int32)
