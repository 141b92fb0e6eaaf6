"""Rasterise hair into a weighted sum for each pixel: the compiled twin of viewer_raster.comp.

A sum holds red, green and blue times the weight, and the weight: the coverage of the pixel times
the transmittance of the hair before it. Strips of columns are drawn apart, each on one thread, in
the order of the strands, so that equal input gives equal pictures; the sums of a strip fit a cache.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Int64Array, UInt8Array
from hairkit.simulation.lanes import stage
from hairkit.simulation.vectors import HALF, ONE, ZERO, Frame, Number, inlined
from hairkit.viewer.draw.place_kernels import pixels_per_metre
from hairkit.viewer.draw.records import Columns, HairState, Strokes
from hairkit.viewer.draw.shade_kernels import ALL_HIDDEN

STRIP = 64
"""Columns of a strip: 0.5 MB of sums where hair is 500 pixels high, as much as a core's cache."""
WIDEST = np.float32(64)
"""Largest width of a stroke, pixels."""
CROWDED = np.float32(0.8)
"""Dense hair closes before its strokes cover a pixel: coverage c is an opacity of c (1 + 0.8 c)."""
_TINY = np.float32(1e-6)
_WHITE = np.float32(255)


class Pen(NamedTuple):
    """How a stroke is drawn."""

    width: Number
    """Pixels."""
    smooth: bool
    """Whether it is antialiased."""
    free: bool
    """Whether no mesh is before it."""


class Raster(NamedTuple):
    """The pixels of a strip as a stroke goes through them."""

    solids: Float32Array
    """(N,) depths of the meshes."""
    sums: Float32Array
    """(N, 4)"""
    along: int
    """Places from a pixel to the next along the stroke's longer side."""
    across: int
    """Places to the next pixel across."""
    least: int
    """First pixel across that may be drawn."""
    limit: int
    """First pixel across behind those."""


@stage
def draw_hair(
    first_strip: int,
    last_strip: int,
    state: HairState,
    widths: Float32Array,
    strokes: Strokes,
    columns: Columns,
) -> None:
    """Draw strips of the strands, of `widths` (S, m) at rest in metres, into columns."""
    reach, left = state.reach, columns.left
    for strip in range(first_strip, last_strip):
        begin, end = strip * STRIP, min((strip + 1) * STRIP, columns.solid.shape[0])
        for s in range(strokes.hairs):
            if reach[s, 0] - left < end and reach[s, 1] - left >= begin:
                _draw_strand(state, s, widths[s], strokes, columns, begin, end)


@inlined
def _draw_strand(
    state: HairState,
    s: int,
    widths: Float32Array,
    strokes: Strokes,
    columns: Columns,
    left: int,
    right: int,
) -> None:
    """Draw the strokes of a strand in the columns `left` to before `right`."""
    seen, beside = state.seen[s], columns.beside
    for k in range(1, len(seen)):
        behind = state.hidden[s, k - 1]
        if behind < ALL_HIDDEN:
            a, b = seen[k - 1, 0] - columns.left, seen[k, 0] - columns.left
            if min(a, b) - beside < right and max(a, b) + beside >= left:
                scale = pixels_per_metre(strokes.camera, seen[k, 3])
                pen = Pen(widths[k] * strokes.wider * scale, strokes.smooth, behind == 0)
                _stroke(seen, state.looks[s], k, pen, columns, left, right)


@stage
def _stroke(
    seen: Float32Array,
    looks: Float32Array,
    k: int,
    pen: Pen,
    columns: Columns,
    left: int,
    right: int,
) -> None:
    """Draw the segment from point k - 1 to k of a strand in some columns."""
    solid, sums = columns.solid, columns.sums
    ax, ay, az = seen[k - 1, 0] - columns.left, seen[k - 1, 1], seen[k - 1, 2]
    bx, by, bz = seen[k, 0] - columns.left, seen[k, 1], seen[k, 2]
    steep = abs(by - ay) > abs(bx - ax)
    if steep:
        ax, ay, bx, by = ay, ax, by, bx
    begin, end = k - 1, k
    if bx < ax:
        ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
        begin, end = k, k - 1
    wide, high = solid.shape
    stride_x, stride_y = (1, high) if steep else (high, 1)
    least_x, limit_x = (0, high) if steep else (left, right)
    least_y, limit_y = (left, right) if steep else (0, high)
    raster = Raster(solid.reshape(wide * high), sums, stride_x, stride_y, least_y, limit_y)
    along, slope = bx - ax, by - ay
    pace = ONE / max(along, _TINY)
    across = min(pen.width * np.sqrt(along * along + slope * slope) * pace, WIDEST)
    x = max(int(np.ceil(ax - HALF)), least_x)
    last = min(int(np.ceil(bx - HALF)), limit_x)
    t = (np.float32(x) + HALF - ax) * pace
    y, slope = ay + t * slope, slope * pace
    r, g, b, w = _weight_colour(looks, begin, min(across, ONE))
    red, green, blue, weight = _weight_colour(looks, end, min(across, ONE))
    dr, dg, db, dw = red - r, green - g, blue - b, weight - w
    tip = Pen(across, pen.smooth, pen.free)
    while x < last:
        look = r + t * dr, g + t * dg, b + t * db, w + t * dw
        _dab(raster, tip, x, y, az + t * (bz - az), look)
        x += 1
        t += pace
        y += slope


