"""How far hair stands off the head where photos of one side do not bound it.

One photo, or a few from one side, bound the hair across their views and not along them. Where a
photo sees hair, it is between the depths that a network tells (`hairkit.field.hair_depth`).
Elsewhere it lies about the head as a shell. Its outline shows the shell's thickness at the two
bearings beside each view, at every height, down to the hair's ends; in between it is interpolated
around the head. The mirrored photo counts where the photo itself sees nothing: heads are alike on
both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from hairkit import Camera, Mask, OrientationMap, Scene, VoxelGrid
from hairkit.arrays import BoolArray, Float64Array
from hairkit.field.hair_depth import HairDepth, guess_hair_depth, head_middle
from hairkit.head_model.torso import Torso
from hairkit.types.head import BROWS

CAP = 0.1
"""Radius of the arcs that measure height above the head's middle, metres."""
STEP, REACH = 0.004, 0.45
"""Edge of the table's rows, and how far they go down from the head's middle, metres."""
BEARINGS = 72
"""Columns of the table, from behind over the subject's right, the front and the left."""
PROBE, FARTHEST = 0.002, 0.3
"""Distance of the points looked up along an outline's radius, and the last one's, metres."""
NEAR_BEARING, EVEN = 4.0, 0.04
"""Concentration (von Mises) of an outline's say about other bearings: half of it 34 degrees away.
Metres along the height over which hair is evened far from all outlines, where locks may bulge."""
MIRRORED = 0.05
"""Weight of a mirrored outline: it decides only where no other is near."""
HANGS = 0.499
"""Least share of the outlines, by nearness, that have hair at a height where there is some: hair of
one side alone reaches to the middle of the back."""
SMOOTH = 0.008
"""Standard deviation along the height over which outlines are smoothed, metres."""
LYING = 0.015
"""Thickness of hair that lies on face and back, metres."""
CHIN = -0.15
"""Height below the head's middle down to which outlines show how thick hair hangs, metres: further
down it spreads over the shoulders."""
CUT_OFF = 0.1
"""How far hair goes on that the picture's lower edge cuts off, metres. F at 4 mm/40 of eight fronts
cut off below the chin (length): 55.9 (0.55) without, 60.6 (0.75) here, 58.1 (0.85) with 0.15."""
CHIN_POINT, EYE_CORNERS, BEHIND_EYES = 8, [36, 45], 0.02
"""Landmarks, and metres behind these outer corners from which on hair beside the face lies on it:
with eight photos up to 0.6 % of a head's hair stands before, with one it was up to 17 %."""
FACE = 0.4
"""Cosine of the bearing up to which an outline is that of the face."""


