"""Grooms through files and back, and animations of them, for checks by other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.grooming.guide_weights import guide_mask
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import plugin_for
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands


def written(manager: Manager, groom: Groom, path: Path, **options: object) -> Path:
    """Write the groom with the export plugin of the file's ending; return the path."""
    name = plugin_for(manager, "export_groom", path)
    chosen = manager.options(name, options)
    manager.call("export_groom", name, chosen, groom=groom, path=path)
    return path


def read_back(manager: Manager, path: Path, **options: object) -> Groom:
    """Return what the import plugin of the file's ending reads."""
    name = plugin_for(manager, "import_groom", path)
    read: Groom = manager.call("import_groom", name, manager.options(name, options), path=path)
    return read


def wandering(groom: Groom, frames: int = 3) -> PointCache:
    """Return frames at 24 a second, the first at rest, then every point goes a way of its own."""
    guides = groom.strands.select(guide_mask(groom.strands))
    away = np.random.default_rng(11).normal(0, 0.004, (frames, *guides.points.shape))
    away[0] = 0
    points = guides.points + np.cumsum(away, axis=0)
    return PointCache(points, np.arange(frames) / 24, np.tile(np.eye(4), (frames, 1, 1)))


def nodding(groom: Groom, frames: int = 3) -> PointCache:
    """Return frames in which the head turns about its joint and hair and skin go along rigidly."""
    motion = np.tile(np.eye(4), (frames, 1, 1))
    joint = groom.head.joints[-1].astype(np.float64)
    for frame, angle in enumerate(np.linspace(0, 0.6, frames)):
        turn = motion[frame, :3, :3]
        turn[1:, 1:] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        motion[frame, :3, 3] = joint - turn @ joint
    guides = groom.strands.select(guide_mask(groom.strands))
    return PointCache(moved(motion, guides.points), np.arange(frames) / 24, motion)


def swinging(groom: Groom, frames: int, speeds: Float64Array) -> PointCache:
    """Return 24 frames a second: a nodding head whose hair is a sum of waves.

    `speeds` are radians a frame; every wave moves the points in directions of its own, the more the
    farther they are from the root.
    """
    rng, still = np.random.default_rng(7), nodding(groom, frames)
    guides = groom.strands.select(guide_mask(groom.strands))
    arc = guides.arc_lengths()
    size = (len(speeds), *guides.points.shape)
    shapes = rng.normal(scale=0.02 / np.sqrt(len(speeds)), size=size) * (arc / arc.max())[:, None]
    phase = rng.uniform(0, 2 * np.pi, len(speeds))
    shifts = np.einsum("tw,wpc->tpc", np.sin(np.arange(frames)[:, None] * speeds + phase), shapes)
    turns, places = still.head_from_rest[:, :3, :3], still.head_from_rest[:, None, :3, 3]
    points = np.einsum("tij,tpj->tpi", turns, guides.points + shifts) + places
    return PointCache(points, still.times, still.head_from_rest)


def moved(motion: Float64Array, points: Float32Array) -> Float32Array:
    """Return points (P, 3) under each of the rigid motions (T, 4, 4): (T, P, 3)."""
    turned = np.einsum("tij,pj->tpi", motion[:, :3, :3], points) + motion[:, None, :3, 3]
    return np.asarray(turned, np.float32)


def off_strands(points: npt.NDArray[Any], strands: npt.NDArray[Any], layout: Strands) -> float:
    """Return the largest distance of points (N, 3) from the polylines of points (P, 3)."""
    first = layout.segments()[1]
    start, way = strands[first].astype(float), (strands[first + 1] - strands[first]).astype(float)
    share = np.einsum("nsc,sc->ns", points[:, None] - start, way) / (way**2).sum(axis=1)
    foot = start + share.clip(0, 1)[..., None] * way
    return float(np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1).max())
