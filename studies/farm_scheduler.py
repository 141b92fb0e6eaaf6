"""Dask's scheduler with ten thousand and ten million captures, simulated in this process.

The scheduler's own state machine (`distributed.scheduler.SchedulerState`) is given tasks and
workers that exist nowhere else; events are played in the order of a simulated clock: a capture that
ends on a worker, the scheduler that takes the next. What an event takes of this processor is
measured and added to that clock, so that a scheduler which cannot keep up makes workers wait.

Not in these figures: the network, and (de)serialisation of messages. `farm_costs.py` measures both
together with client and worker.
"""

from __future__ import annotations

import argparse
import gc
import hashlib
import heapq
import itertools
import logging
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from dask._task_spec import Task
from distributed.collections import HeapSet
from distributed.core import Status
from distributed.scheduler import ClientState, SchedulerState, WorkerState
from sortedcontainers import SortedDict

from hairkit.batches.dask_pool import TASK, WINDOW
from hairkit.child_process import resident_bytes

COUNTS = (10_000, 10_000_000)
WORKERS = (256, 4096)
SECONDS = 22.0
"""Processor seconds of a capture, as of docs/farm_costs.md."""
LOOK = 10_000
"""Captures between two looks at the memory."""
RESULT_BYTES = 4000
"""What a capture's result takes on its worker: a `Result` with its health."""
SPREAD = 0.3
"""Captures take from 1 - 0.3 to 1 + 0.3 of the mean, evenly."""
GIBIBYTE = 2**30
HOUR = 3600.0
CLIENT = "client"
SPEC = Task("capture", print)
"""What workers are sent, the same for all tasks: it is not in the memory of a task."""


@dataclass(frozen=True)
class Played:
    """What a simulation took."""

    processor_seconds: float
    """Of the scheduler."""
    hours: float
    """By the simulated clock, from the first task to the last."""
    best_hours: float
    """The same with a scheduler that takes no time."""
    memory_bytes: int
    """Most that the process grew by."""
    known: int
    """Most tasks that the scheduler knew at once."""


def main() -> None:
    """Print a row for each number of captures and workers."""
    logging.getLogger("distributed").setLevel(logging.WARNING)
    parser = argparse.ArgumentParser(prog="farm_scheduler.py", description=__doc__)
    add = parser.add_argument
    add("--counts", type=int, nargs="+", default=COUNTS, help="captures")
    add("--workers", type=int, nargs="+", default=WORKERS, help="workers")
    add("--seconds", type=float, default=SECONDS, help="seconds of a capture")
    add("--window", type=int, nargs="+", default=[WINDOW], help="captures known at once; 0: all")
    args = parser.parse_args()
    print(
        "| captures | workers | known at once | processor time a task | memory a task |"
        " hours | without the scheduler's time |"
    )
    print("|---|---|---|---|---|---|---|")
    for count in args.counts:
        for window in args.window:
            for workers in args.workers:
                print(row(count, workers, play(count, workers, args.seconds, window)), flush=True)


def row(count: int, workers: int, played: Played) -> str:
    """Return one row."""
    return (
        f"| {count:,} | {workers:,} | {played.known:,} |"
        f" {1e6 * played.processor_seconds / count:.0f} us |"
        f" {played.memory_bytes / played.known / 1000:.1f} kB | {played.hours:,.2f} |"
        f" {played.best_hours:,.2f} |"
    )


def play(count: int, workers: int, seconds: float, window: int = 0) -> Played:
    """Return what so many captures take of the scheduler, and how long they take on the workers."""
    gc.collect()
    before, most = resident_bytes(os.getpid()), 0
    farm = Farm(workers)
    ends: list[tuple[float, int, Any]] = []
    idle: dict[str, float] = {}  # when each worker has done all that it was told
    free, spent, known, submitted, done = 0.0, 0.0, 0, 0, 0
    share, order = lengths(), itertools.count()

    def started(told: list[tuple[str, Any]]) -> None:
        for worker, name in told:
            idle[worker] = max(free, idle.get(worker, 0.0)) + seconds * next(share)
            heapq.heappush(ends, (idle[worker], next(order), name))

    began = time.process_time()
    first = min(window or count, count)
    farm.submit(first)
    submitted = known = first
    free = spent = time.process_time() - began
    started(farm.begun())
    while ends:
        now, _, name = heapq.heappop(ends)
        began = time.process_time()
        farm.finish(name)
        if submitted < count:
            farm.submit(1)
            submitted += 1
        told = farm.begun()
        took = time.process_time() - began
        spent, free, done = spent + took, max(free, now) + took, done + 1
        started(told)
        if done % LOOK == 1:
            most = max(most, resident_bytes(os.getpid()) - before)
    assert done == count
    return Played(spent, free / HOUR, count * seconds / workers / HOUR, most, known)


