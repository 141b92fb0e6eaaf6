"""Print how soon the studio answers a stroke: its outline, a preview of the hair, the whole hair.

python benchmarks/studio.py --photos photos/ --strokes 3
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hairkit.io.capture_reader import sample_folder

GUIDES = 600
STROKES = 3
"""Strokes, one after the other, each on another photo; the figures are their means."""
LONGEST_S = 1200.0
ANSWERS = ("outline", "preview", "whole hair")
"""To a stroke, in the order in which they come."""


class Studio:
    """A studio in a process of its own, asked as its pages ask it."""

    def __init__(self, folder: Path, guides: int | None = None) -> None:
        command = [sys.executable, "-m", "hairkit", "studio", str(folder), "--no-browser"]
        command += ["--guides", str(guides or GUIDES)]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert self.process.stderr is not None
        self.host, token = self.process.stderr.readline().split("//")[1].split("/#t=")
        self.cookie = ""
        self.ask("POST", "/api/session", {"token": token.strip()})

    def ask(self, method: str, path: str, body: Any = None) -> Any:
        """Return the JSON that is answered."""
        line = http.client.HTTPConnection(self.host, timeout=LONGEST_S)
        data = json.dumps(body).encode() if isinstance(body, dict) else body
        line.request(method, path, data, {"Origin": f"http://{self.host}", "Cookie": self.cookie})
        answer = line.getresponse()
        self.cookie = (answer.headers["Set-Cookie"] or self.cookie).split(";")[0]
        document = json.loads(answer.read())
        line.close()
        if answer.status >= http.client.BAD_REQUEST:
            raise SystemExit(f"{path}: {document}")
        return document

    def close(self) -> None:
        """End the process."""
        self.process.terminate()
        self.process.wait()
        if self.process.stderr is not None:
            self.process.stderr.close()

    def wait(self, ready: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Return the project's state once it is ready."""
        ends = time.monotonic() + LONGEST_S
        while time.monotonic() < ends:
            state: dict[str, Any] = self.ask("GET", "/api/project")
            if state["build"]["state"] == "failed":
                raise SystemExit(state["build"]["reason"])
            if ready(state):
                return state
            time.sleep(0.05)
        raise SystemExit(f"not ready after {LONGEST_S:g} s")

    def busy_s(self) -> float:
        """Return the processor's seconds of the server and of the processes that it started, with
        those that have ended."""
        if not Path(f"/proc/{self.process.pid}/stat").is_file():
            return float("nan")
        ticks, pids = 0, [str(self.process.pid)]
        for pid in pids:
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # it has ended
                fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
                ticks += sum(int(field) for field in fields[11:15])
                for task in Path(f"/proc/{pid}/task").iterdir():
                    pids += (task / "children").read_text().split()
        return ticks / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Make a project of photos, draw strokes, and print seconds of the clock and the processor."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--photos", type=Path, default=sample_folder() / "photos")
    parser.add_argument("--strokes", type=int, default=STROKES)
    parser.add_argument("--until", choices=ANSWERS, default=ANSWERS[-1], help="last answer")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(Path(folder) / "head")
        try:
            last = 1 + ANSWERS.index(arguments.until)
            _measure(studio, sorted(arguments.photos.iterdir()), arguments.strokes, last)
        finally:
            studio.close()


def _measure(studio: Studio, photos: list[Path], strokes: int, answers: int) -> None:
    began = time.monotonic()
    for photo in photos:
        studio.ask("POST", "/api/photos", photo.read_bytes())
    last = time.monotonic()
    state = studio.wait(_is_done)
    first = (time.monotonic() - last, studio.busy_s())
    photo = state["photos"]
    rows = [_stroke(studio, photo[k % len(photos)], answers) for k in range(strokes)]
    print("| from | to | seconds | processor |")
    print("|---|---|---|---|")
    print(f"| first photo | last photo | {last - began:.1f} | |")
    print(f"| last photo | hair | {first[0]:.1f} | {first[1]:.1f} |")
    for name, values in zip(ANSWERS[:answers], zip(*rows, strict=True), strict=True):
        clock, busy = (sum(column) / len(rows) for column in zip(*values, strict=True))
        print(f"| stroke | {name} | {clock:.2f} | {busy:.2f} |")


def _is_done(state: dict[str, Any]) -> bool:
    return bool(state["build"]["state"] == "done")


def _stroke(studio: Studio, photo: dict[str, Any], answers: int) -> list[tuple[float, float]]:
    """Return seconds by clock and processor until each of the first `answers`."""
    before = studio.ask("GET", "/api/project")
    width, height = photo["width"], photo["height"]
    middle = [[0.45 * width, 0.3 * height], [0.55 * width, 0.3 * height]]
    shape = {"label": "foreground", "shape_type": "linestrip", "points": middle}
    drawn = {
        "flags": {"corrects": True}, "shapes": [shape],
        "imageWidth": width, "imageHeight": height,
    }  # fmt: skip
    began, busy, found = time.monotonic(), studio.busy_s(), []

    def passed() -> None:
        found.append((time.monotonic() - began, studio.busy_s() - busy))

    studio.ask("PUT", f"/api/photos/{photo['id']}/strokes", drawn)
    passed()
    for made in (_previewed, _made)[: answers - 1]:
        studio.wait(lambda state, made=made: made(state, before))
        passed()
    return found


def _previewed(state: dict[str, Any], before: dict[str, Any]) -> bool:
    return state["draft"] not in ("", before["draft"]) or _made(state, before)


def _made(state: dict[str, Any], before: dict[str, Any]) -> bool:
    return _is_done(state) and state["result"] != before["result"]


if __name__ == "__main__":
    main()
