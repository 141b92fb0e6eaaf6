"""Drawn guides and 2D orientations against the photos themselves: where hair is and how it runs.

The directions that photos show are measured here once more (Bigun and Granlund 1987), by nothing
that the guides were made from: a recipe whose `orient` is wrong everywhere agrees with itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Int64Array, UInt8Array
from hairkit.cameras.depth_raster import HEAD_TOLERANCE, head_depth, point_depth
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap, angle_between
from hairkit.types.strands import Strands

HEIGHT, FINER = 240, 3
"""Height in pixels at which guides and photos are compared, and how many times as fine the picture
is in which directions are measured."""
GRADIENT_SIGMA, WINDOW_SIGMA = 1.2, 2.7
"""Gaussians before the gradient, in pixels of that picture, and of the tensor, in pixels of the
comparison: strands, and locks."""
RIM = 3
"""Pixels of that picture that are taken off the hair on all sides: its edge is no strand."""
DIRECTION_LIMIT = np.radians(20.0)
"""Angle in the picture up to which a piece of a guide runs as photographed."""
PIECES, GUIDE_RADIUS, EDGE, SHADE = 39, 0.003, 3, 11
"""Pieces of a guide, the radius in metres within which it hides others, and pixels across which
hair is a wisp, or so narrow that all of it shows how the head's roundness is shaded, no strands:
directions of four portraits with hair of 2 cm were 0.01 to 0.3 as photographed."""
POINTS = 4 * PIECES + 1
"""Points of a guide that hide what is behind them; every fourth is the end of a piece."""
AT_ONCE = 4096
"""Guides whose pieces are looked for at a time."""
BESIDE = 9
"""Pixels, twice of which half a guide may lie beside the hair of a mask."""
LOCK, LEAST_LOCK, LOCK_SHARE, USUAL_GUIDES = 0.01, 0.004, 0.25, 600
"""Radius in metres of the lock that a guide stands for, where there are so many guides; fewer stand
for wider ones. Within 4 cm of the head's outline locks have this share of the distance from it, but
are not thinner than outlines are off: hair of 12 mm that lacks its outer 5 mm is bare there."""
COHERENT = 0.28
"""Coherence from which a photo tells a direction that any orienter finds: 0.34 to 0.58 in the
median of captures of straight and wavy hair, 0.14 to 0.16 of coils and curls."""


@dataclass(frozen=True)
class DrawnHair:
    """What one view shows of the guides."""

    right: float
    """Length in pixels of visible guides that run as photographed."""
    judged: float
    """Length of those over hair whose direction the photo shows."""
    astray: float
    """Length of visible guides where the photo shows no hair."""
    shown: float
    """Length of all visible guides."""
    bare: int
    """Pixels of the photo's hair without a guide nearby."""
    standing: int
    """Pixels of the photo's hair that stands out over the head's outline."""
    coherence: float
    """How much the photo's hair runs one way nearby, its median: 0 for no direction, up to 1."""


def compare_drawing(groom: Groom, camera: Camera, shown: PhotoHair) -> DrawnHair:
    """Compare the guides that one view shows, hidden by no other guide and no head, with its photo.

    Guides have `POINTS` points each. Directions count over hair away from its edge, where the photo
    shows them more clearly than in its median; guides run as photographed within `DIRECTION_LIMIT`.
    """
    small = camera.resized(*shown.hair.shape[::-1])
    hair, judged, dense = shown.hair, shown.judged, groom.strands.points
    near = cv2.dilate(hair, np.ones((BESIDE, BESIDE), np.uint8)) > 0
    head = head_depth(groom.head, small)
    surface = np.minimum(point_depth(small, dense, GUIDE_RADIUS), head)
    places, way = _visible(groom, small, surface)
    drawn = np.isfinite(point_depth(small, dense))
    bare, standing = _bare(hair, drawn, np.isfinite(head), small, len(groom.strands))
    length, at = np.linalg.norm(way, axis=1), (places[:, 1], places[:, 0])
    gap = np.asarray(angle_between(np.arctan2(way[:, 1], way[:, 0]), shown.angle[at]))
    told, along = judged[at], gap <= DIRECTION_LIMIT
    return DrawnHair(
        float(length[told & along].sum()),
        float(length[told].sum()),
        float(length[~near[at]].sum()),
        float(length.sum()),
        bare,
        standing,
        shown.coherence,
    )


