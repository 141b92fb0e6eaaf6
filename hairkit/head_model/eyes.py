"""Eyeballs in open lids for the default head, and the picture of them.

The lids of the default head are a surface that bulges over the eyeballs. It is opened between two
curves: vertices near them are moved onto them, and what lies between is pushed back behind the
eyeball, so that the mesh stays closed. The eyeballs are spheres, which lie in the texture in the
corners beside the disc of the head (`hairkit.head_model.template`), in an equal-area projection
about the axis of view. Lengths are millimetres in the head frame, the left half mirrored, as in
`template_shape`; they are rounded averages of adults (Bekerman et al. 2014 for the eyeball).
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, Int32Array, UInt8Array
from hairkit.types.head import Head

CENTRE = np.array([30.8, -35.4, 68.0])
"""Middle of the left eyeball."""
RADIUS = 12.0
"""Of the eyeballs."""
IRIS_RADIUS, PUPIL_RADIUS = 5.8, 2.0
"""Of the iris and of the pupil."""
CORNEA = 1.3
"""By which the middle of the iris stands out of the sphere: from the side, too, it is seen."""
_Curve = list[tuple[float, float]]
UPPER_LID: _Curve = [(17.5, -37.6), (20, -34.6), (27, -31), (32, -30.6), (37, -31.5), (43.5, -36)]
"""Edge of the left upper lid, x and y."""
LOWER_LID: _Curve = [
    (17.5, -37.6), (21, -38.6), (26.5, -39.6), (32, -40.2), (37, -39.5), (43.5, -36),
]  # fmt: skip
"""Edge of the left lower lid."""
POCKET, EDGE = 7.0, 0.9
"""How far the surface between the lids is pushed back, and how far from their edges wholly."""
LID, LID_BLEND = 0.9, 0.4
"""Thickness of the lids, and over which they leave the eyeball for the face."""
FACE = 0.04
"""Metres in front of the origin beyond which a point is on the face."""
NEAR_EDGE = 0.8
"""Vertices no farther from a lid's edge are moved onto it."""
RINGS, AROUND = 14, 24
"""Circles of vertices about the axis of view, and vertices of each."""
DISC_CENTRE, DISC_RADIUS = 0.078, 0.076
"""Of an eyeball in the texture: distance from the two edges beside it, and radius."""
SAME_UV = 1e-5
"""By which texture coordinates of the same disc differ at most."""
IRIS, SCLERA = (92.0, 68.0, 47.0), (216.0, 206.0, 198.0)
"""Colours of iris and white, sRGB of 255, where no photo tells them."""
_LIMBUS, _PUPIL_COLOUR, _VEIN = 0.45, 12.0, (190.0, 120.0, 110.0)
"""Brightness of the iris at its rim, level of the pupil, and colour that veins tend to."""
_RIM = 0.9
"""Millimetres over which iris and white, and pupil and iris, fade into each other."""
_FIBRES, _FIBRE_DEPTH = 46, 0.16
"""Fibres around the iris, and by how much they are brighter and darker."""
_VEIN_COVER, _VEIN_START = 0.35, 0.5
"""Cover of veins at the back of the eyeball, and share of the texture's radius where they begin."""


class Eyeballs(NamedTuple):
    """Two spheres, the left one first."""

    vertices: Float64Array
    """(2 E, 3) metres."""
    faces: Int32Array
    """(F, 3) counter-clockwise from outside."""
    uv: Float64Array
    """(2 E, 2)."""