def lengths() -> Iterator[float]:
    """Yield what captures take, relative to their mean: evenly spread, the same every time."""
    step, place = (5**0.5 - 1) / 2, 0.5
    while True:
        place = (place + step) % 1.0
        yield 1 + SPREAD * (2 * place - 1)


class State(SchedulerState):
    """The scheduler without its server."""

    def log_event(self, topic: Any, msg: Any) -> None:
        """Do nothing; the server would keep it for its pages."""


class Farm:
    """The scheduler's state, with workers and a client that hear what it says and do nothing."""

    def __init__(self, workers: int) -> None:
        self._client = ClientState(CLIENT)
        self._state = State(
            aliases={}, clients={CLIENT: self._client}, workers=SortedDict(), host_info={},
            resources={}, tasks={}, unrunnable={}, queued=HeapSet(key=lambda task: task.priority),
            validate=False,
        )  # fmt: skip
        self._digest = hashlib.sha256(b"settings").hexdigest()
        self._count = 0
        self._begun: list[tuple[str, Any]] = []
        for number in range(workers):
            self._add_worker(f"tcp://10.0.{number // 256}.{number % 256}:40000")

    def submit(self, count: int) -> None:
        """Make the scheduler know further tasks, under keys as `DaskPool` gives them."""
        recommendations = {}
        for number in range(self._count, self._count + count):
            key = (TASK, f"{number:08d}-{self._digest}")
            task = self._state.new_task(key, SPEC, "released")
            task.priority = (0, number, 0)
            task.who_wants = {self._client}
            self._client.wants_what.add(task)
            recommendations[key] = "waiting"
        self._count += count
        self._move(recommendations)

    def begun(self) -> list[tuple[str, Any]]:
        """Return which workers were told to do which tasks since the last call."""
        state = self._state
        while state.queued and state.idle_task_count:
            self._move({state.queued.peek().key: "processing"})
        begun, self._begun = self._begun, []
        return begun

    def finish(self, key: Any) -> None:
        """Let a task end on its worker, and the client take its result and forget it."""
        task = self._state.tasks[key]
        recommendations, _, worker_messages = self._state._transition(
            key, "memory", "done", worker=task.processing_on.address, nbytes=RESULT_BYTES,
            type=b"", typename="Result", run_id=task.run_id, startstops=[],
        )  # fmt: skip
        self._hear(worker_messages)
        self._move(recommendations)
        forgotten: dict[Any, Any] = {}
        self._state._client_releases_keys([key], self._client, forgotten)
        self._move(forgotten)

    def _move(self, recommendations: dict[Any, Any]) -> None:
        worker_messages: dict[str, list[Any]] = {}
        self._state._transitions(recommendations, {}, worker_messages, "simulated")
        self._hear(worker_messages)

    def _hear(self, messages: dict[str, list[Any]]) -> None:
        """Note which tasks workers are told to do; what else they are told needs no answer."""
        told = ((worker, each) for worker, batch in messages.items() for each in batch)
        self._begun += [(to, each["key"]) for to, each in told if each["op"] == "compute-task"]

    def _add_worker(self, address: str) -> None:
        state = self._state
        worker = WorkerState(
            address=address, status=Status.running, pid=1, name=address, nthreads=1,
            memory_limit=2**32, local_directory="/tmp", nanny=None, server_id=address,
            scheduler=state,
        )  # fmt: skip
        state.workers[address] = worker
        state.running.add(worker)
        state.total_nthreads += worker.nthreads
        state.check_idle_saturated(worker)


if __name__ == "__main__":
    main()