@dataclass(frozen=True, eq=False)
class PhotoHair:
    """The hair of one photo, `HEIGHT` pixels high, and the directions that it shows."""

    hair: UInt8Array
    """(H, W) 1 where the mask says so."""
    angle: Float32Array
    """(H, W) of the strands, in [0, pi)."""
    sure: Float32Array
    """(H, W) how much the photo runs one way nearby: 0 for no direction, up to 1."""
    judged: BoolArray
    """(H, W) hair away from its edge that shows its direction more clearly than the median."""
    coherence: float
    """Median of `sure`."""

    @classmethod
    def of(cls, photo: UInt8Array, mask: Mask) -> Self:
        """Return what a photo (h, w, 3) shows of the hair of its mask (h, w)."""
        size = (round(HEIGHT * photo.shape[1] / len(photo)), HEIGHT)
        whole = mask.hair.astype(np.uint8)
        hair = np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_NEAREST), np.uint8)
        angle, sure = photo_directions(photo, whole, size)
        inner = cv2.erode(hair, np.ones((SHADE, SHADE), np.uint8)) > 0
        coherence = float(np.median(sure[inner])) if inner.any() else 0.0
        return cls(hair, angle, sure, inner & (sure >= coherence), coherence)


def share_oriented(found: OrientationMap, shown: PhotoHair) -> float:
    """Return the share of the hair whose direction `found` tells, and not otherwise than the photo.

    Only hair counts whose direction the photo shows more clearly than in its median; where that is
    below `COHERENT`, any direction is taken for right. 1 where no hair is.
    """
    size, doubled = shown.hair.shape[::-1], cv2.polarToCart(found.confidence, 2 * found.angle)
    x, y, sure = (
        cv2.resize(part, size, interpolation=cv2.INTER_AREA)
        for part in (*doubled, found.confidence)
    )
    along = np.asarray(angle_between(np.arctan2(y, x) / 2, shown.angle)) <= DIRECTION_LIMIT
    right = (sure > 0) & (along | (shown.sure < COHERENT))
    return share_of(right[shown.judged].sum(), shown.judged.sum())


def with_pieces(groom: Groom) -> Groom:
    """Return the groom with `POINTS` points on every guide; some guides are resampled at a time."""
    points, offsets, count = groom.strands.points, groom.strands.offsets, len(groom.strands)
    fine = []
    for some in (offsets[k : k + AT_ONCE + 1] for k in range(0, count, AT_ONCE)):
        part = Strands(points[some[0] : some[-1]], some - some[0])
        fine.append(part.resampled(POINTS).points)
    strands = Strands(np.concatenate(fine), np.arange(count + 1) * POINTS)
    return replace(groom, strands=strands)


