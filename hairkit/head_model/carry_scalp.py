"""What a head has at its vertices, scalp above all, carried to a head of another mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int32Array
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.head_model.register_head import HeadMap, Surface, register_head
from hairkit.head_model.template import default_head
from hairkit.types.head import Head

SCALP_GAP = 0.012
"""Metres between the mapped head and the other up to which its scalp is carried over: heads of
other topology, such as those with a mouth and eye sockets inside, have surface far from it."""


@dataclass(frozen=True, eq=False)
class Carrier:
    """Where the vertices of another head lie on a head that was brought onto it."""

    faces: Int32Array
    """(V, 3) corners of the head's nearest face to each vertex."""
    weights: Float64Array
    """(V, 3) barycentric weights in it."""
    apart: Float64Array
    """(V,) metres between the two."""

    @classmethod
    def of(cls, head: Head, heads: HeadMap, vertices: Float64Array) -> Carrier:
        """Return the carrier from a head, by its map, to vertices (V, 3) of another."""
        tree = build_tree(heads(head.vertices), head.faces)
        face, weights, apart = nearest_on_surface(tree, vertices)
        return cls(head.faces[face], weights, apart)

    def carry(self, values: Float32Array) -> Float64Array:
        """Return the head's values (V', K) or (V',) at the other's vertices, (V, K)."""
        at_corners = values.reshape(len(values), -1)[self.faces]
        return np.asarray(np.einsum("nk,nkd->nd", self.weights, at_corners))

    def scalp(self, head: Head) -> Float64Array:
        """Return the head's scalp at the other's vertices, (V,)."""
        return np.where(self.apart < SCALP_GAP, self.carry(head.scalp)[:, 0], 0.0)


def transfer_scalp(
    vertices: Float64Array, faces: Int32Array, landmarks: Int32Array | None
) -> tuple[Float64Array, Int32Array]:
    """Return the default head's scalp (V,) and landmarks (68,) on an unmarked head, by its shape.

    Given landmarks (68,), vertex numbers, help and stay. Raises `InputError` where the mesh cannot
    be a head in metres that faces +Z.
    """
    head = default_head()
    marks = None if landmarks is None else vertices[landmarks]
    heads = register_head(head, Surface(vertices, faces, marks))
    if landmarks is None:
        assert head.landmark_vertices is not None  # the default head has all of them
        used = np.unique(faces)
        near = cKDTree(vertices[used]).query(heads(head.vertices[head.landmark_vertices]))[1]
        landmarks = used[near].astype(np.int32)
    return Carrier.of(head, heads, vertices).scalp(head), landmarks
