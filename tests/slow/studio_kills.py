"""Kill the studio's server and workers at random moments of the story, and print what was lost.

python tests/slow/studio_kills.py --photos photos/ --kills 20
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import json
import os
import signal
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.io.capture_reader import read_capture, sample_folder
from hairkit.io.capture_toml import read_capture_file
from hairkit.pipeline.reconstruct import reconstruct

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from studio import Studio

GUIDES = 100
KILLS = 20
SPACING_S = (0.5, 30.0)
"""Seconds from the end of a process to the end of the next; a whole run takes about a minute."""
MOST_WAIT_S = 60.0
"""Longest pause between two changes of the user, who need not wait for the hair."""
STROKE_PX = 9.0
END_S = 10.0
"""Seconds within which processes end whose server was killed."""
LONGEST_S = 1800.0
FILES = ("groom.npz", "groom.apx", "groom.abc", "groom.glb")


@dataclass
class Story:
    """A user who goes on whatever happens, and who remembers what the studio confirmed."""

    folder: Path
    studio: Studio
    starts: int = 1
    doing: str = "nothing"
    drawn: dict[int, int] = field(default_factory=dict)
    """The number that tells the last confirmed stroke of a photo from those before it."""
    width_mm: float = 0.0
    lost: list[str] = field(default_factory=list)

    def ask(self, method: str, path: str, body: Any = None) -> Any:
        """Return the answer, from a new server where the old one has gone; None if it went then."""
        try:
            return self.studio.ask(method, path, body)
        except (OSError, http.client.HTTPException, ValueError):
            self._start_again()
            return None

    def insist(self, method: str, path: str, body: Any = None) -> Any:
        """Ask until there is an answer; for requests that may be made twice."""
        while (answer := self.ask(method, path, body)) is None:
            pass
        return answer

    def add_photos(self, photos: list[Path]) -> None:
        """Upload photos; one that was under way when the server ended may be there."""
        count = 0
        while count < len(photos):
            self.doing = f"photo {count + 1}"
            answer = self.ask("POST", "/api/photos", photos[count].read_bytes())
            there = len(self.insist("GET", "/api/project")["photos"])
            least = count + (answer is not None)
            if there < least or there > count + 1:
                self.lost.append(f"{there} photos, {least} were confirmed")
            count = there

    def draw(self, identity: int, number: int) -> None:
        """Draw a stroke whose last point is `number` pixels down, once the outline is there."""
        self.doing = f"stroke on photo {identity}"
        photo = self.insist("GET", f"/api/photos/{identity}/outline")
        x = photo["width"] / 2
        points = [[x, 0.3 * photo["height"]], [x + STROKE_PX, 0.3 * photo["height"] + number]]
        shape = {"label": "foreground", "shape_type": "linestrip", "points": points}
        document = {
            "flags": {"corrects": True}, "shapes": [shape],
            "imageWidth": photo["width"], "imageHeight": photo["height"],
        }  # fmt: skip
        self.insist("PUT", f"/api/photos/{identity}/strokes", document)
        self.drawn[identity] = number

    def choose(self, width_mm: float) -> None:
        """Choose the width of the hair."""
        self.doing = "choice"
        self.insist("PUT", "/api/choices", {"hair": {"width_mm": width_mm}})
        self.width_mm = width_mm

    def wait_for_hair(self, doing: str, enough: float = LONGEST_S) -> None:
        """Wait until the hair is that of the project, or for `enough` seconds."""
        ends = time.monotonic() + enough
        while time.monotonic() < ends:
            state = self.insist("GET", "/api/project")["build"]
            self.doing = f"{doing}: {state.get('stage', state['state'])}"
            if state["state"] == "failed":
                self.lost.append(state["reason"])
                self.insist("POST", "/api/build")
            if state["state"] == "done":
                return
            time.sleep(0.1)

    def check(self) -> None:
        """Compare the files with what was confirmed."""
        for number, said in self.drawn.items():
            path = self.folder / "strokes" / f"{number:03d}.json"
            points = json.loads(path.read_text())["shapes"][0]["points"] if path.is_file() else []
            if not points or round(points[1][1] - points[0][1]) != said:
                self.lost.append(f"stroke on photo {number}")
        width = read_capture_file(self.folder / "capture.toml").chosen.hair.width_mm
        if self.width_mm and width != self.width_mm:
            self.lost.append(f"width {self.width_mm} mm: {width}")

    def _start_again(self) -> None:
        self.studio.close()
        while True:
            with contextlib.suppress(OSError, http.client.HTTPException, ValueError, IndexError):
                self.studio = Studio(self.folder, GUIDES)
                break
        self.starts += 1
        self.check()


@dataclass
class Killer(threading.Thread):
    """Kills the server or one of the processes below it, again and again."""

    story: Story
    kills: int
    generator: np.random.Generator
    rows: list[tuple[str, str, float]] = field(default_factory=list)
    orphans: int = 0

    def __post_init__(self) -> None:
        super().__init__(daemon=True)

    __hash__ = threading.Thread.__hash__

    def run(self) -> None:
        """Kill at random moments."""
        began = time.monotonic()
        while len(self.rows) < self.kills:
            time.sleep(float(self.generator.uniform(*SPACING_S)))
            server = self.story.studio.process.pid
            below = _descendants(server)
            worker = below and self.generator.random() < 1 / 2
            victim = int(self.generator.choice(below)) if worker else server
            doing = self.story.doing
            with contextlib.suppress(ProcessLookupError):
                os.kill(victim, signal.SIGKILL)
                self.rows.append(
                    ("worker" if worker else "server", doing, time.monotonic() - began)
                )
            if not worker:
                self.orphans += _count_after(below, END_S)


def main() -> None:
    """Go through the story while processes are killed, and compare the end with a run alone."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--photos", type=Path, default=sample_folder() / "photos")
    parser.add_argument("--kills", type=int, default=KILLS)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    photos = sorted(arguments.photos.iterdir())
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "head"
        story = Story(folder, Studio(folder, GUIDES))
        killer = Killer(story, arguments.kills, np.random.default_rng(arguments.seed))
        try:
            killer.start()
            _live(story, killer, photos)
        finally:
            story.studio.close()
        equal = _is_as_if_alone(folder, Path(scratch) / "alone")
        left = [str(p.relative_to(folder)) for p in folder.rglob(".*") if "part" in p.name]
    print("| second | killed | during |\n|---|---|---|")
    for victim, doing, second in killer.rows:
        print(f"| {second:.0f} | {victim} | {doing} |")
    print(
        f"\nstarts of the server: {story.starts}; lost: {story.lost or 'nothing'}; processes left "
        f"after {END_S:g} s: {killer.orphans}; unfinished files: {left or 'none'}; "
        f"bytes as of a run alone: {'yes' if equal else 'NO'}"
    )
    if story.lost or left or killer.orphans or not equal:
        raise SystemExit("something was lost")


