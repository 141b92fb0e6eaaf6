"""A process that does tasks one after the other, started when needed, replaced when it dies."""

from __future__ import annotations

import asyncio
import secrets
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hairkit.child_process import ChildError, ChildProcess, Limits
from hairkit.errors import HairkitError

COMMAND = (sys.executable, "-P", "-m", "hairkit.studio.task_child")
"""What is started."""
TRIES = 6
"""Processes that are given a task before it counts as what ends them: one that the system killed
for its memory, or that somebody killed, says nothing of the task."""


class TaskError(HairkitError):
    """A task failed; the text is one line for the user."""


class TaskProcess:
    """One process; calls take turns in the order in which they came."""

    def __init__(self) -> None:
        self._child = ChildProcess(COMMAND)
        self._turn = asyncio.Lock()
        self._stop = Path(tempfile.gettempdir()) / f"hairkit-stop-{secrets.token_hex()}"
        """A file that is there once the task is to end."""

    async def call(
        self,
        do: str,
        limit_s: float,
        values: Mapping[str, Any] | None = None,
        tell: Callable[[dict[str, Any]], None] | None = None,
    ) -> Any:
        """Return the result of a task; `tell` hears what it says on its way.

        A task whose process dies is given to a new one, so tasks must be such that they can be
        done twice.

        Raises
        ------
        TaskError
            The task failed, took longer than `limit_s`, or ended `TRIES` processes.
        """
        loop = asyncio.get_running_loop()

        def hear(event: dict[str, Any]) -> None:
            if tell is not None:
                loop.call_soon_threadsafe(tell, event)

        question = {"do": do, "stop": str(self._stop), **(values or {})}
        async with self._turn:
            self._stop.unlink(missing_ok=True)
            for _ in range(TRIES):
                child = self._child
                try:
                    answer = await asyncio.to_thread(child.ask, question, Limits(limit_s), hear)
                except ChildError as error:
                    if error.limit:
                        raise TaskError(f"its process {error}") from error
                except asyncio.CancelledError:
                    child.stop()
                    self._child = ChildProcess(COMMAND)
                    raise
                else:
                    if "error" in answer:
                        raise TaskError(f"unexpected {answer['error']}")
                    if "refused" in answer["result"]:
                        raise TaskError(answer["result"]["refused"])
                    return answer["result"]["made"]
            raise TaskError("the process for it ended again and again; a file may be damaged")

    async def idle(self) -> None:
        """Wait until the tasks that were asked for before have ended."""
        async with self._turn:
            pass

    def stop(self) -> None:
        """Ask the task that is running to end early, as if it had failed."""
        self._stop.touch()

    def close(self) -> None:
        """End the process, and start no other one."""
        self._child.stop()
        self._stop.unlink(missing_ok=True)