@dataclass(frozen=True, eq=False)
class Shell:
    """The room that hair may fill, as radii about the head's axis."""

    middle: Float64Array
    """(3,) of the cranium, metres."""
    limit: Float64Array
    """(BEARINGS, rows) largest radius of hair, metres; negative where none is."""
    sides: tuple[tuple[float, Float64Array], ...]
    """Bearing (radians) of each outline, and its radius (rows,)."""
    depths: tuple[HairDepth, ...]
    """How far away the hair is that each view sees."""
    head: Float64Array
    """(BEARINGS, rows) radius of the head, metres."""
    face: tuple[float, float, float]
    """Heights of chin and brows; how far before the middle hair between them stands off, metres."""

    @classmethod
    def of(
        cls,
        scene: Scene,
        masks: Sequence[Mask],
        orientations: Sequence[OrientationMap],
        torso: Torso | None,
    ) -> Shell:
        """Return the shell that the outlines of all views show."""
        middle = head_middle(scene.head)
        head = _radii(scene.head.vertices - middle)
        hang = _hang(head)
        sides = tuple(
            (side, _outline(camera, mask, middle, side, hang[_column(side)]))
            for camera, mask in zip(scene.cameras, masks, strict=True)
            for side in np.radians(camera.azimuth_deg) + np.array([-1, 1]) * np.pi / 2
        )
        thickness, there = _between(sides, hang)
        limit = hang + thickness
        if torso is not None:
            limit = np.maximum(limit, _radii(torso.mesh()[0] - middle) + LYING)
        depths = tuple(
            guess_hair_depth(scene.head, *view)
            for view in zip(scene.cameras, masks, orientations, strict=True)
        )
        face = (np.inf, -np.inf, np.inf)
        if scene.head.landmark_vertices is not None:
            places = scene.head.vertices[scene.head.landmark_vertices] - middle
            before = places[EYE_CORNERS, 2].mean() - BEHIND_EYES
            face = (places[CHIN_POINT, 1], places[BROWS, 1].mean(), before)
        return cls(middle, np.where(there, limit, -1.0), sides, depths, head, face)

    def inside(self, grid: VoxelGrid) -> BoolArray:
        """Return the cells (X, Y, Z) in which there may be hair."""
        points = grid.centres_of(np.ones(grid.shape, bool)) - self.middle
        bearing, row, radius = _place(points)
        found = radius <= _look_up(self.limit, bearing, row)
        for side, outline in self.sides:
            across = points @ np.array([np.sin(side), 0.0, np.cos(side)])
            width = np.interp(row, np.arange(len(outline)), outline)
            found &= (across <= width) | (_tells_nothing(side) & (width == 0))
        views, deep = np.zeros(len(points), int), np.zeros(len(points))
        for depth in self.depths:
            seen, inwards = depth.within(points + self.middle)
            views += seen
            deep += np.where(seen, inwards, 0)
        chin, brows, before = self.face
        beside = (points[:, 1] > chin) & (points[:, 1] < brows) & (points[:, 2] > before)
        beside &= radius > _look_up(self.head, bearing, row) + LYING
        return np.asarray((np.where(views, deep >= 0, found) & ~beside).reshape(grid.shape))


def _heights() -> Float64Array:
    """Return the rows' heights: metres below the middle, above it metres along `CAP`."""
    return np.arange(-REACH, CAP * np.pi / 2 + STEP, STEP)


def _place(points: Float64Array) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return column, row and radius (N,) of points (N, 3) about the head's middle."""
    x, y, z = np.asarray(points, np.float64).T
    level = np.hypot(x, z)
    above = y > 0
    height = np.where(above, CAP * np.arctan2(np.maximum(y, 0), level), y)
    bearing = (np.arctan2(x, z) / (2 * np.pi) + 0.5) * BEARINGS
    return bearing, (height + REACH) / STEP, np.where(above, np.hypot(level, y), level)


def _look_up(radii: Float64Array, bearing: Float64Array, row: Float64Array) -> Float64Array:
    """Return radii (N,) of a table (BEARINGS, rows) at columns and rows (N,)."""
    around = np.pad(radii, ((0, 1), (0, 0)), "wrap")
    return np.asarray(ndimage.map_coordinates(around, [bearing, row], order=1, mode="nearest"))


def _radii(points: Float64Array) -> Float64Array:
    """Return the largest radius (BEARINGS, rows) of points (N, 3) of a surface; 0 without any."""
    bearing, row, radius = _place(points)
    found = np.zeros((BEARINGS, len(_heights())))
    rows = np.rint(row).astype(int)
    known = (rows >= 0) & (rows < found.shape[1])
    where = np.rint(bearing[known]).astype(int) % BEARINGS, rows[known]
    np.maximum.at(found, where, radius[known])
    return np.asarray(ndimage.grey_closing(found, (5, 7), mode="nearest"))


def _hang(head: Float64Array) -> Float64Array:
    """Return radii on which hair lies or hangs: they do not shrink below the head's middle."""
    below = _heights() <= 0
    radii = head.copy()
    radii[:, below] = np.maximum.accumulate(head[:, below][:, ::-1], axis=1)[:, ::-1]
    return radii


def _column(bearing: float) -> int:
    """Return the column of a bearing in radians."""
    return round((bearing / (2 * np.pi) + 0.5) * BEARINGS) % BEARINGS


