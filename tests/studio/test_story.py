"""The story of a user in a real browser: photos, masks, a stroke, moving hair, files.

It is told by the keyboard alone; what pointers do, too, is checked beside it.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from studio_keys import FOCUSED, MOST_STOPS, PAGES, go, step, tab_to

from hairkit.cli import main
from hairkit.io.capture_reader import read_capture
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.reconstruct import reconstruct

GUIDES = 80
SLOW_S = 600
"""Seconds for what computes, on a busy machine."""
SIZES = ((390, 844), (1440, 900))
LISTEN = """window.spoken = []; window.streams = [];
speechSynthesis.speak = (said) => { window.spoken.push(said.text); };
const ask = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices);
navigator.mediaDevices.getUserMedia = async (wanted) => {
  const stream = await ask(wanted);
  window.streams.push(stream);
  return stream;
};"""
"""What is spoken is written down, since browsers without a sound card say nothing, and what the
camera sends is kept."""
LIVE = "() => window.streams.flatMap((s) => s.getTracks()).some((t) => t.readyState === 'live')"
WRITTEN_ONLY, LEAST_FILE = (".html", ".fbx", ".ma", ".cards.glb"), 10_000
"""Files that hairkit does not read, and bytes of the smallest file."""


@pytest.fixture
def project(tmp_path: Path, start_studio: Callable[..., Any]) -> Iterator[Any]:
    """One studio for the whole story."""
    folder = tmp_path / "head"
    started = start_studio(folder, "--guides", str(GUIDES))
    yield started
    started.kill()


@pytest.fixture
def page(browser: Any, project: Any) -> Iterator[Any]:
    """The page that the link opens; errors and requests to other origins are kept."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    opened = context.new_page()
    opened.set_default_timeout(1000 * SLOW_S)
    opened.trouble, opened.foreign = [], []
    opened.on("pageerror", lambda error: opened.trouble.append(str(error)))
    opened.on("console", lambda m: m.type == "error" and opened.trouble.append(m.text))
    opened.on(
        "request",
        lambda r: (
            r.url.startswith((project.origin, "blob:", "data:")) or opened.foreign.append(r.url)
        ),
    )
    opened.add_init_script(LISTEN)
    opened.goto(project.link)
    yield opened
    context.close()


def wait_ready(page: Any, project: Any) -> None:
    """Wait until the hair belongs to the project as it is."""
    result = project.folder / "result" / "studio.json"
    inputs = ""
    for _ in range(SLOW_S):
        time.sleep(1)
        status = page.locator("#build-text")
        assert "bad" not in (status.get_attribute("class") or ""), status.inner_text()
        if result.is_file() and status.inner_text() == "Hair is ready":
            now = json.loads(result.read_text())["inputs"]
            if now == inputs:
                return
            inputs = now
    raise AssertionError("no hair")


def test_the_whole_story(
    page: Any, project: Any, browser: Any, photos: list[Path], tmp_path: Path
) -> None:
    """From photos to files, every step of the story holds, in this order."""
    check_photos_become_hair_by_themselves(page, project, photos)
    check_a_parameter_is_kept(page, project)
    check_files_equal_those_of_the_command_line(page, project, photos, tmp_path)
    check_a_stroke_moves_the_outline(page, project)
    check_landmarks_are_moved_by_keys(page, project)
    check_the_head_is_moved_by_keys(page, project)
    check_the_hair_moves(page, project)
    check_files_are_downloaded(page, project, browser, tmp_path)
    check_a_shot_of_the_camera_becomes_a_photo(page, project)
    check_the_compass_is_a_hint(page)
    check_photos_change_places_by_keys(page, project)
    for size in SIZES:
        for name in PAGES:
            check_pages_are_accessible(page, project, name, size)
    assert page.foreign == []  # no request of the whole story went to another origin


def check_photos_become_hair_by_themselves(page: Any, project: Any, photos: list[Path]) -> None:
    """Photos chosen in the page get masks and become hair without a further touch."""
    with page.expect_file_chooser() as caught:
        tab_to(page, "Choose photos")
        page.keyboard.press("Enter")
    caught.value.set_files([str(photo) for photo in photos])
    hair = page.locator(".card path.hair")
    hair.nth(len(photos) - 1).wait_for(state="attached", timeout=1000 * SLOW_S)
    wait_ready(page, project)
    assert not page.trouble


