"""Masks of all views mended together, by the head's place in them and by the person's colours.

The head of the first scene, drawn into every view, tells where no hair grows: face, ears and neck.
There, what the network takes for hair is face if it has the colours that the landmarks of any view
enclose, a beard's or the frame of glasses', and hair if not: long hair hangs over cheeks and ears.
Hair, face, clothes and backdrop have one colour model for all views
(`hairkit.imaging.hair_colours`). Hair that is then left on bare parts of the head, apart from the
scalp's, is no hair of the head.
Edges are refined as in `auto_matte`.

Masks and strokes are the user's word: views that have them keep their masks.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np

from hairkit import Camera, Capture, Head, Mask, Scene, hookimpl
from hairkit.arrays import Float32Array, UInt8Array
from hairkit.head_model.bare_head import mark_bare_head
from hairkit.imaging.alpha_matting import refine_near_hair
from hairkit.imaging.hair_colours import ALL_PHOTOS, HairPrior, label_colours
from hairkit.imaging.hair_network import find_hair, mark_face
from hairkit.imaging.seeded_segmentation import UNKNOWN, reduced_size
from hairkit.options import option
from hairkit.types.capture import View
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Masks

_LEAST_HAIR = 5e-4
"""Share of the picture below which there is no hair; such a view keeps its mask."""


@dataclass(frozen=True)
class Options:
    """Settings of the masks mended together."""

    reduced_height: int = option(
        360, low=120, high=1080, doc="Rows of the pictures that are labelled first.", unit="px"
    )
    given: float = option(
        0.2,
        low=0.0,
        high=1.0,
        doc="Share of the given mask in the prior; the rest is the network's.",
    )


@hookimpl
def refine_masks(
    capture: Capture, masks: tuple[Mask, ...], scene: Scene, options: Options
) -> Masks:
    """Label the views again that have neither mask nor strokes."""
    free = [
        index
        for index, view in enumerate(capture.views)
        if view.mask_path is None and view.strokes_path is None
    ]
    if not free:
        return Masks(masks)

    def prior_of(index: int) -> HairPrior:
        camera = scene.cameras[index]
        return _prior(capture.views[index], masks[index], scene.head, camera, options)

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        priors = list(pool.map(prior_of, free))
        labels = label_colours(priors, ALL_PHOTOS)
        mended = pool.map(_mend, [masks[i] for i in free], priors, labels)
        better = dict(zip(free, mended, strict=True))
    return Masks(tuple(better.get(index, mask) for index, mask in enumerate(masks)))


def _mend(mask: Mask, prior: HairPrior, labels: UInt8Array) -> Mask:
    """Return the mask of the labels (h, w) with refined edges; `mask` where they have no hair."""
    kept = _without_islands(labels, prior.bare)
    if np.count_nonzero(kept == HAIR) < _LEAST_HAIR * kept.size:
        return mask
    fine, alpha = refine_near_hair(prior.image, kept, np.full_like(kept, UNKNOWN))
    return Mask(fine, person_known=True, alpha=alpha)


def _prior(view: View, mask: Mask, head: Head, camera: Camera, options: Options) -> HairPrior:
    """Return what network, mask, landmarks and head say about a view."""
    size = reduced_size(view.width, view.height, options.reduced_height)
    network = find_hair(view)
    given = _shares(mask, network.shape[1::-1])
    share = np.float32(options.given)
    probability = (1 - share) * network + share * given
    bare = mark_bare_head(head, camera.resized(*size))
    return HairPrior(view.image, probability, mark_face(view, size), bare)


def _shares(mask: Mask, size: tuple[int, int]) -> Float32Array:
    """Return (height, width, 3) the shares of a mask's labels in the cells of a smaller picture."""
    labels = np.dstack([mask.labels == label for label in (HAIR, PERSON, BACKGROUND)])
    shares = cv2.resize(labels.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(shares, np.float32)


def _without_islands(labels: UInt8Array, bare: Float32Array) -> UInt8Array:
    """Return labels (h, w) without hair that lies on bare parts of the head only."""
    count, part = cv2.connectedComponents((labels == HAIR).astype(np.uint8))
    rooted = np.zeros(count, np.bool_)
    rooted[part[bare < 0.5]] = True
    return np.where((labels == HAIR) & ~rooted[part], np.uint8(PERSON), labels).astype(np.uint8)
