"""Strands drawn onto their cards: coverage, depth, direction, normal and number, texel by texel.

Every point of a strand is brought into the card's own frame: along its middle, across it, and above
it. The line between two points is then drawn with its coverage shared by the two nearest texels
(Wu 1991, "An efficient antialiasing technique"). Hair is thinner than a texel and drawn as wide as
one; thicker strands are lines side by side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array, UInt8Array
from hairkit.parallel import compiled, compiled_with, parallel_for
from hairkit.types.strands import Strands

from .packing import Places
from .strips import Cards

Int8Array = npt.NDArray[np.int8]
ROUNDNESS = 0.7
"""Slope of a lock's surface at its edges: locks are lit as if they were round."""
COVERED = 0.35
"""Coverage from which a line decides what a texel shows."""
UNIT = 127
"""What stands for 1 in directions of signed bytes."""
MIN_CARDS = 16
"""Least number of cards that are worth another thread."""


class Atlas(NamedTuple):
    """Pictures (H, W) under construction."""

    alpha: Float32Array
    """Coverage, 0 to 1."""
    height: Float32Array
    """Metres above the middle of the lock, of the hair that is seen."""
    share: UInt8Array
    """255 times the way along the strand, 0 at its root."""
    strand: Int32Array
    """Number of the strand."""
    flow: Int8Array
    """(H, W, 2) 127 times the unit direction across and along the card."""
    normal: Int8Array
    """(H, W, 2) 127 times the normal's parts across and along the card."""


class _Sheet(NamedTuple):
    """One level's cards with their strands, in arrays for the kernel."""

    centre: Float64Array
    across: Float64Array
    outward: Float64Array
    half: Float64Array
    corner: Int64Array
    size: Int64Array
    points: Float32Array
    widths: Float32Array
    offsets: Int64Array
    order: Int64Array
    """(S,) strands, lock by lock."""
    first: Int64Array
    """(K + 1,) where each lock begins in that order."""
    share: float
    """Of the strands of a lock that are drawn."""


def blank_atlas(edge: int) -> Atlas:
    """Return empty pictures of `edge` x `edge` texels."""
    square = (edge, edge)
    return Atlas(
        np.zeros(square, np.float32),
        np.full(square, -np.inf, np.float32),
        np.zeros(square, np.uint8),
        np.zeros(square, np.int32),
        np.zeros((*square, 2), np.int8),
        np.zeros((*square, 2), np.int8),
    )


def paint(
    atlas: Atlas,
    strands: Strands,
    widths: Float32Array,
    cards: Cards,
    at: Places,
    share: float = 1.0,
) -> None:
    """Draw a share of the strands, with widths (P,) in metres, onto the places of their cards."""
    order = np.argsort(cards.lock, kind="stable")
    first = np.searchsorted(cards.lock[order], np.arange(len(cards) + 1))
    sheet = _Sheet(
        cards.centre, cards.across, cards.outward, cards.half, at.corner, at.size,
        strands.points, widths, strands.offsets, order, first, share,
    )  # fmt: skip
    parallel_for(_paint_cards, len(cards), sheet, atlas, min_chunk=MIN_CARDS)


@compiled_with(allocates=True)
def _paint_cards(begin: int, end: int, sheet: _Sheet, atlas: Atlas) -> None:
    """Draw the strands of cards `begin` to `end`; every card has texels of its own."""
    before, here = np.empty(4), np.empty(4)
    for card in range(begin, end):
        _lay_ground(card, sheet, atlas)
        column = 2 * sheet.half[card].max() / sheet.size[card, 0]
        row = _card_length(sheet.centre[card]) / sheet.size[card, 1]
        for place in range(sheet.first[card], sheet.first[card + 1]):
            rank = place - sheet.first[card]
            if int(rank * sheet.share) == int((rank - 1) * sheet.share) and rank > 0:
                continue
            strand = sheet.order[place]
            root, tip = sheet.offsets[strand], sheet.offsets[strand + 1]
            station = 0
            for i in range(root, tip):
                station = _locate(card, sheet, sheet.points[i], station, here)
                here[3] = (i - root) / (tip - 1 - root)
                if i > root:
                    lines = max(int(sheet.widths[i] / column + 0.5), 1)
                    for n in range(lines):
                        shift = n - 0.5 * (lines - 1)
                        before[0], here[0] = before[0] + shift, here[0] + shift
                        _line(card, sheet, atlas, strand, (column, row), before, here)
                        before[0], here[0] = before[0] - shift, here[0] - shift
                for k in range(4):
                    before[k] = here[k]


@compiled_with(inside=True)
def _lay_ground(card: int, sheet: _Sheet, atlas: Atlas) -> None:
    """Give texels without hair the colour and direction of hair at their height."""
    x0, y0 = sheet.corner[card]
    columns, rows = sheet.size[card]
    for y in range(rows):
        for x in range(columns):
            atlas.share[y0 + y, x0 + x] = int(255 * (y + 0.5) / rows)
            atlas.strand[y0 + y, x0 + x] = sheet.order[sheet.first[card]]
            atlas.flow[y0 + y, x0 + x, 1] = UNIT


