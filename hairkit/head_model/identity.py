"""Shapes of the default head: what makes one person's head differ from another's.

Each mode moves the vertices of the default head as its builder's own parameters would: a part is
stretched about a level or an axis, or a smooth bump is added. Its size is one standard deviation
among adults, rounded from Zhuang and Bradtmiller, "Head-and-face anthropometric survey of U.S.
respirator users" (2005), where that has the measure, and otherwise an estimate (marked "est.").
Lengths are millimetres in the head frame, as in `template_shape`; features beside the median plane
are mirrored. Modes are not independent in people; a fit treats them as if they were.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import InputError
from hairkit.head_model.template import default_head
from hairkit.types.head import Head

_STRETCHES = {  # shares along x, y, z; fixed middle; level where whole, reach above, below
    "head_breadth": ((0.039, 0, 0), (0, 0, 0), (-20, 200, 70)),
    "head_length": ((0, 0, 0.038), (0, 0, -10), (-20, 200, 60)),
    "cheek_breadth": ((0.045, 0, 0), (0, 0, 0), (-55, 24, 24)),
    "jaw_breadth": ((0.075, 0, 0), (0, 0, 0), (-110, 26, 22)),
    "neck_breadth": ((0.07, 0, 0.07), (0, 0, -15), (-200, 40, 200)),  # est.
}
_LIFTS = {  # move along y from one level to another on, growing in between; above them if positive
    "cranium_height": (6.0, 0.0, 60.0),
    "face_height": (-6.6, -25.0, -140.0),
}
_BUMPS: dict[str, list[tuple[float, ...]]] = {  # middle (3), reach (3), move (3)
    "forehead": [(0, 25, 85, 50, 22, 30, 0, 0, 4)],  # est.
    "back_of_head": [(0, -20, -90, 50, 40, 30, 0, 0, -4)],  # est.
    "brow_ridge": [(30, -12, 88, 25, 8, 25, 0, 0, 2)],  # est.
    "eyes_apart": [(31, -36, 80, 15, 14, 25, 1.8, 0, 0)],
    "eyes_deep": [(31, -36, 80, 16, 11, 25, 0, 0, -2)],  # est.
    "nose_protrusion": [(0, -66, 112, 13, 15, 25, 0, 0, 2.7)],
    "nose_length": [(0, -78, 100, 17, 13, 25, 0, -3.5, 0)],
    "nose_breadth": [(15, -76, 92, 8, 10, 20, 2.0, 0, 0)],
    "mouth_breadth": [(23, -102, 86, 10, 9, 20, 2.1, 0, 0)],
    "mouth_height": [(0, -101, 95, 28, 11, 25, 0, 2.5, 0)],  # est.
    "lips": [(0, -102, 98, 17, 9, 20, 0, 0, 2)],  # est.
    "jaw_forward": [(0, -105, 90, 35, 28, 40, 0, 0, 4)],  # est.
    "chin": [(0, -136, 88, 17, 12, 25, 0, 0, 3.5)],  # est.
    "cheeks": [(48, -78, 65, 15, 18, 22, 2.5, 0, 2)],  # est.
    "ears": [(84, -58, -12, 14, 30, 20, 3.0, 0, 0)],  # est.
}
MODES = (*_STRETCHES, *_LIFTS, *_BUMPS)
"""Names of the modes, in the order of `identity_modes`."""
BASE_SHAPES: dict[str, dict[str, float]] = {
    "woman": {"head_breadth": -0.5, "head_length": -0.7, "jaw_breadth": -0.8, "brow_ridge": -1.2,
              "face_height": -0.7, "neck_breadth": -1.2, "nose_protrusion": -0.4, "chin": -0.5,
              "lips": 0.5, "forehead": 0.4, "cheeks": 0.3},
    "man": {"head_breadth": 0.5, "head_length": 0.7, "jaw_breadth": 1.0, "brow_ridge": 1.3,
            "face_height": 0.7, "neck_breadth": 1.2, "nose_protrusion": 0.6, "chin": 0.8,
            "lips": -0.4, "forehead": -0.5, "cheeks": -0.4},
    "child": {"face_height": -3.0, "jaw_breadth": -1.6, "nose_protrusion": -2.4, "chin": -1.6,
              "nose_length": -1.6, "brow_ridge": -1.8, "forehead": 1.4, "cheeks": 1.6,
              "neck_breadth": -3.0, "cranium_height": 0.6, "nose_breadth": -0.6},
}  # fmt: skip
"""Weights of the modes that make two adults and a child of about six years of the average head."""
BASE_SCALES = {"woman": 0.98, "man": 1.02, "child": 0.92}
"""Sizes of the base shapes, of the average adult's."""


