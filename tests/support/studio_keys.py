"""The pages of the studio by their address and by the keyboard."""

from __future__ import annotations

from typing import Any

PAGES = ("photos", "capture", "annotate", "pose", "strands", "hair")
NAMES = ("Photos", "Camera", "Mask", "Pose", "Strands", "Hair")
"""Of the pages, in the bar of steps."""
MOST_STOPS = 90
"""Stops of the Tab key on a page, at most."""
FOCUSED = """() => {
  const e = document.activeElement, box = e.getBoundingClientRect(), style = getComputedStyle(e);
  const middle = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
  return {
    name: e.getAttribute("aria-label") || e.textContent.trim() || e.tagName,
    drawn: style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2,
    seen: box.width > 0 && box.right > 0 && box.bottom > 0 && box.x < innerWidth
      && box.y < innerHeight,
    covered: middle !== null && !e.contains(middle) && !middle.contains(e)
      && !e.closest("label")?.contains(middle),
    body: e === document.body,
  };
}"""
"""What the keyboard is at: its name, whether that is marked, and whether one can see it."""


def go(page: Any, project: Any, name: str) -> None:
    """Go to a page of the studio by its address."""
    page.goto(f"{project.origin}/#{name}")
    page.locator(f"nav a[aria-current][href='#{name.partition('/')[0]}']").wait_for()


def step(page: Any, name: str) -> None:
    """Go to a page by the bar of steps: Tab from the top, Enter."""
    page.evaluate("document.activeElement.blur()")
    tab_to(page, NAMES[PAGES.index(name)])
    page.keyboard.press("Enter")
    page.locator(f"nav a[aria-current][href='#{name}']").wait_for()


def tab_to(page: Any, name: str) -> None:
    """Press Tab until the control of that name has the keyboard."""
    for _ in range(MOST_STOPS):
        page.keyboard.press("Tab")
        if page.evaluate(FOCUSED)["name"].startswith(name):
            return
    raise AssertionError(f"no Tab reaches {name!r}")
