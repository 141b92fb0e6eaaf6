"""Compiled functions, and the one way to run a compiled loop over index ranges on threads.

A loop is written as a compiled function of a range, `kernel(first, last, *arguments)`, and shared
by `parallel_for(kernel, count, *arguments)`. Compiled functions run without Python's lock, so plain
threads run them in parallel. Numba's `prange` takes 1.0 to 1.3 times the processor time and 7 to
32 % less wall time on idle cores (`benchmarks/threads.py`). Processor time decides, since views,
simulation and drawing share the cores.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar, cast

from numba import config, njit

from hairkit.kernel_cache import KernelCache

TASKS_PER_THREAD = 3
"""Ranges for each thread: what one that is held up leaves is taken by the others."""

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """Compile a function that releases Python's lock and divides as NumPy does.

    It makes no array of its own, and arrays that it is given are its caller's: nothing counts
    references to them, which threads would do by turns at every call of another function.
    """
    return compiled_with()(function)


def compiled_with(
    *, allocates: bool = False, inside: bool = False, **options: Any
) -> Callable[[_Function], _Function]:
    """Return the same decorator with more of Numba's options: `fastmath=True`.

    `allocates` is for functions that make or return arrays. Those that return one are called by
    Python alone: another compiled function would never free it. `inside` is for functions that
    compiled ones alone call: they take a tenth less time to compile, and Python would crash.
    """

    def decorate(function: _Function) -> _Function:
        options["_nrt"] = allocates  # Numba's runtime, which counts references
        options.update(no_cpython_wrapper=inside, no_cfunc_wrapper=True)
        made: Any = njit(nogil=True, error_model="numpy", **options)(function)
        made._cache = KernelCache(function)
        return cast(_Function, made)

    return decorate


def thread_count() -> int:
    """Return the number of threads that share a loop: Numba's, which `NUMBA_NUM_THREADS` sets."""
    settings: Any = config
    return int(settings.NUMBA_NUM_THREADS)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let matrix products of NumPy and SciPy run on one thread; also a function's decorator.

    The matrices here are small: threads of the BLAS library cost more than they bring, and sums in
    another order give other results on machines with other numbers of cores.
    """
    import scipy.linalg  # noqa: F401 - SciPy has a BLAS of its own, found only when it is loaded
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, "blas"):
        yield


def parallel_for(
    kernel: Callable[..., None], count: int, *arguments: Any, min_chunk: int = 1
) -> None:
    """Call `kernel(first, last, *arguments)` on ranges that together are `range(count)`.

    Parameters
    ----------
    kernel
        A compiled function that writes only what belongs to the indices `first` to `last`, so that
        the result does not depend on the number of threads.
    min_chunk
        Least number of indices that are worth a call on another thread.

    Raises what `kernel` raises on any thread.
    """
    threads = thread_count()
    tasks = min(count // min_chunk, threads * TASKS_PER_THREAD)
    if tasks < 2 or threads < 2:
        kernel(0, count, *arguments)
        return
    bounds = [count * k // tasks for k in range(tasks + 1)]
    ranges = iter([*pairwise(bounds)])
    helpers = [
        _pool(threads).submit(_run_ranges, ranges, kernel, arguments)
        for _ in range(min(threads, tasks) - 1)
    ]
    _run_ranges(ranges, kernel, arguments)
    for helper in helpers:
        if not helper.cancel():
            helper.result()


def _run_ranges(
    ranges: Iterator[tuple[int, int]], kernel: Callable[..., None], arguments: tuple[Any, ...]
) -> None:
    """Run ranges until none is left; a list's iterator gives each to one thread only."""
    for first, last in ranges:
        kernel(first, last, *arguments)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads - 1, "parallel_for")
