"""A user's strokes on an automatic mask: certain where they are, persuasive nearby."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import BoolArray, Float32Array
from hairkit.imaging.geodesic import seed_distance

PULL, REACH = 4.0, 5.0
"""Log odds that a stroke adds beside it, and the geodesic distance at which that ends. On rendered
photos of five heads 0 and 6 for the one, 1 and 2 for the other change the mean intersection over
union after two strokes by less than 0.01."""
LEAST = 1e-4
"""Least probability of a class."""


def pull_prior(
    prior: Float32Array, costs: Float32Array, hair: BoolArray, rest: BoolArray
) -> Float32Array:
    """Return probabilities (h, w, 3), of which hair is the first, drawn to what strokes say.

    Parameters
    ----------
    prior
        (h, w, 3) without the strokes.
    costs
        (h, w, 4) from `edge_costs`: nearby is meant along paths that cross no contour.
    hair, rest
        (h, w) where the user says that there is hair, and that there is none.
    """
    pull = np.zeros(hair.shape, np.float32)
    for said, sign in ((hair, 1), (rest, -1)):
        if said.any():
            pull += sign * np.maximum(1 - seed_distance(costs, said) / np.float32(REACH), 0)
    pulled = prior.copy()
    pulled[..., 0] *= np.exp(np.float32(PULL) * pull)
    pulled[hair] = (1, LEAST, LEAST)
    pulled[rest, 0] = LEAST * pulled[rest, 1:].max(axis=-1)
    return pulled
