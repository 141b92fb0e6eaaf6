"""Many captures: what two workers bring, and what a worker pool and Dask cost for each capture.

The other tables use stand-ins: jobs that wait show what the pool itself leaves of two workers, jobs
that do nothing what a job costs. The first needs `--captures` and cores that nothing else uses.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import resource
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hairkit.batches.batch import batch
from hairkit.batches.dask_pool import DaskPool, local_client
from hairkit.batches.jobs import Job, Settings
from hairkit.batches.pool import LocalPool
from hairkit.batches.run_job import JobLimits
from hairkit.cli import main as hairkit

JOBS = 200
"""Jobs of the stand-in; those before the first result of each worker are not counted."""
WARM = 8
"""Jobs that start the workers."""
WAITING, WAIT_S = 100, 0.1
"""Jobs of the table of those that wait, and the seconds of each."""
SIZE, STRANDS, GUIDES = "120x160", "500", 100
"""Photos, hair and guides of the captures that are drawn for the first table."""
SIMPLE = (
    "landmarks=landmark_files", "person=none", "turn=none", "scene=landmarks", "refine=none",
    "fit=none", "export=hairworks",
)  # fmt: skip
"""Changes of the recipe for them, which leave 6 of the 11 s that such a capture takes."""
STAND_IN = """
import sys, time
from hairkit import worker

def capture(question, tell):
    job = question["job"]
    time.sleep(float(sys.argv[1]))
    return {"name": job["name"], "state": "done", "out": job["out"], "health": []}

worker.answer_questions({"capture": capture})
"""


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(prog="batch.py", description=__doc__)
    parser.add_argument("--captures", type=int, default=0, help="captures of the first table")
    parser.add_argument("--dask", action="store_true", help="measure Dask, too")
    args = parser.parse_args()
    if args.captures:
        print_speedup(args.captures)
    print_waiting()
    print_overhead(dask=args.dask)


def print_speedup(count: int) -> None:
    """Print seconds of the same captures on one worker and on two, each with one thread.

    Both do them in halves, in the order 1, 2, 2, 1, so that what else the machine does meets both.
    """
    print("| workers | captures | seconds | processor seconds of each | cores used by others |")
    print("|---|---|---|---|---|")
    taken: dict[int, list[Span]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as folder:
        halves = [range(count // 2), range(count // 2, count)]
        draw_captures(Path(folder), halves)
        for workers, half in ((1, 0), (2, 0), (2, 1), (1, 1)):
            span = seconds_of_batch(Path(folder), half, workers)
            taken[workers].append(span)
            print(
                f"| {workers} | {span.captures} | {span.seconds:.1f} | {span.each:.2f} |"
                f" {span.others:.2f} |",
                flush=True,
            )
    seconds = {workers: sum(span.seconds for span in spans) for workers, spans in taken.items()}
    print(f"\ntwo workers: {seconds[1] / seconds[2]:.2f} times as many captures as one\n")


def draw_captures(folder: Path, halves: Sequence[range]) -> None:
    """Draw captures, each with hair and cameras of its own."""
    for half, numbers in enumerate(halves):
        for number in numbers:
            out = str(folder / f"captures-{half}" / f"{number:03}")
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(None):
                words = ["synth", "short", "-o", out, "--seed", str(number)]
                hairkit([*words, "--size", SIZE, "--strands", STRANDS])


@dataclass(frozen=True)
class Span:
    """What a batch took."""

    captures: int
    seconds: float
    each: float
    """Processor seconds of a capture, the mean."""
    others: float
    """Cores that other processes used meanwhile, the mean."""


def seconds_of_batch(folder: Path, half: int, workers: int) -> Span:
    """Return what one half of the captures takes."""
    given = {"guides": GUIDES, "settings": SIMPLE}
    captures, out = folder / f"captures-{half}", folder / f"out-{workers}-{half}"
    busy, own, began = busy_seconds(), own_seconds(), time.perf_counter()
    results = list(batch(captures, out, settings=given, workers=workers, threads=1))
    seconds = time.perf_counter() - began
    others = busy_seconds() - busy - (own_seconds() - own)
    if any(result.error for result in results):
        raise SystemExit(next(result.error for result in results if result.error))
    each = sum(result.processor_seconds for result in results) / len(results)
    return Span(len(results), seconds, each, others / seconds)


def busy_seconds() -> float:
    """Return the processor seconds that all processes of this machine took since its start."""
    user, nice, system, *_ = map(int, Path("/proc/stat").read_text().split()[1:5])
    return (user + nice + system) / os.sysconf("SC_CLK_TCK")


def own_seconds() -> float:
    """Return the processor seconds of this process and of its children that have ended."""
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in usage)


def print_waiting() -> None:
    """Print seconds of jobs that wait and do not compute, on one worker and on two."""
    print("| workers | jobs that wait | seconds | times one worker |")
    print("|---|---|---|---|")
    first = 0.0
    with tempfile.TemporaryDirectory() as folder:
        command = stand_in(folder, WAIT_S)
        for workers in (1, 2):
            pool = LocalPool(workers, JobLimits(60.0), budget_bytes=2**40, command=command)
            seconds = WAITING * seconds_of_job(pool, WAITING)
            first = first or seconds
            print(f"| {workers} | {WAITING} | {seconds:.2f} | {first / seconds:.2f} |")
    print()


def stand_in(folder: str, wait_s: float) -> tuple[str, ...]:
    """Write a program in the place of the one that reconstructs; return its command."""
    path = Path(folder) / "stand_in.py"
    path.write_text(STAND_IN)
    return sys.executable, str(path), str(wait_s)


def print_overhead(*, dask: bool) -> None:
    """Print seconds of a job that does nothing."""
    print("| pool | jobs | seconds of a job |")
    print("|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        command = stand_in(folder, 0.0)
        limits = JobLimits(60.0)
        pool = LocalPool(2, limits, budget_bytes=2**40, command=command)
        print(f"| processes | {JOBS} | {1000 * seconds_of_job(pool, JOBS):.1f} ms |")
        if dask:
            client = local_client(2)
            try:
                pool = DaskPool(client, limits, command=command)
                print(f"| Dask | {JOBS} | {1000 * seconds_of_job(pool, JOBS):.1f} ms |")
            finally:
                client.close()
                client.cluster.close()


def seconds_of_job(pool: LocalPool | DaskPool, count: int) -> float:
    """Return the seconds between results, from the first after the workers have started."""
    jobs = [(Job(f"job-{number}", "", ""), "0") for number in range(count + WARM)]
    results = pool.run(jobs, Settings())
    for _ in range(WARM):
        next(results)
    began = time.perf_counter()
    count = sum(1 for _ in results)
    return (time.perf_counter() - began) / count


if __name__ == "__main__":
    main()
