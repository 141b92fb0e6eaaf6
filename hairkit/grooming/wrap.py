"""A groom carried to another head: roots on its surface, strands around it, lengths kept.

The heads' map takes every root to the other surface and every strand to its side. Each strand is
then laid anew from its root, piece by piece in the mapped directions and with the lengths of its
pieces, and slides along the head where it would enter it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array, unit_vectors
from hairkit.errors import InputError
from hairkit.field.growth_prior import gradient
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.head_model.carry_scalp import Carrier
from hairkit.head_model.register_head import HeadMap, Surface, register_head
from hairkit.head_model.scalp import evaluate, roots_at
from hairkit.head_model.signed_distance import signed_distance
from hairkit.io.head_reader import BareHead
from hairkit.types.groom import Groom
from hairkit.types.head import Capsules, Head
from hairkit.types.strands import Strands
from hairkit.types.tie import Tie
from hairkit.types.volume import VoxelGrid

CLEARANCE = 0.0003
"""Metres that strands keep from the head: above the error of the sampled distance."""
LIFTED_OVER = 0.004
"""Metres from the root over which a strand may rise to that clearance."""
SLIDES = 8
"""Rounds that take a point out of the head and back to its distance from the one before."""
CELL, MOST_CELLS = 0.002, 12e6
"""Metres of a cell of the sampled distance, and how many cells there may be."""
MAP_CELL = 0.008
"""Metres between the points at which the map is evaluated; it is smooth."""
MAP_MARGIN = 0.02
"""Metres around the strands that these points reach."""
TIE_STEP = 0.01
"""Metres along a tie's axis over which its direction is mapped."""


def wrap_groom(groom: Groom, head: BareHead, *, keep_root_uv: bool = False) -> Groom:
    """Return the groom on another head, in the frame of that head.

    Strands keep their lengths, numbers and points. Scalp, texture coordinates, joints and capsules
    that the other head lacks are carried over from the groom's, and so are ties; what the groom's
    file held beyond the groom belonged to the old head and is left out.

    Parameters
    ----------
    groom
        Its head and the other must be whole down to the neck; bodies may follow.
    head
        The other head, of any mesh, `hairkit.io.head_reader.read_bare_head`.
    keep_root_uv
        Keep the roots' old texture coordinates, for pictures that were painted on the old head.

    Raises
    ------
    InputError
        The other head has another size or direction than a head in metres that faces +Z.
    """
    marks = None if head.landmark_vertices is None else head.vertices[head.landmark_vertices]
    heads = register_head(groom.head, Surface(head.vertices, head.faces, marks))
    tree = build_tree(head.vertices, head.faces)
    old = evaluate(groom.head, groom.root_triangle, groom.root_barycentric)
    triangle, weights, _ = nearest_on_surface(tree, heads(old))
    fitted = _fitted_head(groom, head, heads, triangle)
    strands = _lay(groom.strands, fitted, heads, evaluate(fitted, triangle, weights))
    if not (keep_root_uv and groom.strands.root_uv is not None):
        strands = replace(strands, root_uv=roots_at(fitted, triangle, weights).uv)
    return replace(
        groom,
        strands=strands,
        head=fitted,
        root_triangle=triangle,
        root_barycentric=weights.astype(np.float32),
        ties=tuple(_carried_tie(tie, heads) for tie in groom.ties),
        carried=None,
    )


