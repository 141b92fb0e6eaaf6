"""What many captures cost beyond one machine, and where the first bottleneck is.

Seconds, memory and bytes of a capture are measured by a run of a few small ones, or given. What
Dask's own scheduler takes is measured in this process, client and worker included: tasks that do
nothing, on a worker that is a thread. From these the table says how long a number of captures takes
on a number of cores, and which of three runs out first: cores, the scheduler's time, or the shared
drive. `farm_scheduler.py` plays such numbers through the scheduler.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hairkit.batches.batch import batch
from hairkit.child_process import resident_bytes
from hairkit.cli import main as hairkit

TASKS = (2000, 10_000)
"""Tasks of the two runs of Dask's scheduler, whose difference is what a task costs."""
CAPTURES, SIZE, STRANDS, GUIDES = 2, "240x320", "2000", 100
"""Captures that are measured where no figures are given."""
COUNTS = (10_000, 10_000_000)
CORES = (16, 256, 4096, 65_536)
DRIVE_BYTES_S = 2e9
"""Bytes in a second of a shared drive: 16 Gbit/s, a common file server. `--drive` says another."""
HOUR = 3600.0


@dataclass(frozen=True)
class Capture:
    """What one capture takes."""

    processor_seconds: float
    memory_bytes: float
    bytes_read: float
    bytes_kept: float


@dataclass(frozen=True)
class Scheduler:
    """What one task takes of Dask's scheduler."""

    seconds: float
    memory_bytes: float


def main() -> None:
    """Print what was measured, and the tables."""
    parser = argparse.ArgumentParser(prog="farm_costs.py", description=__doc__)
    add = parser.add_argument
    add("--seconds", type=float, help="processor seconds of a capture (default: measured)")
    add("--memory", type=float, default=1.0, help="GiB of a capture, with --seconds")
    add("--read", type=float, default=24e6, help="bytes read for a capture, with --seconds")
    add("--kept", type=float, default=30e6, help="bytes kept of a capture, with --seconds")
    add("--drive", type=float, default=DRIVE_BYTES_S, help="bytes/s of the shared drive")
    args = parser.parse_args()
    if args.seconds is None:
        capture = measure_captures()
    else:
        capture = Capture(args.seconds, args.memory * 2**30, args.read, args.kept)
    scheduler = measure_scheduler()
    print(
        f"a capture: {capture.processor_seconds:.1f} processor seconds,"
        f" {capture.memory_bytes / 2**30:.2f} GiB, reads {capture.bytes_read / 1e6:.1f} MB,"
        f" keeps {capture.bytes_kept / 1e6:.1f} MB"
    )
    print(
        f"a task of Dask's scheduler: {1e3 * scheduler.seconds:.2f} ms,"
        f" {scheduler.memory_bytes / 1e3:.1f} kB\n"
    )
    print("| captures | cores | memory | hours | kept | first limit | the next takes |")
    print("|---|---|---|---|---|---|---|")
    for count in COUNTS:
        for cores in CORES:
            print(row(count, cores, capture, scheduler, args.drive))


def row(count: int, cores: int, capture: Capture, scheduler: Scheduler, drive: float) -> str:
    """Return one row: the hours are those of the part that takes longest."""
    moved = capture.bytes_read + capture.bytes_kept
    parts = {
        "cores": count * capture.processor_seconds / cores,
        "scheduler": count * scheduler.seconds,
        "drive": count * moved / drive,
    }
    first = max(parts, key=lambda part: parts[part])
    second = sorted(parts.values())[-2]
    word = f"{second / parts[first]:.0%} of that"
    return (
        f"| {count:,} | {cores:,} | {cores * capture.memory_bytes / 2**30:,.0f} GiB |"
        f" {parts[first] / HOUR:,.1f} | {count * capture.bytes_kept / 1e12:,.1f} TB |"
        f" {first} | {word} |"
    )


def measure_captures() -> Capture:
    """Return the means of a few small captures, done one after the other on one thread."""
    with tempfile.TemporaryDirectory() as folder:
        captures, out = Path(folder) / "captures", Path(folder) / "out"
        for number in range(CAPTURES):
            words = ["synth", "short", "-o", str(captures / f"{number:03}"), "--seed", str(number)]
            hairkit([*words, "--size", SIZE, "--strands", STRANDS])
        given: dict[str, Any] = {"guides": GUIDES}
        results = list(batch(captures, out, settings=given, workers=1, threads=1))
        last = results[-1]  # the first compiles kernels, or loads them
        kept = [p for p in out.rglob("*") if p.is_file() and "work" not in p.parts]
        read = json.loads((Path(last.out) / "run.json").read_text())["inputs"]
        return Capture(
            last.processor_seconds,
            last.peak_bytes,
            sum(os.path.getsize(file["path"]) for file in read),
            sum(path.stat().st_size for path in kept) / len(results),
        )


def measure_scheduler() -> Scheduler:
    """Return what a task costs: the difference of two runs, whose futures are all kept."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=False,
            dashboard_address="127.0.0.1:0",  # without one, port 8787, which may be taken
            memory_limit=0,
        ) as cluster,
        Client(cluster) as client,
    ):
        seconds, memory = [], []
        for count in TASKS:
            began, before = time.perf_counter(), resident_bytes(os.getpid())
            futures = client.map(_nothing, range(count), pure=False)
            client.gather(futures)
            seconds.append(time.perf_counter() - began)
            memory.append(resident_bytes(os.getpid()) - before)
            client.cancel(futures)
    more = TASKS[1] - TASKS[0]
    return Scheduler((seconds[1] - seconds[0]) / more, max(memory[1] - memory[0], 0) / more)


def _nothing(number: int) -> None:
    """Take no time: all that is measured is the scheduler's."""


if __name__ == "__main__":
    main()
