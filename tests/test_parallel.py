"""Laws of loops over index ranges on threads."""

from __future__ import annotations

import importlib
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from hairkit import parallel
from hairkit.parallel import parallel_for


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_index_is_run_once(monkeypatch: pytest.MonkeyPatch, threads: int) -> None:
    """Whatever the counts and the number of threads, each index is in one range."""
    monkeypatch.setattr(parallel, "thread_count", lambda: threads)
    done = np.zeros(1000, int)

    def add(first: int, last: int, step: int) -> None:
        done[first:last] += step

    for count, min_chunk in ((1000, 1), (1000, 400), (7, 3), (0, 1)):
        done[:] = 0
        parallel_for(add, count, 2, min_chunk=min_chunk)
        assert (done[:count] == 2).all()
        assert (done[count:] == 0).all()


def test_ranges_run_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two threads meet at a barrier that one alone would wait at for ever."""
    monkeypatch.setattr(parallel, "thread_count", lambda: 2)
    monkeypatch.setattr(parallel, "TASKS_PER_THREAD", 1)
    barrier = threading.Barrier(2, timeout=20)
    parallel_for(lambda first, last: barrier.wait() and None, 2)


def test_no_range_is_smaller_than_the_least_chunk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops too short to share run as one call on the caller's thread."""
    monkeypatch.setattr(parallel, "thread_count", lambda: 2)
    ranges: list[tuple[int, int]] = []
    parallel_for(lambda first, last: ranges.append((first, last)), 99, min_chunk=50)
    assert ranges == [(0, 99)]
    parallel_for(lambda first, last: ranges.append((first, last)), 100, min_chunk=50)
    assert all(last - first >= 50 for first, last in ranges)


def test_an_error_on_any_thread_is_raised() -> None:
    """The caller sees what the kernel raised."""

    def fail(first: int, last: int) -> None:
        raise ValueError(first)

    with pytest.raises(ValueError, match=r"\d"):
        parallel_for(fail, 1000)


def test_a_cache_that_names_a_type_of_an_older_version_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A module updated with a type renamed compiles again, and finds its own cache afterwards."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # two versions in one second look alike
    for name in ("Older", "Newer", "Newer"):
        (tmp_path / "updated_kernels.py").write_text(KERNELS.format(name=name))
        monkeypatch.delitem(sys.modules, "updated_kernels", raising=False)
        importlib.invalidate_caches()
        kernels = importlib.import_module("updated_kernels")
        assert kernels.total(getattr(kernels, name)(1.5, 2.0)) == 3.5
    assert sum(kernels.total.stats.cache_hits.values()) == 1


KERNELS = """
from typing import NamedTuple
from hairkit.parallel import compiled

class {name}(NamedTuple):
    first: float
    second: float

@compiled
def total(both):
    return both.first + both.second
"""
"""A module with one compiled function of a type whose name changes."""
