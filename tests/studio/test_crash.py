"""Law: whatever is killed at whatever moment, nothing is lost and the story goes on."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairkit.io.capture_reader import read_capture

MOMENTS = 20
LONGEST_S = 2.0
"""The last of the moments at which the server is killed, after the first request."""


def children(pid: int) -> list[int]:
    """Return the processes that a process started."""
    tasks = Path(f"/proc/{pid}/task/{pid}/children")
    if not tasks.is_file():
        pytest.skip("this system does not tell the children of a process")
    return [int(number) for number in tasks.read_text().split()]


def test_a_killed_server_loses_nothing_that_it_confirmed(
    tmp_path: Path, start_studio: Callable[..., Any], photos: list[Path]
) -> None:
    """Killed at random moments, the project can always be read and holds what was confirmed."""
    generator = np.random.default_rng(5)
    folder, confirmed = tmp_path / "head", 0
    for _ in range(MOMENTS):
        server = start_studio(folder).enter()
        timer = threading.Timer(float(generator.uniform(0, LONGEST_S)), server.kill)
        timer.start()
        with contextlib.suppress(OSError, ValueError):
            while True:
                if confirmed >= len(photos):
                    done = server.ask("DELETE", "/api/photos/" + _last(server))
                    confirmed -= done.status == 200
                else:
                    done = server.ask("POST", "/api/photos", photos[confirmed].read_bytes())
                    confirmed += done.status == 201
        timer.join()
        kept = len(list((folder / "photos").iterdir()))
        assert abs(kept - confirmed) <= 1  # what was under way may be there, unconfirmed
        confirmed = kept
        if kept >= 3:
            assert len(read_capture(folder).views) == kept
    assert not list((folder / "photos").glob(".*"))


def _last(server: Any) -> str:
    return str(server.ask("GET", "/api/project").json["photos"][-1]["id"])


def test_processes_do_not_outlive_the_server(server: Any, photos: list[Path]) -> None:
    """When the server is killed, what it started ends by itself."""
    assert server.ask("POST", "/api/photos", photos[0].read_bytes()).status == 201
    started = children(server.process.pid)
    assert started
    server.kill()
    for _ in range(100):
        if not any(Path(f"/proc/{pid}").exists() for pid in started):
            return
        time.sleep(0.1)
    raise AssertionError(f"{started} are still there")


def test_a_killed_process_is_replaced(server: Any, photos: list[Path]) -> None:
    """A task whose process dies fails in one line; the next one is done."""
    data = photos[0].read_bytes()
    assert server.ask("POST", "/api/photos", data).status == 201
    for pid in children(server.process.pid):
        os.kill(pid, signal.SIGKILL)
    assert server.ask("POST", "/api/photos", data).status in (201, 422)
    assert server.ask("POST", "/api/photos", data).status == 201