@inlined
def _dab(raster: Raster, pen: Pen, x: int, y: Number, depth: Number, look: Frame) -> None:
    """Draw the pixels of a stroke at `x` along it; `y` is its middle across."""
    solids, sums, step = raster.solids, raster.sums, raster.across
    least, limit, free = raster.least, raster.limit, pen.free
    if pen.width <= ONE and pen.smooth:  # one pixel wide: split between two pixels
        low = int(np.floor(y - HALF))
        part = y - HALF - np.float32(low)
        at = x * raster.along + low * step
        if least <= low < limit and (free or depth <= solids[at]):
            _add(sums, at, ONE - part, look)
        if least - 1 <= low < limit - 1 and (free or depth <= solids[at + step]):
            _add(sums, at + step, part, look)
    elif pen.width <= ONE:
        low = int(np.floor(y))
        at = x * raster.along + low * step
        if least <= low < limit and (free or depth <= solids[at]):
            _add(sums, at, ONE, look)
    else:
        half = HALF * pen.width
        first = max(int(np.floor(y - half)), least)
        top = min(int(np.floor(y + half)), limit - 1)
        for line in range(first, top + 1):
            at = x * raster.along + line * step
            part = min(y + half, np.float32(line + 1)) - max(y - half, np.float32(line))
            if free or depth <= solids[at]:
                _add(sums, at, part, look)


@inlined
def _weight_colour(looks: Float32Array, k: int, cover: Number) -> Frame:
    """Return the colour of a point times its weight, and the weight."""
    weight = looks[k, 3] * cover
    return looks[k, 0] * weight, looks[k, 1] * weight, looks[k, 2] * weight, weight


@inlined
def _add(sums: Float32Array, at: int, part: Number, look: Frame) -> None:
    sums[at, 0] += part * look[0]
    sums[at, 1] += part * look[1]
    sums[at, 2] += part * look[2]
    sums[at, 3] += part * look[3]


@stage
def composite(
    first: int,
    last: int,
    sums: Float32Array,
    hair: Int64Array,
    changed: Int64Array,
    behind: UInt8Array,
    picture: UInt8Array,
) -> None:
    """Write rows of the `changed` region of `picture` (H, W, 4): hair over `behind`.

    The sums are those of the columns of the region `hair`, in which they are cleared; regions are
    arrays of the values of `region.Region`, and `hair` lies within `changed`.
    """
    high = picture.shape[0]
    first, last = first + changed[1], last + changed[1]
    for y in range(first, last):
        for x in range(changed[0], changed[2]):
            for c in range(4):
                picture[y, x, c] = behind[y, x, c]
    for x in range(hair[0], hair[2]):
        for y in range(max(first, hair[1]), min(last, hair[3])):
            at = (x - hair[0]) * high + y
            weight = sums[at, 3]
            if weight <= ZERO:
                continue
            red, green, blue = sums[at, 0], sums[at, 1], sums[at, 2]
            sums[at, 0] = sums[at, 1] = sums[at, 2] = sums[at, 3] = ZERO
            opaque = min(weight * (ONE + CROWDED * weight), ONE)
            share = opaque * _WHITE / max(weight, _TINY)
            through = ONE - opaque
            red = red * share + through * np.float32(behind[y, x, 0])
            green = green * share + through * np.float32(behind[y, x, 1])
            blue = blue * share + through * np.float32(behind[y, x, 2])
            picture[y, x, 0] = np.uint8(min(red + HALF, _WHITE))
            picture[y, x, 1] = np.uint8(min(green + HALF, _WHITE))
            picture[y, x, 2] = np.uint8(min(blue + HALF, _WHITE))
