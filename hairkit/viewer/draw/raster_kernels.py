"""Rasterise hair into a weighted sum for each pixel: the compiled twin of viewer_raster.comp.

A sum holds red, green and blue times the weight, and the weight: the coverage of the pixel times
the transmittance of the hair before it. Strips of columns are drawn apart, each on one thread, in
the order of the strands, so that equal input gives equal pictures; the sums of a strip fit a cache.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.viewer.draw.place_kernels import inlined, pixels_per_metre, shared
from hairkit.viewer.draw.shade_kernels import ALL_HIDDEN

STRIP = 64
"""Columns of a strip: 0.5 MB of sums where hair is 500 pixels high, as much as a core's cache."""
WIDEST = 64.0
"""Largest width of a stroke, pixels."""
_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)
_WIDEST = np.float32(WIDEST)
_TINY = np.float32(1e-6)
_WHITE = np.float32(255)


@shared
def draw_hair(  # type: ignore[no-untyped-def]
    first_strip, last_strip, seen, looks, hidden, reach, widths, solid, camera, wider, smooth,
    count, frame, beside, sums,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Draw strips of `count` strands into `sums` (at least W H, 4).

    `seen` comes from `place_hair`, `looks`, `hidden` and `reach` from `shade_hair`; `frame` holds
    the least x and y of the drawn part of the picture, and `solid` (W, H) its depth buffer. Both
    are stored column by column: most hair hangs, so that a stroke's pixels lie side by side in
    memory. No stroke is wider than `beside`, pixels on either side.
    """
    for strip in range(first_strip, last_strip):
        left, right = strip * STRIP, min((strip + 1) * STRIP, solid.shape[0])
        for s in range(count):
            if reach[s, 0] - frame[0] < right and reach[s, 1] - frame[0] >= left:
                _draw_strand(
                    seen, looks, hidden, widths, solid, camera, wider, smooth, s, frame, beside,
                    left, right, sums,
                )  # fmt: skip


@shared
def _draw_strand(  # type: ignore[no-untyped-def]
    seen, looks, hidden, widths, solid, camera, wider, smooth, s, frame, beside, left, right, sums
) -> None:  # pragma: no cover - compiled
    """Draw the strokes of a strand in the columns `left` to before `right`."""
    for k in range(1, seen.shape[1]):
        behind = hidden[s, k - 1]
        if behind < ALL_HIDDEN:
            a, b = seen[s, k - 1, 0] - frame[0], seen[s, k, 0] - frame[0]
            if min(a, b) - beside < right and max(a, b) + beside >= left:
                width = widths[s, k] * wider * pixels_per_metre(camera, seen[s, k, 3])
                _stroke(seen, looks, behind, s, k, width, smooth, solid, frame, left, right, sums)


@shared
def _stroke(  # type: ignore[no-untyped-def]
    seen, looks, behind, s, k, width, smooth, solid, frame, left, right, sums
) -> None:  # pragma: no cover - compiled
    """Draw the segment from point k - 1 to k in some columns."""
    ax, ay, az = seen[s, k - 1, 0] - frame[0], seen[s, k - 1, 1] - frame[1], seen[s, k - 1, 2]
    bx, by, bz = seen[s, k, 0] - frame[0], seen[s, k, 1] - frame[1], seen[s, k, 2]
    steep = abs(by - ay) > abs(bx - ax)
    if steep:
        ax, ay, bx, by = ay, ax, by, bx
    begin, end = k - 1, k
    if bx < ax:
        ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
        begin, end = k, k - 1
    wide, high = solid.shape
    solids = solid.reshape(wide * high)
    stride_x, stride_y = (1, high) if steep else (high, 1)
    least_x, limit_x = (0, high) if steep else (left, right)
    least_y, limit_y = (left, right) if steep else (0, high)
    along, slope = bx - ax, by - ay
    pace = _ONE / max(along, _TINY)
    across = min(width * np.sqrt(along * along + slope * slope) * pace, _WIDEST)
    x: Any = max(np.int64(np.ceil(ax - _HALF)), least_x)
    last = min(np.int64(np.ceil(bx - _HALF)), limit_x)
    t = (np.float32(x) + _HALF - ax) * pace
    y, slope = ay + t * slope, slope * pace
    r, g, b, w = _weight_colour(looks, s, begin, min(across, _ONE))
    red, green, blue, weight = _weight_colour(looks, s, end, min(across, _ONE))
    dr, dg, db, dw = red - r, green - g, blue - b, weight - w
    half = _HALF * max(across, _ONE)
    narrow, soft, free = across <= _ONE, smooth != 0, behind == 0
    while x < last:
        red, green, blue, weight = r + t * dr, g + t * dg, b + t * db, w + t * dw
        depth = az + t * (bz - az)
        if narrow and soft:  # one pixel wide: split between two pixels
            low = np.int64(np.floor(y - _HALF))
            part = y - _HALF - np.float32(low)
            at = x * stride_x + low * stride_y
            if least_y <= low < limit_y and (free or depth <= solids[at]):
                _add(sums, at, _ONE - part, red, green, blue, weight)
            if least_y - 1 <= low < limit_y - 1 and (free or depth <= solids[at + stride_y]):
                _add(sums, at + stride_y, part, red, green, blue, weight)
        elif narrow:
            low = np.int64(np.floor(y))
            at = x * stride_x + low * stride_y
            if least_y <= low < limit_y and (free or depth <= solids[at]):
                _add(sums, at, _ONE, red, green, blue, weight)
        else:
            first: Any = max(np.int64(np.floor(y - half)), least_y)
            top: Any = min(np.int64(np.floor(y + half)), limit_y - 1)
            for line in range(first, top + 1):
                at = x * stride_x + line * stride_y
                part = min(y + half, np.float32(line + 1)) - max(y - half, np.float32(line))
                if free or depth <= solids[at]:
                    _add(sums, at, part, red, green, blue, weight)
        x += 1
        t += pace
        y += slope


@inlined
def _weight_colour(looks, s, k, cover):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the colour of a point times its weight, and the weight."""
    weight = looks[s, k, 3] * cover
    return looks[s, k, 0] * weight, looks[s, k, 1] * weight, looks[s, k, 2] * weight, weight


@inlined
def _add(sums, at, part, red, green, blue, weight):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    sums[at, 0] += part * red
    sums[at, 1] += part * green
    sums[at, 2] += part * blue
    sums[at, 3] += part * weight


@shared
def composite(first, last, sums, hair, changed, behind, picture) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
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
            if weight <= _ZERO:
                continue
            red, green, blue = sums[at, 0], sums[at, 1], sums[at, 2]
            sums[at, 0] = sums[at, 1] = sums[at, 2] = sums[at, 3] = _ZERO
            opaque = min(weight * (_ONE + np.float32(0.8) * weight), _ONE)
            share = opaque * _WHITE / max(weight, _TINY)
            through = _ONE - opaque
            red = red * share + through * np.float32(behind[y, x, 0])
            green = green * share + through * np.float32(behind[y, x, 1])
            blue = blue * share + through * np.float32(behind[y, x, 2])
            picture[y, x, 0] = np.uint8(min(red + _HALF, _WHITE))
            picture[y, x, 1] = np.uint8(min(green + _HALF, _WHITE))
            picture[y, x, 2] = np.uint8(min(blue + _HALF, _WHITE))
