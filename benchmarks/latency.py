"""Print how soon what a hand does is seen: in the studio's pages and in the viewer's window.

python benchmarks/latency.py --repeats 3
python benchmarks/latency.py --only viewer

The studio is used by headless Chromium, which draws the hair on the same processor: a stroke or a
slider is moved by mouse and keys while nothing else is going on, and the seconds end when the page
shows what came of it. Pages draw what is found for the hair on the page *Hair*. Processor seconds
are those of the studio's processes. The viewer's rows are the whole life of `hairkit view` that
ends once it has shown its first picture, of guides, or its second, of all hair, on a screen of its
own (Xvfb).
"""

from __future__ import annotations

import argparse
import itertools
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from studio import Studio

from hairkit.io.capture_reader import sample_folder

GUIDES = 600
LONGEST_MS = 300_000
WARM = 1
"""Starts of the viewer that are not counted: the first one compiles."""
QUIET_S = 2.0
"""Seconds after the whole hair was made, before the next thing is done."""
BROWSER = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-background-networking",
]  # fmt: skip
START = (
    "import os, sys; from hairkit.__main__ import main;"
    "from hairkit.rendering.context import Renderer;"
    "from hairkit.viewer.window.window import Window;"
    "show, left = Window.show_hidden, [{pictures}];"
    "Renderer.software = Renderer.software and {soft};"
    "Window.show_hidden = lambda self: (show(self), left.pop(), left or os._exit(0));"
    "sys.exit(main())"
)
"""The viewer, which ends as soon as some pictures are on the screen; unless `soft` the shaders draw
the hair, as on a graphics card, here by a software renderer."""
NEW_HAIR = """before => {
  const stage = document.querySelector('#hair[data-frames]');
  return stage && stage !== window.oldStage && window.shownHair !== before;
}"""
WATCH = """const ask = window.fetch;
window.fetch = async (path, ...rest) => {
  const answer = await ask(path, ...rest);
  if (String(path).startsWith('/api/result/')) {
    window.oldStage = document.querySelector('#hair');
    window.shownHair = String(path);
  }
  return answer;
};"""
"""Remembers which hair was read last, and what stood on the page before."""


class Hand:
    """A user before a page of the studio."""

    def __init__(self, studio: Studio, page: Any) -> None:
        self.studio, self.page = studio, page
        self.rows: dict[str, list[tuple[float, float]]] = {}

    def rest(self) -> None:
        """Leave the page, and wait until the whole hair is made and nothing else is going on."""
        self.turn_to("photos", ".card")
        state = self.studio.wait(lambda now: now["build"]["state"] == "done" and not now["draft"])
        self.page.wait_for_timeout(1000 * QUIET_S)
        self.before = f"/api/result/hair?v={state['result']}"

    def turn_to(self, name: str, wanted: str) -> None:
        """Turn to a page, and wait for an element of it."""
        self.page.evaluate(f"location.hash = '#{name}'")
        self.page.locator(wanted).first.wait_for()

    def begin(self) -> None:
        """Start the clock: what the hand does next is the last of it."""
        self.busy, self.began = self.studio.busy_s(), time.perf_counter()

    def see(self, what: str, condition: str = "", before: Any = None) -> None:
        """Stop the clock once the page's condition holds, by default that it shows other hair."""
        self.page.wait_for_function(condition or NEW_HAIR, arg=before or self.before)
        taken = time.perf_counter() - self.began, self.studio.busy_s() - self.busy
        self.rows.setdefault(what, []).append(taken)

    def see_hair(self, what: str) -> None:
        """Turn to the page of the hair, and stop the clock once it shows other hair."""
        self.page.evaluate("location.hash = '#hair'")
        self.see(what)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--photos", type=Path, default=sample_folder() / "photos")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", choices=("studio", "viewer"))
    parser.add_argument("--project", type=Path, help="a project whose hair is made; it is copied")
    parser.add_argument("--acts", nargs="*", choices=[*ACTS], default=[*ACTS])
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "head"
        if arguments.project is not None:
            shutil.copytree(arguments.project, project)
        studio = Studio(project, GUIDES)
        try:
            _make_hair(studio, arguments.photos)
            if arguments.only != "viewer":
                _measure_studio(studio, arguments.acts, arguments.repeats)
        finally:
            studio.close()
        if arguments.only != "studio":
            _measure_viewer(project / "result" / "groom.npz", arguments.repeats)


