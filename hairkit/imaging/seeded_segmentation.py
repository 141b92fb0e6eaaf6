"""Label a photo from seeds or from probabilities: hair, the rest of the person, background.

The method follows GrabCut (Rother, Kolmogorov and Blake 2004): a colour mixture for each class is
learnt from the seeds, labels every pixel, and is learnt again from the labels. Three things differ.
There are three classes, because skin and clothes are unlike a backdrop. The mixtures use texture as
well as colour. And the geodesic distance from the seeds (`hairkit.imaging.geodesic`) keeps regions
connected instead of a graph cut, which trims thin hair away.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.imaging.alpha_matting import refine_labels, refine_near_hair
from hairkit.imaging.corrections import Corrections, pull_prior
from hairkit.imaging.geodesic import edge_costs, seed_distance
from hairkit.imaging.masked_filters import blur
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

UNKNOWN = 64
"""Value of seed images where nothing is known."""
_SAMPLES = 1500
"""Pixels at most from which a class's mixture is learnt; k-means takes time linear in them."""
_MIN_CLUSTER = 10
"""Pixels of the smallest cluster that becomes a component."""
_RIDGE = 0.05
"""Added to a component's variances, as a share of each feature's variance in the picture."""
_KMEANS_ROUNDS, _KMEANS_STILL = 10, 0.1
"""Iterations of k-means at most, and the move of the centres (deviations) at which it ends."""
_COST_PER_PIXEL, _COST_PER_CONTRAST = 0.02, 0.25
"""Geodesic cost of one pixel's step, and of a difference of one in Lab along it."""
_DENOISE_SIGMA = 1.0
"""Gaussian in pixels before contrasts are measured, and after probabilities are."""
_SMOOTH_SIGMA = 2.0
"""Gaussian in pixels of the mean colour and of the deviation of lightness."""
_DETAIL_SIGMA, _DETAIL_GAIN = 1.5, 4.0
"""Gaussian in pixels that fine detail is measured against, and by which it is then averaged; gain
of the detail before its logarithm, which brings hair's few grey levels to about the range of the
other features."""
_LEAST_DEVIATION = 1e-3
"""Added to a feature's deviation, so that a feature that is constant in the picture counts as 0."""
_CERTAIN, _CERTAIN_WINDOW = 0.95, 5
"""Least probability of pixels from which the mixtures are learnt again, and the edge in pixels of
the square that has to have one label around them."""
THINNED = np.s_[::2, ::2]
"""Pixels of the reduced picture by which mixtures beside a prior are learnt again."""
_ORDER = (HAIR, PERSON, BACKGROUND)
"""Classes of the channels of a probability."""
_SURE, _FEWEST, _LEAST_PROBABILITY = 0.85, 30, 1e-4
"""Probability from which a pixel teaches the mixtures, the fewest pixels that do, and the least
probability of a class. With 0.95 in the place of 0.85 photographs lose 0.01 of IoU."""


@dataclass(frozen=True)
class LabelSettings:
    """Weights of the evidence in `label_from_seeds`."""

    rounds: int = 2
    """Times that the mixtures are learnt."""
    components: int = 12
    """Normal distributions at most in the mixture of each class."""
    distance_weight: float = 1.0
    """Log-likelihood lost for each unit of geodesic distance from the seeds."""
    distance_cap: float = 10.0
    """Geodesic distance at which that loss ends."""
    evidence_cap: float = 6.0
    """Largest difference in log-likelihood that one pixel's appearance makes between classes."""
    seed: int = 1
    """Seed of the clustering."""


BESIDE_A_PRIOR = LabelSettings(components=8, evidence_cap=3.0)
"""Weights of colours beside the network's probability: a cap of 1.5 instead of 3 loses 0.01 of IoU
on photographs, one of 6 changes nothing."""


class Mixture(NamedTuple):
    """Normal distributions, of which a sample's best counts."""

    weights: Float32Array
    """(J, M) of the `polynomial_terms`."""
    offsets: Float32Array
    """(J,)"""

    def scores(self, terms: Float32Array) -> Float32Array:
        """Return (h, w) the log-likelihood of pixels, from their terms (M, h, w)."""
        each = self.weights @ terms.reshape(len(terms), -1) + self.offsets[:, None]
        return np.asarray(each.max(axis=0), np.float32).reshape(terms.shape[1:])


