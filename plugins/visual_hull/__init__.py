"""Visual hull of the hair: votes of silhouettes, or a carve that cuts out head and body too.

`votes` is the thesis's hull (5.2, after Laurentini 1994): a cell is hair when at least `min_views`
views see hair there, then erosions and dilations. `labels` uses all labels of the masks: a view
votes a cell empty where it sees background, and where it sees the person *behind* the cell; it has
no vote behind a surface. Where the views show clothes, a torso is fitted to their outlines and
removed, as the head is. Hair that a view shows only as wisps does not fill a volume: `dense` is
carved with opened masks, `loose` with the masks as they are. Cells that are empty in at most
`forgive` views are kept, which survives camera errors.

* `carving`: votes of views on cells, compiled
* `shell`: how far hair stands off the head where no photo shows it
* `torso_fit`: a torso fitted to the outlines of clothes
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from hairkit import Camera, Head, Hull, Mask, OrientationMap, Scene, VoxelGrid, hookimpl
from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.cameras.depth_raster import SPLAT_CELLS, head_depth, mesh_depth, splat_depth
from hairkit.cameras.projection_kernels import pack_camera
from hairkit.errors import InputError
from hairkit.field.cell_shells import dilate_cells, erode_cells
from hairkit.head_model.signed_distance import signed_distance
from hairkit.head_model.torso import Torso
from hairkit.imaging.masked_filters import picture_scale
from hairkit.options import option

from .carving import EMPTY, HAIR, PERSON, LabelledView, Rule, carve
from .shell import Shell
from .torso_fit import fit_torso

_log = logging.getLogger("hairkit.visual_hull")
POOR_CAMERAS = 8.0
"""Misfit in pixels of a picture 1080 high above which one empty vote is forgiven."""
LYING = 0.04
"""Metres off the body within which hair may lie where a picture's edge cuts it off."""
BELOW_HEAD = np.array([0.3, 0.5, 0.3])
"""Metres beside, below and behind the head's mesh in which hair is looked for: it may be long."""
ABOVE_HEAD = np.array([0.3, 0.3, 0.3])
"""Metres beside, above and before the head's mesh in which hair is looked for."""
MOST_HAIR = 0.05
"""Cubic metres of hair up to which cells have the size that is set: five times the hull of tight
curls (9 litres). Masks that call whole photos hair would be fifty times the work."""
COARSE_CELLS = 4
"""Edge, in cells, of those by which the box of the hair is found."""
SCALP_ROOM = 0.012
"""Metres about the scalp that the grid holds: its shell, and strands that leave the hull."""
CLOTHES_SHRINK = 4
"""Depth maps of the person's hull are this much smaller than the pictures: cells are larger."""
BEHIND_SKIN = 0.02
"""Metres behind seen skin and clothes up to which a cell is empty where views show one side only:
there cells are hair that no view sees."""
LEAST_PART = 0.1
"""Parts of the hull with fewer cells than this share of the largest are dropped."""
SHELL_CELLS = 2
"""Thickness of the shell over the scalp, in cells."""
SCALP_REACH_CELLS = 3
"""Cells from the scalp's vertices within which the shell lies: they are up to 8 mm apart."""
FINEST = 0.0015
"""Metres of the smallest cell: hair 55 cm wide and deep and 70 cm long then fits into a grid, so
that an allowed size is not refused when the cameras are found."""


