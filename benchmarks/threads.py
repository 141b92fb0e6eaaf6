"""Compares `hairkit.parallel.parallel_for` with Numba's `prange` on the same two loops.

python benchmarks/threads.py

The loops are one Jacobi step on a volume and one pass of three-point smoothing along strands; each
runs many times with Python between the runs, as in solvers and viewers. Processor seconds are the
sum over all threads. `ratio` is prange over parallel_for.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np
from numba import njit, prange

from hairkit.arrays import Float32Array
from hairkit.parallel import compiled, parallel_for, thread_count

REPETITIONS = 5
"""The median of so many measurements is printed."""


@compiled
def jacobi_range(first: int, last: int, old: Float32Array, new: Float32Array) -> None:
    """Replace the inner cells of slices `first` to `last` by the mean of their six neighbours."""
    for i in range(first + 1, last + 1):
        for j in range(1, old.shape[1] - 1):
            for k in range(1, old.shape[2] - 1):
                sides = old[i, j - 1, k] + old[i, j + 1, k] + old[i, j, k - 1] + old[i, j, k + 1]
                new[i, j, k] = (old[i - 1, j, k] + old[i + 1, j, k] + sides) / 6


@njit(parallel=True, cache=True)
def jacobi_prange(old: Float32Array, new: Float32Array) -> None:
    """Do the same as `jacobi_range` for all slices."""
    for i in prange(1, old.shape[0] - 1):
        for j in range(1, old.shape[1] - 1):
            for k in range(1, old.shape[2] - 1):
                sides = old[i, j - 1, k] + old[i, j + 1, k] + old[i, j, k - 1] + old[i, j, k + 1]
                new[i, j, k] = (old[i - 1, j, k] + old[i + 1, j, k] + sides) / 6


@compiled
def smooth_range(first: int, last: int, old: Float32Array, new: Float32Array) -> None:
    """Smooth strands `first` to `last` of points (S, M, 3) by [1 2 1] / 4."""
    for s in range(first, last):
        for m in range(1, old.shape[1] - 1):
            for k in range(3):
                new[s, m, k] = (old[s, m - 1, k] + 2 * old[s, m, k] + old[s, m + 1, k]) / 4


@njit(parallel=True, cache=True)
def smooth_prange(old: Float32Array, new: Float32Array) -> None:
    """Do the same as `smooth_range` for all strands."""
    for s in prange(old.shape[0]):
        for m in range(1, old.shape[1] - 1):
            for k in range(3):
                new[s, m, k] = (old[s, m - 1, k] + 2 * old[s, m, k] + old[s, m + 1, k]) / 4


def main() -> None:
    """Print one row a loop and size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=200, help="runs in one measurement")
    runs = parser.parse_args().runs
    rng = np.random.default_rng(0)
    print(f"{thread_count()} threads, {runs} runs")
    print("| loop | parallel_for, s | processor s | prange, s | processor s | ratio, processor s |")
    print("|---|---|---|---|---|---|")
    for size in (32, 96):
        old = rng.random((size, size, size), np.float32)
        row(f"Jacobi step, {size}^3 cells", old, size - 2, jacobi_range, jacobi_prange, runs)
    for count in (600, 10_000):
        old = rng.random((count, 32, 3), np.float32)
        row(f"smoothing, {count} strands", old, count, smooth_range, smooth_prange, runs)


def row(
    name: str,
    old: Float32Array,
    count: int,
    ranged: Callable[..., None],
    whole: Callable[..., None],
    runs: int,
) -> None:
    """Measure both forms of a loop and print a row."""
    new, other = old.copy(), old.copy()
    parallel_for(ranged, count, old, new)
    whole(old, other)
    np.testing.assert_array_equal(new, other)
    ours = measure(lambda: parallel_for(ranged, count, old, new), runs)
    theirs = measure(lambda: whole(old, other), runs)
    times = " | ".join(f"{seconds:.3f}" for seconds in (*ours, *theirs))
    print(f"| {name} | {times} | {theirs[1] / ours[1]:.2f} |", flush=True)


def measure(run: Callable[[], None], runs: int) -> tuple[float, float]:
    """Return wall seconds and processor seconds of `runs` runs, medians, with Python in between."""
    walls, processors = [], []
    for _ in range(REPETITIONS):
        wall, processor = time.perf_counter(), time.process_time()
        for _ in range(runs):
            run()
            sum(range(5_000))
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return statistics.median(walls), statistics.median(processors)


if __name__ == "__main__":
    main()
