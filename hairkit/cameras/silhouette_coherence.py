"""Silhouette coherence: how well the viewing rays of one view's outline touch all other views'
silhouettes.

A point of an outline is the picture of a point on the subject, and that point lies inside every
other silhouette. So somewhere along the ray the smallest signed distance to the other silhouettes
must reach 0 (Hernandez, Schmitt and Cipolla, "Silhouette coherence for camera calibration under
circular motion", 2007).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit, prange

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.types.mask import Mask

FIELD_HEIGHT = 540
"""Signed distances are sampled at about this many rows."""
EDGE = 4
"""Contour points this near to the picture's edge, in field pixels, are cuts and no outline."""
REACH, COARSE, FINE = 0.28, 48, 8
"""Rays are searched this far (metres) before and behind the turn's centre: coarse steps, then
halvings."""
FASTEST = 1.6
"""A point on a ray moves at most this times (pixels per metre at the turn's centre) in another
view."""
FAR = 1e5
"""Signed distance, in field pixels, where a picture shows no outline at all."""
CAP = 40.0
"""Signed distances are cut at this many pixels; outside its picture a silhouette says nothing."""


@dataclass(frozen=True, eq=False)
class Outlines:
    """The silhouettes of all views, ready for coherence."""

    fields: Float32Array
    """(V, H, W) signed distance to the silhouette's edge, positive inside, in pixels of the full
    picture."""
    scale: float
    """Field pixels per picture pixel."""
    points: Float64Array
    """(N, 2) contour points in picture pixels."""
    views: Int64Array
    """(N,) their views."""

    @classmethod
    def of(cls, masks: Sequence[Mask], count: int) -> Outlines:
        """Return fields and about `count` contour points a view."""
        masks = _of_one_size(masks)
        height, width = masks[0].labels.shape
        scale = min(1.0, FIELD_HEIGHT / height)
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        fields, points, views = [], [], []
        whole = all(mask.person_known for mask in masks)
        for view, mask in enumerate(masks):
            silhouette = _smooth(mask.person if whole else mask.hair, size)
            fields.append(_signed_distance(silhouette) / scale)
            contour = _contour(fields[-1] * scale, count)
            points.append(contour / scale)
            views.append(np.full(len(contour), view))
        return cls(
            np.stack(fields).astype(np.float32),
            scale,
            np.concatenate(points),
            np.concatenate(views).astype(np.int64),
        )

    def crowns(self, ratio: float) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Return each silhouette's top row, and its middle column and width `ratio` widths below
        the top, pixels."""
        found = []
        for field in self.fields:
            inside = field > 0
            rows = np.nonzero(inside.any(1))[0]
            first = inside.argmax(1)
            last = inside.shape[1] - inside[:, ::-1].argmax(1)
            width = (last - first)[rows]
            deep = np.nonzero(rows - rows[0] >= ratio * width)[0]
            row = rows[deep[deep > 2][0]] if (deep > 2).any() else rows[-1]
            found.append((rows[0], (first[row] + last[row]) / 2, last[row] - first[row]))
        top, middle, width = np.array(found, np.float64).T / self.scale
        return top, middle, width


def _of_one_size(masks: Sequence[Mask]) -> Sequence[Mask]:
    """Return masks continued to the right and below, edge pixels repeated, to the largest size."""
    height = max(mask.labels.shape[0] for mask in masks)
    width = max(mask.labels.shape[1] for mask in masks)
    continued = []
    for mask in masks:
        more = ((0, height - mask.labels.shape[0]), (0, width - mask.labels.shape[1]))
        continued.append(Mask(np.pad(mask.labels, more, mode="edge"), mask.person_known))
    return continued


def _smooth(silhouette: npt.NDArray[np.bool_], size: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """Shrink to the field's size, without flying hairs and with holes between hairs filled."""
    small = cv2.resize(silhouette.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    result: npt.NDArray[np.bool_] = cv2.GaussianBlur(small, (0, 0), 2.0) > 0.5
    return result


def _signed_distance(silhouette: npt.NDArray[np.bool_]) -> Float32Array:
    inside = cv2.distanceTransform(silhouette.astype(np.uint8), cv2.DIST_L2, 5)
    outside = cv2.distanceTransform((~silhouette).astype(np.uint8), cv2.DIST_L2, 5)
    distance = np.where(silhouette, inside - 0.5, 0.5 - outside)
    return np.asarray(np.clip(distance, -FAR, FAR), np.float32)


def _contour(field: Float32Array, count: int) -> Float64Array:
    """Return about `count` points (n, 2) evenly along the longest outline, without cut edges."""
    outlines, _ = cv2.findContours(
        (field > 0).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    if not outlines:
        return np.zeros((0, 2))
    longest = max(outlines, key=len)[:, 0, :].astype(np.float64)
    height, width = field.shape
    kept = (longest >= EDGE).all(1) & (longest < [width - EDGE, height - EDGE]).all(1)
    longest = longest[kept]
    if not len(longest):
        return np.zeros((0, 2))
    chosen = longest[np.linspace(0, len(longest), count, endpoint=False).astype(int)]
    return _to_edge(field, chosen) + 0.5


def _to_edge(field: Float32Array, points: Float64Array) -> Float64Array:
    """Move points by their signed distance along its gradient on to the edge."""
    smooth = cv2.GaussianBlur(field, (0, 0), 1.5)
    row_slope, column_slope = np.gradient(smooth)
    column, row = points.astype(int).T
    gradient = np.stack([column_slope[row, column], row_slope[row, column]], axis=1)
    length = np.maximum((gradient**2).sum(1, keepdims=True), 0.1)
    moved: Float64Array = points - field[row, column][:, None] * gradient / length
    return moved


def coherence(
    outlines: Outlines,
    rotation: Float64Array,
    translation: Float64Array,
    focal: Float64Array,
    centre: Float64Array,
    middle: float,
) -> tuple[Float64Array, Float64Array]:
    """Return how far each contour ray stays inside all other silhouettes, and how that follows the
    cameras.

    Parameters
    ----------
    rotation, translation, focal, centre
        Cameras (V, 3, 3), (V, 3), (V,), (V, 2).
    middle
        Depth of the turn's centre in all views, metres.

    Returns
    -------
    value
        (N,) pixels, below 0 where the ray misses some silhouette.
    slope
        (N, V, 7) derivative by each camera's small motion (see `Turn.tangents`).
    """
    value = np.empty(len(outlines.points))
    slope = np.zeros((len(outlines.points), len(rotation), 7))
    # turns[own, view] and shifts[own, view] bring camera coordinates of one view to another's.
    turns = np.ascontiguousarray(np.einsum("vij,okj->ovik", rotation, rotation))
    shifts = translation[None] - np.einsum("ovik,ok->ovi", turns, translation)
    _coherence(
        outlines.points, outlines.views, outlines.fields, outlines.scale, turns, shifts,
        focal, centre, middle, value, slope,
    )  # fmt: skip
    return value, slope


@njit(cache=True)
def _sample(field, scale, u, v, out):  # type: ignore[no-untyped-def]
    """Write signed distance and its gradient by (u, v) at a picture pixel to `out`; CAP outside
    the picture."""
    x, y = u * scale - 0.5, v * scale - 0.5
    height, width = field.shape
    if not (x >= 0.0 and y >= 0.0 and x < width - 1 and y < height - 1):
        out[0], out[1], out[2] = CAP, 0.0, 0.0
        return
    i, j = int(y), int(x)
    fy, fx = y - i, x - j
    a, b, c, d = field[i, j], field[i, j + 1], field[i + 1, j], field[i + 1, j + 1]
    value = (a * (1 - fx) + b * fx) * (1 - fy) + (c * (1 - fx) + d * fx) * fy
    if value > CAP:
        out[0], out[1], out[2] = CAP, 0.0, 0.0
        return
    out[0] = value
    out[1] = ((b - a) * (1 - fy) + (d - c) * fy) * scale
    out[2] = ((c - a) * (1 - fx) + (d - b) * fx) * scale


@njit(cache=True)
def _turned(turn, vector, result):  # type: ignore[no-untyped-def]
    """Write turn @ vector; calls into linear algebra libraries cost more than they do."""
    for i in range(3):
        result[i] = turn[i, 0] * vector[0] + turn[i, 1] * vector[1] + turn[i, 2] * vector[2]


@njit(cache=True)
def _smallest(z, ray, own, fields, scale, relative, offset, focal, centre, bar, out):  # type: ignore[no-untyped-def]
    """Return the smallest signed distance over all views but `own` at depth z of a ray; below
    `bar`, any such."""
    best = CAP
    for view in range(len(fields)):
        if view == own:
            continue
        x = z * relative[view, 0] + offset[view, 0]
        y = z * relative[view, 1] + offset[view, 1]
        depth = z * relative[view, 2] + offset[view, 2]
        if depth < 1e-3:
            continue
        u = focal[view] * x / depth + centre[view, 0]
        v = focal[view] * y / depth + centre[view, 1]
        _sample(fields[view], scale, u, v, out)
        if out[0] < best:
            best = out[0]
            if best < bar:
                return best
    return best


@njit(cache=True, parallel=True)
def _coherence(  # type: ignore[no-untyped-def]
    points, views, fields, scale, turns, shifts, focal, centre, middle, value, slope
):
    count = len(turns)
    for n in prange(len(points)):
        own = views[n]
        out = np.empty(3)
        ray = np.empty(3)
        ray[0] = (points[n, 0] - centre[own, 0]) / focal[own]
        ray[1] = (points[n, 1] - centre[own, 1]) / focal[own]
        ray[2] = 1.0
        relative = np.empty((count, 3))
        for view in range(count):
            _turned(turns[own, view], ray, relative[view])
        offset = shifts[own]
        step = 2 * REACH / (COARSE - 1)
        fastest = FASTEST * focal[own] / middle
        z = middle
        best = -1e30
        at = middle - REACH
        while at <= middle + REACH:
            here = _smallest(
                at, ray, own, fields, scale, relative, offset, focal, centre, best, out
            )
            if here > best:
                best, z = here, at
            # A silhouette this far off cannot be reached sooner.
            at += max(step, (best - here) / fastest)
        for _ in range(FINE):
            step *= 0.5
            for side in (-1.0, 1.0):
                at = z + side * step
                here = _smallest(
                    at, ray, own, fields, scale, relative, offset, focal, centre, best, out
                )
                if here > best:
                    best, z = here, at
        value[n] = best
        _slopes(n, z, ray, own, fields, scale, relative, offset, turns, focal, centre, out, slope)


@njit(cache=True)
def _slopes(  # type: ignore[no-untyped-def]
    n, z, ray, own, fields, scale, relative, offset, turns, focal, centre, out, slope
):
    """Write the derivative of the best value: of the one or two silhouettes that bound it at depth
    z."""
    count = len(fields)
    distance = np.full(count, CAP)
    along = np.zeros(count)
    gradient = np.zeros((count, 3))
    zoom = np.zeros(count)
    back = np.empty(3)
    first = -1
    for view in range(count):
        if view == own:
            continue
        local = z * relative[view] + offset[view]
        if local[2] < 1e-3:
            continue
        x, y = focal[view] * local[0] / local[2], focal[view] * local[1] / local[2]
        _sample(fields[view], scale, x + centre[view, 0], y + centre[view, 1], out)
        distance[view] = out[0]
        gradient[view, 0] = out[1] * focal[view] / local[2]
        gradient[view, 1] = out[2] * focal[view] / local[2]
        gradient[view, 2] = -(out[1] * x + out[2] * y) / local[2]
        zoom[view] = out[1] * x + out[2] * y
        for axis in range(3):
            along[view] += gradient[view, axis] * relative[view, axis]
        if first < 0 or out[0] < distance[first]:
            first = view
    if first < 0 or distance[first] >= CAP:
        return
    second = -1
    for view in range(count):
        if view in (own, first) or along[view] * along[first] >= 0.0:
            continue
        if distance[view] - distance[first] < 1.0 and (
            second < 0 or distance[view] < distance[second]
        ):
            second = view
    share = 1.0
    if second >= 0:
        share = along[second] / (along[second] - along[first])
    for view, weight in ((first, share), (second, 1.0 - share)):
        if view < 0 or weight == 0.0:
            continue
        local = z * relative[view] + offset[view]
        g = gradient[view]
        slope[n, view, 0] += weight * (local[1] * g[2] - local[2] * g[1])
        slope[n, view, 1] += weight * (local[2] * g[0] - local[0] * g[2])
        slope[n, view, 2] += weight * (local[0] * g[1] - local[1] * g[0])
        slope[n, view, 3:6] += weight * g
        slope[n, view, 6] += weight * zoom[view]
        _turned(turns[view, own], g, back)
        seen = z * ray
        slope[n, own, 0] -= weight * (seen[1] * back[2] - seen[2] * back[1])
        slope[n, own, 1] -= weight * (seen[2] * back[0] - seen[0] * back[2])
        slope[n, own, 2] -= weight * (seen[0] * back[1] - seen[1] * back[0])
        slope[n, own, 3:6] -= weight * back
        slope[n, own, 6] -= weight * (seen[0] * back[0] + seen[1] * back[1])