@compiled
def _locate(
    card: int, sheet: _Sheet, point: Float32Array, station: int, result: Float64Array
) -> int:
    """Write column, row and metres above the card of a point (3,); return its station.

    The nearest place on the middle line is looked for from the station of the point before.
    """
    line = sheet.centre[card]
    last = len(line) - 2
    nearest, found, along = np.inf, station, 0.0
    for j in range(max(station - 1, 0), min(station + 2, last) + 1):
        length = 0.0
        dot = 0.0
        for k in range(3):
            step = line[j + 1, k] - line[j, k]
            length += step * step
            dot += step * (point[k] - line[j, k])
        t = dot / max(length, 1e-18)
        low = -1.0 if j == 0 else 0.0
        high = 2.0 if j == last else 1.0
        t = min(max(t, low), high)
        apart = 0.0
        for k in range(3):
            apart += (line[j, k] + t * (line[j + 1, k] - line[j, k]) - point[k]) ** 2
        if apart < nearest:
            nearest, found, along = apart, j, t
    u, w = 0.0, 0.0
    for k in range(3):
        away = point[k] - line[found, k] - along * (line[found + 1, k] - line[found, k])
        mix = min(max(along, 0.0), 1.0)
        u += away * (
            (1 - mix) * sheet.across[card, found, k] + mix * sheet.across[card, found + 1, k]
        )
        w += away * (
            (1 - mix) * sheet.outward[card, found, k] + mix * sheet.outward[card, found + 1, k]
        )
    half = (1 - mix) * sheet.half[card, found] + mix * sheet.half[card, found + 1]
    columns, rows = sheet.size[card]
    result[0] = 0.5 * (u / half + 1) * columns - 0.5
    result[1] = (found + along) / (last + 1) * rows - 0.5
    result[2] = w
    return found


@compiled_with(inside=True)
def _normal(u: float, tx: float, ty: float, tz: float) -> tuple[float, float]:
    """Return x and y of the unit normal of a rounded card at `u`, -1 to 1 across it, square to a
    strand's unit tangent."""
    lean = ROUNDNESS * u * tx + tz
    nx, ny, nz = ROUNDNESS * u - lean * tx, -lean * ty, 1.0 - lean * tz
    norm = max(np.sqrt(nx * nx + ny * ny + nz * nz), 1e-9)
    return nx / norm, ny / norm


@compiled
def _line(
    card: int,
    sheet: _Sheet,
    atlas: Atlas,
    strand: int,
    scale: tuple[float, float],
    start: Float64Array,
    end: Float64Array,
) -> None:
    """Draw the line between two places (4,): column, row, metres above, share of the strand.

    `scale` holds the metres of a column and of a row.
    """
    column, row_size = scale
    columns, rows = sheet.size[card]
    dx, dy = end[0] - start[0], end[1] - start[1]
    across, along, above = column * dx, row_size * dy, end[2] - start[2]
    size = np.sqrt(across**2 + along**2 + above**2)
    if size <= 0 or start[1] > rows + 1 or end[1] < -2:
        return
    tx, ty, tz = across / size, along / size, above / size
    steps = int(np.ceil(max(abs(dx), abs(dy), 1e-6)))
    steep = abs(dy) >= abs(dx)
    weight = min(1.0, max(abs(dx), abs(dy)))
    for n in range(steps):
        t = (n + 0.5) / steps
        x, y = start[0] + t * dx, start[1] + t * dy
        height = start[2] + t * above
        share = start[3] + t * (end[3] - start[3])
        nx, ny = _normal(2 * (x + 0.5) / columns - 1, tx, ty, tz)
        major = y if steep else x
        minor = x if steep else y
        cell = int(np.floor(minor))
        part = minor - cell
        row = int(np.floor(major + 0.5))
        for side in range(2):
            i = cell + side
            a = weight * (part if side else 1 - part)
            px, py = (i, row) if steep else (row, i)
            if a <= 0 or px < 0 or py < 0 or px >= columns or py >= rows:
                continue
            cx, cy = sheet.corner[card, 0] + px, sheet.corner[card, 1] + py
            free = 1 - atlas.alpha[cy, cx]
            atlas.alpha[cy, cx] = 1 - free * (1 - a)
            if a >= COVERED and height > atlas.height[cy, cx]:
                atlas.height[cy, cx] = height
                atlas.share[cy, cx] = int(255 * share)
                atlas.strand[cy, cx] = strand
                atlas.flow[cy, cx, 0] = int(UNIT * tx)
                atlas.flow[cy, cx, 1] = int(UNIT * ty)
                atlas.normal[cy, cx, 0] = int(UNIT * nx)
                atlas.normal[cy, cx, 1] = int(UNIT * ny)


@compiled_with(inside=True)
def _card_length(line: Float64Array) -> float:
    total = 0.0
    for j in range(len(line) - 1):
        step = 0.0
        for k in range(3):
            step += (line[j + 1, k] - line[j, k]) ** 2
        total += np.sqrt(step)
    return total