@cache
def identity_modes() -> Float32Array:
    """Return (K, V, 3) the moves of the default head's vertices by one deviation of each mode, m.

    Modes are in the order of `MODES`.
    """
    points = 1e3 * default_head().vertices.astype(np.float64)
    moves = [_stretch(points, *row) for row in _STRETCHES.values()]
    moves += [_lift(points, *row) for row in _LIFTS.values()]
    moves += [_bumps(points, rows) for rows in _BUMPS.values()]
    result = (1e-3 * np.stack(moves)).astype(np.float32)
    result.setflags(write=False)
    return result


def blend_head(weights: Mapping[str, float]) -> Head:
    """Return the default head changed by modes, in standard deviations, and base shapes, in shares.

    >>> blend_head({"man": 0.5, "nose_length": -1.0})
    Head(12190 vertices, 24368 faces, with landmarks)

    Raises
    ------
    InputError
        A name is neither of `MODES` nor of `BASE_SHAPES`.
    """
    total = dict.fromkeys(MODES, 0.0)
    size = 1.0
    for name, weight in weights.items():
        if name not in total and name not in BASE_SHAPES:
            known = ", ".join((*BASE_SHAPES, *MODES))
            raise InputError(f"no shape of the head is named {name!r}; there are {known}")
        for mode, share in BASE_SHAPES.get(name, {name: 1.0}).items():
            total[mode] += weight * share
        size *= BASE_SCALES.get(name, 1.0) ** weight
    head = default_head()
    moves = np.tensordot(np.array([*total.values()], np.float32), identity_modes(), axes=1)
    shaped = replace(head, vertices=head.vertices + moves)
    return shaped.carried(lambda points: np.float32(size) * points, size)


def _stretch(
    points: Float64Array,
    share: tuple[float, ...],
    middle: tuple[float, ...],
    levels: tuple[float, ...],
) -> Float64Array:
    """Return moves of points (V, 3) that scale about a middle, by less above and below a level."""
    level, above, below = levels
    away = points[:, 1] - level
    fade = np.exp(-0.5 * (away / np.where(away > 0, above, below)) ** 2)
    return np.asarray(fade[:, None] * np.array(share) * (points - np.array(middle)))


def _lift(points: Float64Array, move: float, first: float, last: float) -> Float64Array:
    """Return moves along y that grow smoothly from one level to another."""
    t = np.clip((points[:, 1] - first) / (last - first), 0, 1)
    grown = move * t * t * (3 - 2 * t)
    return np.stack([0 * grown, grown, 0 * grown], axis=1)


def _bumps(points: Float64Array, rows: list[tuple[float, ...]]) -> Float64Array:
    """Return moves that are Gaussian about middles, mirrored where these are off the median."""
    total = np.zeros_like(points)
    for row in rows:
        middle, reach, move = np.array(row).reshape(3, 3)
        for side in (1.0, -1.0) if middle[0] else (1.0,):
            mirror = np.array([side, 1.0, 1.0])
            away = (points - middle * mirror) / reach
            total += np.exp(-0.5 * (away**2).sum(axis=1))[:, None] * move * mirror
    return total
