"""Silhouettes as signed distances and contour points, for fits of cameras and heads to masks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array
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

    @classmethod
    def of(cls, masks: Sequence[Mask], count: int) -> Outlines:
        """Return fields and about `count` contour points a view."""
        shapes = [mask.labels.shape for mask in masks]
        masks = _of_one_size(masks)
        height, width = masks[0].labels.shape
        scale = min(1.0, FIELD_HEIGHT / height)
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        fields, points = [], []
        whole = all(mask.person_known for mask in masks)
        for view, mask in enumerate(masks):
            silhouette = _smooth(mask.person if whole else mask.hair, size)
            fields.append(_signed_distance(silhouette) / scale)
            contour = _contour(fields[-1] * scale, scale * np.array(shapes[view]), count)
            points.append(contour / scale)
        views = np.repeat(np.arange(len(masks)), [len(each) for each in points])
        return cls(np.stack(fields), scale, np.concatenate(points), views, whole)

    def arranged(self, order: Int64Array) -> Outlines:
        """Return the outlines with the views in another order."""
        mine = [np.flatnonzero(self.views == view) for view in order]
        views = np.repeat(np.arange(len(order)), [len(each) for each in mine])
        points = self.points[np.concatenate(mine)]
        return replace(self, fields=self.fields[order], points=points, views=views)

    def thinned(self, every: int) -> Outlines:
        """Return the outlines with one of `every` so many contour points."""
        return replace(self, points=self.points[::every].copy(), views=self.views[::every].copy())

    def crowns(self, ratio: float) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Return each silhouette's top row, and middle column and width `ratio` widths below it.

        All in pixels, (V,) each.
        """
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
        if any(after for _, after in more):
            mask = Mask(np.pad(mask.labels, more, mode="edge"), mask.person_known)
        continued.append(mask)
    return continued


def _smooth(silhouette: npt.NDArray[np.bool_], size: tuple[int, int]) -> npt.NDArray[np.bool_]:
    """Shrink to the field's size, without flying hairs and with holes between hairs filled."""
    small = cv2.resize(silhouette.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return cv2.GaussianBlur(small, (0, 0), SMOOTHING_PX) > 0.5


def _signed_distance(silhouette: npt.NDArray[np.bool_]) -> Float32Array:
    inside = cv2.distanceTransform(silhouette.astype(np.uint8), cv2.DIST_L2, MASK_SIZE)
    outside = cv2.distanceTransform((~silhouette).astype(np.uint8), cv2.DIST_L2, MASK_SIZE)
    distance = np.where(silhouette, inside - 0.5, 0.5 - outside)
    return np.asarray(np.clip(distance, -FAR, FAR), np.float32)


def _contour(field: Float32Array, shape: Float64Array, count: int) -> Float64Array:
    """Return about `count` points (n, 2) evenly along the longest outline in a picture (2,).

    Without its cut edges, and without what a smaller picture was continued by.
    """
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
