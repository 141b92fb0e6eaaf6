"""Many captures: what two workers bring, and what a worker pool and Dask cost for each capture.

The other tables use stand-ins: jobs that wait show what the pool itself leaves of two workers, jobs
that do nothing what a job costs. The first needs `--captures` and cores that nothing else uses.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
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
SIZE, STRANDS, GUIDES = "240x320", "2000", 100
"""Photos, hair and guides of the captures that are drawn for the first table."""
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
    """Print seconds of a batch on one worker and on two, each with one thread."""
    with tempfile.TemporaryDirectory() as folder:
        captures = Path(folder) / "captures"
        for number in range(count):
            words = ["synth", "short", "-o", str(captures / f"{number:03}"), "--seed", str(number)]
            hairkit([*words, "--size", SIZE, "--strands", STRANDS])
        print("| workers | captures | seconds | each | times one worker |")
        print("|---|---|---|---|---|")
        first = 0.0
        for workers in (1, 2):
            began = time.perf_counter()
            results = list(
                batch(
                    captures, Path(folder) / f"out-{workers}", settings={"guides": GUIDES},
                    workers=workers, threads=1,
                )
            )  # fmt: skip
            seconds = time.perf_counter() - began
            first = first or seconds
            done = sum(result.state == "done" for result in results)
            print(
                f"| {workers} | {done} | {seconds:.1f} | {seconds / count:.2f} |"
                f" {first / seconds:.2f} |"
            )
    print()


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
