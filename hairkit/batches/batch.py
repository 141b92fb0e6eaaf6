"""Reconstruct many captures and yield what becomes of each, as it comes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hairkit.batches.jobs import Job, Result, Settings, find_jobs, finished, job_digest, part_of
from hairkit.batches.pool import LocalPool, Watcher
from hairkit.batches.run_job import JobLimits
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.remote import is_url
from hairkit.system import core_count

GIB = 2**30
"""Bytes of a GiB."""


def batch(
    captures: str | os.PathLike[str],
    out: str | os.PathLike[str],
    recipe: str | os.PathLike[str] = "default",
    *,
    settings: Mapping[str, Any] | Settings | None = None,
    only: Sequence[str] = (),
    part: str | None = None,
    workers: int | None = None,
    threads: int | None = None,
    memory_gib: float | None = None,
    capture_memory_gib: float | None = None,
    seconds: float = 3600.0,
    retries: int = 2,
    client: Any = None,
    watcher: Watcher | None = None,
) -> Iterator[Result]:
    """Reconstruct every capture in a folder: `for result in hairkit.batch("captures/", "out/")`.

    What an earlier batch made of the same photos with the same settings and plugins is kept.

    Parameters
    ----------
    captures
        Folder with one folder of photos, or one video, for each capture, at a path or a URL; or a
        `.txt` file that names one a line, as the recipe's stage `capture` knows it.
    out
        Folder for the results, one folder a capture, as `reconstruct` writes them; or a URL.
    recipe
        A shipped recipe's name, or a `.toml` file.
    settings
        More of `hairkit.batches.jobs.Settings`: `{"guides": 8000, "settings": ["fit=none"]}`.
    only, part
        Names of the captures to do; every N-th from the K-th on, "K/N", for job arrays of farms.
    workers, threads
        Captures done at the same time (default: a worker a core), and threads of each (default:
        the cores that each worker has).
    memory_gib
        What all workers together may take; by default most of the memory that is free.
    capture_memory_gib, seconds, retries
        Limits of one capture; how often it is tried again after a crash.
    client
        A `distributed.Client`, whose workers do the captures in the place of this machine's.
    watcher
        Hears what happens.

    Raises
    ------
    HairkitError
        No capture can be done at all: recipe, plugins or folders are at fault. What goes wrong with
        one capture is its result's `error`.
    """
    shared = _shared(settings, os.fspath(recipe))
    limits = JobLimits(seconds, _bytes(capture_memory_gib), retries)
    pool = _pool(client, workers, threads, memory_gib, limits)
    jobs = part_of(find_jobs(captures, out, only), part)
    digest = shared.digest(Manager.loaded(shared.plugin_files))
    if not is_url(out):
        Path(out).mkdir(parents=True, exist_ok=True)
    return _results(jobs, shared, digest, pool, watcher)


def _shared(settings: Mapping[str, Any] | Settings | None, recipe: str) -> Settings:
    """Return the settings of all captures; a recipe that is named replaces theirs."""
    given = settings if isinstance(settings, Settings) else Settings(**settings or {})
    return replace(given, recipe=recipe) if recipe != "default" else given


def _pool(
    client: Any,
    workers: int | None,
    threads: int | None,
    memory_gib: float | None,
    limits: JobLimits,
) -> Any:
    """Return Dask's workers, or this machine's."""
    cores = core_count()
    count = cores if workers is None else workers
    for name, value in (("workers", count), ("threads", threads), ("seconds", limits.seconds)):
        if value is not None and not value > 0:
            raise InputError(f"{name} is {value}, expected more than 0")
    if client is not None:
        from hairkit.batches.dask_pool import DaskPool

        return DaskPool(client, limits, threads=threads or 1)
    each = threads or max(1, cores // count)
    return LocalPool(count, limits, threads=each, budget_bytes=_bytes(memory_gib))


def _results(
    jobs: Sequence[Job], settings: Settings, digest: str, pool: Any, watcher: Watcher | None
) -> Iterator[Result]:
    """Yield what is there already, then what the pool makes."""
    missing = []
    for job in jobs:
        own = job_digest(job, digest)
        kept = finished(job, own)
        if kept is not None:
            yield kept
        else:
            missing.append((job, own))
    if missing:
        yield from pool.run(missing, settings, watcher)


def _bytes(gib: float | None) -> int | None:
    if gib is not None and not gib > 0:
        raise InputError(f"{gib} GiB of memory, expected more than 0")
    return None if gib is None else int(gib * GIB)