def label_from_seeds(
    image: UInt8Array,
    seeds: UInt8Array,
    hair_allowed: BoolArray,
    settings: LabelSettings | None = None,
) -> UInt8Array:
    """Return the label (255 hair, 128 person, 0 background) of every pixel of a photo.

    Parameters
    ----------
    image : (H, W, 3)
        RGB.
    seeds : (h, w)
        Of the reduced picture: 255, 128 or 0 where the label is certain, `UNKNOWN` elsewhere. A
        class without seeds is not used.
    hair_allowed : (h, w)
        False where no hair can be.
    settings : LabelSettings, optional

    Returns
    -------
    (H, W) labels.

    Raises
    ------
    InputError
        No seed is hair, or all are.
    """
    labels = coarse_labels(image, seeds, hair_allowed, settings)
    return refine_labels(image, labels, seeds, hair_allowed)


def coarse_labels(
    image: UInt8Array,
    seeds: UInt8Array,
    hair_allowed: BoolArray,
    settings: LabelSettings | None = None,
) -> UInt8Array:
    """Return the labels (h, w) of the reduced picture, before edges are refined at full size.

    Parameters and errors are those of `label_from_seeds`.
    """
    settings = settings or LabelSettings()
    classes = [label for label in (HAIR, PERSON, BACKGROUND) if (seeds == label).any()]
    if HAIR not in classes or len(classes) < 2:
        missing = "all are hair" if HAIR in classes else "none is hair"
        raise InputError(
            f"seeds of {len(classes)} classes, {missing}: mark hair and something that is not hair "
            "to tell them apart"
        )
    height, width = seeds.shape
    colour, features = _standard_features(image, width, height)
    costs = edge_costs(blur(colour, _DENOISE_SIGMA), _COST_PER_PIXEL, _COST_PER_CONTRAST)
    distance = np.stack([seed_distance(costs, seeds == label) for label in classes], axis=-1)
    prior = -np.float32(settings.distance_weight) * np.minimum(distance, settings.distance_cap)
    terms = polynomial_terms(features)
    known = seeds
    for _ in range(settings.rounds):
        evidence = class_evidence(features, terms, known, classes, settings)
        probability = _probability(evidence, prior, seeds, classes, hair_allowed, settings)
        labels = np.take(np.asarray(classes, np.uint8), probability.argmax(axis=-1))
        known = _certain(labels, probability.max(axis=-1), seeds)
    return np.asarray(labels)


def label_from_probability(
    image: UInt8Array,
    probability: Float32Array,
    size: tuple[int, int],
    face: BoolArray | None = None,
    corrections: Corrections | None = None,
) -> tuple[UInt8Array, UInt8Array]:
    """Return labels (H, W) of the photo's pixels, and the opacity of the hair, 0 to 255.

    The mixtures of the classes are learnt from the pixels that are probable, and what they say is
    weighed against the probability; then they are learnt once more from the result.

    Parameters
    ----------
    image : (H, W, 3)
        RGB.
    probability : (h, w, 3)
        Of hair, of the rest of the person and of the background, of a smaller picture.
    size : (width, height)
        Of the reduced picture that is labelled before the edges are refined.
    face : (height, width), optional
        Where colours do not count, because a beard, brows and glasses have those of the hair.
    corrections : Corrections, optional
        Where a user says that there is hair, and that there is none; what is like these places and
        near them follows.
    """
    prior = np.asarray(cv2.resize(probability, size, interpolation=cv2.INTER_CUBIC), np.float32)
    prior = np.clip(prior, np.float32(_LEAST_PROBABILITY), 1)
    colour, features = _standard_features(image, *size)
    if corrections is not None:
        smooth = blur(colour, _DENOISE_SIGMA)
        costs = edge_costs(smooth, _COST_PER_PIXEL, _COST_PER_CONTRAST)
        prior = pull_prior(prior, costs, corrections)
    said = [] if corrections is None else [corrections.hair, corrections.rest]
    told = said if face is None else [face, *said]
    posterior = _weigh_colours(prior, features, told, BESIDE_A_PRIOR)
    labels = np.take(np.array(_ORDER, np.uint8), posterior.argmax(axis=-1))
    seeds = np.full_like(labels, UNKNOWN)
    if corrections is not None:
        known = corrections.hair | corrections.rest
        seeds[known] = labels[known]
    return refine_near_hair(image, labels, seeds)


