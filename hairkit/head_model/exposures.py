"""Exposure and white balance of photos of one surface, evened where they overlap."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, UInt8Array

GAIN_PRIOR = 0.05
"""Weight of the belief that a view needs no gain, in shares of a texel that two views share."""
FLOOR = 4.0
"""Levels of 255 added before logarithms."""


def even_exposures(
    colours: Sequence[Float32Array | UInt8Array], weights: Sequence[Float32Array]
) -> Float64Array:
    """Return gains (V, 3) that make the colours of views agree where they overlap.

    `colours` (H, W, 3) and `weights` (H, W) of V views. The logarithms of the gains minimise the
    weighted squared differences over all pairs, and their weighted mean is 0.
    """
    logs = [np.log(colour + FLOOR).reshape(-1, 3).astype(np.float64) for colour in colours]
    flat = [weight.ravel().astype(np.float64) for weight in weights]
    count = len(logs)
    normal, right = np.zeros((count, count)), np.zeros((count, 3))
    for i in range(count):
        for j in range(i):
            both = flat[i] * flat[j]
            total = both.sum()
            if total <= 0:
                continue
            apart = both @ (logs[j] - logs[i])
            normal[i, i] += total
            normal[j, j] += total
            normal[i, j] -= total
            normal[j, i] -= total
            right[i] += apart
            right[j] -= apart
    prior = np.array([weight.sum() for weight in flat]) * GAIN_PRIOR
    gains = np.linalg.solve(normal + np.diag(prior + 1e-9), right)
    mean = (prior[:, None] * gains).sum(axis=0) / max(prior.sum(), 1e-9)
    return np.asarray(np.exp(gains - mean))
