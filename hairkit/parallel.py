"""Threads that do pieces of a loop together.

Compiled functions run without Python's lock, so that plain threads do; waiting for each other they
sleep. Numba's own `prange` waits busily, which beside other work, such as a viewer's drawing on the
same cores, costs many times what the pieces do, and takes longer to compile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

from numba import config as numba_config

config: Any = numba_config

EACH = 3
"""Pieces a thread, so that one which is held up leaves its share to the others."""


class Crew:
    """As many threads as Numba would take."""

    def __init__(self) -> None:
        self.threads = int(config.NUMBA_NUM_THREADS)
        """How many."""
        self._pool: ThreadPoolExecutor | None = None

    def share(self, work: Callable[..., None], count: int, worth: int, *args: Any) -> None:
        """Call work(first, last, *args) on pieces of range(count), none of less than `worth`."""
        pieces = min(count // worth, self.threads * EACH)
        if pieces < 2 or self.threads < 2:
            work(0, count, *args)
            return
        cuts = [count * k // pieces for k in range(pieces + 1)]
        spans = iter([*pairwise(cuts)])
        if self._pool is None:
            self._pool = ThreadPoolExecutor(self.threads - 1)
        others = min(self.threads, pieces) - 1
        asked = [self._pool.submit(_drain, spans, work, args) for _ in range(others)]
        _drain(spans, work, args)
        for other in asked:
            other.result()


def _drain(
    spans: Iterator[tuple[int, int]], work: Callable[..., None], args: tuple[Any, ...]
) -> None:
    """Do one span after the other until none is left; a list's iterator hands out each once."""
    for first, last in spans:
        work(first, last, *args)
