"""Label a photo from seeds: hair, the rest of the person, background.

The road is that of GrabCut (Rother, Kolmogorov and Blake 2004): a colour mixture for each class,
learnt from the seeds, labels every pixel, and is learnt anew from the labels. Three things differ.
There are three classes, because skin and clothes are unlike a backdrop. The mixtures see texture
beside colour. And regions hold together by the distance from the seeds that counts edges
crossed (`hairkit.imaging.geodesic`) instead of a cut through the graph, which trims thin hair away.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.imaging.alpha_matting import refine_labels
from hairkit.imaging.geodesic import edge_costs, seed_distance
from hairkit.imaging.masked_filters import blur
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

UNKNOWN = 64
"""Value of seed images where nothing is known."""

_SAMPLES = 1500
_MIN_CLUSTER = 10
_RIDGE = 0.05


@dataclass(frozen=True)
class LabelSettings:
    """How `label_from_seeds` weighs its evidence; lengths are pixels of the reduced picture."""

    rounds: int = 2
    """How often the mixtures are learnt."""
    components: int = 12
    """Normal distributions in the mixture of each class."""
    distance_weight: float = 1.0
    """Log-likelihood that one unit of distance from the seeds takes away."""
    distance_cap: float = 10.0
    """Distances beyond this count no more."""
    evidence_cap: float = 6.0
    """No pixel speaks louder than this against a class."""
    seed: int = 1


def reduced_size(width: int, height: int, reduced_height: int) -> tuple[int, int]:
    """Return (width, height) of a picture brought to at most `reduced_height` rows."""
    rows = min(height, reduced_height)
    return max(round(width * rows / height), 1), rows


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
        class without seeds takes no part.
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
    """Return the labels (h, w) of the reduced picture, before edges are settled at full size.

    Parameters and errors are those of `label_from_seeds`.
    """
    settings = settings or LabelSettings()
    classes = [label for label in (HAIR, PERSON, BACKGROUND) if (seeds == label).any()]
    if HAIR not in classes or len(classes) < 2:
        raise InputError("seeds need hair and something that is not hair, to tell them apart")
    height, width = seeds.shape
    colour, features = appearance(image, width, height)
    costs = edge_costs(blur(colour, 1.0), 0.02, 0.25)
    distance = np.stack([seed_distance(costs, seeds == label) for label in classes], axis=-1)
    prior = -np.float32(settings.distance_weight) * np.minimum(distance, settings.distance_cap)
    flat = features.reshape(height * width, -1)
    flat = (flat - flat.mean(axis=0)) / (flat.std(axis=0) + np.float32(1e-3))
    terms = polynomial_terms(flat)
    known = seeds
    for _ in range(settings.rounds):
        evidence = class_evidence(flat, terms, known, classes, settings)
        probability = _probability(evidence, prior, seeds, classes, hair_allowed, settings)
        labels = np.take(np.asarray(classes, np.uint8), probability.argmax(axis=-1))
        known = _certain(labels, probability.max(axis=-1), seeds)
    result: UInt8Array = labels
    return result


def appearance(image: UInt8Array, width: int, height: int) -> tuple[Float32Array, Float32Array]:
    """Return the Lab picture (height, width, 3) and colour and texture features (height, width, 8).

    Features: Lab; Lab under a Gaussian of 2 px; the deviation of lightness there; and the
    fine detail of the full picture, in which hair differs from smooth cloth of its colour.
    """
    full = cv2.cvtColor(image.astype(np.float32) / np.float32(255), cv2.COLOR_RGB2Lab)
    colour = cv2.resize(full, (width, height), interpolation=cv2.INTER_AREA)
    lightness = np.ascontiguousarray(full[..., 0])
    detail = cv2.absdiff(lightness, cv2.GaussianBlur(lightness, (0, 0), 1.5))
    detail = cv2.resize(detail, (width, height), interpolation=cv2.INTER_AREA)
    smooth = cv2.GaussianBlur(colour, (0, 0), 2.0)
    square = cv2.GaussianBlur(colour[..., 0] ** 2, (0, 0), 2.0)
    deviation = np.sqrt(np.maximum(square - smooth[..., 0] ** 2, 0))
    texture = cv2.GaussianBlur(detail, (0, 0), 1.5)
    features = np.dstack([colour, smooth, np.log1p(deviation), np.log1p(4 * texture)])
    return np.asarray(colour, np.float32), features.astype(np.float32)


def class_evidence(
    features: Float32Array,
    terms: Float32Array,
    known: UInt8Array,
    classes: list[int],
    settings: LabelSettings,
) -> Float32Array:
    """Return (h, w, K) the log-likelihood of every pixel under the mixture of each class.

    Each mixture is learnt by k-means from the pixels of (h, w) `known` with its label; a pixel is
    scored by its best component, as GrabCut does.

    Parameters
    ----------
    features : (N, F)
        Of every pixel, each feature with mean 0 and deviation 1.
    terms : (M, N)
        From `polynomial_terms`.
    """
    evidence = np.empty((*known.shape, len(classes)), np.float32)
    for index, label in enumerate(classes):
        samples = features[known.ravel() == label]
        pick = np.random.default_rng(settings.seed).permutation(len(samples))[:_SAMPLES]
        weights, offsets = _mixture(samples[pick], settings)
        score = (weights @ terms + offsets[:, None]).max(axis=0)
        evidence[..., index] = score.reshape(known.shape)
    return evidence


def polynomial_terms(features: Float32Array) -> Float32Array:
    """Return (M, N) the products of two features (N, F) and the features themselves.

    A normal distribution's log density is linear in these.
    """
    rows = np.ascontiguousarray(features.T)
    first, second = np.triu_indices(len(rows))
    terms = np.empty((len(first) + len(rows), rows.shape[1]), np.float32)
    for index, (one, other) in enumerate(zip(first, second, strict=True)):
        np.multiply(rows[one], rows[other], out=terms[index])
    terms[len(first) :] = rows
    return terms


def _mixture(samples: Float32Array, settings: LabelSettings) -> tuple[Float32Array, Float32Array]:
    """Return a mixture of J components as weights (J, M) of `polynomial_terms` and offsets (J,)."""
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
    return np.stack(weights).astype(np.float32), np.asarray(offsets, np.float32)


def _clusters(samples: Float32Array, count: int, settings: LabelSettings) -> list[Float64Array]:
    cv2.setRNGSeed(settings.seed)
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 10, 0.1)
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
    """Return (h, w, K) how likely each class is, smoothed a little; certain at the seeds."""
    allowed = np.ones(evidence.shape, bool)
    allowed[..., classes.index(HAIR)] = hair_allowed
    evidence = np.where(allowed, evidence, -np.inf)
    relative = np.maximum(evidence - evidence.max(axis=-1, keepdims=True), -settings.evidence_cap)
    score = np.where(allowed, relative + prior, -np.inf)
    odds = np.exp(score - score.max(axis=-1, keepdims=True))
    probability = (odds / odds.sum(axis=-1, keepdims=True)).astype(np.float32)
    for index, label in enumerate(classes):
        probability[seeds == label] = np.eye(len(classes), dtype=np.float32)[index]
    return np.asarray(cv2.GaussianBlur(probability, (0, 0), 1.0)).reshape(evidence.shape)


def _certain(labels: UInt8Array, probability: Float32Array, seeds: UInt8Array) -> UInt8Array:
    """Return seeds for the next round: what is likely and lies off the edges, and the old seeds."""
    known = np.full(labels.shape, UNKNOWN, np.uint8)
    for label in np.unique(labels):
        inner = cv2.erode(
            ((labels == label) & (probability > 0.95)).astype(np.uint8), np.ones((5, 5))
        )
        known[inner > 0] = label
    return np.where(seeds != UNKNOWN, seeds, known)
