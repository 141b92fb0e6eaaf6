"""Laws of the camera's page, in a real browser with a test picture for a camera."""

from __future__ import annotations

from typing import Any

from studio_keys import go


def test_a_shot_of_the_camera_becomes_a_photo(page: Any, story: Any) -> None:
    """The shutter takes the picture inside the outline; it is the retake of its view."""
    folder = story.folder / "photos"
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    begin_turn(page, story)
    after = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert len(set(after.values()) - set(before.values())) == 1
    assert page.evaluate("window.spoken"), "nobody was told where to stand"


def begin_turn(page: Any, story: Any) -> None:
    """Take the first photo of a turn, with a phone that looks north."""
    go(page, story, "capture")
    point_phone(page, 0)
    page.locator(".ring path.taken").first.wait_for()
    page.locator(".stage[data-feedback]").wait_for()
    with page.expect_response(lambda r: "/api/photos" in r.url and r.request.method != "GET"):
        page.keyboard.press("Space")
    page.locator(".stage[data-shots]").wait_for()


def test_the_compass_is_a_hint(page: Any, story: Any) -> None:
    """A phone turned as far as the view is right; turned the other way it is told so."""
    begin_turn(page, story)
    page.get_by_role("button", name="Back one").click()  # from the view above to the last one
    stage = page.locator(".stage")
    for turned, right in ((45, True), (-45, False)):
        point_phone(page, turned)
        page.wait_for_function(
            "off => Number(document.querySelector('.stage').dataset.compass) === off",
            arg=0 if right else -90,
        )
        page.wait_for_timeout(500)
        assert ("wrong_angle" in stage.get_attribute("data-feedback").split()) != right


def point_phone(page: Any, heading_deg: float) -> None:
    """Turn the upright phone that the page runs on, clockwise seen from above."""
    if not hasattr(page, "phone"):  # one session owns the sensor
        page.phone = page.context.new_cdp_session(page)
    page.phone.send(
        "DeviceOrientation.setDeviceOrientationOverride",
        {"alpha": -heading_deg % 360, "beta": 90, "gamma": 0},
    )
