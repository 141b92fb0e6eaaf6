"""Wisps: single locks that hang off the rest of the hair, thinner than the opened masks hold.

The dense hull is carved with opened masks, so it has no wisps, and the masks themselves break a
wisp into dots whose pictures miss each other by the error of the cameras. Here thin hair, what
opening takes from a mask, is grown by that error before it carves: a cell is kept that no view
calls empty and in which `LEAST_VIEWS` views see thin hair. What stays over bare skin and is long
enough is a wisp. How many strands it holds is told by the share of its picture that is hair.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.field.growth_prior import chamfer_distance
from hairkit.imaging.masked_filters import picture_scale
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.tie import LooseHair
from hairkit.types.volume import Hull, VoxelGrid

OPENING, RIM = 4.0, 10.0
"""Pixels of a picture 1080 high by which masks are opened, as for the dense hull, and about what
is left within which frayed edges are no wisps."""
CAMERA_ERROR = 5.0
"""Pixels of a picture 1080 high by which thin hair is grown: with 4 a wisp of three hairs falls to
pieces, with 6 a ghost of frayed edges joins it."""
LEAST_VIEWS = 3
"""Views that must see thin hair in a cell."""
RIM_CELLS = 2
"""Cells about the dense hull that hold its frayed edges."""
PAD_CELLS = 10
"""Cells around the hull's grid in which wisps are looked for."""
GAP_CELLS = 2
"""Half the gap, in cells, across which pieces of a wisp are joined."""
ROOT_REACH = 0.035
"""Metres from the scalp within which a wisp begins."""
ROOT_DROP = 0.015
"""Metres below its highest place within which a wisp begins."""
SHORTEST = 0.06
"""Metres of a wisp from end to end: frayed hair above the ears leaves pieces of 0.045."""


class _Picture(NamedTuple):
    """What one view says about wisps; all (H, W)."""

    possible: BoolArray
    """Hair may be here: it is hair, grown by the cameras' error."""
    thin: BoolArray
    """Thin hair, grown likewise."""
    hair: BoolArray
    """Hair as the mask has it."""
    surface: Float32Array
    """Depth of the bare head, metres."""


def find_wisps(
    masks: Sequence[Mask], cameras: Sequence[Camera], head: Head, hull: Hull
) -> tuple[LooseHair, ...]:
    """Return the wisps that hang over bare skin off the dense hull."""
    pad = PAD_CELLS * hull.grid.spacing
    grid = VoxelGrid(
        hull.grid.origin - pad,
        hull.grid.spacing,
        tuple(size + 2 * PAD_CELLS for size in hull.grid.shape),
    )
    near = np.pad(ndimage.binary_dilation(hull.dense, iterations=RIM_CELLS), PAD_CELLS)
    cells = np.argwhere(~near)
    points = grid.origin + (cells + 0.5) * grid.spacing
    thin, covered, seen = (np.zeros(len(points), np.int64) for _ in range(3))
    for mask, camera in zip(masks, cameras, strict=True):
        keep, wisp, hair, visible = _look(_picture(mask, camera, head), camera, points)
        votes = (thin + wisp, covered + hair, seen + visible)
        thin, covered, seen = (vote[keep] for vote in votes)
        cells, points = cells[keep], points[keep]
    bare = head.scalp[cKDTree(head.vertices).query(points)[1]] <= 0.5
    chosen = bare & (thin >= LEAST_VIEWS)
    occupied, cover = np.zeros(grid.shape, bool), np.zeros(grid.shape)
    at = tuple(cells[chosen].T)
    occupied[at] = True
    cover[at] = (covered / np.maximum(seen, 1))[chosen]
    return _connected(occupied, cover, grid, head, int(hull.dense.sum()))


def _picture(mask: Mask, camera: Camera, head: Head) -> _Picture:
    scale = picture_scale(mask.labels.shape[0])
    hair = mask.hair.astype(np.uint8)
    core = cv2.erode(hair, _disc(OPENING * scale), borderValue=1)
    bulk = cv2.dilate(core, _disc((OPENING + RIM) * scale))
    reach = _disc(CAMERA_ERROR * scale)
    thin = cv2.dilate(np.where(bulk > 0, 0, hair).astype(np.uint8), reach)
    return _Picture(cv2.dilate(hair, reach) > 0, thin > 0, hair > 0, head_depth(head, camera))


def _look(
    picture: _Picture, camera: Camera, points: Float64Array
) -> tuple[BoolArray, BoolArray, BoolArray, BoolArray]:
    """Return, for points (N, 3): may be hair; is thin hair; is hair; is visible."""
    height, width = picture.hair.shape
    column, row = np.floor(camera.project(points)).astype(np.int64).T
    inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    pixel = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
    visible = inside & (camera.depth(points) < picture.surface[pixel])
    keep = picture.possible[pixel] | ~visible
    return keep, picture.thin[pixel] & visible, picture.hair[pixel] & visible, visible


def _connected(
    occupied: BoolArray, cover: Float64Array, grid: VoxelGrid, head: Head, dense: int
) -> tuple[LooseHair, ...]:
    """Return the connected parts of cells (X, Y, Z) that are long enough, with their ways."""
    corridor = ndimage.binary_dilation(occupied, np.ones((3, 3, 3)), GAP_CELLS)
    parts, _ = ndimage.label(corridor, np.ones((3, 3, 3)))
    scalp = cKDTree(head.vertices[head.scalp > 0.5])
    found = []
    for number, box in enumerate(ndimage.find_objects(parts), 1):
        own, cells = parts[box] == number, occupied[box] & (parts[box] == number)
        corner = grid.origin + grid.spacing * np.array([side.start for side in box])
        centres = corner + (np.argwhere(cells) + 0.5) * grid.spacing
        rooted = scalp.query(centres)[0] < ROOT_REACH
        if not rooted.any():
            continue
        begin = np.zeros(own.shape, bool)
        highest = centres[rooted, 1].max()  # hair falls from its roots
        begin[cells] = rooted & (centres[:, 1] > highest - ROOT_DROP)
        way = chamfer_distance(own, begin, grid.spacing)[cells]
        if way.max() >= SHORTEST:
            rows = np.column_stack([centres, way]).astype(np.float32)
            # the cells are wider than the wisp by 1 / cover in both directions across it
            found.append(LooseHair(rows, float((cover[box][cells] ** 2).sum()) / dense))
    return tuple(found)


def _disc(radius: float) -> UInt8Array:
    size = 2 * max(round(radius), 0) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)
