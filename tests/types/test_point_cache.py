"""Laws of point caches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.testing import bristle_groom
from hairkit.types.point_cache import PointCache, read_cache


def cache_of(points: np.ndarray, times: list[float]) -> PointCache:
    """Return a cache of still points at the times."""
    frames = np.tile(points, (len(times), 1, 1))
    return PointCache(frames, np.array(times), np.tile(np.eye(4), (len(times), 1, 1)))


def test_saving_keeps_every_bit(tmp_path: Path) -> None:
    """What is read is what was written, for the groom it was made of."""
    groom = bristle_groom()
    cache = cache_of(groom.strands.points, [0.0, 0.04, 0.08])
    cache.save(tmp_path / "c.npz")
    back = read_cache(tmp_path / "c.npz", groom)
    for name in ("points", "times", "head_from_rest"):
        assert np.array_equal(getattr(back, name), getattr(cache, name))
    assert len(back) == 3


@pytest.mark.parametrize(("times", "rate"), [([0.0], 24.0), ([0.0, 0.5], 2.0), ([1, 2, 3], 1.0)])
def test_rate_is_frames_over_time(times: list[float], rate: float) -> None:
    """Intervals per second; a lone frame says nothing, so film's rate is taken."""
    assert cache_of(np.zeros((2, 3)), times).frames_per_second == pytest.approx(rate)


@pytest.mark.parametrize("times", [[], [0.0, 0.0], [1.0, 0.5]])
def test_times_ascend(times: list[float]) -> None:
    """No frame, or frames out of order, are refused."""
    with pytest.raises(InputError):
        PointCache(np.zeros((len(times), 2, 3)), np.array(times), np.zeros((len(times), 4, 4)))


def test_caches_of_another_groom_are_refused(tmp_path: Path) -> None:
    """The number of points tells, and the message says what to do."""
    cache_of(np.zeros((7, 3)), [0.0]).save(tmp_path / "c.npz")
    with pytest.raises(InputError, match=r"a cache of 7 points.*simulate this groom again"):
        read_cache(tmp_path / "c.npz", bristle_groom())
