"""The silhouette of a person's head in one photo, in head widths.

Lengths are in head widths, so that photos of different sizes, lenses and distances can be compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float64Array, UInt8Array

PERSON_LEVEL = 127
"""Probability, of 255, above which a pixel is the person's."""
DEPTHS = np.linspace(0.02, 1.3, 48)
"""Depths below the crown at which outlines are compared, head widths: crown to collar."""
WIDTH_DEPTHS = (0.35, 0.7)
"""The head's width is the median between these depths, head widths."""
MIDDLE = 0.6
"""Depth of the middle of the head below the crown, head widths."""
WIDTH_ROUNDS = 20
"""Most rounds until width and depths agree: they settle within five."""
SHOULDER = 1.35
"""Shoulders begin where the outline is this many head widths wide."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The silhouette of a head, down to the collar."""

    width_px: float
    """Width of the head in the photo."""
    top_px: float
    """Row of the crown."""
    middle_px: float
    """Column of the head's middle."""
    edges: Float64Array
    """(48, 2) left and right edge at `DEPTHS`, head widths from the head's middle."""
    shoulder: float
    """Depth of the shoulders below the crown, head widths; inf where the picture shows none."""
    inside: BoolArray
    """(H, W) the person, without other things that were taken for persons."""


def trace_outline(alpha: UInt8Array) -> Outline | None:
    """Return the outline of the largest person in a probability (H, W), None where nobody is."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(
        (alpha > PERSON_LEVEL).astype(np.uint8)
    )
    if count < 2:
        return None
    inside = labels == 1 + stats[1:, cv2.CC_STAT_AREA].argmax()
    rows = np.nonzero(inside.any(1))[0]
    left = inside.argmax(1)[rows].astype(np.float64)
    right = inside.shape[1] - inside[:, ::-1].argmax(1)[rows].astype(np.float64)
    width = _head_width(right - left)
    if width < 2:
        return None
    depth = (rows - rows[0]) / width
    middle = float(np.median(((left + right) / 2)[_between(depth, *WIDTH_DEPTHS)]))
    edges = np.stack([np.interp(DEPTHS, depth, (side - middle) / width) for side in (left, right)])
    wide = (right - left > SHOULDER * width) & (depth > WIDTH_DEPTHS[1])
    shoulder = float(depth[wide.argmax()]) if wide.any() else np.inf
    return Outline(width, float(rows[0]), middle, edges.T, shoulder, inside)


def _between(depth: Float64Array, low: float, high: float) -> BoolArray:
    found: BoolArray = np.asarray((depth >= low) & (depth <= high))
    return found if found.any() else np.asarray(depth == depth[np.abs(depth - low).argmin()])


def _head_width(widths: Float64Array) -> float:
    """Return the median width between the depths that are measured in this very width."""
    width = float(np.median(widths[: max(2, len(widths) // 4)]))
    for _ in range(WIDTH_ROUNDS):
        first, last = (int(depth * width) for depth in WIDTH_DEPTHS)
        if first >= len(widths):
            break
        found = float(np.median(widths[first : max(last, first + 2)]))
        if abs(found - width) < 1:
            break
        width = found
    return width