def check_a_parameter_is_kept(page: Any, project: Any) -> None:
    """A slider shows its strands, and its value is an option of the hair that is made next."""
    step(page, "strands")
    page.locator(".stage[data-drawn]").wait_for()
    drawn = page.locator(".stage").get_attribute("data-drawn")
    tab_to(page, "Narrowest window")
    for _ in range(8):
        page.keyboard.press("ArrowRight")
    page.wait_for_function(
        "before => document.querySelector('.stage').dataset.drawn !== before", arg=drawn
    )
    page.get_by_text("Kept; the hair is made again.").wait_for()
    settings = read_capture(project.folder).chosen.settings
    assert len(settings) == 1
    assert settings[0].startswith("structure_tensor.finest_window=")


def check_files_equal_those_of_the_command_line(
    page: Any, project: Any, photos: list[Path], tmp_path: Path
) -> None:
    """The original photos give the same bytes by `reconstruct`, in every file of the recipe, with
    the option as `--set` gives it."""
    wait_ready(page, project)
    originals = tmp_path / "photos"
    originals.mkdir()
    for photo in photos:
        (originals / photo.name).write_bytes(photo.read_bytes())
    recipe = load_recipe("default").with_set(read_capture(project.folder).chosen.settings)
    reconstruct(originals, tmp_path / "out", recipe, guides=GUIDES, sheet=False)
    for name in ("groom.npz", "groom.apx", "groom.abc", "groom.glb"):
        there = project.folder / "result" / name
        assert there.read_bytes() == (tmp_path / "out" / name).read_bytes(), name


def check_a_stroke_moves_the_outline(page: Any, project: Any) -> None:
    """A stroke that is drawn changes the mask, is kept as labelme's JSON, and can be undone."""
    step(page, "annotate")
    stage = page.locator(".stage")
    page.get_by_text("Found automatically").wait_for(timeout=1000 * SLOW_S)
    tab_to(page, "Photo with the outline")
    for key in ("Enter", "b", *["Shift+ArrowUp"] * 2, "Enter", *["ArrowRight"] * 8, "Enter"):
        page.keyboard.press(key)
    box = page.locator(".stage canvas").bounding_box()
    middle, top = box["x"] + box["width"] / 2, box["y"] + 0.45 * box["height"]
    page.locator(".stage[data-outline-ms]").wait_for(timeout=1000 * SLOW_S)
    assert int(stage.get_attribute("data-outline-ms")) > 0
    kept = json.loads((project.folder / "strokes" / "001.json").read_text())
    assert kept["flags"] == {"corrects": True}
    assert kept["shapes"][0]["label"] == "background"
    assert len(kept["shapes"][0]["points"]) > 4
    page.keyboard.press("Control+z")
    page.get_by_text("Found automatically").wait_for(timeout=1000 * SLOW_S)
    assert not (project.folder / "strokes" / "001.json").exists()
    page.keyboard.press("Control+Shift+z")
    page.get_by_text("1 stroke", exact=True).wait_for(timeout=1000 * SLOW_S)
    page.keyboard.press("s")  # the edge brush
    page.mouse.move(middle, top)
    page.mouse.down()
    page.mouse.move(middle + 30, top, steps=4)
    page.mouse.up()
    page.get_by_text("2 strokes", exact=True).wait_for(timeout=1000 * SLOW_S)
    again = kept
    for _ in range(SLOW_S):  # the page counts a stroke before it is saved
        again = json.loads((project.folder / "strokes" / "001.json").read_text())
        if len(again["shapes"]) > 1:
            break
        time.sleep(1)
    assert again["shapes"][0] == kept["shapes"][0]
    assert again["shapes"][1]["radius"] > 0
    page.keyboard.press("Delete")
    page.keyboard.press("Control+z")
    page.get_by_text("Found automatically").wait_for(timeout=1000 * SLOW_S)


