"""How hair leaves the scalp when nothing better is known: away from the crown and down, a little outward."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.head import Head
from hairkit.stored import Float64Array

WHORL_BEHIND = 0.03
"""Metres behind the highest point of the head where the vertical axis of the crown's whorl stands."""


def combing_direction(
    head: Head, points: npt.ArrayLike, normals: npt.ArrayLike, lift: float
) -> Float64Array:
    """Return unit directions (N, 3), root to tip, of hair combed from the crown.

    The tangential part of "0.7 outward from the crown's axis + 1 down", made unit, plus `lift` times the
    outward normal (N, 3).
    """
    at, outward = np.asarray(points, np.float64), np.asarray(normals, np.float64)
    top = head.vertices[np.argmax(head.vertices[:, 1])].astype(np.float64)
    away = at - (top - [0, 0, WHORL_BEHIND])
    away[:, 1] = 0
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
    combed = 0.7 * away + [0.0, -1.0, 0.0]
    combed -= np.sum(combed * outward, axis=1, keepdims=True) * outward
    combed /= np.maximum(np.linalg.norm(combed, axis=1, keepdims=True), 1e-6)
    direction = combed + lift * outward
    result: Float64Array = direction / np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-9)
    return result