def eyeballs() -> Eyeballs:
    """Return the eyeballs of the default head, which look straight ahead."""
    angle = np.linspace(0, np.pi, RINGS + 1)[1:-1, None]
    turn = 2 * np.pi * np.arange(AROUND)[None] / AROUND
    unit = np.stack(
        np.broadcast_arrays(
            np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle)
        ),
        axis=-1,
    ).reshape(-1, 3)
    unit = np.concatenate([[[0.0, 0, 1]], unit, [[0.0, 0, -1]]])
    length = np.hypot(*unit.T[:2])
    across = unit[:, :2] / np.maximum(length, 1e-9)[:, None]
    flat = across * np.sin(0.5 * np.arccos(unit[:, 2:].clip(-1, 1)))
    flat[-1] = flat[-2]
    bulge = CORNEA * np.clip(1 - (RADIUS * length / IRIS_RADIUS) ** 2, 0, 1) * (unit[:, 2] > 0)
    left, faces = 1e-3 * (CENTRE + (RADIUS + bulge[:, None]) * unit), _sphere_faces()
    disc = np.array([1 - DISC_CENTRE, DISC_CENTRE]) + DISC_RADIUS * flat
    mirror = np.array([-1.0, 1, 1])
    right = np.column_stack([1 - disc[:, 0], disc[:, 1]])
    return Eyeballs(
        np.concatenate([left, left * mirror]),
        np.concatenate([faces, faces[:, ::-1] + len(left)]).astype(np.int32),
        np.concatenate([disc, right]),
    )


def _sphere_faces() -> Int32Array:
    """Return the faces of a sphere: front pole, rings from front to back, back pole."""
    last = 1 + (RINGS - 1) * AROUND
    here = np.arange(AROUND)
    there = (here + 1) % AROUND
    faces = [np.stack([0 * here, 1 + here, 1 + there], axis=1)]
    for ring in range(RINGS - 2):
        first = 1 + ring * AROUND
        a, b, c, d = first + here, first + there, first + AROUND + here, first + AROUND + there
        faces += [np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)]
    first = last - AROUND
    faces.append(np.stack([first + there, first + here, 0 * here + last], axis=1))
    return np.concatenate(faces).astype(np.int32)


def between_lids(points: Float64Array) -> Float64Array:
    """Return (N,) how far points (N, 3), metres, of the face lie between the lids, mm: 0 on an
    edge, negative outside."""
    x, y = 1e3 * np.abs(points[:, 0]), 1e3 * points[:, 1]
    upper, lower = _lids()
    first, last = UPPER_LID[0][0], UPPER_LID[-1][0]
    held = np.clip(x, first, last)
    inside = [
        side * (curve(held) - y) / np.sqrt(1 + curve(held, 1) ** 2)
        for side, curve in ((1, upper), (-1, lower))
    ]
    beyond = np.maximum(first - x, x - last)
    depth = np.minimum(*inside)
    depth = np.where(beyond > 0, -np.hypot(beyond, np.minimum(depth, 0)), depth)
    return np.asarray(np.where(points[:, 2] > FACE, depth, -np.inf))


def nearest_edge(points: Float64Array) -> Float64Array:
    """Return points (N, 3), metres, moved to the nearer lid's edge along y."""
    x, y = 1e3 * np.abs(points[:, 0]), 1e3 * points[:, 1]
    upper, lower = (curve(x) for curve in _lids())
    nearer = np.where(np.abs(upper - y) < np.abs(lower - y), upper, lower)
    return np.asarray(np.column_stack([points[:, 0], 1e-3 * nearer, points[:, 2]]))


def near_edge(points: Float64Array, faces: Int32Array) -> BoolArray:
    """Return (N,) whether points (N, 3), metres, belong on an edge of the lids.

    They do where they are near it, or nearer than the other end of a side of faces (F, 3) that
    crosses it: afterwards none does, and the lids have smooth edges.
    """
    x = 1e3 * np.abs(points[:, 0])
    depth = between_lids(points)
    near = (x > UPPER_LID[0][0]) & (x < UPPER_LID[-1][0]) & (np.abs(depth) < NEAR_EDGE)
    depth[near] = 0
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    crossing = sides[(depth[sides] * [1, -1]).min(axis=1) > 0]
    crossing = crossing[(x[crossing] > UPPER_LID[0][0]).all(axis=1)]
    nearer = np.abs(depth[crossing]).argmin(axis=1)
    near[crossing[np.arange(len(crossing)), nearer]] = True
    return near


