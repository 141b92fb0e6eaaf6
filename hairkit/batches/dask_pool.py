"""Jobs on the workers of Dask: one process on this machine's cores, or a cluster's.

A Dask worker gives each job to a process of hairkit's own, with its limits, so that no capture can
harm the worker. A worker that is lost has its jobs given to others by Dask's scheduler.
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import queue
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from hairkit.batches.jobs import DONE, FAILED, Job, Result, Settings, finished
from hairkit.batches.pool import Watcher
from hairkit.batches.run_job import COMMAND, JobLimits, run_job, start_child
from hairkit.child_process import ChildProcess
from hairkit.errors import HairkitError, MissingExtraError, one_line

POLL_S = 0.5
"""Seconds between two looks at whether the scheduler is there."""
CONNECTING_S = 30.0
"""Seconds in which a scheduler must answer."""
LOST_WORKERS = 10
"""Workers that may be lost with a job before Dask gives it up: its own 3 are meant for jobs that
kill their workers, which these cannot."""
WINDOW = 10_000
"""Captures that the scheduler knows at once: its memory, some 5 kB a capture, stays below 0.1 GB,
and adaptive clusters see hours of work (studies/farm_scheduler.py)."""
TASK = "hairkit-capture"
"""First part of the keys, by which Dask takes all captures for one group and queues them: keys that
begin otherwise each would be groups of their own, and given to workers at once."""
GONE = "the Dask scheduler is gone; run the batch again, it does what is missing"
_own = threading.local()


class SchedulerLostError(HairkitError):
    """The connection to the scheduler is gone; what is done is on disk."""


class DaskPool:
    """The workers that a Dask client knows."""

    def __init__(
        self, client: Any, limits: JobLimits, *, threads: int = 1, command: Sequence[str] = COMMAND
    ) -> None:
        self._client = client
        self._limits = limits
        self._threads = threads
        self._command = tuple(command)
        self._futures: dict[Any, tuple[Any, Job]] = {}

    def run(
        self, jobs: Sequence[tuple[Job, str]], settings: Settings, watcher: Watcher | None = None
    ) -> Iterator[Result]:
        """Yield results as they come; raises `SchedulerLostError` when the scheduler is gone."""
        watcher, waiting = watcher or Watcher(), iter(jobs)
        ended: queue.SimpleQueue[Any] = queue.SimpleQueue()

        def submit(count: int) -> None:
            for job, digest in itertools.islice(waiting, count):
                future = self._client.submit(
                    _do, job, settings, digest, self._limits, self._threads, self._command,
                    key=(TASK, f"{job.name}-{digest}"), pure=False,
                )  # fmt: skip
                self._futures[future.key] = future, job
                watcher.started(job.name)
                future.add_done_callback(ended.put)

        try:
            submit(WINDOW)
            while self._futures:
                future = self._next(ended)
                result = self._result(future, self._futures.pop(future.key)[1])
                del future  # its worker may be lost now without the capture being done again
                submit(1)
                yield result
        finally:
            left = [future for future, _ in self._futures.values()]
            with contextlib.suppress(Exception):  # a scheduler that is gone cannot cancel either
                self._client.cancel(left, force=True)
            self._futures.clear()

    def _next(self, ended: queue.SimpleQueue[Any]) -> Any:
        """Return the next future that has ended; raises when the scheduler does not answer."""
        while True:
            with contextlib.suppress(queue.Empty):
                future = ended.get(timeout=POLL_S)
                if future.status in ("finished", "error") and future.key in self._futures:
                    return future
            if self._client.status != "running":
                raise SchedulerLostError(GONE)

    def _result(self, future: Any, job: Job) -> Result:
        """Return what a future holds; a job whose workers were all lost has failed."""
        distributed = _distributed()
        try:
            result: Result = future.result()
            return result
        except (distributed.CancelledError, distributed.comm.CommClosedError) as error:
            raise SchedulerLostError(GONE) from error  # it ended just before the scheduler did
        except distributed.KilledWorker as error:
            reason = f"the workers that had it were lost {error.allowed_failures + 1} times"
        except Exception as error:
            reason = one_line(f"{type(error).__name__}: {error}")
        return Result(job.name, FAILED, job.out, error=reason)


def local_client(workers: int) -> Any:
    """Return a client of a new cluster on this machine, each worker a process with one job."""
    distributed = _distributed()
    cluster = distributed.LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        memory_limit=0,  # jobs are limited themselves
        dashboard_address="127.0.0.1:0",
    )
    return distributed.Client(cluster)


def connect(address: str) -> Any:
    """Return a client of a scheduler: `tcp://10.0.0.1:8786`."""
    distributed = _distributed()
    try:
        return distributed.Client(address, timeout=CONNECTING_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise HairkitError(f"{address}: no Dask scheduler answers ({error})") from error


def _distributed() -> Any:
    """Return the module `distributed`, schedulers of this process told how to treat captures."""
    try:
        dask = importlib.import_module("dask")
        distributed = importlib.import_module("distributed")
    except ImportError as error:
        raise MissingExtraError("Dask is not installed; pip install 'hairkit[batch]'") from error
    # a capture waits at the scheduler, not at a worker that is busy while another has nothing to do
    settings = {"allowed-failures": LOST_WORKERS, "worker-saturation": 1.0}
    dask.config.set({f"distributed.scheduler.{key}": value for key, value in settings.items()})
    return distributed


def _do(
    job: Job,
    settings: Settings,
    digest: str,
    limits: JobLimits,
    threads: int,
    command: tuple[str, ...],
) -> Result:
    """Run a job on a worker of Dask, in the process that its thread keeps.

    What another worker has done that was lost before it could say so is not done again.
    """
    kept = finished(job, digest)
    if kept is not None:
        return replace(kept, state=DONE)
    child: ChildProcess | None = getattr(_own, "child", None)
    if child is None or _own.kind != (threads, command):
        _own.child = child = start_child(threads, command)
        _own.kind = (threads, command)
    return run_job(child, job, settings, digest, limits)
