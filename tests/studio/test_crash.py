"""Law: whatever is killed at whatever moment, nothing is lost and the story goes on."""

from __future__ import annotations

import contextlib
import http.client
import itertools
import json
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairkit.io.capture_reader import read_capture
from hairkit.studio.project import Project

MOMENTS = 5
"""Moments in each test; `tests/slow/studio_kills.py` goes through the whole story with 20."""
LONGEST_S = 2.0
"""The last of the moments at which the server is killed, after the first request."""


def children(pid: int) -> list[int]:
    """Return the processes that a process started."""
    threads = list(Path(f"/proc/{pid}/task").glob("*/children"))
    if not threads:
        pytest.skip("this system does not tell the children of a process")
    return [int(number) for thread in threads for number in thread.read_text().split()]


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
        with contextlib.suppress(OSError, ValueError, http.client.HTTPException):
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


def test_whatever_is_killed_nothing_confirmed_is_lost(
    tmp_path: Path, start_studio: Callable[..., Any], photos: list[Path]
) -> None:
    """Server or worker is killed at random moments while somebody draws, chooses and arranges.

    What was confirmed last, or what was under way then, is in the project that is opened again.
    """
    generator = np.random.default_rng(9)
    folder = tmp_path / "head"
    first = start_studio(folder).enter()
    for photo in photos:
        assert first.ask("POST", "/api/photos", photo.read_bytes()).status == 201
    first.kill()
    actions = _actions([1 + index for index in range(len(photos))])
    kept: dict[str, list[Any]] = {}
    for moment in range(MOMENTS):
        server = start_studio(folder).enter()
        timer = threading.Timer(
            float(generator.uniform(0, LONGEST_S)), _kill, (server, moment % 2 == 1)
        )
        timer.start()
        with contextlib.suppress(OSError, ValueError, http.client.HTTPException):
            while server.process.poll() is None:
                method, path, body = next(actions)
                kept[path] = [kept.get(path, [None])[-1], body]
                if server.ask(method, path, body).status < 300:
                    kept[path] = [body]
        timer.join()
        server.kill()
        capture = read_capture(folder)
        assert len(capture.views) == len(photos)
        _check(folder, kept)


def _actions(numbers: list[int]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield strokes, tones, choices, orders and poses of the head; values never repeat."""
    for count in itertools.count(1):
        number = numbers[count % len(numbers)]
        line = {"label": "foreground", "shape_type": "linestrip", "points": [[1, 1], [9, count]]}
        drawn = {"flags": {"corrects": True}, "shapes": [line]}
        yield "PUT", f"/api/photos/{number}/strokes", drawn
        yield "PUT", f"/api/photos/{number}/tone", {"contrast": 1 + count / 1000}
        yield "PUT", "/api/choices", {"hair": {"width_mm": 0.05 + count / 10_000}}
        yield "PUT", "/api/order", {"order": [*numbers[count % 8 :], *numbers[: count % 8]]}
        yield "PUT", "/api/head", {"scale": 1 + count / 1000}


def _kill(server: Any, worker: bool) -> None:
    """Kill a process of the server, then the server; or the server alone."""
    if worker:
        for pid in children(server.process.pid)[:1]:
            os.kill(pid, signal.SIGKILL)
        time.sleep(0.5)
    server.kill()


def _check(folder: Path, kept: dict[str, list[Any]]) -> None:
    """Assert that the files hold what was confirmed last, or what was asked for after that."""
    project = Project(folder)
    capture = read_capture(folder)
    found: dict[str, Any] = {
        "/api/order": [shot.id for shot in project.shots],
        "/api/choices": capture.chosen.hair.width_mm,
        "/api/head": None if capture.chosen.head is None else capture.chosen.head[0, 0],
    }
    for shot in project.shots:
        found[f"/api/photos/{shot.id}/tone"] = shot.contrast
        if project.strokes(shot).is_file():
            shapes = json.loads(project.strokes(shot).read_text())["shapes"]
            found[f"/api/photos/{shot.id}/strokes"] = shapes[0]["points"][1][1]
    for path, bodies in kept.items():
        if len(bodies) == 1:  # confirmed, and nothing after it
            assert found[path] == pytest.approx(_value(path, bodies[0])), path


def _value(path: str, body: Any) -> Any:
    """Return what a request's body asks for."""
    if path.endswith("strokes"):
        return body["shapes"][0]["points"][1][1]
    keys = {"tone": "contrast", "order": "order", "head": "scale", "choices": "hair"}
    value = body[keys[path.rsplit("/", 1)[1]]]
    return value["width_mm"] if isinstance(value, dict) else value


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
    """Whoever asks for a task does not notice that its process was killed."""
    data = photos[0].read_bytes()
    assert server.ask("POST", "/api/photos", data).status == 201
    for pid in children(server.process.pid):
        os.kill(pid, signal.SIGKILL)
    assert server.ask("POST", "/api/photos", data).status == 201


def test_what_a_crash_left_half_done_goes(tmp_path: Path) -> None:
    """Opening a project removes uploads and unfinished files, folders too, and nothing else."""
    project = Project(tmp_path / "head")
    project.result.mkdir()
    (project.incoming / "tmp1").mkdir()
    kept = [project.folder / "mine.txt", project.result / "groom.npz"]
    left = [
        project.incoming / "tmp1" / "strands.png", project.incoming / "upload",
        project.folder / ".capture.toml.x1.part", project.result / ".groom.abc.x2.abc",
        project.pictures / ".001-small.jpg.x3.part",
    ]  # fmt: skip
    for path in (*kept, *left):
        path.write_bytes(b"x")
    Project(project.folder)
    assert [path.exists() for path in kept] == [True] * len(kept)
    assert not any(path.exists() for path in left)


def test_a_new_link_opens_a_page_that_stayed_open(
    browser: Any, start_studio: Callable[..., Any], tmp_path: Path
) -> None:
    """After the server was started again its link works in the same tab, which loads anew."""
    first = start_studio(tmp_path / "head")
    page = browser.new_context().new_page()
    page.goto(first.link)
    page.wait_for_function("() => !location.hash.includes('t=')")
    first.kill()
    second = start_studio(tmp_path / "head", "--port", str(first.port))
    try:
        page.evaluate("link => { location.href = link; }", second.link)
        page.wait_for_function("() => location.hash === '#photos'")
        page.get_by_text("Photos").first.wait_for()
        asked = "fetch('/api/project').then((answer) => answer.status)"
        assert page.evaluate(asked) == 200
    finally:
        page.context.close()
        second.kill()