def open_lids(points: Float64Array) -> Float64Array:
    """Return the surface (N, 3), metres, that covers the eyeballs but for what is between the lids,
    which is pushed back."""
    t = np.clip(between_lids(points) / EDGE, 0, 1)
    away = 1e3 * points - CENTRE * np.column_stack(
        [np.sign(points[:, 0]), *np.ones((2, len(points)))]
    )
    distance = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
    lacking = (RADIUS + LID - distance) / LID_BLEND
    moved = LID_BLEND * np.logaddexp(0, lacking) * (points[:, 2] > FACE)
    lids = points + 1e-3 * (moved / distance)[:, None] * away
    return np.asarray(lids - np.outer(1e-3 * POCKET * t * t * (3 - 2 * t), [0, 0, 1]))


# SciPy's splines take as long to load as NumPy: they are loaded when a head is made.
@cache
def _lids() -> Any:
    """The edges of upper and lower lid, y over x."""
    from scipy.interpolate import PchipInterpolator

    return tuple(PchipInterpolator(*np.transpose(curve)) for curve in (UPPER_LID, LOWER_LID))


def has_default_eyes(head: Head) -> bool:
    """Return whether a head's eyeballs lie in its texture as those of the default head."""
    if head.eye_vertices is None:
        return False
    uv, wanted = head.uv[head.eye_vertices.ravel()], eyeballs().uv
    return uv.shape == wanted.shape and bool(np.allclose(uv, wanted, atol=SAME_UV))


def _from_disc(uv: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return (N,) distance from the middle of the nearer disc, of its radius, and angle."""
    across = np.minimum(uv[:, 0], 1 - uv[:, 0]) - DISC_CENTRE
    up = uv[:, 1] - DISC_CENTRE
    return np.hypot(across, up) / DISC_RADIUS, np.arctan2(up, across)


def paint_eyes(
    uv: Float64Array,
    iris: tuple[float, float, float] = IRIS,
    sclera: tuple[float, float, float] = SCLERA,
) -> Float64Array:
    """Return the colours (N, 3) of eyeballs at texture coordinates (N, 2), sRGB of 255."""
    distance, angle = _from_disc(uv)
    theta = 2 * np.arcsin(np.clip(distance, 0, 1))
    away = RADIUS * np.sin(np.minimum(theta, np.pi / 2)) + RADIUS * np.maximum(theta - np.pi / 2, 0)
    share = np.clip((away - PUPIL_RADIUS) / (IRIS_RADIUS - PUPIL_RADIUS), 0, 1)
    fibres = np.sin(_FIBRES * angle + 2 * np.sin(7 * angle)) * np.sin(np.pi * share)
    shade = (1 + _FIBRE_DEPTH * fibres) * (1 - (1 - _LIMBUS) * share**6)
    coloured = shade[:, None] * np.array(iris)
    pupil = _ramp(PUPIL_RADIUS + 0.5 * _RIM - away)
    coloured += pupil[:, None] * (_PUPIL_COLOUR - coloured)
    veins = _VEIN_COVER * np.clip((distance - _VEIN_START) / (1 - _VEIN_START), 0, 1)
    white = np.array(sclera) + veins[:, None] * (np.array(_VEIN) - np.array(sclera))
    inside = _ramp(IRIS_RADIUS + 0.5 * _RIM - away)[:, None]
    return np.asarray(np.clip(white + inside * (coloured - white), 0, 255))


def paint_over(
    albedo: UInt8Array,
    iris: tuple[float, float, float] = IRIS,
    sclera: tuple[float, float, float] = SCLERA,
) -> UInt8Array:
    """Return the picture (S, S, 3) of the default head's texture with eyeballs of those colours."""
    size = len(albedo)
    edge = int(np.ceil(2 * DISC_CENTRE * size))
    row, column = (part.ravel() for part in np.mgrid[size - edge : size, 0:edge])
    uv = np.column_stack([(column + 0.5) / size, 1 - (row + 0.5) / size])
    near = _from_disc(uv)[0] < 1 + 1 / (DISC_RADIUS * size)
    colour = np.rint(paint_eyes(uv[near], iris, sclera)).astype(np.uint8)
    painted = albedo.copy()
    for columns in (column, size - 1 - column):
        painted[row[near], columns[near]] = colour
    return painted


def _ramp(inside: Float64Array) -> Float64Array:
    t = np.clip(inside / _RIM, 0, 1)
    return t * t * (3 - 2 * t)
