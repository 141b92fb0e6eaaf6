"""The 68 iBUG landmarks as weighted sums of mesh points, and how far off they usually are.

`landmark_table.csv` holds a landmark, a mesh point and a weight in each line; the weights of a
landmark sum to one. `landmark_noise.csv` holds for each landmark the standard deviation of its
place in the crop, at yaw 0 and at yaw 45, in shares of the crop's edge, measured on heads that were
left out of the fit. `benchmarks/face_landmarks.py` makes both.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from hairkit.arrays import BoolArray, Float64Array
from hairkit.types.head import LANDMARKS

MESH, MESH_POINTS = "face_landmark", 468
TABLE = Path(__file__).with_name("landmark_table.csv")
NOISE = Path(__file__).with_name("landmark_noise.csv")
OBLIQUE_DEG = 45.0
"""Yaw of the second column of `landmark_noise.csv`."""
MIRROR = np.array(
    [*range(16, -1, -1), *range(26, 16, -1), 27, 28, 29, 30, *range(35, 30, -1),
     45, 44, 43, 42, 47, 46, 39, 38, 37, 36, 41, 40, *range(54, 47, -1), *range(59, 54, -1),
     *range(64, 59, -1), 67, 66, 65]
)  # fmt: skip
"""The landmark at the place of each in the mirror image of a face."""


def pick_landmarks(meshes: Float64Array, mirrored: BoolArray) -> Float64Array:
    """Return the landmarks (C, 68, 3) of meshes (C, 468, 3); `mirrored` (C,) were found mirrored.

    >>> meshes = np.ones((2, 468, 3))
    >>> pick_landmarks(meshes, np.array([False, True])).shape
    (2, 68, 3)
    """
    landmarks: Float64Array = np.einsum("lm,cmx->clx", _weights(), meshes)
    landmarks[mirrored] = landmarks[mirrored][:, MIRROR]
    return landmarks


def noise_of(yaw_deg: float, size: float) -> Float64Array:
    """Return the standard deviation (68,) of landmarks in pixels, for a crop of `size` pixels."""
    front, oblique = _noise().T
    share = min(abs(yaw_deg) / OBLIQUE_DEG, 1.0)
    return np.asarray(size * (front + share * (oblique - front)))


@cache
def _weights() -> Float64Array:
    """Return the table as a matrix (68, 468)."""
    rows = np.loadtxt(TABLE, delimiter=",", skiprows=1)
    table = np.zeros((LANDMARKS, MESH_POINTS))
    table[rows[:, 0].astype(int), rows[:, 1].astype(int)] = rows[:, 2]
    return table


@cache
def _noise() -> Float64Array:
    """Return the noise (68, 2) at yaw 0 and at 45 degrees."""
    return np.asarray(np.loadtxt(NOISE, delimiter=",", skiprows=1)[:, 1:])