def check_landmarks_are_moved_by_keys(page: Any, project: Any) -> None:
    """Arrow keys move a landmark, which is kept and can be given back."""
    step(page, "pose")
    page.get_by_text("Face found").wait_for()
    tab_to(page, "Photo with the fitted head")
    for key in ("n", "Shift+ArrowRight"):
        page.keyboard.press(key)
    tab_to(page, "Keep landmarks")
    page.keyboard.press("Enter")
    page.get_by_text("Kept; the hair is made again.").wait_for()
    assert json.loads((project.folder / "landmarks.json").read_text())["views"]
    tab_to(page, "Use automatic ones")
    page.keyboard.press("Enter")
    page.get_by_text("Automatic landmarks are used.").wait_for()


def check_the_head_is_moved_by_keys(page: Any, project: Any) -> None:
    """Keys move the head in every photo, the residual follows, and the fit can be had again."""
    go(page, project, "pose/1")
    stage = page.locator(".stage")
    page.locator(".stage[data-residual]:not([data-residual=''])").wait_for()
    fitted = float(stage.get_attribute("data-residual"))
    tab_to(page, "Move the head")
    page.keyboard.press("Enter")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("q")
    page.get_by_role("button", name="As it was fitted").and_(page.locator(":enabled")).wait_for()
    assert "[fitted_head]" in (project.folder / "capture.toml").read_text()
    page.wait_for_function(
        "before => Math.abs(document.querySelector('.stage').dataset.residual - before) > 1",
        arg=fitted,
    )
    tab_to(page, "As it was fitted")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="As it was fitted").and_(page.locator(":disabled")).wait_for()
    assert stage.get_attribute("data-residual") == f"{fitted:.2f}"


def check_photos_change_places_by_keys(page: Any, project: Any) -> None:
    """A photo goes on in the turn and back again, and the keyboard goes with it."""
    step(page, "pose")
    tab_to(page, "Photo 2 later")
    page.keyboard.press("Enter")
    moved = "(name) => document.activeElement.ariaLabel?.startsWith(name)"
    page.wait_for_function(moved, arg="Photo 3 later")
    kept = json.loads((project.folder / "studio.json").read_text())["photos"]
    assert [photo["id"] for photo in kept[:3]] == [1, 3, 2]
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Enter")
    page.wait_for_function(moved, arg="Photo 2 earlier")


def check_the_hair_moves(page: Any, project: Any) -> None:
    """The hair is drawn, hangs still without wind, moves in wind, and keeps its lengths."""
    wait_ready(page, project)
    go(page, project, "hair")
    page.locator("#hair[data-frames]").wait_for(timeout=1000 * SLOW_S)
    measure = """() => {
      const m = document.querySelector('#hair').hairMotion;
      const step = (n) => { for (let i = 0; i < n; i += 1) m.step(); };
      const away = () => Math.max(...m.now.map((v, i) => Math.abs(v - m.rest[i])));
      const stretch = () => {
        let most = 0;
        for (let g = 0; g < m.count; g += 1) for (let p = 1; p < m.points; p += 1) {
          const i = (g * m.points + p) * 3;
          const [x, y, z] = [0, 1, 2].map((k) => m.now[i + k] - m.now[i + k - 3]);
          const d = Math.hypot(x, y, z);
          most = Math.max(most, Math.abs(d / m.lengths[g * m.points + p] - 1));
        }
        return most;
      };
      step(60); const still = away();
      m.wind = [3, 0, 0]; step(90); const blown = away(), long = stretch();
      m.wind = [0, 0, 0]; step(600); return [still, blown, long, away()];
    }"""
    still, blown, stretched, settled = page.evaluate(measure)
    assert still < 1e-3
    page.locator("#hair[data-skin]").wait_for()  # the skin of the photos
    tab_to(page, "Hair on a head")
    for key in ("p", "ArrowRight", "ArrowRight"):
        page.keyboard.press(key)
    held = "document.querySelector('#hair').hairMotion.held"
    assert page.evaluate(f"{held}.at.length") == 3
    page.keyboard.press("p")
    assert page.evaluate(held) is None
    assert blown > 5e-3
    assert stretched < 1e-3
    assert settled < 2e-3
    assert not page.trouble