def _hair_at(camera: Camera, mask: Mask, points: Float64Array) -> BoolArray:
    """Return at which points (..., 3) a view has hair."""
    x, y = np.moveaxis(np.floor(np.nan_to_num(camera.project(points), nan=-1)).astype(int), -1, 0)
    known = (x >= 0) & (y >= 0) & (x < camera.width) & (y < camera.height)
    return np.asarray(known & mask.hair[np.where(known, y, 0), np.where(known, x, 0)])


def _outwards(bearing: float) -> Float64Array:
    """Return the rows' unit directions (rows, 3) at a bearing."""
    rise = np.maximum(_heights(), 0) / CAP
    level = np.cos(rise)
    return np.stack([np.sin(bearing) * level, np.sin(rise), np.cos(bearing) * level], axis=1)


def _outline(
    camera: Camera, mask: Mask, middle: Float64Array, side: float, support: Float64Array
) -> Float64Array:
    """Return the radius (rows,) of the outermost hair at a bearing beside the view; 0 without.

    Hair that an edge of the picture cuts off is at least as far off the support (rows,) as in the
    nearest row that shows its end. Cut off below it goes on as wide as there, down to `CUT_OFF`.
    """
    radii, rows = np.arange(0.0, FARTHEST, PROBE), np.arange(len(support))
    feet = middle + np.outer(np.minimum(_heights(), 0.0), [0.0, 1.0, 0.0])
    points = feet[:, None] + radii[:, None] * _outwards(side)[:, None]
    found = np.where(_hair_at(camera, mask, points), radii, 0.0).max(axis=1)
    last = np.rint(found / PROBE).astype(int)
    beyond = camera.project(points[rows, np.minimum(last + 1, len(radii) - 1)])
    cut = ((beyond < 0) | (beyond >= [camera.width, camera.height])).any(axis=1)
    ends = rows[(found > 0) & ~cut]
    if len(ends):
        off = np.interp(rows, ends, (found - support)[ends])
        found = np.where(cut & (found > 0), np.maximum(found, support + off), found)
    lowest = int((found > 0).argmax())
    if lowest and camera.project(points[lowest - 1, last[lowest]])[1] > camera.height:
        found[max(lowest - round(CUT_OFF / STEP), 0) : lowest] = found[lowest]
    return np.asarray(found)


def _tells_nothing(side: float) -> bool:
    """Return whether an outline without hair is the face's: there is none on any head."""
    return bool(np.cos(side) > FACE)


def _between(
    sides: Sequence[tuple[float, Float64Array]], support: Float64Array
) -> tuple[Float64Array, BoolArray]:
    """Return how far hair reaches beyond the support (BEARINGS, rows), and whether any hangs."""
    bearings = (np.arange(BEARINGS) / BEARINGS - 0.5) * 2 * np.pi
    thick, shown, total, nearest = np.zeros((4, *support.shape))
    for mirror, weight in ((1, 1.0), (-1, MIRRORED)):
        for side, outline in sides:
            has = (outline > 0).astype(float)
            soft = ndimage.gaussian_filter1d(has, SMOOTH / STEP)
            off = ndimage.gaussian_filter1d(
                has * (outline - support[_column(mirror * side)]), SMOOTH / STEP
            )
            near = weight * np.exp(NEAR_BEARING * (np.cos(bearings - mirror * side) - 1))[:, None]
            nearest = np.maximum(nearest, near)
            thick += near * off
            shown += near * soft
            total += near * np.where(_tells_nothing(side), soft, 1.0)
    thick = thick / np.maximum(shown, 1e-9)
    both = np.stack([thick, shown > 0]).astype(float)
    even, known = ndimage.gaussian_filter1d(both, EVEN / STEP)
    thick += (1 - nearest) * (even / np.maximum(known, 1e-9) - thick)
    below = _heights() < CHIN
    hung = thick[:, ~below & (_heights() < 0)].max(axis=1, keepdims=True)
    thick[:, below] = np.minimum(thick[:, below], hung)
    return thick, np.asarray((shown > 0) & (shown >= HANGS * total))
