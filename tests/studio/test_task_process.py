"""Laws of the process that does tasks: it may be killed, a task is done all the same."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

import pytest
from waiting import run

from hairkit.studio import task_process
from hairkit.studio.task_process import TRIES, TaskError, TaskProcess

CHILD = """
import json, os, signal, sys
for line in sys.stdin:
    request = json.loads(line)
    kills, path = request["kills"], request["path"]
    with open(path, "a") as file:
        file.write("x")
    if os.path.getsize(path) <= kills:
        os.kill(os.getpid(), signal.SIGKILL)
    print(json.dumps({"id": request["id"], "result": {"made": os.path.getsize(path)}}), flush=True)
"""
"""A stand-in for the child: it is killed at its first `kills` tasks."""


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch) -> TaskProcess:
    """A process that runs the stand-in."""
    monkeypatch.setattr(task_process, "COMMAND", (sys.executable, "-c", CHILD))
    return TaskProcess()


@pytest.mark.parametrize("kills", [0, 1, TRIES - 1])
def test_a_task_whose_process_is_killed_is_done_by_another(
    process: TaskProcess, tmp_path: Path, kills: int
) -> None:
    """Whoever asked does not notice."""

    async def ask() -> int:
        values = {"kills": kills, "path": str(tmp_path / "count")}
        done: int = await process.call("count", 20.0, values)
        process.close()
        return done

    assert run(ask) == kills + 1


def test_idle_comes_after_what_was_asked_for_before(process: TaskProcess, tmp_path: Path) -> None:
    """Whoever waits for it finds what the tasks before left."""
    path = tmp_path / "count"

    async def ask() -> bool:
        done = asyncio.create_task(process.call("count", 20.0, {"kills": 1, "path": str(path)}))
        await asyncio.sleep(0)
        await process.idle()
        ended = path.read_text() == "xx"
        await done
        process.close()
        return ended

    assert run(ask)


def test_a_task_that_ends_every_process_is_given_up(process: TaskProcess, tmp_path: Path) -> None:
    """It fails in one line, and the next task is done."""

    async def ask() -> int:
        values = {"kills": TRIES, "path": str(tmp_path / "count")}
        with pytest.raises(TaskError, match="again and again"):
            await process.call("count", 20.0, values)
        done: int = await process.call("count", 20.0, values)
        process.close()
        return done

    assert run(ask) == TRIES + 1