def _visible(
    groom: Groom, camera: Camera, surface: Float32Array
) -> tuple[Int64Array, Float32Array]:
    """Return pixels (N, 2) and ways (N, 2) of the pieces of guides on the first surface (H, W).

    The way of a wave is that of its axis: from half a pitch before a piece to half a pitch behind.
    """
    points = groom.strands.points.reshape(-1, POINTS, 3)[:, :: (POINTS - 1) // PIECES]
    around, pitch = np.zeros((len(points), 1), np.int64), groom.material.curl_pitch
    if pitch > 0:
        half = PIECES * pitch / (2 * np.maximum(groom.strands.lengths(), 1e-9))
        around[:, 0] = np.rint(half)
    rows = (slice(k, k + AT_ONCE) for k in range(0, len(points), AT_ONCE))
    parts = [_visible_pieces(points[some], around[some], camera, surface) for some in rows]
    places, ways = map(np.concatenate, zip(*parts, strict=True))
    return places, ways


def _visible_pieces(
    points: Float32Array, around: Int64Array, camera: Camera, surface: Float32Array
) -> tuple[Int64Array, Float32Array]:
    """Return the same of ends of pieces (S, M, 3); ways are over (S, 1) pieces to both sides."""
    ends = camera.project(points)
    middle = ((ends[:, :-1] + ends[:, 1:]) / 2).reshape(-1, 2)
    places = np.nan_to_num(np.floor(middle), nan=-1).astype(np.int64)
    size = [camera.width, camera.height]
    inside = np.asarray(((places >= 0) & (places < size)).all(axis=1))
    column, row = (places * inside[:, None]).T
    depth = camera.depth((points[:, :-1] + points[:, 1:]) / 2).ravel()
    seen = inside & (depth <= surface[row, column] + HEAD_TOLERANCE)
    first = np.maximum(np.arange(PIECES) - around, 0)
    last = np.minimum(np.arange(1, PIECES + 1) + around, PIECES)
    strand = np.arange(len(ends))[:, None]
    way = (ends[strand, last] - ends[strand, first]) / (last - first)[..., None]
    return places[seen], way.reshape(-1, 2)[seen].astype(np.float32)


def _bare(
    hair: UInt8Array, drawn: BoolArray, head: BoolArray, camera: Camera, guides: int
) -> tuple[int, int]:
    """Return the pixels of hair farther than a lock from those drawn, and those beside the head.

    Wisps of less than `EDGE` pixels do not count.
    """
    whole = cv2.morphologyEx(hair, cv2.MORPH_OPEN, np.ones((EDGE, EDGE), np.uint8)) > 0
    metre = camera.pixels_per_metre
    off_head, off_guides = (
        cv2.distanceTransform((~part).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5) / metre
        for part in (head, drawn)
    )
    lock = np.where(head, LOCK, np.clip(LOCK_SHARE * off_head, LEAST_LOCK, LOCK))
    wider = max(1.0, np.sqrt(USUAL_GUIDES / max(guides, 1)))
    standing = whole & (off_head > LEAST_LOCK)
    bare = whole & (head | standing) & (off_guides > wider * lock)
    return int(bare.sum()), int(standing.sum())


def photo_directions(
    photo: UInt8Array, hair: UInt8Array, size: tuple[int, int]
) -> tuple[Float32Array, Float32Array]:
    """Return angles in [0, pi) and coherence (height, width) of the hair, 1 where mask `hair`."""
    fine = (FINER * size[0], FINER * size[1])
    grey = cv2.cvtColor(photo, cv2.COLOR_RGB2GRAY).astype(np.float32)
    grey = cv2.resize(grey, fine, interpolation=cv2.INTER_AREA).astype(np.float32)
    grey = cv2.GaussianBlur(grey, (0, 0), GRADIENT_SIGMA).astype(np.float32)
    inside = cv2.resize(hair, fine, interpolation=cv2.INTER_NEAREST)
    inside = cv2.erode(inside, np.ones((2 * RIM + 1,) * 2, np.uint8)).astype(np.float32)
    x, y = cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)
    parts = np.dstack([(x * x - y * y) * inside, 2 * x * y * inside, (x * x + y * y) * inside])
    parts = cv2.resize(parts, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    even, mixed, energy = np.moveaxis(cv2.GaussianBlur(parts, (0, 0), WINDOW_SIGMA), -1, 0)
    angle = (np.arctan2(mixed, even) + np.pi) / 2  # along the strand, across the gradient
    coherence = np.hypot(even, mixed) / np.maximum(energy, 1e-3)
    return np.asarray(angle % np.pi, np.float32), np.asarray(coherence, np.float32)


def share_of(part: float, whole: float) -> float:
    """Return a share; 1 of nothing."""
    return float(part / whole) if whole else 1.0
