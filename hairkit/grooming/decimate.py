"""Choose guides from full hair: cluster strands by root and shape, one guide per cluster.

Clusters are those of k-means (Lloyd 1982; seeds spread out after Arthur & Vassilvitskii 2007) over
the root and the points relative to it; the guide is the strand nearest to its cluster's mean, so
that guides are real strands. `hairkit.grooming.guide_weights.closest_guides` then ties the hair
to them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import InputError
from hairkit.head_model.spread_vertices import spread_points
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

SHAPE_WEIGHT = 0.5
"""Metres between roots that weigh as much as a metre between shapes."""
SAMPLES = 6
"""Points of a strand that its shape is compared at, besides the root."""
ROUNDS = 12
TRAINED_ON = 20_000
"""Strands that the means are found from; all strands join the nearest one."""


@dataclass(frozen=True, eq=False)
class Clusters:
    """Strands that belong together."""

    guides: Int64Array
    """(K,) the strand that represents each cluster, ascending."""
    cluster: Int64Array
    """(S,) the cluster of every strand."""


def decimate(groom: Groom, count: int) -> Groom:
    """Return the groom with all its strands, `count` of them marked as guides.

    Parameters
    ----------
    groom
        Full hair; what it marks as guides is forgotten.
    count
        Guides wanted, 1 to the number of strands.
    """
    clusters = cluster_strands(groom.strands, count)
    guide = np.zeros(len(groom.strands), bool)
    guide[clusters.guides] = True
    return replace(groom, strands=replace(groom.strands, guide=guide))


def cluster_strands(strands: Strands, count: int, seed: int = 0) -> Clusters:
    """Return `count` clusters of strands that start near each other and run alike.

    Raises
    ------
    InputError
        More guides are wanted than there are strands, or fewer than one.
    """
    if not 1 <= count <= len(strands):
        raise InputError(f"{count} guides are wanted, expected 1 to {len(strands)}, the strands")
    features = _features(strands)
    rng = np.random.default_rng(seed)
    sample = features
    if len(features) > max(TRAINED_ON, 4 * count):
        sample = features[rng.choice(len(features), max(TRAINED_ON, 4 * count), replace=False)]
    means = _means(sample, count, rng)
    means = means[np.unique(cKDTree(features).query(means)[1], return_index=True)[1]]
    cluster = cKDTree(means).query(features)[1]
    guides = np.unique(_medoids(features, means, cluster))
    spare = np.setdiff1d(np.arange(len(features)), guides)[: count - len(guides)]
    guides = np.sort(np.concatenate([guides, spare]))
    return Clusters(guides, cKDTree(features[guides]).query(features)[1])


def _features(strands: Strands) -> Float64Array:
    """Return (S, 3 + 3 SAMPLES) roots, and points relative to them, in metres."""
    points = strands.resampled(SAMPLES + 1).points.reshape(len(strands), -1, 3).astype(np.float64)
    shape = (points[:, 1:] - points[:, :1]).reshape(len(strands), -1)
    return np.hstack([points[:, 0], SHAPE_WEIGHT / np.sqrt(SAMPLES) * shape])


def _means(sample: Float64Array, count: int, rng: np.random.Generator) -> Float64Array:
    """Return the cluster means (K, F) after `ROUNDS` of Lloyd's iteration."""
    means = sample[_spread_seeds(sample, count, rng)]
    for _ in range(ROUNDS):
        owner = cKDTree(means).query(sample)[1]
        size = np.bincount(owner, minlength=count)
        total = np.stack([np.bincount(owner, column, count) for column in sample.T], axis=1)
        means = np.where(size[:, None] > 0, total / np.maximum(size, 1)[:, None], means)
    return means


def _spread_seeds(sample: Float64Array, count: int, rng: np.random.Generator) -> Int64Array:
    """Return (K,) rows: candidates thinned out by keeping the one farthest from those kept."""
    pool = rng.choice(len(sample), min(len(sample), 4 * count), replace=False)
    return pool[spread_points(sample[pool], count)]


def _medoids(features: Float64Array, means: Float64Array, cluster: Int64Array) -> Int64Array:
    """Return the row nearest to the mean of each cluster that has any."""
    away = ((features - means[cluster]) ** 2).sum(axis=1)
    order = np.lexsort((away, cluster))
    first = np.unique(cluster[order], return_index=True)[1]
    return order[first]
