"""Silhouettes as signed distances and contour points, for fits of cameras and heads to masks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.imaging.person_outline import trace_outline
from hairkit.types.mask import Mask

FIELD_HEIGHT = 540
"""Signed distances are sampled at about this many rows."""
SMOOTHING_PX = 2.0
"""Gaussian that closes holes between hairs and drops flying ones, field pixels."""
SLOPE_SMOOTHING_PX = 1.5
"""Gaussian of the field by whose gradient contour points move to the edge, field pixels."""
LEAST_SLOPE = 0.1
"""Least square of the gradient by which contour points move: it is 1 off the medial axis."""
MASK_SIZE = cv2.DIST_MASK_5
"""Window of the chamfer distance transform."""
HEAD_DEPTH, BARE = 1.2, 0.05
"""Height of a head in its widths with hair; what a pixel without hair weighs beside one with."""
EDGE = 4
"""Contour points this near to the picture's edge, in field pixels, are cuts and no outline."""
FAR = 1e5
"""Signed distance, in field pixels, where a picture shows no outline at all."""


@dataclass(frozen=True, eq=False)
class Outlines:
    """The silhouettes of all views, ready for coherence."""

    fields: Float32Array
    """(V, H, W) signed distance to the edge, positive inside, in pixels of the full picture."""
    scale: float
    """Field pixels per picture pixel."""
    points: Float64Array
    """(N, 2) contour points in picture pixels."""
    views: Int64Array
    """(N,) their views."""
    whole: bool
    """The silhouettes are those of persons; of their hair where a mask knows no person."""
    heads: Float64Array
    """(V, 3) row of the crown, column of the head's middle and width, pixels; NaN where unknown."""

    @classmethod
    def of(cls, masks: Sequence[Mask], count: int) -> Outlines:
        """Return fields and about `count` contour points a view."""
        whole = all(mask.person_known for mask in masks)
        inside = [_person(mask) if whole else mask.hair for mask in masks]
        heads, ends = _trace(inside)
        rows = np.fmax(heads[:, 0] + ends * heads[:, 2], [_end(mask.hair) for mask in masks])
        height, width = np.max([each.shape for each in inside], axis=0)
        scale = min(1.0, FIELD_HEIGHT / height)
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        fields, points = [], []
        for each, row in zip(inside, rows, strict=True):
            right = np.pad(each, ((0, height - len(each)), (0, width - each.shape[1])), mode="edge")
            fields.append(_signed_distance(_smooth(right, size)) / scale)
            seen = np.array([min(row, len(each)), each.shape[1]])
            points.append(_contour(fields[-1] * scale, scale * seen, count) / scale)
        views = np.repeat(np.arange(len(masks)), [len(each) for each in points])
        return cls(np.stack(fields), scale, np.concatenate(points), views, whole, heads)

    def arranged(self, order: Int64Array) -> Outlines:
        """Return the outlines with the views in another order."""
        mine = [np.flatnonzero(self.views == view) for view in order]
        views = np.repeat(np.arange(len(order)), [len(each) for each in mine])
        points = self.points[np.concatenate(mine)]
        fields, heads = self.fields[order], self.heads[order]
        return replace(self, fields=fields, points=points, views=views, heads=heads)

    def thinned(self, every: int) -> Outlines:
        """Return the outlines with one of `every` so many contour points."""
        return replace(self, points=self.points[::every].copy(), views=self.views[::every].copy())


def _person(mask: Mask) -> BoolArray:
    """Return the piece of the person with most hair, (H, W); the largest of a bald one."""
    _, labels = cv2.connectedComponents(mask.person.astype(np.uint8))
    weight = np.where(mask.hair, 1.0, BARE)[mask.person]
    return np.asarray(labels == np.bincount(labels[mask.person], weight).argmax())


def _trace(silhouettes: Sequence[BoolArray]) -> tuple[Float64Array, float]:
    """Return the heads (V, 3) of persons, and down to how many widths all of them were found.

    Persons stand on the picture's lower edge: below the end of a silhouette something is missing.
    """
    heads, depth = np.full((len(silhouettes), 3), np.nan), np.inf
    for head, inside in zip(heads, silhouettes, strict=True):
        outline = trace_outline(np.uint8(255) * inside)
        if outline is not None:
            head[:] = outline.top_px, outline.middle_px, outline.width_px
            depth = min(depth, (_end(inside) - head[0]) / head[2])
    return heads, max(depth, HEAD_DEPTH)


def _end(inside: BoolArray) -> int:
    """Return the row below the last that has something inside."""
    return int(np.nonzero(inside.any(1))[0][-1]) + 1


def _smooth(silhouette: BoolArray, size: tuple[int, int]) -> BoolArray:
    """Shrink to the field's size, without flying hairs and with holes between hairs filled."""
    small = cv2.resize(silhouette.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(small, (0, 0), SMOOTHING_PX) > 0.5


def _signed_distance(silhouette: BoolArray) -> Float32Array:
    inside = cv2.distanceTransform(silhouette.astype(np.uint8), cv2.DIST_L2, MASK_SIZE)
    outside = cv2.distanceTransform((~silhouette).astype(np.uint8), cv2.DIST_L2, MASK_SIZE)
    distance = np.where(silhouette, inside - 0.5, 0.5 - outside)
    return np.asarray(np.clip(distance, -FAR, FAR), np.float32)


def _contour(field: Float32Array, shape: Float64Array, count: int) -> Float64Array:
    """Return about `count` points (n, 2) evenly along the longest outline within a shape (2,)."""
    outlines, _ = cv2.findContours(
        (field > 0).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE
    )
    longest = max(outlines, key=len, default=np.zeros((0, 1, 2)))[:, 0, :].astype(np.float64)
    kept = (longest >= EDGE).all(1) & (longest < shape[::-1] - EDGE).all(1)
    longest = longest[kept]
    if not len(longest):
        return longest
    chosen = longest[np.linspace(0, len(longest), count, endpoint=False).astype(int)]
    return _to_edge(field, chosen) + 0.5


def _to_edge(field: Float32Array, points: Float64Array) -> Float64Array:
    """Move points by their signed distance along its gradient on to the edge."""
    smooth = cv2.GaussianBlur(field, (0, 0), SLOPE_SMOOTHING_PX)
    column, row = points.astype(int).T  # off the border, see EDGE
    across = smooth[row, column + 1] - smooth[row, column - 1]
    gradient = np.stack([across, smooth[row + 1, column] - smooth[row - 1, column]], axis=1) / 2
    length = np.maximum((gradient**2).sum(1, keepdims=True), LEAST_SLOPE)
    return np.asarray(points - field[row, column][:, None] * gradient / length)