def _fitted_head(groom: Groom, head: BareHead, heads: HeadMap, triangle: Int32Array) -> Head:
    """Return the other head as a `Head`, with what its file lacks carried from the groom's."""
    vertices, old = head.vertices, groom.head
    carrier = Carrier.of(old, heads, vertices)
    scalp = head.scalp
    if scalp is None:
        scalp = carrier.scalp(old)
        scalp[head.faces[triangle]] = 1.0  # hair grows where its roots are
    density = None if old.density is None else np.clip(carrier.carry(old.density)[:, 0], 0, 1)
    uv = carrier.carry(old.uv) if head.uv is None else head.uv
    capsules = old.capsules
    scale = np.float32(heads.similarity.scale)
    return Head(
        vertices.astype(np.float32),
        head.faces,
        uv.astype(np.float32),
        scalp.astype(np.float32),
        head.landmark_vertices,
        heads(old.joints).astype(np.float32),
        Capsules(
            heads(capsules.first).astype(np.float32),
            heads(capsules.second).astype(np.float32),
            scale * capsules.radius,
        ),
        None if density is None else density.astype(np.float32),
        head.maps,
        head.blendshapes,
    )


def _carried_tie(tie: Tie, heads: HeadMap) -> Tie:
    ends = heads(np.stack([tie.centre, tie.centre + TIE_STEP * tie.axis]))
    axis = ends[1] - ends[0]
    return replace(
        tie,
        centre=ends[0].astype(np.float32),
        axis=(axis / np.linalg.norm(axis)).astype(np.float32),
    )


def _lay(strands: Strands, head: Head, heads: HeadMap, roots: Float64Array) -> Strands:
    """Return the strands on the other head, from roots (S, 3)."""
    points = _mapped(strands.points, heads)
    owner = strands.strand_of_point
    points += (roots - points[strands.offsets[:-1]])[owner]
    grid = _grid_around(points, head)
    laid = _laid(points, strands, grid, signed_distance(head, grid))
    return replace(strands, points=laid.astype(np.float32))


def _laid(
    mapped: Float64Array, strands: Strands, grid: VoxelGrid, distance: Float32Array
) -> Float64Array:
    """Return points (P, 3) laid in the directions of the mapped ones, around the head.

    `distance` (X, Y, Z) is the signed one to the head in the cells of the grid.
    """
    laid, arc = mapped.copy(), strands.arc_lengths()
    for rank in range(1, int(strands.counts.max(initial=0))):
        here = strands.offsets[:-1][strands.counts > rank] + rank
        before, length = laid[here - 1], (arc[here] - arc[here - 1])[:, None]
        at = before + length * unit_vectors(mapped[here] - mapped[here - 1])
        clearance = CLEARANCE * np.minimum(arc[here] / LIFTED_OVER, 1.0)
        near = np.arange(len(at))
        for _ in range(SLIDES):
            lack = clearance[near] - grid.sample(distance, at[near])
            near, lack = near[lack > 0], lack[lack > 0]
            away = at[near] + lack[:, None] * gradient(grid, distance, at[near]) - before[near]
            at[near] = before[near] + length[near] * unit_vectors(away)
        laid[here] = at
    return laid


def _mapped(points: Float32Array, heads: HeadMap) -> Float64Array:
    """Return points (P, 3) under the map, which is sampled on a grid where they are many."""
    moved = heads.similarity.apply(points)
    if heads.bend is None:
        return moved
    low, high = moved.min(axis=0) - MAP_MARGIN, moved.max(axis=0) + MAP_MARGIN
    grid = VoxelGrid.around(low, high, MAP_CELL)
    if np.prod(grid.shape) > len(moved):
        return moved + heads.bend(moved)
    values = heads.bend(grid.centres().reshape(-1, 3)).astype(np.float32)
    return moved + grid.sample(values.reshape(*grid.shape, 3), moved)


def _grid_around(points: Float64Array, head: Head) -> VoxelGrid:
    """Return the grid of the distance: where both strands and the head are."""
    margin = 10 * CELL
    low = np.maximum(points.min(axis=0), head.vertices.min(axis=0)) - margin
    high = np.minimum(points.max(axis=0), head.vertices.max(axis=0)) + margin
    if (high <= low).any():
        raise InputError("the strands lie beside the head; is it in the same unit and upright?")
    spacing = max(CELL, float(np.cbrt(np.prod(high - low) / MOST_CELLS)))
    return VoxelGrid.around(low, high, spacing)