@dataclass(frozen=True)
class Options:
    """Settings of the hull."""

    mode: str = option("labels", choices=("labels", "votes"), doc="How views decide on a cell.")
    voxel_size: float = option(
        0.0035, low=FINEST, high=0.02, doc="Edge length of a cell.", unit="m"
    )
    min_views: int = option(2, low=1, high=64, doc="Views that must have hair at a cell.")
    forgive: int = option(
        -1, low=-1, high=8, doc="Views that may call a hair cell empty; -1: by the misfit."
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
        0.015, low=0, high=0.2, doc="Depth of clothes where no torso is fitted.", unit="m"
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
def build_hull(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    options: Options,
) -> Hull:
    """Carve the masks in a grid of `voxel_size` cells around the hair."""
    views = _Views.of(scene, masks, options)
    torso = _torso(scene, masks, options)
    dressed = views if torso is None else views.in_front_of(torso)
    shell = Shell.of(scene, masks, orientations, torso) if views.mirrored else None
    grid = _grid_around_hair(scene, dressed, torso, shell, options)
    if torso is not None and grid.origin[1] < torso.top:
        views = dressed
    del dressed  # a picture of depths for each view
    distance = signed_distance(scene.head, grid)
    outside, near = _room(grid, torso, shell, options)
    if options.cut_head:
        outside &= distance > 0
    loose, dense = _carve_both(grid, outside, near, views, options)
    scalp = _scalp_shell(scene, grid, distance) if options.cut_head else np.zeros(grid.shape, bool)
    shape = None if torso is None else torso.shape()
    return Hull(grid, dense, loose | dense | scalp, distance, shape)


def _room(
    grid: VoxelGrid, torso: Torso | None, shell: Shell | None, options: Options
) -> tuple[BoolArray, BoolArray]:
    """Return the cells (X, Y, Z) outside of the torso, and those near enough to the person."""
    outside = np.ones(grid.shape, bool) if shell is None else shell.inside(grid)
    near = np.ones(grid.shape, bool)
    if torso is not None and grid.origin[1] < torso.top:
        outside &= ~torso.inside(grid, options.body_depth)
        above = grid.origin[1] + np.arange(grid.shape[1]) * grid.spacing > torso.top
        near = torso.inside(grid, -LYING) | above[:, None]
    return outside, near


def _torso(scene: Scene, masks: tuple[Mask, ...], options: Options) -> Torso | None:
    """Return the fitted torso, None if disabled."""
    if not (options.cut_body and options.mode == "labels"):
        return None
    found = fit_torso(scene.head, scene.cameras, masks)
    return Torso.under(scene.head) if found is None and scene.one_sided else found


@dataclass(frozen=True)
class _View:
    """The pictures (H, W) by which a view carves."""

    camera: Camera
    loose: UInt8Array
    """Labels that carve the loose hull: `carving.EMPTY`, `PERSON` or `HAIR`."""
    dense: UInt8Array
    """Labels that carve the dense hull."""
    surface: Float32Array
    """Depth of the head, and of the clothes once they are known, metres; infinite elsewhere."""
    open_edges: tuple[bool, bool, bool, bool]
    """Hair touches the left, top, right, bottom edge."""

    @classmethod
    def of(cls, head: Head, camera: Camera, mask: Mask, options: Options) -> _View:
        depth = head_depth(head, camera)
        return cls(camera, *_labels(mask, depth, options), depth, _touched_edges(mask))

    def with_clothes(self, depth: Float32Array) -> _View:
        """Return the view with `depth` (H, W) as the surface where it shows clothes."""
        clothes = (self.loose == PERSON) & ~np.isfinite(self.surface)
        return replace(self, surface=np.where(clothes, depth, self.surface))

    def labelled(self, labels: UInt8Array) -> LabelledView:
        """Return what carving by `labels` (H, W) reads."""
        return LabelledView(pack_camera(self.camera), labels, self.surface, *self.open_edges)


@dataclass(frozen=True)
class _Views:
    """All views, and how many of them may call a hair cell empty."""

    views: tuple[_View, ...]
    forgive: int
    clothed: bool = False
    """True when the surfaces hold the clothes' depth too."""
    mirrored: int = 0
    """How many at the end are mirror images of the others; none where photos go around the head."""

    @classmethod
    def of(cls, scene: Scene, masks: tuple[Mask, ...], options: Options) -> _Views:
        if len(masks) != len(scene.cameras):
            raise InputError(
                f"the scene has {len(scene.cameras)} cameras but {len(masks)} masks came"
            )
        pairs = list(zip(scene.cameras, masks, strict=True))
        mirrored = len(pairs) if options.mode == "labels" and scene.one_sided else 0
        if mirrored:
            pairs += [
                (camera.mirrored(), replace(mask, labels=mask.labels[:, ::-1], alpha=None))
                for camera, mask in pairs
            ]
        views = tuple(_View.of(scene.head, camera, mask, options) for camera, mask in pairs)
        return cls(views, _forgiven_votes(scene, options), mirrored=mirrored)

    def in_front_of(self, torso: Torso) -> _Views:
        """Return the views with the torso as the surface of the clothes."""
        mesh = torso.mesh()
        dressed = [view.with_clothes(mesh_depth(*mesh, view.camera)) for view in self.views]
        return replace(self, views=tuple(dressed), clothed=True)

    def loose(self) -> list[LabelledView]:
        """Return the views that carve the loose hull."""
        return [view.labelled(view.loose) for view in self.views]

    def dense(self) -> list[LabelledView]:
        """Return the views that carve the dense hull."""
        return [view.labelled(view.dense) for view in self.views]


def _touched_edges(mask: Mask) -> tuple[bool, bool, bool, bool]:
    hair = mask.hair
    left, top, right, bottom = hair[:, 0], hair[0], hair[:, -1], hair[-1]
    return bool(left.any()), bool(top.any()), bool(right.any()), bool(bottom.any())


def _labels(mask: Mask, depth: Float32Array, options: Options) -> tuple[UInt8Array, UInt8Array]:
    """Return the label pictures (H, W) that carve the loose and the dense hull."""
    scale = picture_scale(mask.labels.shape[0])
    hair = mask.hair.astype(np.uint8)
    grown = cv2.dilate(hair, _disc(options.slack * scale)) if options.slack else hair
    rest = PERSON * mask.person.astype(np.uint8)
    if not mask.person_known:
        rest[np.isfinite(depth)] = PERSON
        rows = np.flatnonzero(np.isfinite(depth).any(axis=1))
        if len(rows):
            rest[rows[-1] :] = PERSON
    core: npt.NDArray[Any] = hair
    if options.mode == "labels" and options.opening:
        eroded = cv2.erode(hair, _disc(options.opening * scale), borderValue=1)
        core = cv2.dilate(eroded, _disc((options.opening + options.slack) * scale))
    loose, dense = rest.copy(), rest
    loose[grown > 0] = HAIR
    dense[hair > 0] = EMPTY
    dense[core > 0] = HAIR
    return loose, dense


def _disc(radius: float) -> UInt8Array:
    size = 2 * max(round(radius), 0) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)


