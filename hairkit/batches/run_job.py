"""One job in a process that may be lost: its limits, its tries, and what is said when it fails."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

from hairkit.batches.jobs import FAILED, Job, Result, Settings, result_from
from hairkit.child_process import ChildError, ChildProcess, Limits

COMMAND = (sys.executable, "-P", "-m", "hairkit.batches.capture_child")
"""What is started for each worker."""
THREAD_SETTINGS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""Environment variables that say how many threads libraries use."""
OUTPUT_BYTES = 2**28
"""What a capture's process may print."""


@dataclass(frozen=True)
class JobLimits:
    """What one capture may take."""

    seconds: float = 3600.0
    memory_bytes: int | None = None
    """Resident memory of its process; None for no limit."""
    retries: int = 2
    """How often a capture is tried again whose process crashed or was killed."""


def start_child(threads: int, command: Sequence[str] = COMMAND) -> ChildProcess:
    """Return a process, not yet started, that uses as many threads."""
    environment = dict(os.environ) | dict.fromkeys(THREAD_SETTINGS, str(threads))
    return ChildProcess(command, environment=environment)


def run_job(
    child: ChildProcess,
    job: Job,
    settings: Settings,
    digest: str,
    limits: JobLimits,
    tell: Callable[[str], None] | None = None,
) -> Result:
    """Return what became of a job; nothing that happens to it is raised.

    A job whose process is lost is done again, which finds the stages that it had finished. One that
    took too long, too much memory or too much output would do so again, and is not.
    """
    question = {"do": "capture", "job": asdict(job), "settings": asdict(settings), "digest": digest}
    bounds = Limits(limits.seconds, limits.memory_bytes, OUTPUT_BYTES)
    began, tries = time.perf_counter(), 0
    while True:
        tries += 1
        try:
            answer = child.ask(question, bounds, tell)
            reason = answer.get("error", "")
            if not reason:
                return replace(result_from(answer["result"]), tries=tries)
            break
        except ChildError as error:
            reason = f"its process {error}"
            if error.limit or tries > limits.retries:
                break
        except (KeyError, TypeError):
            reason = "its process gave no result"
            break
    seconds = round(time.perf_counter() - began, 3)
    return Result(job.name, FAILED, job.out, seconds=seconds, tries=tries, error=str(reason))
