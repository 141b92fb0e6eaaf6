"""Votes of views on cells: hair, empty or none; the hull keeps cells by a rule on their numbers.

Where the head hides a cell from a view, hair in the picture lies before the head and says little
about the cell: silhouettes alone leave a thin layer on skin that every nearer view sees bare.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit import VoxelGrid
from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.cameras.projection_kernels import PackedCamera, project
from hairkit.parallel import compiled, compiled_with, parallel_for

EMPTY, PERSON, HAIR, HIDDEN = 0, 1, 2, 3
"""Labels of pixels; as votes, PERSON means none, and HIDDEN hair of a view from which the head
hides the cell."""
BEYOND = 0.05
"""Metres that hair may go on beyond a picture's sides or top that cut it off; hair may hang down
farther. Without a bound the hull of wide hair is deepest where the fewest views see it."""


class LabelledView(NamedTuple):
    """The pictures by which a view votes."""

    camera: PackedCamera
    labels: UInt8Array
    """(H, W) EMPTY, PERSON or HAIR."""
    surface: Float32Array
    """(H, W) depth of the person's surface without hair, metres; infinite where it is unknown."""
    open_left: bool
    """Hair touches this edge of the picture: beyond it nothing is known."""
    open_top: bool
    open_right: bool
    open_bottom: bool


class Cells(NamedTuple):
    """The cells that are voted on."""

    origin: Float64Array
    """(3,) corner of the grid, metres."""
    spacing: float
    """Edge of a cell, metres."""
    candidates: BoolArray
    """(X, Y, Z) cells that may be hair at all."""
    near: BoolArray
    """(X, Y, Z) cells near enough to the person to hold hair that a picture's edge cuts off."""


class Rule(NamedTuple):
    """When a cell is kept."""

    min_views: int
    """Views that must have hair at its pixel, at least one of them before the head."""
    forgive: int
    """Views that may call it empty."""
    front_margin: float
    """Depth in front of the person's surface beyond which a cell is empty, metres."""
    hidden_depth: float
    """Depth behind the head's surface beyond which a cell is hidden, metres."""
    mirrored: int = 0
    """Views at the end of the list that are mirror images: they carve what no other has hair at,
    and cells that no view sees are kept."""


class Votes(NamedTuple):
    """What the views say of each cell; all (X, Y, Z)."""

    hair: npt.NDArray[np.int16]
    """Views with hair at its pixel."""
    empty: npt.NDArray[np.int16]
    """Views that call it empty."""
    seen: BoolArray
    """A view has hair at its pixel, and the cell is not hidden behind the head."""


def carve(
    grid: VoxelGrid,
    candidates: BoolArray,
    near: BoolArray,
    views: Sequence[LabelledView],
    rule: Rule,
) -> BoolArray:
    """Return the candidate cells (X, Y, Z) that the views' votes keep.

    Outside of a picture only cells `near` (X, Y, Z) the person may hold hair.
    """
    cells = Cells(grid.origin, float(grid.spacing), candidates, near)
    real = len(views) - rule.mirrored
    votes = _count(cells, views[:real], rule)
    kept = candidates & (votes.empty <= rule.forgive)
    if not rule.mirrored:
        return kept & votes.seen & (votes.hair >= rule.min_views)
    return kept & (votes.seen | (_count(cells, views[real:], rule).empty <= rule.forgive))


def _count(cells: Cells, views: Sequence[LabelledView], rule: Rule) -> Votes:
    """Return the votes of some views."""
    shape = cells.candidates.shape
    hair, empty = (np.zeros(shape, np.int16) for _ in range(2))
    votes = Votes(hair, empty, np.zeros(shape, bool))
    for view in views:
        parallel_for(add_votes, shape[0], view, cells, rule, votes)
    return votes


@compiled
def add_votes(
    first: int, last: int, view: LabelledView, cells: Cells, rule: Rule, votes: Votes
) -> None:
    """Add a view's votes for the layers `first` to `last` along x.

    Cells that already have too many empty votes are left out: they are lost. Arrays are taken out
    of their tuples before the loop, in which Numba would count references to them.
    """
    candidates, near, origin = cells.candidates, cells.near, cells.origin
    hair, empty, seen = votes.hair, votes.empty, votes.seen
    camera, labels, surface = view.camera, view.labels, view.surface
    edges = view.open_left, view.open_top, view.open_right, view.open_bottom
    margins = rule.front_margin, rule.hidden_depth
    _, size_y, size_z = candidates.shape
    height, width = labels.shape
    for ix in range(first, last):
        x = origin[0] + (ix + 0.5) * cells.spacing
        for iy in range(size_y):
            y = origin[1] + (iy + 0.5) * cells.spacing
            for iz in range(size_z):
                if not candidates[ix, iy, iz] or empty[ix, iy, iz] > rule.forgive:
                    continue
                z = origin[2] + (iz + 0.5) * cells.spacing
                u, v, depth = project(camera, x, y, z)
                if u < 0 or v < 0 or u >= width or v >= height:
                    reach = BEYOND * camera.focal / (1.0 if camera.orthographic else depth)
                    if not (near[ix, iy, iz] and _beyond_hair(u, v, reach, labels.shape, edges)):
                        empty[ix, iy, iz] += 1
                    continue
                vote = _vote(labels[int(v), int(u)], surface[int(v), int(u)], depth, margins)
                if vote == EMPTY:
                    empty[ix, iy, iz] += 1
                elif vote != PERSON:
                    hair[ix, iy, iz] += 1
                    if vote == HAIR:
                        seen[ix, iy, iz] = True


@compiled_with(inside=True)
def _beyond_hair(
    u: float, v: float, reach: float, shape: tuple[int, int], edges: tuple[bool, bool, bool, bool]
) -> bool:
    """Return whether pixel u, v lies beyond one of the `edges` that hair touches, and no more than
    `reach` pixels beyond any but the lower one."""
    left, top, right, bottom = edges
    height, width = shape
    if u < -reach or u >= width + reach or v < -reach:
        return False
    return (u < 0 and left) or (v < 0 and top) or (u >= width and right) or (v >= height and bottom)


@compiled_with(inside=True)
def _vote(label: int, surface: float, depth: float, margins: tuple[float, float]) -> int:
    """Return a view's vote on a cell: EMPTY, HAIR, HIDDEN, or PERSON for no vote.

    `label` and `surface` are those of its pixel, `margins` those of the rule. Where the view sees
    the person, a cell farther than `front_margin` in front of the surface is empty.
    """
    front_margin, hidden_depth = margins
    if label == PERSON and np.isfinite(surface) and depth < surface - front_margin:
        return EMPTY
    if label == HAIR and depth > surface + hidden_depth:
        return HIDDEN
    return int(label)
