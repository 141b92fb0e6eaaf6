"""Masks of all views mended together, by the head's place in them and by the person's colours.

The head of the first scene, drawn into every view, tells where no hair grows: face, ears and neck.
There, what the network takes for hair is face if it has the colours that the landmarks of any view
enclose, a beard's or the frame of glasses', and hair if not: long hair hangs over cheeks and ears.
Above the brows neither a beard nor clothes are: dark hair like a jacket is not taken for one there.
Hair, face, clothes and backdrop have one colour model for all views
(`hairkit.imaging.hair_colours`). Hair that is then left on bare parts of the head, apart from the
scalp's, is no hair of the head. Nor is an island behind which no point shows as hair in most of the
other views that see the point: a beard that stands out behind the cheek.
Edges are refined as in `auto_matte`.

Masks and strokes are the user's word: views that have them keep their masks.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np

from hairkit import Camera, Capture, Head, Mask, Scene, hookimpl
from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.cameras.depth_raster import depth_behind, head_depth
from hairkit.head_model.bare_head import mark_bare_head, mark_upper_head
from hairkit.imaging.alpha_matting import refine_near_hair
from hairkit.imaging.hair_colours import ALL_PHOTOS, HairPrior, label_colours
from hairkit.imaging.hair_network import find_hair, mark_face
from hairkit.imaging.masked_filters import reduced_size
from hairkit.imaging.seeded_segmentation import UNKNOWN
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, PERSON, Masks

_LEAST_HAIR = 5e-4
"""Share of the picture below which there is no hair; such a view keeps its mask."""
_REACH, _STEP = 0.3, 0.005
"""Metres before and behind the head in which an island's hair may lie, and the
distance of the points that are looked up there."""
_HIDDEN = 0.02
"""Metres behind the head's surface from which a view does not see a point: the head is an average
one, and its place a first one."""
_ROOTED = 0.05
"""Share of the visible scalp that hair covers which needs no other view."""
_LOOKED_UP = 60
"""Pixels of an island that are looked up, evenly spread."""
_CONFIRMED = 0.2
"""Share of an island's pixels that other views must show as hair: 0 of a beard's and a shirt's on
photographs of a man, 1 of locks beside the neck on three captures. With 0.1 a spot on his ear
stays, with 0.4 two specks go."""
_THICK, _FILLED = 0.01, 0.9
"""Metres before the head's surface in which others look for the hair of a hole, and the share of
its pixels that they must show as hair: 1 of a man's highlights, 0.7 of another's bald crown."""


@hookimpl
def refine_masks(capture: Capture, masks: tuple[Mask, ...], scene: Scene) -> Masks:
    """Label the views again that have neither mask nor strokes."""
    free = [
        index
        for index, view in enumerate(capture.views)
        if view.mask_path is None and view.strokes_path is None
    ]
    if not free:
        return Masks(masks)
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        priors = list(
            pool.map(lambda i: _prior(capture.views[i], scene.head, scene.cameras[i]), free)
        )
        found = zip(label_colours(priors, ALL_PHOTOS), priors, strict=True)
        labels = dict(
            zip(free, (_without_islands(each, prior.bare) for each, prior in found), strict=True)
        )
        every = [labels.get(index, mask.labels) for index, mask in enumerate(masks)]
        confirmed = _as_others_see(every, scene)
        mended = pool.map(_mend, [masks[i] for i in free], priors, [confirmed[i] for i in free])
        better = dict(zip(free, mended, strict=True))
    return Masks(tuple(better.get(index, mask) for index, mask in enumerate(masks)))


def _mend(mask: Mask, prior: HairPrior, kept: UInt8Array) -> Mask:
    """Return the mask of the labels (h, w) with refined edges; `mask` where they have no hair."""
    if np.count_nonzero(kept == HAIR) < _LEAST_HAIR * kept.size:
        return mask
    fine, alpha = refine_near_hair(prior.image, kept, np.full_like(kept, UNKNOWN))
    return Mask(fine, person_known=True, alpha=alpha)


def _prior(view: View, head: Head, camera: Camera) -> HairPrior:
    """Return what network, landmarks and head say about a view."""
    size = reduced_size(view.width, view.height)
    small = camera.resized(*size)
    upper = mark_upper_head(head, small)
    bare = mark_bare_head(head, small) * (1 - upper)
    return HairPrior(view.image, find_hair(view), mark_face(view, size), bare, upper)


def _without_islands(labels: UInt8Array, bare: Float32Array) -> UInt8Array:
    """Return labels (h, w) without hair that lies on bare parts of the head only."""
    count, part = cv2.connectedComponents((labels == HAIR).astype(np.uint8))
    rooted = np.zeros(count, np.bool_)
    rooted[part[bare < 0.5]] = True
    return np.where((labels == HAIR) & ~rooted[part], np.uint8(PERSON), labels).astype(np.uint8)


def _as_others_see(labels: list[UInt8Array], scene: Scene) -> list[UInt8Array]:
    """Return the labels (h, w) of all views without islands of hair that no other view confirms,
    and with holes in the hair above the brows filled that others call hair.

    Hair that covers some of the scalp is no island.
    """
    scalp = scene.head.vertices[scene.head.scalp > 0.5]
    small = scene.resized([view.shape[::-1] for view in labels]).cameras
    depths = [head_depth(scene.head, camera) for camera in small]
    views = list(zip(small, labels, depths, strict=True))
    kept = []
    for index, (camera, view, depth) in enumerate(views):
        others = views[:index] + views[index + 1 :]
        skin = np.where(np.isfinite(depth), depth, camera.depth(np.zeros(3)))
        clean = view.copy()
        count, part = cv2.connectedComponents((view == HAIR).astype(np.uint8))
        shown = scalp[depth_behind(camera, depth, scalp) < _HIDDEN]
        column, row = camera.project(shown).astype(int).T
        covers = np.bincount(part[row, column], minlength=count) > _ROOTED * len(row)
        for island in (i for i in range(1, count) if not covers[i]):
            at = part == island
            if _confirmed(at, skin, (-_REACH, _REACH), camera, others) < _CONFIRMED:
                clean[at] = PERSON
        upper = mark_upper_head(scene.head, camera) == 1
        count, part = cv2.connectedComponents((view == PERSON).astype(np.uint8))
        for hole in np.setdiff1d(part[upper], part[~upper]):
            at = part == hole
            if hole and _confirmed(at, skin, (-_THICK, 0), camera, others) > _FILLED:
                clean[at] = HAIR
        kept.append(clean)
    return kept


def _confirmed(
    at: BoolArray,
    surface: Float32Array,
    reach: tuple[float, float],
    camera: Camera,
    others: list[tuple[Camera, UInt8Array, Float32Array]],
) -> float:
    """Return the share of pixels (h, w) near whose surface most views of a point show hair."""
    row, column = (rows[:: -(-len(rows) // _LOOKED_UP)] for rows in np.nonzero(at))
    depths = np.maximum(surface[row, column, None] + np.arange(*reach, _STEP), _STEP)
    pixels = np.stack([column, row], axis=1)[:, None] + np.full((depths.shape[1], 2), 0.5)
    flat = camera.unproject(pixels, depths).reshape(-1, 3).astype(np.float32)
    votes = np.zeros(len(flat))
    for other, labels, depth in others:
        seen = depth_behind(other, depth, flat) < _HIDDEN
        column, row = other.project(flat[seen]).astype(np.int64).T
        votes[seen] += np.where(labels[row, column] == HAIR, 1, -1)
    return float((votes.reshape(depths.shape) > 0).any(axis=1).mean())
