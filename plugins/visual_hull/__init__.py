"""Visual hull of the hair: votes of silhouettes, or a carve that cuts out head and body too.

`votes` is the thesis's hull (5.2, after Laurentini 1994): a cell is hair when at least `min_views`
views see hair there, then erosions and dilations. `labels` uses all that a mask says: a view
empties a cell where it sees background, and where it sees the person *behind* the cell; a surface
in front of the cell says nothing. Where the views show clothes, a torso is fitted to their outlines
and is taken out as the head is. Hair that a view shows only as wisps does not fill a volume:
`dense` is carved with opened masks, `loose` with the masks as they are. Cells that are empty in at
most `forgive` views are kept, which survives camera errors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit, prange
from scipy import ndimage

from hairkit import Hull, Mask, Scene, VoxelGrid, hookimpl
from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.cameras.projection_kernels import (
    head_depth,
    mesh_depth,
    pack_cameras,
    project_row,
    splat_depth,
)
from hairkit.errors import InputError
from hairkit.head_model.signed_distance import signed_distance
from hairkit.head_model.torso import Torso
from hairkit.imaging.masked_filters import picture_scale
from hairkit.options import option

from .torso_fit import fit_torso

EMPTY, PERSON, HAIR, UNSEEN = 0, 1, 2, 3
POOR_CAMERAS = 8.0
"""Misfit in pixels of a picture 1080 high above which one empty vote is forgiven."""
LYING = 0.04
"""Metres off the body within which hair may lie where a picture's edge cuts it off."""


@dataclass(frozen=True)
class Options:
    """Settings of the hull."""

    mode: str = option("labels", choices=("labels", "votes"), doc="How views decide on a cell.")
    voxel_size: float = option(0.003, low=0.001, high=0.02, doc="Edge length of a cell.", unit="m")
    min_views: int = option(2, low=1, high=64, doc="Views that must see hair in a cell.")
    forgive: int = option(
        -1,
        low=-1,
        high=8,
        doc="Views that may call a hair cell empty; -1 lets the scene's misfit decide.",
    )
    slack: float = option(2.0, low=0, high=30, doc="Growth of the hair masks.", unit="px")
    opening: float = option(
        4.0, low=0, high=40, doc="Opening of the masks that carve the dense hull.", unit="px"
    )
    loose_cells: int = option(
        3, low=1, high=100, doc="Cells that the loose hull may reach beyond the dense one."
    )
    front_margin: float = option(
        0.006, low=0, high=0.05, doc="A cell this far in front of seen skin is empty.", unit="m"
    )
    body_margin: float = option(
        0.015,
        low=0,
        high=0.2,
        doc="Assumed depth of clothes behind the person's hull, where no torso is fitted.",
        unit="m",
    )
    erosions: int = option(0, low=0, high=8, doc="Erosions of the voted hull.")
    dilations: int = option(0, low=0, high=8, doc="Dilations after the erosions.")
    cut_head: bool = option(True, doc="Take the head out of the hull.")
    cut_body: bool = option(
        True, doc="Fit a torso where clothes are seen, and take it out of the hull."
    )
    body_depth: float = option(
        0.005, low=0, high=0.05, doc="Hair may lie this deep in the fitted torso.", unit="m"
    )


@hookimpl
def build_hull(scene: Scene, masks: tuple[Mask, ...], options: Options) -> Hull:
    """Carve the masks in a grid of `voxel_size` cells around the hair."""
    views = _Views.of(scene, masks, options)
    box = _bounding_box(scene, views, options)
    grid = VoxelGrid.around(box[0], box[1], options.voxel_size)
    distance = signed_distance(scene.head, grid)
    outside = distance > 0 if options.cut_head else np.ones(grid.shape, bool)
    near = np.ones(grid.shape, bool)
    torso = _torso(scene, masks, grid, options)
    if torso is not None:
        outside &= ~torso.inside(grid, options.body_depth)
        above = grid.origin[1] + np.arange(grid.shape[1]) * grid.spacing > torso.top
        near = torso.inside(grid, -LYING) | above[:, None]
        views = views.before(torso, scene)
    loose, dense = _carve_both(grid, outside, near, views, options)
    scalp = _scalp_shell(scene, grid, distance) if options.cut_head else np.zeros(grid.shape, bool)
    return Hull(grid, dense, loose | dense | scalp, distance)


