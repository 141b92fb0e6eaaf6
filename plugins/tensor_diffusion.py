"""3D orientation field of the thesis: planes of the views on the hair's surface, diffused inwards.

A 2D orientation and the ray through its pixel span a plane that holds the strand. In outer cells
that two or more views see, the direction D minimises `sum w_i^2 (N_i . D)^2` over the plane
normals N_i (Wei et al. 2005; thesis 5.3, with the confidence where it prints its inverse, which
would favour bad pixels). Cells that the scalp cuts get its normals. Both are kept as they are, and
D D^T is diffused to all other cells (Paris et al. 2008; thesis 5.4). The direction of a cell is the
eigenvector of the largest eigenvalue; the text's "smallest" is a slip.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit import (
    Head,
    Hull,
    Mask,
    OrientationField,
    OrientationMap,
    ScalpDistance,
    Scene,
    hookimpl,
)
from hairkit.arrays import Float32Array, Float64Array
from hairkit.field.cell_shells import erode_cells
from hairkit.field.diffusion import CellGraph, solve_screened
from hairkit.field.growth_prior import growth_potential
from hairkit.field.view_fusion import Fading, front_depths, fuse_planes, plane_directions
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.options import option
from hairkit.types.volume import outer_products

FIXED = 1e3
"""Weight of known cells against the differences of neighbours: a Dirichlet condition."""


@dataclass(frozen=True)
class Options:
    """Settings of fusion and diffusion."""

    min_views: int = option(2, low=2, high=8, doc="Views that a cell needs to be fused.")
    box: int = option(
        5, low=1, high=31, unit="px", doc="Edge of the box over which confidence is averaged."
    )
    tolerance: float = option(1e-4, low=1e-8, high=0.1, doc="Relative residual of the solver.")


@hookimpl
def solve_field(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    scalp_distance: ScalpDistance,
    options: Options,
) -> OrientationField:
    """Fuse the outer cells, fix the scalp's, diffuse over the loose hull."""
    weighted = tuple(_weigh(found, options.box) for found in orientations)
    fronts = front_depths(scene.cameras, weighted, hull)
    fading = Fading(see_through=0.0, free_depth=hull.grid.spacing)
    planes, views = fuse_planes(scene.cameras, masks, weighted, fronts, hull, fading)
    outer = (hull.dense & ~erode_cells(hull.dense))[hull.loose]  # a face neighbour is no hair
    views[~outer] = 0
    tensor, gap = plane_directions(planes, views, options.min_views)
    weight = np.where(gap > 0, FIXED, 0).astype(np.float32)
    centres = hull.grid.centres_of(hull.loose)
    normal = scalp_normals(scene.head, centres, hull.grid.spacing)
    cut = normal.any(axis=1)
    tensor[cut], weight[cut] = outer_products(normal[cut]), FIXED
    field = np.zeros((*hull.grid.shape, 6), np.float32)
    cells = CellGraph.of(hull.loose)
    field[hull.loose] = solve_screened(cells, tensor, weight, 1.0, tolerance=options.tolerance)
    confidence = np.zeros(hull.grid.shape, np.float32)
    confidence[hull.loose] = np.clip(weight, 0, 1)
    growth = growth_potential(hull, scalp_distance)
    return OrientationField(hull.grid, field, confidence, growth)


def _weigh(found: OrientationMap, box: int) -> OrientationMap:
    """Return the map with the square of its mean confidence over a box of pixels as confidence."""
    mean = cv2.blur(found.confidence, (box, box), borderType=cv2.BORDER_REPLICATE)
    return OrientationMap(found.angle, mean * mean)


def scalp_normals(head: Head, points: Float32Array, spacing: float) -> Float64Array:
    """Return the head's unit normals (N, 3) in the cells that its scalp cuts, zero in others.

    `points` (N, 3) are the centres of cells with edges of `spacing` metres. A cell is cut if the
    surface's nearest point to its centre lies in it; there the normals of the triangle's corners
    are interpolated.
    """
    result = np.zeros(points.shape)
    tree = build_tree(head.vertices, head.faces)
    face, weights, _ = nearest_on_surface(tree, points)
    corners = head.faces[face]
    nearest = np.einsum("nc,ncx->nx", weights, head.vertices[corners].astype(np.float64))
    cut = (np.abs(nearest - points) <= spacing / 2).all(axis=1)
    cut &= np.einsum("nc,nc->n", weights, head.scalp[corners].astype(np.float64)) > 0.5
    normal = np.einsum("nc,ncx->nx", weights[cut], head.normals()[corners[cut]])
    result[cut] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return result
