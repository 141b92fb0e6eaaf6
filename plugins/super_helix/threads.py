"""Strands are independent in a step: compiled functions run on shares of them, one a thread.

Numba's own `prange` misreads named tuples of arrays, so plain functions that release the lock do.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numba
import numpy as np

from hairkit.arrays import Int64Array

SHARES_A_THREAD = 4
"""Shares are smaller than threads need, so that a busy core does not hold up the rest."""


def over_strands(function: Callable[..., Any], offsets: Int64Array, *arguments: Any) -> None:
    """Call `function(*arguments, first, last)` on shares of the strands with alike many elements.

    The result does not depend on the number of threads: no strand is in two shares.
    """
    threads = numba.get_num_threads()
    goals = np.linspace(0, offsets[-1], threads * SHARES_A_THREAD + 1)
    bounds = np.unique(np.searchsorted(offsets, goals))
    if threads == 1 or len(bounds) < 3:
        function(*arguments, 0, len(offsets) - 1)
        return
    jobs = [
        _pool(threads).submit(function, *arguments, int(first), int(last))
        for first, last in pairwise(bounds)
    ]
    for job in jobs:
        job.result()


@lru_cache(maxsize=1)
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, "super_helix")