def _make_hair(studio: Studio, photos: Path) -> None:
    if not studio.ask("GET", "/api/project")["photos"]:
        studio.ask("PUT", "/api/hold", {"held": True})  # the hair is made once, of all photos
        for photo in sorted(photos.iterdir()):
            studio.ask("POST", "/api/photos", photo.read_bytes())
        studio.ask("PUT", "/api/hold", {"held": False})
    studio.wait(lambda state: bool(state["build"]["state"] == "done"))


def _measure_studio(studio: Studio, acts: list[str], repeats: int) -> None:
    with _page(studio) as page:
        hand = Hand(studio, page)
        for name in acts:
            for number in range(1, repeats + 1):
                hand.rest()
                ACTS[name](hand, number)
    print("| hand | seen | s | processor s |\n|---|---|---|---|")
    for what, taken in hand.rows.items():
        clock, busy = (statistics.median(column) for column in zip(*taken, strict=True))
        print(f"| {what} | {clock:.2f} | {busy:.2f} |", flush=True)


@contextmanager
def _page(studio: Studio) -> Iterator[Any]:
    """Open a page of a studio that has a session."""
    from playwright.sync_api import sync_playwright

    name, value = studio.cookie.split("=", 1)
    with sync_playwright() as play:
        found = shutil.which("chromium") or shutil.which("chromium-browser")
        browser = play.chromium.launch(executable_path=found, args=BROWSER)
        context = browser.new_context(viewport={"width": 1440, "height": 900})
        context.add_cookies([{"name": name, "value": value, "url": f"http://{studio.host}"}])
        page = context.new_page()
        page.set_default_timeout(LONGEST_MS)
        page.add_init_script(WATCH)
        page.goto(f"http://{studio.host}/#hair")
        page.locator("#hair[data-frames]").wait_for()
        yield page
        browser.close()


def draw_on_mask(hand: Hand, number: int) -> None:
    """Draw a stroke on hair in a photo."""
    page, stage = hand.page, ".stage[data-outline-ms]"
    hand.turn_to(f"annotate/{number}", f"button[aria-label='Photo {number}'][aria-pressed='true']")
    page.get_by_text("Found automatically").wait_for()
    page.evaluate("delete document.querySelector('.stage').dataset.outlineMs")
    box = page.locator(".stage canvas").bounding_box()
    middle, top = box["x"] + box["width"] / 2, box["y"] + 0.3 * box["height"]
    page.mouse.move(middle - 20, top)
    page.mouse.down()
    page.mouse.move(middle + 20, top, steps=4)
    hand.begin()
    page.mouse.up()
    hand.see("stroke on a mask | its outline", f"() => document.querySelector('{stage}')")
    hand.see_hair("stroke on a mask | hair")


def brighten(hand: Hand, number: int) -> None:
    """Move the slider of the brightness of a photo."""
    hand.turn_to(f"annotate/{number}", f"button[aria-label='Photo {number}'][aria-pressed='true']")
    hand.page.get_by_label("Brightness").focus()
    hand.begin()
    hand.page.keyboard.press("ArrowRight")
    hand.see_hair("slider of a photo's brightness | hair")


def follow_strands(hand: Hand, number: int) -> None:
    """Move a slider of the stage that follows strands."""
    page, drawn = hand.page, "document.querySelector('.stage').dataset.drawn"
    hand.turn_to(f"strands/{number}", ".stage[data-drawn]")
    page.locator("input[type='range']").first.focus()
    before = page.evaluate(drawn)
    hand.begin()
    page.keyboard.press("ArrowRight")
    hand.see("slider of how strands are followed | lines", f"was => {drawn} !== was", before)
    hand.see_hair("slider of how strands are followed | hair")


