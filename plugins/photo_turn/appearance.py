"""What single photos and pairs of them show of the turn: outlines, skin, copies.

All pictures are upright. Lengths are in head widths, so that photos of different sizes, lenses and
distances can be compared.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from hairkit import View
from hairkit.arrays import Float64Array, UInt8Array
from hairkit.imaging.hair_network import find_hair
from hairkit.imaging.person_outline import DEPTHS, PERSON_LEVEL, Outline
from hairkit.types.face import Face

STRETCHES = np.linspace(0.85, 1.18, 9)
"""Scales tried between two outlines: heads are nearer in one photo than in the other."""
SHIFTS = np.array([-0.05, -0.025, 0.0, 0.025, 0.05])
"""Vertical shifts tried, head widths."""
ODD_DISTANCE, ODD_SHOULDER = 2.0, 3.0
"""Weights of the logarithms of distance and depth: ten photos from above are 1.5 to 8 times as far
from the nearest outline as is usual in their turn, profiles with ponytails 3 times."""
FAR = 1.0
"""Largest distance of outlines that counts, head widths."""
HEAD_DEPTH = 1.25
"""Depth below the crown down to which skin is looked for, head widths: the chin."""
SKIN_BLUR_PX, SKIN_EDGE = 1.0, 240
"""Gaussian of the photo in which skin is looked for, and the long edge it is scaled down to."""
SKIN_FLOOR = 0.02
"""Added to colours, of 1, before their logarithm: sensor noise."""
SKIN_SLACK = np.diag([0.003, 0.003, 0.1])
"""Added to the covariance of skin's log chromaticity (2) and log brightness: white balance is
8 % and exposure 0.5 stops off from photo to photo."""
SKIN_WIDTH = 2.0
"""Spreads at which a pixel counts 0.6 as skin."""
SKIN_OUTLIER = 1.5
"""Log colours farther than this from the median are eyes or glints."""
FACE_POINTS = np.r_[17:68]
"""iBUG points whose hull is skin: all but the jaw, which may lie under hair."""
EYES_AND_MOUTH = (np.r_[36:42], np.r_[42:48], np.r_[48:60])
"""iBUG points of what is no skin inside."""
CLOTHES, CROWN_DEPTH = (1.7, 2.7), 0.25
"""Head widths below the crown between which clothes are looked for, on the chest: lower down others
may be worn, or the room seen. Hair is what lies above the last depth."""
NOT_HAIR, CLOTHED = 0.18, 0.3
"""Clothes differ from hair by this much in log chromaticity, in at least this share of the band."""
HEAD_PIXELS, LEAST_UNLIKE = 16, 0.05
"""Edge of the small pictures by which heads are compared, and the least difference of two, over the
usual one: copies are alike."""
THUMBNAIL, THUMBNAIL_BLUR = 32, 1.0
"""Edge of the grey thumbnails in which copies are recognised, and their Gaussian, pixels."""


def compare_outlines(outlines: Sequence[Outline]) -> tuple[Float64Array, Float64Array]:
    """Return distances (V, V) of outlines from each other, and from each other's mirror images.

    Mean absolute difference of the edges, head widths, after the best scale and shift. Views from
    opposite sides mirror each other; neighbours are alike.
    """
    count = len(outlines)
    edges = np.array([outline.edges for outline in outlines])
    variants = np.array([_variants(each) for each in edges])
    alike, mirrored = np.zeros((count, count)), np.zeros((count, count))
    for i in range(count):
        alike[i] = _distance(variants, edges[i])
        mirrored[i] = _distance(variants, -edges[i, :, ::-1])
    return (alike + alike.T) / 2, (mirrored + mirrored.T) / 2


def _variants(edges: Float64Array) -> Float64Array:
    """Return (9 * 5, 48, 2) an outline at all scales and shifts."""
    found = [
        np.stack([np.interp(DEPTHS / s + d, DEPTHS, side) * s for side in edges.T], axis=1)
        for s in STRETCHES
        for d in SHIFTS
    ]
    return np.array(found)


def _distance(variants: Float64Array, edges: Float64Array) -> Float64Array:
    """Return distances (V,) of outlines, each at all its scales, from one."""
    off = variants - edges
    off = off - np.median(off, axis=(2, 3), keepdims=True)
    return np.asarray(np.abs(off).mean(axis=(2, 3)).min(axis=1))


def compare_heads(photos: Sequence[UInt8Array], outlines: Sequence[Outline]) -> Float64Array:
    """Return how unlike heads look (V, V): the logarithm over the median of all pairs.

    Root mean square difference of log colours from crown to chin, where both photos show the
    person, after the best exposure and white balance. Hair lies, and light falls on it, nearly
    alike in neighbours of a turn: their difference is a third of the usual one from behind.
    """
    heads = [_small_head(*pair) for pair in zip(photos, outlines, strict=True)]
    unlike = np.eye(len(heads))
    pairs = np.triu_indices(len(heads), 1)
    for i, j in zip(*pairs, strict=True):
        weight = heads[i][..., 3:] * heads[j][..., 3:]
        weight /= max(float(weight.sum()), 1e-9)
        gap = heads[i][..., :3] - heads[j][..., :3]
        gap -= (weight * gap).sum(axis=(0, 1))
        unlike[i, j] = unlike[j, i] = np.sqrt((weight * gap**2).sum() / 3)
    usual = max(float(np.median(unlike[pairs])), 1e-9)
    return np.asarray(np.log(np.maximum(unlike / usual, LEAST_UNLIKE)))


def _small_head(photo: UInt8Array, outline: Outline) -> Float64Array:
    """Return log colours of a head and where the person is, (16, 16, 4), from crown to chin."""
    small, scale = _shrink(photo)
    inside = cv2.resize(outline.inside.astype(np.uint8), small.shape[1::-1])
    size = HEAD_DEPTH * outline.width_px * scale
    seen = cv2.GaussianBlur(
        np.dstack([np.log(small / 255 + SKIN_FLOOR), inside]).astype(np.float32),
        (0, 0), max(size / HEAD_PIXELS / 2, 0.5),
    )  # fmt: skip
    share = HEAD_PIXELS / size
    corner = np.array([outline.middle_px * scale - size / 2, outline.top_px * scale])
    crop = np.column_stack([share * np.eye(2), -share * corner])
    return np.asarray(cv2.warpAffine(seen, crop, (HEAD_PIXELS, HEAD_PIXELS)), np.float64)


def measure_oddness(
    outlines: Sequence[Outline], alike: Float64Array, mirrored: Float64Array
) -> Float64Array:
    """Return how unlike those of level photos the outlines are (V,), 0 for usual ones.

    Outlines of photos from above are like no other and no mirror image, and the shoulders begin
    higher. Both are logarithms of ratios to the median of the turn, weighted.
    """
    nearest = np.minimum(alike, mirrored) + np.diag(np.full(len(alike), np.inf))
    apart = nearest.min(axis=1, initial=FAR)
    shoulder = np.array([outline.shoulder for outline in outlines])
    known = np.isfinite(shoulder)
    usual = np.median(shoulder[known]) if known.any() else 1.0
    shallow = np.where(known, usual / np.where(known, shoulder, usual), 1.0)
    odd = ODD_DISTANCE * np.log(np.maximum(apart / max(float(np.median(apart)), 1e-9), 1.0))
    return np.asarray(odd + ODD_SHOULDER * np.log(np.maximum(shallow, 1.0)), np.float64)


def measure_skin(views: Sequence[View], outlines: Sequence[Outline]) -> Float64Array | None:
    """Return (V, 2): share of the head that is skin, and its sideways moment in head widths.

    Skin is what has the colour of the sure faces' cheeks, and is no hair where that is told: hair
    in the sun may have its colour. Its share falls from the front to the
    back; its moment is negative from the subject's left, where the face lies on the left. None
    without a sure face.
    """
    samples = [_cheeks(v.image, v.face) for v in views if v.face is not None and v.face.sure]
    samples = [sample for sample in samples if len(sample)]
    if not samples:
        return None
    colour = np.concatenate(samples)
    usual = np.median(colour, axis=0)
    near = (np.abs(colour - usual) < SKIN_OUTLIER).all(1)
    precision = np.asarray(np.linalg.inv(np.cov((colour[near] - usual).T) + SKIN_SLACK), np.float64)
    return np.array([
        _skin_moments(view, outline, usual, precision)
        for view, outline in zip(views, outlines, strict=True)
    ])  # fmt: skip


def _log_colour(image: UInt8Array) -> Float64Array:
    """Return log(red / green), log(blue / green) and log(green) of RGB."""
    log = np.log(image / 255 + SKIN_FLOOR)
    return np.stack([log[..., 0] - log[..., 1], log[..., 2] - log[..., 1], log[..., 1]], axis=-1)


def _cheeks(photo: UInt8Array, face: Face) -> Float64Array:
    """Return log colours (N, 3) of the skin of a face."""
    small, scale = _shrink(photo)
    points = (face.landmarks * scale).astype(np.float32)
    skin = np.zeros(small.shape[:2], np.uint8)
    for chosen, value in ((FACE_POINTS, 1), *((part, 0) for part in EYES_AND_MOUTH)):
        hull = cv2.convexHull(points[chosen]).astype(np.int32)
        cv2.fillConvexPoly(skin, hull, value)
    return _log_colour(small[skin > 0])


def _shrink(photo: UInt8Array) -> tuple[UInt8Array, float]:
    """Return a smooth small copy of a photo and its scale."""
    scale = min(1.0, SKIN_EDGE / max(photo.shape[:2]))
    size = (max(1, round(photo.shape[1] * scale)), max(1, round(photo.shape[0] * scale)))
    small = cv2.resize(photo, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), SKIN_BLUR_PX), np.uint8), scale


def _skin_moments(
    view: View, outline: Outline, usual: Float64Array, precision: Float64Array
) -> Float64Array:
    small, scale = _shrink(view.image)
    size = (small.shape[1], small.shape[0])
    inside = cv2.resize(outline.inside.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    rows, columns = np.nonzero(inside)
    head = rows < (outline.top_px + HEAD_DEPTH * outline.width_px) * scale
    rows, columns = rows[head], columns[head]
    off = _log_colour(small[rows, columns]) - usual
    squared = np.einsum("ni,ij,nj->n", off, precision, off)
    skin = np.exp(-squared / (2 * SKIN_WIDTH))
    skin *= 1 - cv2.resize(find_hair(view)[..., 0], size)[rows, columns]
    if view.person is not None and view.person.hair.size:
        skin *= 1 - cv2.resize(view.person.hair, size)[rows, columns] / 255
    sideways = (columns - columns.mean()) / (outline.width_px * scale)
    return np.array([skin.mean(), (skin * sideways).mean()])


def measure_clothes(views: Sequence[View], outlines: Sequence[Outline]) -> Float64Array:
    """Return the log chromaticity (V, 2) of the clothes, NaN where hair covers them."""
    found = []
    for view, outline in zip(views, outlines, strict=True):
        small, scale = _shrink(view.image)
        size = small.shape[1::-1]
        inside = cv2.resize(outline.inside.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
        rows, columns = np.nonzero(inside)
        colour = _log_colour(small[rows, columns])[:, :2]
        depth = (rows / scale - outline.top_px) / outline.width_px
        unlike = colour - np.median(colour[depth <= CROWN_DEPTH], axis=0)
        worn = np.linalg.norm(unlike, axis=1) > NOT_HAIR
        if view.person is not None and view.person.hair.size:
            worn &= cv2.resize(view.person.hair, size)[rows, columns] <= PERSON_LEVEL
        band = (depth > CLOTHES[0]) & (depth < CLOTHES[1])
        clothed = band.any() and worn[band].mean() > CLOTHED
        found.append(np.median(colour[band & worn], axis=0) if clothed else np.full(2, np.nan))
    return np.array(found)


def thumbnails_alike(
    photos: Sequence[UInt8Array], outlines: Sequence[Outline | None]
) -> Float64Array:
    """Return the correlation (V, V) of small grey copies of the heads: copies of one are alike.

    Of a photo without an outline (None) the whole is looked at: walls and clothes are alike in
    different photos, too.
    """
    small = [_thumbnail(_head(*pair)) for pair in zip(photos, outlines, strict=True)]
    table = np.array(small) - np.mean(small, axis=1, keepdims=True)
    table = table / np.maximum(np.linalg.norm(table, axis=1, keepdims=True), 1e-9)
    return np.asarray(table @ table.T, np.float64)


def _head(photo: UInt8Array, outline: Outline | None) -> UInt8Array:
    """Return the part of a photo from the crown to the chin, a square around the head."""
    if outline is None:
        return photo
    top, left = outline.top_px, outline.middle_px - HEAD_DEPTH * outline.width_px / 2
    size = HEAD_DEPTH * outline.width_px
    rows = slice(max(round(top), 0), round(top + size))
    return photo[rows, max(round(left), 0) : round(left + size)]


def _thumbnail(photo: UInt8Array) -> Float64Array:
    """Return a small grey copy of a photo as a row."""
    size = (THUMBNAIL, THUMBNAIL)
    small = cv2.cvtColor(cv2.resize(photo, size, interpolation=cv2.INTER_AREA), cv2.COLOR_RGB2GRAY)
    blurred = cv2.GaussianBlur(small.astype(np.float64), (0, 0), THUMBNAIL_BLUR)
    return np.asarray(blurred.ravel(), np.float64)
