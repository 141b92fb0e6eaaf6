"""One function of hairkit beside functions of libraries that do the same: times and agreement."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

SLOW_S = 2.0
"""A call that takes this many processor seconds is not repeated."""


class Case(NamedTuple):
    """A function, its input, and what else gives the same result."""

    name: str
    """The function."""
    size: str
    """Its input, in words."""
    ours: Callable[..., Any]
    peers: Mapping[str, Callable[[], Any]]
    """By the name of the library's function. A peer imports its library when it is called."""
    difference: Callable[[Any, Any], float]
    """How far two results are apart."""
    unit: str
    """Of the difference."""
    allowed: float
    """Largest difference that counts as the same result."""


class Row(NamedTuple):
    """What was measured of a function and one peer."""

    case: Case
    peer: str
    ours_ms: float
    peer_ms: float
    difference: float

    @property
    def ratio(self) -> float:
        """Time of the peer over ours."""
        return self.peer_ms / self.ours_ms

    @property
    def agrees(self) -> bool:
        """The results are the same, to the tolerance of the case."""
        return self.difference <= self.case.allowed


def measure(case: Case, rounds: int, missing: Callable[[str, str], None]) -> Iterator[Row]:
    """Yield a row for each peer; calls `missing(peer, module)` for one that is not installed.

    Both run by turns, after a call of each that loads libraries and compiles kernels. Times are
    medians of processor seconds over all threads.
    """
    wanted = case.ours()
    for name, peer in case.peers.items():
        try:
            found = peer()
        except ModuleNotFoundError as error:
            missing(name, str(error.name))
            continue
        apart = case.difference(wanted, found)
        ours, theirs = [], []
        for _ in range(rounds):
            ours.append(_processor_seconds(case.ours))
            if not theirs or theirs[-1] < SLOW_S:
                theirs.append(_processor_seconds(peer))
        times = 1e3 * statistics.median(ours), 1e3 * statistics.median(theirs)
        yield Row(case, name, *times, apart)


def _processor_seconds(run: Callable[[], Any]) -> float:
    began = time.process_time()
    run()
    return time.process_time() - began


def largest(first: Any, second: Any) -> float:
    """Return the largest absolute difference of two arrays; both infinite counts as 0."""
    a, b = np.asarray(first, np.float64), np.asarray(second, np.float64)
    both = np.isfinite(a) | np.isfinite(b)
    return float(np.abs(a[both] - b[both]).max(initial=0.0))


def share_differing(first: Any, second: Any) -> float:
    """Return the per cent of entries that are not equal."""
    return 100 * float(np.mean(np.asarray(first) != np.asarray(second)))
