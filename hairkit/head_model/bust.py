"""A clothed bust under a head that ends at the neck: what pictures and exported scenes show.

The torso of `hairkit.head_model.torso`, from a collar that lies on the head's own neck down to a
rounded end, as of a sculpture. Where strands run inside of it, it gives way: it fits a person's
shoulders roughly, and no hair may be hidden. In simulations it keeps hair out; reconstruction does
not use it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from hairkit.arrays import Float32Array, Float64Array, Int32Array
from hairkit.head_model.torso import Torso, loft
from hairkit.types.head import Head, vertex_normals
from hairkit.types.strands import Strands

CLOTH = (0.045, 0.055, 0.07)
"""Linear RGB of a dark shirt; chosen by eye."""
COLLAR, FOOT = 0.046, -0.165
"""Heights of the collar and the lower end above the root joint of an adult, metres."""
ROUND = -0.06
"""Height below which the bust narrows to its end, metres."""
FLAT = 0.35
"""Size of the lowest section, of what it would be without narrowing."""
BLEND = 0.045
"""Metres below the collar over which its outline turns into the torso's."""
TILT = 0.22
"""Metres that the collar falls for each metre forwards."""
CLOTH_THICK, UNDER = 0.004, 0.003
"""Metres by which the collar stands off the neck, and by which its inner edge lies in it."""
RINGS, AROUND = 44, 72
"""Sections of the mesh and points of each."""
SLAB = 0.010
"""Half height of the slice of the neck that the collar is laid on, metres."""
FEWEST = 24
"""Vertices of the slice at least."""
AT_ROOT = 0.04
"""Metres between the mesh's lower end and the root joint up to which a head ends at its neck."""
BROADEST_NECK = 0.11
"""Metres from its axis up to which the lower end is a neck: beyond, the mesh has shoulders."""
GIVE, CLEAR = 0.35, 0.95
"""Least size of a section that gives way to hair, and its size below that of the hair."""
GIVE_BLUR = 1.0
"""Sigma over which it gives way, sections and points around."""


class Bust(NamedTuple):
    """A mesh in the head frame."""

    vertices: Float32Array
    """(V, 3) metres."""
    faces: Int32Array
    """(F, 3), counter-clockwise seen from outside."""
    normals: Float32Array
    """(V, 3) outward unit normals."""


def bust_under(head: Head, strands: Strands | None = None) -> Bust | None:
    """Return the bust that belongs under a head; None under one that does not end at the neck.

    Sections in which `strands` run are made smaller, so that these stay in front of them.
    """
    torso = Torso.under(head)
    neck = _neck(head, torso)
    if neck is None:
        return None
    heights = np.linspace(COLLAR, FOOT, RINGS)
    rings = torso.surface(heights, AROUND)
    middle = rings.mean(axis=1, keepdims=True)
    rings = _lay_collar(rings, middle, heights, neck, torso.scale)
    vertices, thick = head.vertices.astype(np.float64), CLOTH_THICK * torso.scale
    rings = middle + _clear_neck(rings, middle, vertices, thick)[..., None] * (rings - middle)
    below = np.clip((ROUND - heights) / (ROUND - FOOT), 0, 1)
    narrowed = np.sqrt(1 - (1 - FLAT**2) * below**2)[:, None, None]
    size = narrowed * _give_way(rings, middle, strands)[..., None]
    rings = middle + size * (rings - middle)
    inner = _section(
        middle[0, 0], torso.surface(heights[:1], AROUND)[0], neck, -UNDER * torso.scale
    )
    vertices = np.concatenate([inner, rings.reshape(-1, 3), middle[-1]])
    last = len(vertices) - 1
    foot = np.arange(last - AROUND, last)
    cap = np.stack([foot, np.full(AROUND, last), np.roll(foot, -1)], axis=1)
    faces = np.concatenate([loft(RINGS + 1, AROUND), cap]).astype(np.int32)
    normals = vertex_normals(vertices, faces).astype(np.float32)
    return Bust(vertices.astype(np.float32), faces, normals)


def _neck(head: Head, torso: Torso) -> tuple[Float64Array, Float64Array] | None:
    """Return directions, rising, and distances from the torso's axis of the neck at the collar."""
    vertices = head.vertices.astype(np.float64)
    lowest = float(vertices[:, 1].min())
    end = vertices[vertices[:, 1] < lowest + SLAB * torso.scale] - torso.joint
    if (
        abs(lowest - torso.joint[1]) > AT_ROOT * torso.scale
        or np.abs(end[:, 0]).max() > BROADEST_NECK * torso.scale
    ):
        return None
    ring = torso.surface(np.array([COLLAR]), AROUND)[0]
    off = vertices - ring.mean(axis=0)
    off = off[np.abs(off[:, 1] + TILT * off[:, 2]) < SLAB * torso.scale]
    if len(off) < FEWEST:
        return None
    angle, distance = _polar(off)
    order = np.argsort(angle)
    return angle[order], distance[order]