def _weigh_colours(
    prior: Float32Array, features: Float32Array, told: Sequence[BoolArray], settings: LabelSettings
) -> Float32Array:
    """Return the probability (h, w, 3), in `_ORDER`, by a prior and by the classes' colours.

    `features` (h, w, 8) are those of the pixels; in the regions `told` colours do not count.
    """
    few, order = features[THINNED], np.array(_ORDER, np.uint8)
    posterior: Float32Array = prior / prior.sum(axis=-1, keepdims=True)
    late = posterior[THINNED]
    for part in (*[THINNED] * (settings.rounds - 1), np.s_[:, :]):
        sure = fold_last(np.maximum, late) > _SURE
        known = np.where(sure, order[late.argmax(axis=-1)], np.uint8(UNKNOWN))
        counts = [np.count_nonzero(known == label) for label in order]
        classes = [int(label) for label, n in zip(order, counts, strict=True) if n >= _FEWEST]
        if len(classes) < 2:
            return posterior
        evidence = class_evidence(few, polynomial_terms(features[part]), known, classes, settings)
        relative = np.full(prior[part].shape, -settings.evidence_cap, np.float32)
        relative[..., np.isin(order, classes)] = np.maximum(
            evidence - fold_last(np.maximum, evidence)[..., None], -settings.evidence_cap
        )
        for region in told:
            relative[region[part]] = 0
        odds = prior[part] * np.exp(blur(relative, _DENOISE_SIGMA))
        late = odds / fold_last(np.add, odds)[..., None]
    return late


def fold_last(combine: np.ufunc, values: Float32Array) -> Float32Array:
    """Return (...) the K values (..., K) combined: much faster than a reduction of a few."""
    return np.asarray(functools.reduce(combine, np.moveaxis(values, -1, 0)))


def _standard_features(
    image: UInt8Array, width: int, height: int
) -> tuple[Float32Array, Float32Array]:
    """Return the Lab picture (h, w, 3) and features (h, w, 8) with mean 0 and deviation 1."""
    colour, features = appearance(image, width, height)
    mean, deviation = cv2.meanStdDev(features.reshape(-1, 1, features.shape[2]))
    features = (features - mean[:, 0]) / (deviation[:, 0] + _LEAST_DEVIATION)
    return colour, features.astype(np.float32)


def appearance(image: UInt8Array, width: int, height: int) -> tuple[Float32Array, Float32Array]:
    """Return the Lab picture (height, width, 3) and colour and texture features (height, width, 8).

    Features: Lab; its local mean; the local deviation of lightness; and the fine detail of the full
    picture, in which hair differs from smooth cloth of its colour.
    """
    full = cv2.cvtColor(image.astype(np.float32) / np.float32(255), cv2.COLOR_RGB2Lab)
    colour = cv2.resize(full, (width, height), interpolation=cv2.INTER_AREA)
    lightness = np.ascontiguousarray(full[..., 0])
    detail = cv2.absdiff(lightness, cv2.GaussianBlur(lightness, (0, 0), _DETAIL_SIGMA))
    detail = cv2.resize(detail, (width, height), interpolation=cv2.INTER_AREA)
    smooth = cv2.GaussianBlur(colour, (0, 0), _SMOOTH_SIGMA)
    square = cv2.GaussianBlur(colour[..., 0] ** 2, (0, 0), _SMOOTH_SIGMA)
    deviation = np.sqrt(np.maximum(square - smooth[..., 0] ** 2, 0))
    texture = cv2.GaussianBlur(detail, (0, 0), _DETAIL_SIGMA)
    detailed = np.log1p(np.float32(_DETAIL_GAIN) * texture)
    features = np.dstack([colour, smooth, np.log1p(deviation), detailed])
    return np.asarray(colour, np.float32), features.astype(np.float32)


def class_evidence(
    features: Float32Array,
    terms: Float32Array,
    known: UInt8Array,
    classes: list[int],
    settings: LabelSettings,
) -> Float32Array:
    """Return (h, w, K) the log-likelihood of every pixel under the mixture of each class.

    Each mixture is learnt by k-means from the pixels of (h', w') `known` with its label; a pixel's
    score is that of its best component, as in GrabCut.

    Parameters
    ----------
    features : (h', w', F)
        Of pixels, each feature with mean 0 and deviation 1.
    terms : (M, h, w)
        From `polynomial_terms`, of these pixels or of more.
    """
    evidence = np.empty((*terms.shape[1:], len(classes)), np.float32)
    for index, label in enumerate(classes):
        samples = features[known == label]
        pick = np.random.default_rng(settings.seed).permutation(len(samples))[:_SAMPLES]
        evidence[..., index] = learn_mixture(samples[pick], settings).scores(terms)
    return evidence