def _live(story: Story, killer: Killer, photos: list[Path]) -> None:
    """Take photos, draw, choose and wait, until all kills are done and the hair is whole."""
    story.add_photos(photos)
    story.wait_for_hair("first hair")
    number = 0
    while killer.is_alive():
        shown = story.insist("GET", "/api/project")["photos"]
        number += 1
        story.draw(shown[number % len(shown)]["id"], number)
        pauses = killer.generator.uniform(0, MOST_WAIT_S, 2)
        story.wait_for_hair("hair after a stroke", pauses[0])
        story.choose(0.05 + number / 1000)
        story.wait_for_hair("hair after a choice", pauses[1])
    story.wait_for_hair("last hair")
    story.check()


def _is_as_if_alone(folder: Path, out: Path) -> bool:
    """Return whether the studio's files are those of a run that nobody disturbed."""
    capture = read_capture(folder)
    reconstruct(capture, out, guides=GUIDES, sheet=False)
    return all(
        (folder / "result" / name).read_bytes() == (out / name).read_bytes() for name in FILES
    )


def _descendants(pid: int) -> list[int]:
    found = []
    for thread in Path(f"/proc/{pid}/task").glob("*"):
        with contextlib.suppress(OSError):
            for child in (thread / "children").read_text().split():
                found += [int(child), *_descendants(int(child))]
    return found


def _count_after(pids: list[int], limit_s: float) -> int:
    """Return how many processes are there at the end of a time in which all should end."""
    ends = time.monotonic() + limit_s
    while (there := sum(map(_is_running, pids))) and time.monotonic() < ends:
        time.sleep(0.1)
    return there


def _is_running(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


if __name__ == "__main__":
    main()