def _torso(
    scene: Scene, masks: tuple[Mask, ...], grid: VoxelGrid, options: Options
) -> Torso | None:
    """Return the fitted torso, None where nobody wants it or the hair does not reach down to it."""
    reached = grid.origin[1] < Torso.under(scene.head).top
    if not (options.cut_body and options.mode == "labels" and reached):
        return None
    return fit_torso(scene.head, scene.cameras, masks)


@dataclass(frozen=True)
class _Views:
    """What the carving kernel reads of every view, stacked (V, H, W)."""

    cameras: npt.NDArray[np.float64]
    sizes: npt.NDArray[np.float64]
    """(V, 2) width and height of each view's picture."""
    loose: UInt8Array
    dense: UInt8Array
    surface: Float32Array
    forgive: int
    """Views that may call a hair cell empty."""
    open_edges: BoolArray
    """(V, 4) hair touches the picture's left, top, right, bottom edge: nothing is known beyond
    it."""
    clothed: bool = False
    """True when `surface` holds the clothes' depth too."""

    @classmethod
    def of(cls, scene: Scene, masks: tuple[Mask, ...], options: Options) -> _Views:
        if len(masks) != len(scene.cameras):
            raise InputError(
                f"the scene has {len(scene.cameras)} cameras but {len(masks)} masks came"
            )
        height = max(mask.labels.shape[0] for mask in masks)
        width = max(mask.labels.shape[1] for mask in masks)
        shape = (len(masks), height, width)
        loose, dense = np.full(shape, UNSEEN, np.uint8), np.full(shape, UNSEEN, np.uint8)
        surface = np.full(shape, np.inf, np.float32)
        for i, (mask, camera) in enumerate(zip(masks, scene.cameras, strict=True)):
            h, w = mask.labels.shape
            depth = head_depth(scene.head, camera)
            surface[i, :h, :w] = depth
            loose[i, :h, :w], dense[i, :h, :w] = _labels(mask, depth, options)
        edges = np.array([_touched_edges(mask) for mask in masks])
        sizes = np.array([mask.labels.shape[::-1] for mask in masks], np.float64)
        forgive = _forgiven(scene, options)
        return cls(pack_cameras(scene.cameras), sizes, loose, dense, surface, forgive, edges)

    def before(self, torso: Torso, scene: Scene) -> _Views:
        """Return the views with the torso as the surface of the clothes."""
        vertices, faces = torso.mesh()
        surface = self.surface.copy()
        for i, camera in enumerate(scene.cameras):
            depth = np.full(surface[i].shape, np.inf, np.float32)
            depth[: camera.height, : camera.width] = mesh_depth(vertices, faces, camera)
            clothes = (self.loose[i] == PERSON) & ~np.isfinite(surface[i])
            surface[i][clothes] = depth[clothes]
        return replace(self, surface=surface, clothed=True)


def _touched_edges(mask: Mask) -> list[bool]:
    hair = mask.hair
    return [bool(edge.any()) for edge in (hair[:, 0], hair[0], hair[:, -1], hair[-1])]


def _labels(mask: Mask, depth: Float32Array, options: Options) -> tuple[UInt8Array, UInt8Array]:
    """Return the label pictures (H, W) that carve the loose and the dense hull."""
    scale = picture_scale(mask.labels.shape[0])
    hair = mask.hair.astype(np.uint8)
    grown = cv2.dilate(hair, _disc(options.slack * scale)) if options.slack else hair
    rest = np.where(mask.person, PERSON, EMPTY).astype(np.uint8)
    if not mask.person_known:
        rest[np.isfinite(depth)] = PERSON
        rest[_below_head(depth) :] = PERSON
    core: npt.NDArray[Any] = hair
    if options.mode == "labels" and options.opening:
        eroded = cv2.erode(hair, _disc(options.opening * scale), borderValue=1)
        core = cv2.dilate(eroded, _disc((options.opening + options.slack) * scale))
    bare = np.where(hair > 0, EMPTY, rest)
    return (
        np.where(grown > 0, HAIR, rest).astype(np.uint8),
        np.where(core > 0, HAIR, bare).astype(np.uint8),
    )