def _grid_around_hair(
    scene: Scene, views: _Views, torso: Torso | None, shell: Shell | None, options: Options
) -> VoxelGrid:
    """Return the grid that holds the hair, found on coarse cells.

    Its cells grow where there is more than `MOST_HAIR`.
    """
    low = scene.head.vertices.min(axis=0).astype(np.float64) - BELOW_HEAD
    high = scene.head.vertices.max(axis=0).astype(np.float64) + ABOVE_HEAD
    coarse = VoxelGrid.around(low, high, COARSE_CELLS * options.voxel_size)
    outside, near = _room(coarse, torso, shell, options)
    occupied = carve(coarse, outside, near, views.loose(), _rule(options, views))
    cells = np.argwhere(_largest_part(occupied))
    share = len(cells) * coarse.spacing**3 / MOST_HAIR
    spacing = options.voxel_size * max(1.0, share) ** (1 / 3)
    if share > 1:
        said = "masks hold %.0f litres of hair, so cells are %.1f mm wide, not %.1f; look at them"
        _log.warning(said, *(1000 * v for v in (share * MOST_HAIR, spacing, options.voxel_size)))
    if not len(cells):
        raise InputError(
            "the hull is empty: the masks of the views do not overlap in space; "
            "check masks and cameras"
        )
    corners = (
        coarse.origin + np.array([cells.min(axis=0) - 1, cells.max(axis=0) + 2]) * coarse.spacing
    )
    scalp = scene.head.vertices[scene.head.scalp > 0.5]
    return VoxelGrid.around(
        np.minimum(corners[0], scalp.min(axis=0) - SCALP_ROOM),
        np.maximum(corners[1], scalp.max(axis=0) + SCALP_ROOM),
        spacing,
    )


