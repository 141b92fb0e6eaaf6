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


def test_nothing_is_good_before_the_server_has_seen_it(page: Any, story: Any) -> None:
    """The page says so when the server finds no fault, never before, and names what it finds."""
    answers: list[list[str]] = []

    def any_light(route: Any) -> None:
        said = route.fetch().json()
        said["limits"] |= {"dark": -1, "bright": 999, "sharp": -1, "still": 999}
        route.fulfill(json=said)

    def look(route: Any) -> None:
        route.fulfill(json={"feedback": answers[0]}) if answers else route.abort()

    page.route("**/api/feedback", any_light)
    page.route("**/api/look/*", look)
    go(page, story, "capture")
    page.locator(".ring path.taken").first.wait_for()
    page.get_by_role("button", name="Back one").click()  # from the view above to the last one
    page.locator(".stage[data-feedback]").wait_for()
    page.wait_for_timeout(800)
    assert not page.locator(".guide.right").count()
    assert not page.locator(".hint").inner_text().startswith("Good")
    answers.append([])
    page.locator(".guide.right").wait_for()
    assert page.locator(".hint").inner_text().startswith("Good")
    answers[0] = ["out_of_frame"]
    page.locator(".hint", has_text="Put the head into the outline").wait_for()
    assert not page.locator(".guide.right").count()
    # The browser names the requests that got no answer, some of them late.
    page.trouble[:] = [text for text in page.trouble if "ERR_FAILED" not in text]