def _polar(off: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return angles from the front and distances from the axis of points (..., 3) beside it."""
    return np.arctan2(off[..., 0], off[..., 2]), np.hypot(off[..., 0], off[..., 2])


def _section(
    middle: Float64Array, ring: Float64Array, neck: tuple[Float64Array, Float64Array], off: float
) -> Float64Array:
    """Return a tilted ring (A, 3) in the same directions that stands `off` metres off the neck."""
    angle, distance = _polar(ring - middle)
    even = np.linspace(-np.pi, np.pi, AROUND, endpoint=False)
    found = np.interp(even, *neck, period=2 * np.pi)
    smooth = ndimage.gaussian_filter1d(found, 2.0, mode="wrap")
    wanted = np.interp(angle, even, smooth, period=2 * np.pi) + off
    share = wanted / np.maximum(distance, 1e-9)
    x, y, z = (ring - middle).T
    return np.asarray(middle + np.stack([share * x, y - TILT * share * z, share * z], axis=1))


def _lay_collar(
    rings: Float64Array,
    middle: Float64Array,
    heights: Float64Array,
    neck: tuple[Float64Array, Float64Array],
    scale: float,
) -> Float64Array:
    """Return the sections (R, A, 3), the first on the neck, the others turning into the torso."""
    t = np.clip((COLLAR - heights) / BLEND, 0, 1)
    share = (t * t * (3 - 2 * t))[:, None, None]
    on_neck = np.stack(
        [
            _section(centre[0], ring, neck, CLOTH_THICK * scale)
            for centre, ring in zip(middle, rings, strict=True)
        ]
    )
    return on_neck + share * (rings - on_neck)


def _clear_neck(
    rings: Float64Array, middle: Float64Array, vertices: Float64Array, off: float
) -> Float64Array:
    """Return the size (R, A) of the sections at which a neck's vertices stay `off` metres inside.

    Those above the tilted collar may come out.
    """
    ahead = vertices[:, 2] - middle[0, 0, 2]
    tilted = vertices + np.outer(TILT * ahead, (0, 1, 0))
    return 1 / _least_ratio(rings, middle, tilted, lambda reach, outline: outline / (reach + off))


def _give_way(rings: Float64Array, middle: Float64Array, strands: Strands | None) -> Float64Array:
    """Return the size (R, A) of the sections at which no strand runs inside of them."""
    if strands is None:
        return np.ones(rings.shape[:2])
    points = strands.points.astype(np.float64)
    return _least_ratio(rings, middle, points, lambda reach, outline: CLEAR * reach / outline)


def _least_ratio(
    rings: Float64Array,
    middle: Float64Array,
    points: Float64Array,
    ratio: Callable[[Float64Array, Float64Array], Float64Array],
) -> Float64Array:
    """Return (R, A) the least ratio that points (N, 3) beside a section ask for, smooth, up to 1.

    `ratio` is given their distances from the axis and those of the section in their directions.
    """
    size, level = np.ones(rings.shape[:2]), middle[::-1, 0, 1]
    points = points[(points[:, 1] > level[0]) & (points[:, 1] < level[-1])]
    ring = np.rint(np.interp(points[:, 1], level, np.arange(len(level))[::-1])).astype(np.int64)
    angle, distance = _polar(points - middle[ring, 0])
    reach_angle, reach = _polar(rings - middle)
    column = np.rint(angle / (2 * np.pi) * AROUND).astype(np.int64) % AROUND
    even = np.arange(AROUND) * 2 * np.pi / AROUND
    outline = np.stack(
        [np.interp(even, a, r, period=2 * np.pi) for a, r in zip(reach_angle, reach, strict=True)]
    )
    np.minimum.at(size, (ring, column), ratio(distance, outline[ring, column]))
    modes = ("nearest", "wrap")
    least = ndimage.minimum_filter(size, 3, mode=modes)
    smooth = np.minimum(ndimage.gaussian_filter(least, GIVE_BLUR, mode=modes), least)
    sized = [
        np.interp(a, even, s, period=2 * np.pi) for a, s in zip(reach_angle, smooth, strict=True)
    ]
    return np.asarray(np.clip(np.stack(sized), GIVE, 1))
