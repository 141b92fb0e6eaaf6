"""Label photos of one person: a network's probabilities weighed against this person's colours.

As in GrabCut (Rother, Kolmogorov and Blake 2004) a mixture of colours and textures is learnt for
each class where it is sure, and then labels every pixel. All photos of a person share the mixtures.
A beard, brows and glasses have the colours of hair, so the face has a mixture of its own, learnt
inside the landmarks, where it is known what they are. On the part of the head that bears no hair a
network's hair is taken for face where it has the face's colours: the beard of a profile is
known from the frontal photos, and hair that hangs over a shaven cheek remains hair. Above the brows
a person is hair or skin: hair with the colours of the clothes remains hair.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.imaging.masked_filters import blur
from hairkit.imaging.seeded_segmentation import (
    THINNED,
    LabelSettings,
    Mixture,
    appearance,
    fold_last,
    learn_mixture,
    polynomial_terms,
)
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

ALL_PHOTOS = LabelSettings(components=8, evidence_cap=5.0)
"""Weights of the colours of all photos of a person: a cap of 3 instead of 5 loses 0.003 of IoU."""
_SURE, _LEAST_PROBABILITY = 0.85, 1e-4
"""Probability from which a pixel teaches the mixtures, and the least probability of a class. With
0.95 in the place of 0.85 photographs lose 0.01 of IoU."""
_FEWEST, _SAMPLES, _MOST_PHOTOS = 30, 1500, 3
"""Fewest pixels that teach a mixture; how many do at most, for each photo of at most so many."""
_FACIAL_HAIR = 0.9
"""Share of a network's hair on bare parts of the head that is face unless its colours object."""
_SMOOTH_SIGMA = 1.0
"""Gaussian in pixels of the evidence."""
_LEAST_DEVIATION = 1e-3
"""Added to a feature's deviation, so that a feature that is constant counts as 0."""
_HAIR, _PERSON, _BACKGROUND, _FACE = range(4)
_LABELS = np.array([HAIR, PERSON, BACKGROUND, PERSON], np.uint8)


@dataclass(frozen=True, eq=False)
class HairPrior:
    """A photo, and what is known before its colours are looked at."""

    image: UInt8Array
    """(H, W, 3) RGB."""
    probability: Float32Array
    """(h', w', 3) of hair, the rest of the person and the background, of a smaller picture."""
    face: Float32Array
    """(h, w) of the reduced picture that is labelled: 1 where landmarks show the face, else 0."""
    bare: Float32Array
    """(h, w) 0 to 1, where the head is known to bear no hair but a beard."""
    upper: Float32Array
    """(h, w) 0 to 1, where the head is known to wear neither a beard nor clothes."""


def label_colours(photos: Sequence[HairPrior], settings: LabelSettings) -> list[UInt8Array]:
    """Return the labels (h, w) of photos of one person, before edges are refined."""
    features = [_features(photo) for photo in photos]
    stacked = np.concatenate([rows.reshape(-1, rows.shape[2]) for rows in features])
    mean, deviation = stacked.mean(axis=0), stacked.std(axis=0) + np.float32(_LEAST_DEVIATION)
    features = [(rows - mean) / deviation for rows in features]
    resized = [_resized(photo) for photo in photos]
    taught = [
        _of_classes(p, photo.face, 0.0)[THINNED] for p, photo in zip(resized, photos, strict=True)
    ]
    priors = [
        _of_classes(p, photo.bare, _FACIAL_HAIR, photo.upper)
        for p, photo in zip(resized, photos, strict=True)
    ]
    few = [rows[THINNED] for rows in features]
    mixtures = _learn(few, taught, settings)
    for _ in range(settings.rounds - 1):
        late = [_weigh(r, p[THINNED], mixtures, settings) for r, p in zip(few, priors, strict=True)]
        taught = [
            np.dstack([posterior[..., :_FACE], first[..., _FACE]])
            for posterior, first in zip(late, taught, strict=True)
        ]
        mixtures = _learn(few, taught, settings)
    posteriors = [_weigh(r, p, mixtures, settings) for r, p in zip(features, priors, strict=True)]
    found = []
    for posterior in posteriors:
        hair, person, background, face = np.moveaxis(posterior, -1, 0)
        found.append(_LABELS[np.dstack([hair, person + face, background]).argmax(axis=-1)])
    return found


def _features(photo: HairPrior) -> Float32Array:
    """Return (h, w, 8) colour and texture of the reduced picture's pixels."""
    height, width = photo.bare.shape
    return appearance(photo.image, width, height)[1]


def _resized(photo: HairPrior) -> Float32Array:
    """Return (h, w, 3) the probabilities of the reduced picture's pixels."""
    size = photo.bare.shape[::-1]
    large = cv2.resize(photo.probability, size, interpolation=cv2.INTER_CUBIC)
    positive = np.clip(np.asarray(large, np.float32), np.float32(_LEAST_PROBABILITY), 1)
    return np.asarray(positive / positive.sum(axis=-1, keepdims=True))


def _of_classes(
    probability: Float32Array, region: Float32Array, share: float, upper: Float32Array | float = 0.0
) -> Float32Array:
    """Return (h, w, 4) with the face: in `region` the person and a share of the hair, where nothing
    is worn all of the person."""
    hair, person, background = np.moveaxis(probability, -1, 0)
    taken = np.float32(share) * region * hair
    face = region * person / (2 if share else 1)
    face += upper * (person - face)
    result = np.dstack([hair - taken, person - face, background, face + taken])
    return np.asarray(np.maximum(result, np.float32(_LEAST_PROBABILITY) ** 2), np.float32)


def _learn(
    features: Sequence[Float32Array], teachers: Sequence[Float32Array], settings: LabelSettings
) -> dict[int, Mixture]:
    """Return the mixtures of the classes that have sure pixels."""
    most = _SAMPLES * min(len(features), _MOST_PHOTOS)
    mixtures = {}
    for index in range(len(_LABELS)):
        sure = [rows[p[..., index] > _SURE] for rows, p in zip(features, teachers, strict=True)]
        samples = np.concatenate(sure)
        if len(samples) >= _FEWEST:
            pick = np.random.default_rng(settings.seed).permutation(len(samples))[:most]
            mixtures[index] = learn_mixture(samples[pick], settings)
    return mixtures


def _weigh(
    features: Float32Array,
    prior: Float32Array,
    mixtures: dict[int, Mixture],
    settings: LabelSettings,
) -> Float32Array:
    """Return (h, w, 4) the prior times the likelihood of every pixel's appearance."""
    if len(mixtures) < 2:
        return prior
    terms = polynomial_terms(features)
    evidence = np.full(prior.shape, -np.inf, np.float32)
    for index, mixture in mixtures.items():
        evidence[..., index] = mixture.scores(terms)
    relative = evidence - fold_last(np.maximum, evidence)[..., None]
    relative = np.maximum(relative, np.float32(-settings.evidence_cap))
    odds = prior * np.exp(blur(relative, _SMOOTH_SIGMA))
    return np.asarray(odds / fold_last(np.add, odds)[..., None])
