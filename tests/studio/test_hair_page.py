"""Brushes over the hair in a real browser: what is drawn shows, is kept, and is told."""

from __future__ import annotations

import json
from typing import Any

import cv2
import numpy as np
import pytest
from studio_keys import go, tab_to


def test_a_brush_is_led_by_keys(page: Any, story: Any) -> None:
    """A stroke by keys shows at once and is kept; undone it is gone, also after a reload, where it
    can still be had again."""
    go(page, story, "hair")
    page.locator("#hair[data-skin]").wait_for()
    page.get_by_role("combobox", name="Brush").select_option("comb")
    tab_to(page, "Hair on a head")
    before = page.evaluate("Array.from(document.querySelector('#hair').hairMotion.rest)")
    page.keyboard.press("p")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.wait_for_function(SHAPED, arg=[before, 0.005])
    with page.expect_response("**/api/result/draft*"):
        page.keyboard.press("p")
    [stroke] = strokes_over_hair(story)
    assert stroke["brush"] == "comb"
    assert len(stroke["path"]) == 4
    page.get_by_role("button", name="Undo").click()
    page.locator("button:disabled", has_text="Undo").wait_for()
    while strokes_over_hair(story):
        page.wait_for_timeout(50)
    page.reload()
    page.get_by_role("button", name="Redo").click()
    page.locator("button:enabled", has_text="Undo").wait_for()
    while not strokes_over_hair(story):
        page.wait_for_timeout(50)
    assert strokes_over_hair(story) == [stroke]


@pytest.mark.parametrize("brush", ["puff", "cut", "curl", "thin", "dye"])
def test_a_brush_shows_while_it_is_led(page: Any, story: Any, brush: str) -> None:
    """Other brushes than the comb show before they are lifted, too; dropped, nothing is left."""
    go(page, story, "hair")
    page.locator("#hair[data-skin]").wait_for()
    page.get_by_role("combobox", name="Brush").select_option(brush)
    tab_to(page, "Hair on a head")
    of = "tints" if brush == "dye" else "rest"
    changed = SHAPED.replace("rest", of)
    before = page.evaluate(f"Array.from(document.querySelector('#hair').hairMotion.{of})")
    assert page.get_by_label("Colour of the dye").is_visible() == (brush == "dye")
    kept = strokes_over_hair(story)
    page.keyboard.press("p")
    for _ in range(3):
        page.keyboard.press("ArrowDown")
    page.wait_for_function(changed, arg=[before, 0.0005])
    page.keyboard.press("Escape")
    page.wait_for_function(f"(given) => !({changed})(given)", arg=[before, 1e-6])
    assert strokes_over_hair(story) == kept


def test_a_stroke_that_reaches_no_hair_is_told(page: Any, story: Any) -> None:
    """It is kept, and one line says so on the page, also after a reload."""
    hair = open_brush(page, story, "comb")
    page.get_by_role("combobox", name="Acts on").select_option("lashes")
    hair.focus()
    line = "stroke 1 (comb) reaches no hair; it is kept"
    for key in ("p", "ArrowRight", "p"):
        page.keyboard.press(key)
    page.get_by_role("region", name="Files").get_by_text(line).wait_for()
    page.locator("#notice", has_text=line).wait_for()
    page.locator("#build-text.good").wait_for()
    page.reload()
    page.get_by_role("region", name="Files").get_by_text(line).wait_for()
    assert len(strokes_over_hair(story)) == 1


def test_a_brush_takes_no_wrong_amount_and_gives_way_to_two_fingers(page: Any, story: Any) -> None:
    """An amount in centimetres is told before it is drawn with; fingers that spread only zoom."""
    hair = open_brush(page, story, "trim")
    page.get_by_label("Amount").fill("12")
    hair.focus()
    page.keyboard.press("p")
    page.locator("#notice", has_text="0.03 is 3 cm").wait_for()
    page.get_by_label("Amount").fill("0.12")
    far = "document.querySelector('#hair').hairView.distance"
    before, box = page.evaluate(far), hair.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    device = page.context.new_cdp_session(page)
    for kind, spread in (("Start", [0]), ("Move", [9]), ("Start", [9, 60]), ("Move", [9, 200])):
        fingers = [{"x": x - to, "y": y, "id": number} for number, to in enumerate(spread)]
        device.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": fingers})
    device.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_function(f"(before) => {far} < before", arg=before)
    assert page.get_by_role("button", name="Undo").is_disabled()
    assert strokes_over_hair(story) == []


def test_a_head_whose_picture_is_not_there_yet_is_as_bright(page: Any, story: Any) -> None:
    """Plain skin, shown until the picture of the skin is decoded, is no flash of white."""
    brightness = []
    for late in ("", "createImageBitmap = () => new Promise(() => {});"):
        page.add_init_script(late)
        go(page, story, "hair")
        page.reload()
        page.locator("#hair[data-frames]" if late else "#hair[data-skin]").wait_for()
        page.evaluate("document.querySelector('#hair').hairView.azimuth = 0")
        shown = page.locator("#hair canvas").screenshot()
        picture = cv2.imdecode(np.frombuffer(shown, np.uint8), cv2.IMREAD_GRAYSCALE)
        high, wide = picture.shape
        face = picture[high * 4 // 10 : high // 2, wide // 2 - 40 : wide // 2 + 40]
        brightness.append(float(np.median(face)))
    assert abs(brightness[1] - brightness[0]) < 40


def open_brush(page: Any, story: Any, name: str) -> Any:
    """Take a brush on the page of the hair; returns where the hair is drawn."""
    go(page, story, "hair")
    page.locator("#hair[data-skin]").wait_for()
    page.get_by_role("combobox", name="Brush").select_option(name)
    return page.locator("#hair canvas")


SHAPED = """([before, least]) => {
  const now = document.querySelector('#hair').hairMotion.rest;
  return before.some((value, k) => Math.abs(value - now[k]) > least);
}"""


def strokes_over_hair(story: Any) -> Any:
    """Return the strokes that the project keeps."""
    path = story.folder / "edits.json"
    return json.loads(path.read_text())["strokes"] if path.is_file() else []
