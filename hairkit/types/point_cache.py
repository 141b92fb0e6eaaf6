"""A simulation's result: where every point of the guides is at every frame."""

from __future__ import annotations

import os
import zipfile
from dataclasses import dataclass, fields

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, check_reach, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored
from hairkit.types.groom import Groom

FILM_RATE = 24.0
"""Frames per second of the cinema, taken where a single frame gives no rate."""


@dataclass(frozen=True, eq=False)
class PointCache(Stored):
    """Frames of points on a moving head, in the world: the head frame of the first frame."""

    points: Float32Array
    """(T, P, 3) metres; P points in the order of the simulated groom's strands."""
    times: Float64Array
    """(T,) ascending, seconds."""
    head_from_rest: Float64Array
    """(T, 4, 4) rigid motion of the head since rest, acting on column vectors."""

    def __post_init__(self) -> None:
        points = freeze(self, "points", np.float32, (None, None, 3), "cache points")
        frames = len(points)
        times = freeze(self, "times", np.float64, (frames,), "cache times")
        if not frames or (np.diff(times) <= 0).any():
            raise DataError("a point cache needs at least one frame, at ascending times")
        freeze(self, "head_from_rest", np.float64, (frames, 4, 4), "head_from_rest")

    def __len__(self) -> int:
        return len(self.times)

    @property
    def frames_per_second(self) -> float:
        """Frames per second of a uniform cache; 24 for a single frame."""
        if len(self.times) < 2:
            return FILM_RATE
        return float((len(self.times) - 1) / (self.times[-1] - self.times[0]))


def is_cache_file(path: str | os.PathLike[str]) -> bool:
    """Return whether an npz file has the arrays of a point cache, without reading them."""
    try:
        with zipfile.ZipFile(path) as file:
            names = set(file.namelist())
    except (OSError, zipfile.BadZipFile):
        return False
    return {f"{field.name}.npy" for field in fields(PointCache)} <= names


def read_cache(path: str | os.PathLike[str], groom: Groom) -> PointCache:
    """Return the cache in an npz file; raises `DataError` when it is of another groom."""
    cache = PointCache.load(path)
    check_reach(cache.points, path, "points")
    have, want = cache.points.shape[1], len(groom.strands.points)
    if have != want:
        raise DataError(
            f"{path}: a cache of {have} points, the groom has {want}; simulate this groom again"
        )
    return cache
