"""Turns that come as a video, and turns that a pointer puts in order."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from hairkit.io.photos import read_photo
from hairkit.io.video import FRAMES

WIDTH, HEIGHT, COUNT = 192, 256, 96
BLURRED = range(2, COUNT, 3)


def turning(share: float) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Return a picture (H, W, 3) of a spotted cylinder, turned by that share of a turn."""
    spots = cv2.resize(np.random.default_rng(5).integers(0, 255, (24, 60), np.uint8), (480, HEIGHT))
    across = np.linspace(-0.98, 0.98, WIDTH // 2)
    column = ((np.arcsin(across) / (2 * np.pi) + share) % 1.0 * 480).astype(int)
    picture = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    picture[20:-20, WIDTH // 4 : WIDTH // 4 + WIDTH // 2] = spots[20:-20, column, None]
    return picture


def test_a_video_becomes_its_best_frames(server: Any, tmp_path: Path) -> None:
    """One turn gives the frames of `read_video` as photos in their order, none of them blurred; the
    video does not stay in the project."""
    path = tmp_path / "turn.mp4"
    file = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 30.0, (WIDTH, HEIGHT))
    if not file.isOpened():
        pytest.skip("this OpenCV writes no videos")
    for number in range(COUNT):
        picture = turning(number / COUNT)
        file.write(cv2.GaussianBlur(picture, (0, 0), 2) if number in BLURRED else picture)
    file.release()
    answer = server.ask("POST", "/api/video", path.read_bytes())
    assert answer.status == 201, answer.body
    assert answer.json["ids"] == list(range(1, FRAMES + 1))
    photos = sorted((server.folder / "photos").iterdir())
    found = []
    for photo in photos:
        image = read_photo(photo)[0].astype(float)
        found.append(min(range(COUNT), key=lambda n: np.abs(image - turning(n / COUNT)).mean()))
    assert not set(found) & set(BLURRED)
    assert found == sorted(found)
    assert not [p for p in server.folder.rglob("*") if p.suffix in (".mp4", ".bin")]


def test_dragged_thumbnails_change_the_order(browser: Any, server: Any, photos: list[Path]) -> None:
    """A photo that is dropped on another takes its place in the turn, and that is kept."""
    for photo in photos[:4]:
        server.ask("POST", "/api/photos", photo.read_bytes())
    link = server.ask("POST", "/api/pairing", {}).json["link"]
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    page.goto(link)
    page.goto(f"{server.origin}/#pose")
    cards = page.locator("li.card")
    cards.nth(3).wait_for()
    cards.nth(0).drag_to(cards.nth(2))
    page.locator("[data-order='2,3,1,4']").wait_for(state="attached")
    kept = json.loads((server.folder / "studio.json").read_text())["photos"]
    assert [photo["id"] for photo in kept] == [2, 3, 1, 4]
    page.close()


def test_a_photo_under_the_pointer_stays(browser: Any, server: Any, photos: list[Path]) -> None:
    """What another page does while a photo is dragged neither drops the photo nor gets lost."""
    for photo in photos[:4]:
        server.ask("POST", "/api/photos", photo.read_bytes())
    link = server.ask("POST", "/api/pairing", {}).json["link"]
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page, other = context.new_page(), context.new_page()
    page.goto(link)
    page.goto(f"{server.origin}/#pose")
    other.goto(f"{server.origin}/#pose")
    page.bring_to_front()
    cards = page.locator("li.card")
    cards.nth(3).wait_for()
    held = cards.nth(0).element_handle()
    cards.nth(0).hover()
    page.mouse.down()
    server.ask("PUT", "/api/order", {"order": [1, 2, 4, 3]})
    other.locator("[data-order='1,2,4,3']").wait_for(state="attached")
    assert held.evaluate("card => card.isConnected")
    cards.nth(1).hover()
    page.locator("li.dragged").wait_for()
    cards.nth(3).hover()
    page.mouse.up()
    page.locator("[data-order='2,4,3,1']").wait_for(state="attached")
    context.close()
