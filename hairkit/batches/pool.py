"""Jobs on this machine: one process for each worker, started when memory allows.

A job is expected to take as much memory as the hungriest so far. It starts while that fits into the
budget beside what the others are expected to take; one job runs in any case. A worker that waits
gives the memory of its process back.
"""

from __future__ import annotations

import queue
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from hairkit.batches.jobs import Job, Result, Settings
from hairkit.batches.run_job import COMMAND, JobLimits, run_job, start_child
from hairkit.child_process import ChildProcess
from hairkit.system import available_bytes

FIRST_GUESS = 5 * 2**28
"""Bytes that a capture is expected to take before one has been measured: the sample's eight photos
of one megapixel take 0.9 to 1.1 GiB with the default recipe."""
BUDGET_SHARE = 0.8
"""Share of the memory that is free at the start which a batch takes."""


class Watcher:
    """Hears what happens to jobs, from any thread, and does nothing about it."""

    def started(self, name: str) -> None:
        """A capture has been given to a worker."""

    def stage(self, name: str, stage: str) -> None:
        """A stage of it has begun."""


class LocalPool:
    """Workers of this machine."""

    def __init__(
        self,
        workers: int,
        limits: JobLimits,
        *,
        threads: int = 1,
        budget_bytes: int | None = None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        """Set the number of workers and what all of them together may take, None for free memory.

        A job may take the whole budget unless `limits` says less.
        """
        self._workers = workers
        self._budget = budget_bytes or int(BUDGET_SHARE * max(available_bytes(), FIRST_GUESS))
        self._limits = replace(limits, memory_bytes=limits.memory_bytes or self._budget)
        self._threads = threads
        self._command = command
        self._memory = threading.Condition()
        self._running = 0
        self._expected = min(FIRST_GUESS, self._budget)
        self._stopped = False

    def run(
        self, jobs: Sequence[tuple[Job, str]], settings: Settings, watcher: Watcher | None = None
    ) -> Iterator[Result]:
        """Yield results as they come, of jobs with their digests; closing it ends the processes."""
        waiting = deque(jobs)
        results: queue.SimpleQueue[Result | BaseException] = queue.SimpleQueue()
        children = [start_child(self._threads, self._command) for _ in range(self._workers)]

        def work(child: ChildProcess) -> None:
            try:
                self._work(child, waiting, settings, watcher or Watcher(), results.put)
            except BaseException as error:  # a fault of hairkit must not make the batch wait
                results.put(error)

        threads = [threading.Thread(target=work, args=(c,), daemon=True) for c in children]
        try:
            for thread in threads:
                thread.start()
            for _ in jobs:
                result = results.get()
                if isinstance(result, BaseException):
                    raise result
                yield result
        finally:
            with self._memory:
                self._stopped = True
                self._memory.notify_all()
            for child in children:
                child.stop()
            for thread, child in zip(threads, children, strict=True):
                thread.join()
                child.close()

    def _work(
        self,
        child: ChildProcess,
        waiting: deque[tuple[Job, str]],
        settings: Settings,
        watcher: Watcher,
        put: Callable[[Result], None],
    ) -> None:
        while self._wait_for_memory(child, waiting):
            expected = 0
            try:
                job, digest = waiting.popleft()
                watcher.started(job.name)
                result = run_job(
                    child, job, settings, digest, self._limits,
                    partial(watcher.stage, job.name),
                )  # fmt: skip
                expected = result.peak_bytes
            except IndexError:
                return
            finally:
                self._ended(expected)
            put(result)

    def _ended(self, peak_bytes: int) -> None:
        with self._memory:
            self._running -= 1
            self._expected = min(max(self._expected, peak_bytes), self._budget)
            self._memory.notify_all()

    def _wait_for_memory(self, child: ChildProcess, waiting: deque[tuple[Job, str]]) -> bool:
        """Wait until one more job fits and count it as running; False when there is none left."""
        with self._memory:
            while waiting and not self._stopped and self._running:
                if (self._running + 1) * self._expected <= self._budget:
                    break
                child.close()
                self._memory.wait()
            if self._stopped or not waiting:
                return False
            self._running += 1
            return True
