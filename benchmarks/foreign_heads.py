"""Heads that are not the default one: other people, other meshes, other places."""

from __future__ import annotations

import numpy as np
import trimesh

from hairkit.field.isosurface import volume_surface
from hairkit.head_model.identity import blend_head
from hairkit.head_model.signed_distance import signed_distance
from hairkit.io.head_reader import BareHead
from hairkit.types.volume import VoxelGrid

_CHILD = {"child": 1.0}
_MAN = {"man": 1.0, "head_length": 1.5, "ears": 1.0}
_WOMAN = {"woman": 1.0, "cranium_height": 1.0, "cheeks": 1.5}
"""Shapes of the three, `hairkit.head_model.identity`."""
_CHILD_AT, _MAN_AT, _WOMAN_AT = (0.0, 1.1, 0.02), (0.0, 1.6, 0.0), (0.3, 1.4, 0.0)
"""Metres from the origin."""
_JOINED = 0.009
"""Metres of the cubes in which the coarse head's vertices are joined."""
_CELL = 0.004
"""Metres of the cells that the remeshed head is made of."""
_LOW, _HIGH = (-0.22, -0.42, -0.15), (0.22, 0.17, 0.15)
"""Corners of the volume of these cells, metres."""
_SHOULDERS_AT, _SHOULDERS = (0.0, -0.36, -0.02), (0.2, 0.12, 0.1)
"""Middle and half axes of the shoulders' ellipsoid, metres."""
_BODY = (
    ((0.0, -0.65, -0.02), (0.2, 0.4, 0.13)),
    ((0.45, -0.4, -0.02), (0.4, 0.05, 0.06)),
    ((-0.45, -0.4, -0.02), (0.4, 0.05, 0.06)),
    ((0.1, -1.3, -0.02), (0.09, 0.45, 0.1)),
    ((-0.1, -1.3, -0.02), (0.09, 0.45, 0.1)),
)
"""Middles and half axes of trunk, arms and legs, ellipsoids, metres."""


def make_child_head() -> BareHead:
    """Return a child's head above the ground, without a scalp, with scattered uv."""
    head = blend_head(_CHILD)
    uv = np.random.default_rng(0).uniform(size=(len(head.vertices), 2))
    return BareHead(head.vertices + np.array(_CHILD_AT), head.skin_faces(), uv)


def make_coarse_head() -> BareHead:
    """Return a man's long head of about 5,000 triangles, vertices in each cube joined."""
    head = blend_head(_MAN)
    _, joined = np.unique(np.round(head.vertices / _JOINED), axis=0, return_inverse=True)
    joined = joined.reshape(-1)
    count = np.bincount(joined)
    sums = [np.bincount(joined, head.vertices[:, axis]) for axis in range(3)]
    vertices = np.stack(sums, axis=1) / count[:, None]
    faces = joined[head.skin_faces()]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return BareHead(vertices + np.array(_MAN_AT), faces[whole].astype(np.int32))


def make_remeshed_head() -> BareHead:
    """Return a woman's head with shoulders, its mesh made anew from a volume, beside the origin."""
    head = blend_head(_WOMAN)
    grid = VoxelGrid.around(_LOW, _HIGH, _CELL)
    apart = (grid.centres() - np.array(_SHOULDERS_AT)) / np.array(_SHOULDERS)
    inside = (signed_distance(head, grid) < 0) | (np.linalg.norm(apart, axis=-1) < 1)
    vertices, faces, _ = volume_surface(grid, inside)
    return BareHead(vertices + np.array(_WOMAN_AT), faces)


def make_whole_body() -> BareHead:
    """Return a woman's head on a body with spread arms, of which the head is a small part."""
    head = blend_head(_WOMAN)
    parts = [(head.vertices.astype(np.float64), head.skin_faces())]
    ball = trimesh.creation.icosphere(subdivisions=4)
    for middle, half_axes in _BODY:
        parts.append((ball.vertices * half_axes + np.array(middle), ball.faces))
    sizes = np.cumsum([0] + [len(vertices) for vertices, _ in parts[:-1]])
    faces = [part + size for (_, part), size in zip(parts, sizes, strict=True)]
    return BareHead(
        np.concatenate([vertices for vertices, _ in parts]),
        np.concatenate(faces).astype(np.int32),
    )


FOREIGN_HEADS = {
    "child": make_child_head,
    "coarse": make_coarse_head,
    "remeshed": make_remeshed_head,
    "body": make_whole_body,
}
"""Makers by name."""
