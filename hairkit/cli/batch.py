"""`hairkit batch CAPTURES -o OUT`: reconstruct many captures."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import time
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hairkit.cli.arguments import Add, add_shared, add_stage_settings
from hairkit.errors import InputError

if TYPE_CHECKING:
    from hairkit.batches.jobs import Result, Settings

DESCRIPTION = """\
Example: hairkit batch captures/ -o results/

Reconstruct every capture in a folder: a folder of photos, or a video, for each. CAPTURES may be a
URL (s3://bucket/captures), or a .txt file with a capture on each line. OUT gets a folder for each,
as `hairkit reconstruct` writes it, and report.html and report.json about all. Captures run in
processes of their own, as many at once as there are cores and memory for. One that fails, hangs or
crashes fails alone. Run it again: it does what is missing. Exit code 2 where one failed.
"""
TIME_LIMIT_S = 3600.0
"""Seconds that a capture may take by default, as of `hairkit.batch`."""
REBUILDS = 3
"""Schedulers of its own that are started, one after the other, where they are lost."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("captures", metavar="CAPTURES", help="folder of folders or videos, or its URL, or a .txt")
    add("-o", "--out", required=True, metavar="OUT", help="output folder, or its URL")
    add_stage_settings(add)
    add_shared(add, "--plugin")
    add_shared(add, "--guides", "--seed", "--max-edge")
    add("--sheet", action="store_true", help="draw the contact sheets")
    add("--scores", action="store_true", help="score captures that have a folder truth/")
    add("--drop-work", action="store_true", help="empty work/ of captures that are done")
    add("--only", action="append", default=[], metavar="NAME", help="do this capture")
    add("--part", metavar="K/N", help="do every N-th capture from the K-th on")
    add("--workers", type=int, metavar="N", help="captures at once (default: one a core)")
    add("--threads", type=int, metavar="N", help="threads of each (default: cores / workers)")
    add("--memory", type=float, metavar="GIB", help="for all workers (default: 80 %% of free)")
    add("--capture-memory", type=float, metavar="GIB", help="limit of one (default: --memory)")
    add("--time-limit", type=float, default=TIME_LIMIT_S, metavar="S", help="of one capture (3600)")
    add("--retries", type=int, default=2, metavar="N", help="tries after a crash (default 2)")
    add("--dask", choices=["local"], help="run on a Dask cluster of this machine")
    add("--scheduler", metavar="URL", help="run on a Dask cluster: tcp://HOST:PORT")
    add("--write-job", choices=["openjd", "shell"], help="write a job file for a farm, run nothing")
    add("--report", action="store_true", help="only write the report about what is there")
    add("--no-report", action="store_true", help="write no report: others do other parts")
    add_shared(add, "--quiet", "--json")


def run(args: argparse.Namespace) -> int:
    """Do the batch, and print what became of it."""
    from hairkit.batches.report import DATA, PAGE, summary, write_report
    from hairkit.remote import join

    if args.write_job:
        print(_write_job(args))
        return 0
    began = time.perf_counter()
    results = _found(args) if args.report else _made(args)
    seconds = time.perf_counter() - began
    if not args.no_report:
        write_report(args.out, results, seconds)
    if args.json:
        print(json.dumps([asdict(result) for result in results], indent=1))
    else:
        lines = [summary(results, seconds)]
        lines += [f"failed {r.name}: {r.error}" for r in results if r.error]
        lines += [] if args.no_report else [join(args.out, name) for name in (PAGE, DATA)]
        print("\n".join(lines))
    return 2 if any(result.error for result in results) else 0


def settings_of(args: argparse.Namespace) -> Settings:
    """Return the settings that the arguments name."""
    from hairkit.batches.jobs import Settings

    same = ("recipe", "guides", "seed", "max_edge", "sheet", "scores", "drop_work")
    shared = {name: getattr(args, name) for name in same}
    return Settings(settings=args.set, plugin_files=args.plugin, **shared)


def _made(args: argparse.Namespace) -> list[Result]:
    """Return the results of a batch; a lost scheduler of our own is replaced."""
    from hairkit.batches.dask_pool import SchedulerLostError, connect, local_client
    from hairkit.system import core_count

    if not (args.dask or args.scheduler):
        return _run(args, None)
    if args.scheduler:
        with closing(connect(args.scheduler)) as client:
            return _run(args, client)
    for rebuild in range(REBUILDS):
        client = local_client(args.workers or core_count())
        try:
            print(f"hairkit: Dask's dashboard: {client.dashboard_link}", file=sys.stderr)
            return _run(args, client)
        except SchedulerLostError:
            if rebuild == REBUILDS - 1:
                raise
        finally:
            client.close()
            client.cluster.close()
    raise AssertionError


def _run(args: argparse.Namespace, client: Any) -> list[Result]:
    from hairkit.batches.batch import batch
    from hairkit.batches.jobs import find_jobs, part_of
    from hairkit.cli.batch_table import table_for

    jobs = find_jobs(args.captures, args.out, args.only)
    count = len(part_of(jobs, args.part))
    results = []
    with table_for(sys.stderr, count, quiet=args.quiet or args.json) as table:
        for result in batch(
            args.captures,
            args.out,
            settings=settings_of(args),
            only=args.only,
            part=args.part,
            workers=args.workers,
            threads=args.threads,
            memory_gib=args.memory,
            capture_memory_gib=args.capture_memory,
            seconds=args.time_limit,
            retries=args.retries,
            client=client,
            watcher=table,
        ):
            table.ended(result)
            results.append(result)
    return sorted(results, key=lambda result: result.name)


def _found(args: argparse.Namespace) -> list[Result]:
    """Return what is known of every capture, without doing any."""
    from hairkit.batches.jobs import FAILED, RESULT, Result, find_jobs, read_result
    from hairkit.remote import join

    results = []
    for job in find_jobs(args.captures, args.out, args.only):
        try:
            results.append(read_result(join(job.out, RESULT)))
        except InputError:
            reason = "not done; run the batch again to see why"
            results.append(Result(job.name, FAILED, job.out, error=reason))
    return results


def _write_job(args: argparse.Namespace) -> str:
    """Write a job file and return what to do with it."""
    from hairkit.batches.farm_files import OPENJD, write_job
    from hairkit.batches.jobs import find_jobs
    from hairkit.manager import Manager
    from hairkit.remote import is_url

    for place in (args.captures, args.out):
        if is_url(place) or place.endswith(".txt"):
            raise InputError(f"{place}: a job file takes folders, which all machines of a farm see")
    settings = settings_of(args)
    settings.digest(Manager.loaded(settings.plugin_files))
    jobs = find_jobs(args.captures, args.out, args.only)
    words = ["--recipe", settings.recipe, "--guides", str(args.guides), "--seed", str(args.seed)]
    words += [word for text in args.set for word in ("--set", text)]
    words += [word for file in settings.plugin_files for word in ("--plugin", file)]
    words += [word for name in args.only for word in ("--only", name)]
    words += ["--max-edge", str(args.max_edge)] if args.max_edge is not None else []
    flags = {"--sheet": args.sheet, "--scores": args.scores, "--drop-work": args.drop_work}
    words += [flag for flag, given in flags.items() if given]
    program = (sys.executable, "-m", "hairkit")
    path = write_job(args.write_job, args.captures, args.out, len(jobs), words, program)
    words = ["sh", str(path)]
    if args.write_job == OPENJD:
        folders = {"Captures": Path(args.captures).absolute(), "Out": path.parent}
        words = ["openjd", "run", str(path), "--step", "Report", "--run-dependencies"]
        words += [word for key, value in folders.items() for word in ("-p", f"{key}={value}")]
    return f"{path}\n{shlex.join(words)}"