def polynomial_terms(features: Float32Array) -> Float32Array:
    """Return (M, h, w) the products of two features (h, w, F) and the features themselves.

    A normal distribution's log density is linear in these.
    """
    rows = np.ascontiguousarray(np.moveaxis(features, -1, 0))
    first, second = np.triu_indices(len(rows))
    terms = np.empty((len(first) + len(rows), *rows.shape[1:]), np.float32)
    for index, (one, other) in enumerate(zip(first, second, strict=True)):
        np.multiply(rows[one], rows[other], out=terms[index])
    terms[len(first) :] = rows
    return terms


def learn_mixture(samples: Float32Array, settings: LabelSettings) -> Mixture:
    """Return the mixture of samples (N, F), whose components are found by k-means."""
    count, size = samples.shape
    clusters = _clusters(samples, min(settings.components, max(count // _MIN_CLUSTER, 1)), settings)
    upper = np.triu_indices(size)
    twice = np.where(upper[0] == upper[1], 1.0, 2.0)
    weights, offsets = [], []
    for members in clusters:
        mean = members.mean(axis=0, dtype=np.float64)
        spread = members - mean
        precision = np.linalg.inv(spread.T @ spread / len(members) + _RIDGE * np.eye(size))
        quadratic = -0.5 * precision[upper] * twice
        weights.append(np.concatenate([quadratic, precision @ mean]))
        determinant: float = np.linalg.slogdet(precision)[1]
        offsets.append(
            0.5 * determinant - 0.5 * mean @ precision @ mean + np.log(len(members) / count)
        )
    return Mixture(np.stack(weights).astype(np.float32), np.asarray(offsets, np.float32))


def _clusters(samples: Float32Array, count: int, settings: LabelSettings) -> list[Float64Array]:
    """Return the samples (N, F) in at most `count` clusters of `_MIN_CLUSTER` or more, or in one.

    OpenCV takes a single row for N samples of one feature each, so one cluster is not left to it.
    """
    if count == 1:
        return [samples.astype(np.float64)]
    cv2.setRNGSeed(settings.seed)
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER
    criteria = (stop, _KMEANS_ROUNDS, _KMEANS_STILL)
    start = np.zeros((len(samples), 1), np.int32)
    _, owner, _ = cv2.kmeans(samples, count, start, criteria, 1, cv2.KMEANS_PP_CENTERS)
    groups = [samples[owner[:, 0] == index].astype(np.float64) for index in range(count)]
    large = [group for group in groups if len(group) >= _MIN_CLUSTER]
    return large or [samples.astype(np.float64)]


def _probability(
    evidence: Float32Array,
    prior: Float32Array,
    seeds: UInt8Array,
    classes: list[int],
    hair_allowed: BoolArray,
    settings: LabelSettings,
) -> Float32Array:
    """Return (h, w, K) the probability of each class, smoothed; certain at the seeds."""
    allowed = np.ones(evidence.shape, bool)
    allowed[..., classes.index(HAIR)] = hair_allowed
    evidence = np.where(allowed, evidence, -np.inf)
    relative = np.maximum(evidence - evidence.max(axis=-1, keepdims=True), -settings.evidence_cap)
    score = np.where(allowed, relative + prior, -np.inf)
    odds = np.exp(score - score.max(axis=-1, keepdims=True))
    probability = (odds / odds.sum(axis=-1, keepdims=True)).astype(np.float32)
    for index, label in enumerate(classes):
        probability[seeds == label] = np.eye(len(classes), dtype=np.float32)[index]
    return np.asarray(cv2.GaussianBlur(probability, (0, 0), _DENOISE_SIGMA)).reshape(evidence.shape)


def _certain(labels: UInt8Array, probability: Float32Array, seeds: UInt8Array) -> UInt8Array:
    """Return seeds for the next round: likely pixels off the edges, and the old seeds."""
    known = np.full(labels.shape, UNKNOWN, np.uint8)
    window = np.ones((_CERTAIN_WINDOW, _CERTAIN_WINDOW))
    for label in np.unique(labels):
        likely = ((labels == label) & (probability > _CERTAIN)).astype(np.uint8)
        inner = cv2.erode(likely, window)
        known[inner > 0] = label
    return np.where(seeds != UNKNOWN, seeds, known)
