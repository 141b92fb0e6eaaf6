"""Make the pictures of the studio's pages; needs Chromium and Playwright beside hairkit.

python docs/images/studio_pages.py my-head/ [photos annotate pose strands hair]

opens the studio on a project, waits for its hair, and shows each page on a desktop and on a phone.
The Camera page needs somebody before the camera: it is not among them.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import sync_playwright

HERE = Path(__file__).parent
PAGES = {
    "photos": ".card path.hair",
    "annotate": ".stage canvas",
    "pose": ".stage[data-residual]:not([data-residual=''])",
    "strands": ".stage[data-drawn]",
    "hair": "#hair[data-skin][data-frames]",
}
"""What is there once a page is complete."""
DESKTOP, PHONE = (1440, 900), (390, 844)
HEIGHT, GAP, QUALITY = 630, 14, 88
"""Pixels of a picture and between its two parts, and its JPEG quality."""
SETTLE_MS, LONGEST_MS = 4000, 900_000


def main() -> None:
    """Write a picture for every page that is named."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("project", type=Path)
    parser.add_argument("pages", nargs="*", default=list(PAGES), metavar="PAGE")
    arguments = parser.parse_args()
    command = [sys.executable, "-m", "hairkit", "studio", str(arguments.project), "--no-browser"]
    studio = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert studio.stderr is not None
    link = studio.stderr.readline().split()[1]
    try:
        with sync_playwright() as play:
            words = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
            browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=words)
            page = browser.new_page()
            page.set_default_timeout(LONGEST_MS)
            page.goto(link)
            page.get_by_text("Hair is ready").wait_for()
            for name in arguments.pages:
                pictures = [_shown(page, link, name, size) for size in (DESKTOP, PHONE)]
                _write(HERE / f"studio_{name}.jpg", pictures)
    finally:
        studio.terminate()
        studio.wait()


def _shown(page: Any, link: str, name: str, size: tuple[int, int]) -> Any:
    """Return the picture of a page, RGB."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.goto("about:blank")
    page.goto(link.split("#")[0] + f"#{name}")
    page.locator(PAGES[name]).first.wait_for(state="attached")
    page.wait_for_timeout(SETTLE_MS)
    return cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)


def _write(path: Path, pictures: list[Any]) -> None:
    """Write pictures side by side."""
    parts = []
    for picture in pictures:
        width = round(picture.shape[1] * HEIGHT / picture.shape[0])
        parts += [np.full((HEIGHT, GAP, 3), 255, np.uint8)] if parts else []
        parts.append(cv2.resize(picture, (width, HEIGHT), interpolation=cv2.INTER_AREA))
    cv2.imwrite(str(path), np.hstack(parts), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    print(path)


if __name__ == "__main__":
    main()