def check_files_are_downloaded(page: Any, project: Any, browser: Any, tmp_path: Path) -> None:
    """Every format comes from the page and is read; `result.html` moves without a server."""
    go(page, project, "hair")
    offered = page.locator("a[download]").all()
    names = [link.get_attribute("download") for link in offered]
    assert {"groom.apx", "groom.npz", "result.html"} < set(names)
    for link, name in zip(offered, names, strict=True):
        link.focus()
        with page.expect_download(timeout=1000 * SLOW_S) as caught:
            page.keyboard.press("Enter")
        caught.value.save_as(tmp_path / name)
        assert (tmp_path / name).stat().st_size > LEAST_FILE
        if not name.endswith(WRITTEN_ONLY):
            assert main(["info", str(tmp_path / name)]) == 0, name
    assert (tmp_path / "groom.apx").read_bytes() == (
        project.folder / "result" / "groom.apx"
    ).read_bytes()
    go(page, project, "photos")
    alone = browser.new_page()
    asked: list[str] = []
    alone.on("request", lambda request: asked.append(request.url))
    alone.on("pageerror", lambda error: page.trouble.append(str(error)))
    alone.goto((tmp_path / "result.html").as_uri(), timeout=1000 * SLOW_S)
    alone.locator("#hair[data-frames]").wait_for(timeout=1000 * SLOW_S)
    assert alone.evaluate("document.querySelector('#hair').hairMotion.count") > 0
    alone.locator("#hair[data-skin]").wait_for()
    assert asked == [(tmp_path / "result.html").as_uri()]
    alone.close()


def check_a_shot_of_the_camera_becomes_a_photo(page: Any, project: Any) -> None:
    """The shutter takes the picture inside the outline; it is the retake of its view."""
    before = (project.folder / "photos" / "001.jpg").read_bytes()
    go(page, project, "capture")
    point_phone(page, 0)
    page.locator(".ring path.taken").first.wait_for(timeout=1000 * SLOW_S)
    page.locator(".stage[data-feedback]").wait_for()
    count = len(list((project.folder / "photos").iterdir()))
    with page.expect_response(lambda r: "/api/photos" in r.url and r.request.method != "GET"):
        page.keyboard.press("Space")
    page.locator(".stage[data-shots]").wait_for()
    after = list((project.folder / "photos").iterdir())
    spoken = page.evaluate("window.spoken")
    assert spoken, "nobody was told where to stand"
    retaken = (project.folder / "photos" / "001.jpg").read_bytes() != before
    assert retaken or len(after) == count + 1


def check_the_compass_is_a_hint(page: Any) -> None:
    """A phone turned as far as the view is right; turned the other way it is told so."""
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


def check_pages_are_accessible(page: Any, project: Any, name: str, size: tuple[int, int]) -> None:
    """axe-core finds nothing serious, nothing is wider than the screen, Tab goes through all
    controls, and where it stands is marked and seen."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    page.set_viewport_size({"width": size[0], "height": size[1]})
    go(page, project, name)
    time.sleep(1)
    if name != "capture":
        page.wait_for_function(f"() => !({LIVE})()")  # no camera runs behind another page
    found = axe.Axe().run(page).response["violations"]
    serious = [(v["id"], [n["target"] for n in v["nodes"]]) for v in found
               if v["impact"] in ("serious", "critical")]  # fmt: skip
    assert not serious, (name, size)
    wide = page.evaluate("[document.documentElement.scrollWidth, innerWidth]")
    assert wide[0] <= wide[1], (name, size)
    page.evaluate("document.activeElement.blur()")
    stops = []
    for _ in range(MOST_STOPS):
        page.keyboard.press("Tab")
        stop = page.evaluate(FOCUSED)
        if stop["body"]:
            break
        stops.append(stop)
    hidden = [s["name"] for s in stops if not s["drawn"] or not s["seen"] or s["covered"]]
    assert not hidden, (name, size)
    controls = page.locator(":is(a[href], button, input, select, canvas):visible:enabled")
    assert len(stops) >= controls.count(), (name, size)
