"""Laws of every page of the studio, on a phone and on a desk."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from studio_browser import GUIDES, LIVE, opened
from studio_keys import FOCUSED, MOST_STOPS, PAGES, go

SIZES = ((390, 844), (1440, 900))
SHOWN = {
    "photos": ".card path.hair",
    "capture": ".ring path.taken",
    "annotate": "p[role=status]:text('Found automatically')",
    "pose": "p[role=status]:text('Face found')",
    "strands": ".stage[data-drawn]",
    "hair": "#hair[data-skin]",
}
"""What each page shows when all that it asked for has come."""


@pytest.fixture(scope="module")
def shown(browser: Any, made: Path, start_studio: Callable[..., Any]) -> Iterator[tuple[Any, Any]]:
    """A studio and its page for tests that change nothing."""
    started = start_studio(made, "--guides", str(GUIDES))
    with opened(browser, started) as page:
        yield started, page
    started.kill()


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize("size", SIZES, ids=["phone", "desk"])
def test_pages_are_accessible(shown: tuple[Any, Any], name: str, size: tuple[int, int]) -> None:
    """axe-core finds nothing serious, nothing is wider than the screen, Tab goes through all
    controls, and where it stands is marked and seen."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    project, page = shown
    page.set_viewport_size({"width": size[0], "height": size[1]})
    go(page, project, name)
    page.locator(SHOWN[name]).first.wait_for(state="attached")
    if name != "capture":
        page.wait_for_function(f"() => !({LIVE})()")  # no camera runs behind another page
    found = axe.Axe().run(page).response["violations"]
    serious = [(v["id"], [n["target"] for n in v["nodes"]]) for v in found
               if v["impact"] in ("serious", "critical")]  # fmt: skip
    assert not serious
    wide = page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert wide[0] <= wide[1]
    stops = focus_all(page)
    hidden = [s["name"] for s in stops if not s["drawn"] or not s["seen"] or s["covered"]]
    assert not hidden
    controls = page.locator(":is(a[href], button, input, select, canvas):visible:enabled")
    assert len(stops) >= controls.count()


def focus_all(page: Any) -> list[dict[str, Any]]:
    """Return what Tab comes by on its way through the page."""
    page.evaluate("document.activeElement.blur()")
    stops = []
    for _ in range(MOST_STOPS):
        page.keyboard.press("Tab")
        stop = page.evaluate(FOCUSED)
        if stop["body"]:
            break
        stops.append(stop)
    return stops