def _carve_both(
    grid: VoxelGrid, outside: BoolArray, near: BoolArray, views: _Views, options: Options
) -> tuple[BoolArray, BoolArray]:
    if options.mode == "votes":
        rule = _rule(options, replace(views, forgive=len(views.views)))
        voted = carve(grid, outside, near, views.loose(), rule)
        if options.erosions:
            voted = erode_cells(voted, options.erosions)
        if options.dilations:
            voted = dilate_cells(voted, options.dilations) & outside
        voted = _largest_part(voted)
        return voted, voted
    rule = _rule(options, views)
    body = views if views.clothed else _with_person_hull(grid, views, options)
    loose = _largest_part(carve(grid, outside, near, body.loose(), rule))
    dense = carve(grid, loose, near, body.dense(), rule)
    dense = _largest_part(dense) if dense.any() else loose
    reach = dilate_cells(dense, options.loose_cells)
    return loose & reach, dense


def _rule(options: Options, views: _Views) -> Rule:
    margin = float(options.front_margin)
    hides = options.mode == "labels" and options.cut_head
    hidden = margin if hides else np.inf
    before = -BEHIND_SKIN if views.mirrored else margin
    return Rule(options.min_views, views.forgive, before, hidden, views.mirrored)


def _forgiven_votes(scene: Scene, options: Options) -> int:
    """Return how many empty votes a cell survives: the option, or one if cameras are poor."""
    if options.forgive >= 0:
        return options.forgive
    limit = POOR_CAMERAS * picture_scale(scene.cameras[0].height)
    return int(scene.residual_px is not None and scene.residual_px > limit)


def _with_person_hull(grid: VoxelGrid, views: _Views, options: Options) -> _Views:
    """Return the views with clothes at `body_margin` behind the hull of the whole person."""
    everything = np.ones(grid.shape, bool)
    persons = [
        view.labelled(np.where(view.loose == EMPTY, EMPTY, HAIR).astype(np.uint8))
        for view in views.views
    ]
    hull = carve(grid, everything, everything, persons, _rule(options, replace(views, forgive=0)))
    points = grid.centres_of(hull & ~erode_cells(hull))
    behind = options.body_margin + options.front_margin
    dressed = []
    for view in views.views:
        height, width = view.surface.shape
        depth = np.full((height // CLOTHES_SHRINK, width // CLOTHES_SHRINK), np.inf, np.float32)
        splat_depth(pack_camera(view.camera), points, SPLAT_CELLS * grid.spacing, depth)
        full = cv2.resize(depth, (width, height), interpolation=cv2.INTER_NEAREST)
        dressed.append(view.with_clothes(full + behind))
    return replace(views, views=tuple(dressed))


def _largest_part(occupied: BoolArray) -> BoolArray:
    """Return the largest connected part, and others of at least `LEAST_PART` of its cells."""
    parts, count = ndimage.label(occupied)
    if count == 0:
        return occupied
    sizes = np.bincount(parts.ravel())[1:]
    keep = np.array([False, *(sizes >= LEAST_PART * sizes.max())])
    return np.asarray(keep[parts], bool)


def _scalp_shell(scene: Scene, grid: VoxelGrid, distance: Float32Array) -> BoolArray:
    """Return the cells that touch the scalp from outside: roots always lie in the hull."""
    shell = (distance > -grid.spacing) & (distance < SHELL_CELLS * grid.spacing)
    near = np.zeros(grid.shape, bool)
    cells = grid.nearest_cell(scene.head.vertices[scene.head.scalp > 0.5])
    near[tuple(cells.T)] = True
    return shell & dilate_cells(near, SCALP_REACH_CELLS)
