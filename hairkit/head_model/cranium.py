"""The cranium where photos show it bare: its rim lies on the outline of the person.

Where hair covers the outline it tells how thick the hair is and nothing of the skull. Bald crowns,
receding hairlines and shaved sides show the skull itself, and with it how large it is beside the
face, which no landmark tells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.head_model.spread_vertices import spread_vertices
from hairkit.types.head import Head
from hairkit.types.mask import HAIR, Mask

POINTS = 120
"""Points of the cranium: 20 mm apart."""
RIM = 0.15
"""Cosine between normal and viewing direction at which a point counts for exp(-1/2) of one on the
rim: there the rim of a skull of 90 mm radius stands 1 mm farther out."""
LEAST_SHARE = 0.05
"""Points that count for less than this are left out."""
HAIR_GAP = 0.02
"""An outline is bare where no hair is this near, in heights of the picture: 8 mm in portraits."""


@dataclass(frozen=True, eq=False)
class Cranium:
    """Points of the cranium and where outlines are bare."""

    points: Float64Array
    """(K, 3) in the head frame."""
    normals: Float64Array
    """(K, 3)."""
    fields: Float32Array
    """(V, H, W) 1 where no hair is near."""
    scale: float
    """Field pixels per pixel."""

    @classmethod
    def of(cls, head: Head, masks: tuple[Mask, ...], scale: float) -> Cranium:
        """Return the cranium of a head, and what masks of whole persons show of it."""
        chosen = spread_vertices(head, np.nonzero(head.scalp > 0.5)[0], POINTS)
        shape = np.max([mask.labels.shape for mask in masks], axis=0)
        size = (max(1, round(shape[1] * scale)), max(1, round(shape[0] * scale)))
        fields = np.stack([_far_from_hair(mask, size, scale) for mask in masks])
        normals = head.normals()[chosen].astype(np.float64)
        return cls(head.vertices[chosen].astype(np.float64), normals, fields, scale)

    def arranged(self, order: Int64Array) -> Cranium:
        """Return the cranium with the views in another order."""
        return replace(self, fields=self.fields[order])

    def moved(self, points: Float64Array, normals: Float64Array) -> Cranium:
        """Return the cranium with other points (K, 3) and their normals (K, 3)."""
        return replace(self, points=points, normals=normals)

    def select(self, points: Int64Array) -> Cranium:
        """Return the cranium of some of its points."""
        return replace(self, points=self.points[points], normals=self.normals[points])

    def rims(
        self, cameras: tuple[Float64Array, ...]
    ) -> tuple[Int64Array, Int64Array, Float64Array]:
        """Return views, points and how much each is on the rim, from 0 to 1."""
        rotation, translation = cameras[:2]
        local = self.points @ rotation.transpose(0, 2, 1) + translation[:, None]
        local /= np.linalg.norm(local, axis=2, keepdims=True)
        facing = ((self.normals @ rotation.transpose(0, 2, 1)) * local).sum(2)
        share = np.exp(-0.5 * (facing / RIM) ** 2)
        view, point = np.nonzero(share > LEAST_SHARE)
        return view, point, share[view, point]

    def bare(self, view: Int64Array, pixels: Float64Array) -> Float64Array:
        """Return 1 where no hair is near (N,), 0 elsewhere and off the picture."""
        height, width = self.fields.shape[1:]
        j, i = np.floor(pixels * self.scale).astype(np.int64).T
        inside = (i >= 0) & (i < height) & (j >= 0) & (j < width)
        i, j = np.clip(i, 0, height - 1), np.clip(j, 0, width - 1)
        return np.where(inside, self.fields[view, i, j], 0.0)


def _far_from_hair(mask: Mask, size: tuple[int, int], scale: float) -> Float32Array:
    """Return 1 where no hair is near, in a smaller picture, 0 off the mask."""
    other = np.where(mask.labels == HAIR, np.uint8(0), np.uint8(255))
    small = cv2.resize(other, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    away = cv2.distanceTransform((small == 255).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    result = np.zeros(size[::-1], np.float32)
    rows, columns = min(small.shape[0], size[1]), min(small.shape[1], size[0])
    result[:rows, :columns] = away[:rows, :columns] > max(HAIR_GAP * size[1], 1)
    return result