def colour_hair(hand: Hand, number: int) -> None:
    """Choose another width of the strands."""
    hand.turn_to(f"strands/{number}", "input[data-key='width_mm']")
    width = hand.page.locator("input[data-key='width_mm']")
    width.focus()
    hand.page.keyboard.press("ArrowUp")
    hand.begin()
    hand.page.keyboard.press("Tab")
    hand.see_hair("width, colour or curl of the hair | hair")


def comb(hand: Hand, number: int) -> None:
    """Comb the hair."""
    page = hand.page
    hand.turn_to("hair", "#hair[data-frames]")
    with page.expect_response("**/api/edits/stroke"):
        page.get_by_label("Brush", exact=True).select_option("comb")
    box = page.locator("#hair canvas").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.3 * box["height"] + 10 * number
    page.mouse.move(x, y)
    page.mouse.down()
    hand.begin()
    page.mouse.move(x + 25, y + 25, steps=3)
    shown = "document.querySelector('#hair').hairMotion.shown.size"
    hand.see("brush on the hair | its first guides", f"() => {shown}")
    hand.begin()
    page.mouse.up()
    hand.see("brush on the hair, lifted | hair")


def blow(hand: Hand, number: int) -> None:
    """Move the slider of the wind."""
    hand.turn_to("hair", "#hair[data-frames]")
    hand.page.get_by_label("Wind", exact=True).focus()
    hand.begin()
    hand.page.keyboard.press("ArrowRight")
    motion = "document.querySelector('#hair').hairMotion"
    hand.see("slider of the wind | hair", f"() => Math.hypot(...{motion}.wind) > 0")


def move_head(hand: Hand, number: int) -> None:
    """Move the head by a key, in a photo that shows the face."""
    page, residual = hand.page, "document.querySelector('.stage').dataset.residual"
    hand.turn_to("pose/1", ".stage[data-residual]:not([data-residual=''])")
    page.get_by_role("button", name="Move the head").press("Enter")
    before = page.evaluate(residual)
    hand.begin()
    page.keyboard.press("Shift+ArrowRight")
    hand.see("key that moves the head | its outline", f"was => {residual} !== was", before)
    hand.see_hair("key that moves the head | hair")


ACTS: dict[str, Callable[[Hand, int], None]] = {
    "mask": draw_on_mask,
    "brightness": brighten,
    "strands": follow_strands,
    "look": colour_hair,
    "comb": comb,
    "wind": blow,
    "head": move_head,
}


def _measure_viewer(groom: Path, repeats: int) -> None:
    words = ["view", str(groom), "--size", "1280x720"]
    seen = {"guides": "0", "all hair": "0, 0"}
    print("\n| viewer, 10,000 hairs, 1280 x 720 | s | processor s |\n|---|---|---|")
    with _screen() as screen:
        for (what, pictures), soft in itertools.product(seen.items(), (True, False)):
            command = [sys.executable, "-c", START.format(pictures=pictures, soft=soft), *words]
            runs = [_run(command, screen) for _ in range(WARM + repeats)]
            clock, busy = (statistics.median(column) for column in zip(*runs[WARM:], strict=True))
            drawn = "processor" if soft else "shaders"
            print(f"| {what}, by {drawn} | {clock:.2f} | {busy:.2f} |", flush=True)


@contextmanager
def _screen() -> Iterator[dict[str, str]]:
    """Start a screen, and yield the environment of programs whose windows open on it."""
    numbers, signal = os.pipe()
    command = ["Xvfb", "-screen", "0", "1280x720x24", "-nolisten", "tcp", "-displayfd", str(signal)]
    server = subprocess.Popen(command, pass_fds=[signal], stderr=subprocess.DEVNULL)
    os.close(signal)
    try:
        with os.fdopen(numbers) as reader:
            yield {**os.environ, "DISPLAY": f":{reader.readline().strip()}"}
    finally:
        server.terminate()
        server.wait()


def _run(command: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Return the seconds of a program by the clock and of the processor."""
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, env=environment, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - began, busy


if __name__ == "__main__":
    main()
