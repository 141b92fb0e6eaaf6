"""Strands led through hair that the photos show and no strand from the scalp reaches.

Strands grow from the scalp as it is known and follow the field. A fringe whose roots its own hair
hides, or a lock behind a ridge of the hull, is then passed by none, though the field there is
right. The photos tell where: a pixel of hair on which no strand is drawn. From cells of the hull
behind such pixels strands are followed back to the scalp and on to their tips; each takes the
place of the strand of the nearest root.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.field.cell_shells import dilate_cells
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull

REACH = 0.004
"""Metres about a strand, at least, that count as covered, in space and, on the head, in pictures;
the rim of a mask as wide does not count, either."""
BEHIND = 0.006
"""Metres under the head's surface at which cells are still seen: the head fits to that."""
ROOT_REACH = 0.04
"""Metres between a root and the way that is led to it, at most: fringes have their roots up to
2 cm before the hairline of a head whose forehead they hide."""


def find_bare_cells(
    strands: Strands, hull: Hull, masks: Sequence[Mask], cameras: Sequence[Camera], head: Head
) -> Float64Array:
    """Return the centres (K, 3), metres, of dense cells whose hair no strand shows.

    No strand comes near the cell, and a view that sees it, before the head, has hair at its pixel
    and no strand near it. A strand stands for the hair up to the next root: a hundred guides leave
    as few cells as ten thousand strands.
    """
    apart = cKDTree(strands.roots).query(strands.roots, k=[2])[0]
    reach = max(REACH, float(np.median(apart))) if len(strands) > 1 else REACH
    passed = _passed(strands, hull)
    rounds = max(round(reach / hull.grid.spacing), 1)
    bare = hull.grid.centres_of(hull.dense & ~dilate_cells(passed, rounds)).astype(np.float64)
    covering = hull.grid.centres_of(passed).astype(np.float64)
    shown = np.zeros(len(bare), bool)
    for mask, camera in zip(masks, cameras, strict=True):
        surface = head_depth(head, camera)
        missing = _missing(mask.hair, surface, camera, covering, reach)
        row, column, seen = _seen(surface, camera, bare)
        shown |= seen & missing[row, column]
    return bare[shown]


def _passed(strands: Strands, hull: Hull) -> BoolArray:
    """Return the cells (X, Y, Z) through which strands of equal point counts pass."""
    points = strands.points.reshape(len(strands), -1, 3)
    longest = np.linalg.norm(np.diff(points, axis=1), axis=2).max(initial=0.0)
    between = max(int(np.ceil(longest / hull.grid.spacing)), 1)
    cells = np.zeros(hull.grid.shape, bool)
    for share in np.arange(between) / between:
        at = points[:, :-1] + np.float32(share) * np.diff(points, axis=1)
        cells[tuple(hull.grid.nearest_cell(at.reshape(-1, 3)).T)] = True
    return cells


def _missing(
    hair: BoolArray, surface: Float32Array, camera: Camera, covering: Float64Array, reach: float
) -> BoolArray:
    """Return the pixels (H, W) well inside the hair within `reach` of no covering place (N, 3)."""
    covered = np.zeros(hair.shape, np.uint8)
    row, column, seen = _seen(surface, camera, covering)
    covered[row[seen], column[seen]] = 1
    scale = camera.focal
    if camera.model == "perspective":
        scale /= float(camera.depth(np.zeros(3)))
    rim, near = (max(round(metres * scale), 1) for metres in (REACH, reach))
    return (_pixels_off(hair) > rim) & (_pixels_off(covered == 0) > near)


def _pixels_off(marked: BoolArray) -> Float32Array:
    """Return (H, W) the distance in pixels to the nearest pixel that is not marked."""
    away = cv2.distanceTransform(marked.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    return np.asarray(away, np.float32)


def _seen(
    surface: Float32Array, camera: Camera, points: Float64Array
) -> tuple[Int64Array, Int64Array, BoolArray]:
    """Return rows and columns (N,) of points (N, 3), and whether they lie in the picture, before
    the head's surface (H, W).
    """
    height, width = surface.shape
    column, row = np.floor(camera.project(points)).astype(np.int64).T
    inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    row, column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
    return row, column, inside & (camera.depth(points) < surface[row, column] + BEHIND)


def spread_seeds(bare: Float64Array, hull: Hull, strands: float) -> Float32Array:
    """Return starts (K, 3) in bare cells (N, 3): `strands` times their share of the hair."""
    wanted = int(np.ceil(strands * len(bare) / max(int(hull.dense.sum()), 1)))
    chosen = np.arange(wanted) * len(bare) // max(wanted, 1)
    jitter = np.random.RandomState(0).uniform(-0.5, 0.5, (wanted, 3))  # its stream never changes
    return (bare[chosen] + hull.grid.spacing * jitter).astype(np.float32)


def lead_to_roots(
    strands: Strands, roots: Float32Array, back: Float32Array, ahead: Float32Array
) -> Strands:
    """Return the strands, some replaced by ways `back` to the scalp and `ahead` (K, M, 3).

    Both begin at the same places. A way back ends where it comes nearest to a root (N, 3), and
    joins the nearest root that bears no other way, as far along as the root is off it, but not
    beyond its beginning, so that it bends towards the root; ways that end too far from all are
    left out.
    """
    tree = cKDTree(roots)
    nearest = tree.query(back.reshape(-1, 3))[0].reshape(len(back), -1)
    free = np.ones(len(roots), bool)
    chosen, lines = [], []
    for way, on, end in zip(back, ahead, nearest.argmin(axis=1), strict=True):
        near = np.array(tree.query_ball_point(way[end], ROOT_REACH), np.int64)
        near = near[free[near]]
        if len(near):
            off = np.linalg.norm(roots[near] - way[end], axis=1)
            root = near[np.argmin(off)]
            free[root] = False
            chosen.append(root)
            led = way[end::-1]
            along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(led, axis=0), axis=1))]
            start = min(int(np.searchsorted(along, off.min())), end)
            lines.append(np.concatenate([roots[root, None], led[start:], on[1:]]))
    if not chosen:
        return strands
    points = strands.points.reshape(len(strands), -1, 3).copy()
    even = Strands.from_list(lines).resampled(points.shape[1])
    points[chosen] = even.points.reshape(len(chosen), -1, 3)
    return replace(strands, points=points.reshape(-1, 3))
