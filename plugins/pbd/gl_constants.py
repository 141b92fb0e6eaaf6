"""Constants of rods and embedded points in the layout of the shaders."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array

from .factor_layout import banded_factor
from .linear_system import System
from .reference import Contact
from .resampling import Embedding
from .rods import Rods

NOWHERE = -1e9
"""Least distance of points without a limit, metres."""


def constant_rows(
    rods: Rods, system: System, contact: Contact | None, unit: Float64Array
) -> Float32Array:
    """Return (S, R, 4) rows of a rod as `pbd_constants.glsl` reads them.

    Masses, stiffness and forces are shares of the rod's mean mass `unit` (S,).
    """
    count, nodes = rods.mass.shape
    mean = unit[:, None]
    row, column = np.tril_indices(nodes - 1)
    ends = np.cumsum([1, 2 * nodes, 3 * (nodes - 1), -(-len(row) // 4)])
    rows = np.zeros((count, ends[3], 4), np.float32)
    rows[:, 0] = np.roll(rods.root_frame, -1, axis=-1)
    node = rows[:, ends[0] : ends[1]].reshape(count, nodes, 8)
    node[..., :3], node[..., 3] = rods.points, rods.mass / mean
    node[..., 4], node[..., 5] = system.rates.drag, system.rates.shape
    node[..., 6] = -1.0 if contact is None else contact.clearance
    node[:, 1:, 7] = mean / rods.mass[:, 1:]
    element = rows[:, ends[1] : ends[2]].reshape(count, nodes - 1, 12)
    element[..., :3] = banded_factor(system.banded / mean[..., None])
    element[..., 3], element[..., 7] = rods.length, 1.0 / rods.length
    element[..., 4], element[..., 5] = rods.bend / mean, rods.twist / mean
    element[..., 6], element[..., 8:11] = rods.natural_twist, rods.curvature
    element[:, 0, 11] = unit  # element 0 alone has the mean mass itself
    metric = rows[:, ends[2] :].reshape(count, -1)
    metric[:, : len(row)] = system.metric[:, row, column] * mean
    return rows


def kind_words(embedding: Embedding, deepest: Float64Array | None) -> Float32Array:
    """Return (P, 4): segment, least distance, distance to the point before, 0."""
    least = np.full(len(embedding.rod), NOWHERE) if deepest is None else deepest
    words = np.stack([embedding.segment, least, embedding.length, 0 * least], axis=1)
    return words.astype(np.float32)


def offset_words(embedding: Embedding) -> Float32Array:
    """Return (P, 4): offset in the rod's frame, fraction of the segment."""
    words = np.concatenate([embedding.offset, embedding.share[:, None]], axis=1)
    return words.astype(np.float32)


def share_words(
    before: npt.NDArray[np.integer[Any]], part: npt.NDArray[np.floating[Any]]
) -> npt.NDArray[np.int32]:
    """Return (N, 2): the point before; the bits of the float32 fraction."""
    parts = np.ascontiguousarray(part, np.float32).view(np.int32)
    return np.stack([before.ravel().astype(np.int32), parts.ravel()], axis=1)
