"""A process that does tasks one after the other, started when needed, replaced when it dies."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import sys
from collections.abc import Callable, Mapping
from typing import Any

from hairkit.errors import HairkitError

LONGEST_LINE = 64 * 2**20
"""Bytes of an answer."""
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
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._numbers = itertools.count(1)
        self._running = 0

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
        async with self._turn:
            for _ in range(TRIES):
                number = self._running = next(self._numbers)
                try:
                    process = await self._started()
                    await _send(process, {"id": number, "do": do, **(values or {})})
                    return await asyncio.wait_for(_answer(process, number, tell), limit_s)
                except TimeoutError as error:
                    await self._end()
                    raise TaskError(f"not done within {limit_s:g} s") from error
                except (OSError, EOFError, ValueError):
                    await self._end()
                except asyncio.CancelledError:
                    await self._end()
                    raise
                finally:
                    self._running = 0
            raise TaskError("the process for it ended again and again; a file may be damaged")

    async def stop(self) -> None:
        """Ask the task that is running to end early, as if it had failed."""
        if self._running and self._process is not None:
            with contextlib.suppress(OSError):
                await _send(self._process, {"stop": self._running})

    async def close(self) -> None:
        """End the process."""
        await self._end()

    async def _started(self) -> asyncio.subprocess.Process:
        if self._process is None or self._process.returncode is not None:
            self._process = await asyncio.create_subprocess_exec(
                *COMMAND,
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=LONGEST_LINE,
                env={**os.environ, "OPENCV_LOG_LEVEL": "SILENT"},
                start_new_session=True,  # Ctrl-C is for the server, which ends it
            )
        return self._process

    async def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None and process.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()


async def _send(process: asyncio.subprocess.Process, message: dict[str, Any]) -> None:
    assert process.stdin is not None
    process.stdin.write(json.dumps(message).encode() + b"\n")
    await process.stdin.drain()


async def _answer(
    process: asyncio.subprocess.Process,
    number: int,
    tell: Callable[[dict[str, Any]], None] | None,
) -> Any:
    assert process.stdout is not None
    while True:
        line = await process.stdout.readline()
        if not line:
            raise EOFError
        message = json.loads(line)
        if message.get("id") != number:
            continue
        if "error" in message:
            raise TaskError(message["error"])
        if "result" in message:
            return message["result"]
        if tell is not None:
            tell(message["tell"])