def _below_head(depth: Float32Array) -> int:
    rows = np.flatnonzero(np.isfinite(depth).any(axis=1))
    return int(rows[-1]) if len(rows) else depth.shape[0]


def _disc(radius: float) -> UInt8Array:
    size = 2 * max(round(radius), 0) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)


def _bounding_box(
    scene: Scene, views: _Views, options: Options
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the corners of the box that holds the hair, found on cells four times as large."""
    low = scene.head.vertices.min(axis=0).astype(np.float64) - np.array([0.3, 0.5, 0.3])
    high = scene.head.vertices.max(axis=0).astype(np.float64) + np.array([0.3, 0.3, 0.3])
    coarse = VoxelGrid.around(low, high, 4 * options.voxel_size)
    everywhere = np.ones(coarse.shape, bool)
    occupied = _carve(
        coarse,
        everywhere,
        everywhere,
        views,
        views.loose,
        options,
        views.forgive,
    )
    cells = np.argwhere(_largest_part(occupied))
    if not len(cells):
        raise InputError(
            "the hull is empty: the masks of the views do not overlap in space; "
            "check masks and cameras"
        )
    shell = 0.012  # room for the shell over the scalp and for strands that leave the hull
    corners = (
        coarse.origin + np.array([cells.min(axis=0) - 1, cells.max(axis=0) + 2]) * coarse.spacing
    )
    scalp = scene.head.vertices[scene.head.scalp > 0.5]
    return (
        np.minimum(corners[0], scalp.min(axis=0) - shell),
        np.maximum(corners[1], scalp.max(axis=0) + shell),
    )


def _carve_both(
    grid: VoxelGrid, outside: BoolArray, near: BoolArray, views: _Views, options: Options
) -> tuple[BoolArray, BoolArray]:
    forgive = views.forgive
    if options.mode == "votes":
        voted = _carve(grid, outside, near, views, views.loose, options, len(views.cameras))
        voted = (
            ndimage.binary_erosion(voted, iterations=options.erosions)
            if options.erosions
            else voted
        )
        if options.dilations:
            voted = ndimage.binary_dilation(voted, iterations=options.dilations) & outside
        voted = _largest_part(voted)
        return voted, voted
    body = views if views.clothed else _clothes_depth(grid, views, options)
    loose = _largest_part(_carve(grid, outside, near, body, views.loose, options, forgive))
    dense = _carve(grid, loose, near, body, views.dense, options, forgive)
    dense = _largest_part(dense) if dense.any() else loose
    reach = ndimage.binary_dilation(dense, iterations=options.loose_cells)
    return loose & reach, dense


def _forgiven(scene: Scene, options: Options) -> int:
    """Return how many empty votes a cell survives: the option, or one if cameras are poor."""
    if options.forgive >= 0:
        return options.forgive
    limit = POOR_CAMERAS * picture_scale(scene.cameras[0].height)
    return int(scene.residual_px is not None and scene.residual_px > limit)


def _clothes_depth(grid: VoxelGrid, views: _Views, options: Options) -> _Views:
    """Return the views with a surface where they see clothes: the person's hull plus
    `body_margin`."""
    person = np.where(views.loose == EMPTY, EMPTY, np.where(views.loose == UNSEEN, UNSEEN, HAIR))
    everything = np.ones(grid.shape, bool)
    hull = _carve(grid, everything, everything, views, person.astype(np.uint8), options, 0)
    points = grid.centres_of(hull & ~ndimage.binary_erosion(hull))
    surface = views.surface.copy()
    for i, row in enumerate(views.cameras):
        height, width = surface[i].shape
        depth = np.full((height // 4, width // 4), np.inf, np.float32)
        row = row.copy()
        row[19] = height
        splat_depth(row, points, 0.75 * grid.spacing, depth)
        full = cv2.resize(depth, (width, height), interpolation=cv2.INTER_NEAREST)
        clothes = (views.loose[i] == PERSON) & ~np.isfinite(surface[i])
        surface[i][clothes] = full[clothes] + options.body_margin + options.front_margin
    return replace(views, surface=surface)


def _carve(
    grid: VoxelGrid,
    candidates: BoolArray,
    near: BoolArray,
    views: _Views,
    labels: UInt8Array,
    options: Options,
    forgive: int,
) -> BoolArray:
    """Return the candidate cells (X, Y, Z) with enough hair votes and at most `forgive` empty
    ones; beyond a picture only cells `near` the person may hold hair."""
    kept: BoolArray = _carve_cells(
        grid.origin,
        grid.spacing,
        candidates,
        near,
        views.cameras,
        views.sizes,
        views.open_edges,
        labels,
        views.surface,
        options.front_margin,
        options.min_views,
        forgive,
    )
    return kept


@njit(cache=True, parallel=True)
def _carve_cells(  # type: ignore[no-untyped-def]
    origin,
    spacing,
    candidates,
    near,
    cameras,
    sizes,
    open_edges,
    labels,
    surface,
    margin,
    min_views,
    forgive,
):
    size_x, size_y, size_z = candidates.shape
    views = labels.shape[0]
    kept = np.zeros(candidates.shape, np.bool_)
    for ix in prange(size_x):
        x = origin[0] + (ix + 0.5) * spacing
        for iy in range(size_y):
            y = origin[1] + (iy + 0.5) * spacing
            for iz in range(size_z):
                if not candidates[ix, iy, iz]:
                    continue
                z = origin[2] + (iz + 0.5) * spacing
                hair = 0
                empty = 0
                for view in range(views):
                    u, v, depth = project_row(cameras[view], x, y, z)
                    right, bottom = u >= sizes[view, 0], v >= sizes[view, 1]
                    if u < 0 or v < 0 or right or bottom:
                        edge = open_edges[view]
                        unknown = near[ix, iy, iz] and (
                            (u < 0 and edge[0])
                            or (v < 0 and edge[1])
                            or (right and edge[2])
                            or (bottom and edge[3])
                        )
                        if not unknown:
                            empty += 1
                            if empty > forgive:
                                break
                        continue
                    column, line = int(u), int(v)
                    label = labels[view, line, column]
                    if label == 2:
                        hair += 1
                    elif label == 0 or (
                        label == 1
                        and depth < surface[view, line, column] - margin
                        and surface[view, line, column] < 1e9
                    ):
                        empty += 1
                        if empty > forgive:
                            break
                kept[ix, iy, iz] = empty <= forgive and hair >= min_views
    return kept


def _largest_part(occupied: BoolArray) -> BoolArray:
    """Return the largest connected part and every other one at least a tenth as large, holes
    filled."""
    parts, count = ndimage.label(occupied)
    if count == 0:
        return occupied
    sizes = np.bincount(parts.ravel())[1:]
    keep = np.array([False, *(sizes >= 0.1 * sizes.max())])
    return np.asarray(keep[parts], bool)


def _scalp_shell(scene: Scene, grid: VoxelGrid, distance: Float32Array) -> BoolArray:
    """Return the cells that touch the scalp from outside: roots always lie in the hull."""
    shell = (distance > -grid.spacing) & (distance < 2 * grid.spacing)
    near = np.zeros(grid.shape, bool)
    cells = grid.nearest_cell(scene.head.vertices[scene.head.scalp > 0.5])
    near[tuple(cells.T)] = True
    return np.asarray(shell & ndimage.binary_dilation(near, iterations=3), bool)
