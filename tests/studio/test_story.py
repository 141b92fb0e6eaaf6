"""What a user does in a real browser: photos, masks, a stroke, moving hair, files.

It is done by the keyboard alone; what pointers do, too, is checked beside it. Each test has a
project of its own, whose hair is made already.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from studio_browser import GUIDES, OPTION, SLOW_S, USED, opened
from studio_keys import go, step, tab_to

from hairkit.cli import main
from hairkit.grooming.engine_files import ENGINES
from hairkit.io.capture_reader import read_capture

MEASURE_MOTION = """() => {
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
"""Metres that hair moves at rest and in wind, its stretch there, and metres after a calm."""
WRITTEN_ONLY, LEAST_FILE = (".html", ".fbx", ".ma", ".cards.glb", ".zip"), 10_000
"""Files that hairkit does not read, and bytes of the smallest file."""


def test_photos_become_hair_by_themselves(
    browser: Any, photos: list[Path], tmp_path: Path, start_studio: Callable[..., Any]
) -> None:
    """Photos chosen in the page get masks and become hair without a further touch."""
    studio = start_studio(tmp_path / "head", "--guides", str(GUIDES))
    try:
        with opened(browser, studio) as page, page.expect_file_chooser() as caught:
            tab_to(page, "Choose photos")
            page.keyboard.press("Enter")
            caught.value.set_files([str(photo) for photo in photos])
            hair = page.locator(".card path.hair")
            hair.nth(len(photos) - 1).wait_for(state="attached")
            page.get_by_text("Hair is ready").wait_for()
            assert json.loads((studio.folder / "result" / "studio.json").read_text())["inputs"]
    finally:
        studio.kill()


def test_a_parameter_is_kept(page: Any, story: Any) -> None:
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
    [setting] = read_capture(story.folder).chosen.settings
    name, value = setting.split("=")
    assert name == f"structure_tensor.{OPTION}"
    assert float(value) > USED


def test_files_equal_those_of_the_command_line(
    made: Path, photos: list[Path], tmp_path: Path
) -> None:
    """The original photos give the same bytes by `hairkit reconstruct`, in every file of the
    recipe, with the option as `--set` gives it."""
    (tmp_path / "photos").mkdir()
    for photo in photos:
        shutil.copy(photo, tmp_path / "photos")
    command = [sys.executable, "-m", "hairkit", "reconstruct", "photos", "-o", "out", "--no-sheet"]
    chosen = ["--guides", str(GUIDES), "--set", f"structure_tensor.{OPTION}={USED}"]
    subprocess.run([*command, *chosen], cwd=tmp_path, check=True, capture_output=True)
    for name in ("groom.npz", "groom.apx", "groom.abc", "groom.glb"):
        there = made / "result" / name
        assert there.read_bytes() == (tmp_path / "out" / name).read_bytes(), name


def test_a_stroke_moves_the_outline(page: Any, story: Any) -> None:
    """A stroke that is drawn changes the mask, is kept as labelme's JSON, and can be undone."""
    step(page, "annotate")
    page.get_by_text("Found automatically").wait_for()
    tab_to(page, "Photo with the outline")
    for key in ("Enter", "b", *["Shift+ArrowUp"] * 2, "Enter", *["ArrowRight"] * 8, "Enter"):
        page.keyboard.press(key)
    page.locator(".stage[data-outline-ms]").wait_for()
    [shape] = kept_strokes(story, 1)
    assert shape["label"] == "background"
    assert len(shape["points"]) > 4
    page.keyboard.press("Control+z")
    page.get_by_text("Found automatically").wait_for()
    assert not (story.folder / "strokes" / "001.json").exists()
    page.reload()
    page.get_by_text("Found automatically").wait_for()
    page.keyboard.press("Control+Shift+z")
    page.get_by_text("1 stroke", exact=True).wait_for()
    assert kept_strokes(story, 1) == [shape]


def test_an_edge_brush_keeps_its_radius(page: Any, story: Any) -> None:
    """What a pointer paints with a brush is a stroke with a radius; Delete takes it back."""
    go(page, story, "annotate/1")
    page.get_by_text("Found automatically").wait_for()
    box = page.locator(".stage canvas").bounding_box()
    middle, top = box["x"] + box["width"] / 2, box["y"] + 0.45 * box["height"]
    page.keyboard.press("s")
    page.mouse.move(middle, top)
    page.mouse.down()
    page.mouse.move(middle + 30, top, steps=4)
    page.mouse.up()
    [shape] = kept_strokes(story, 1)
    assert shape["radius"] > 0
    page.keyboard.press("Delete")
    page.get_by_text("Found automatically").wait_for()


def test_strokes_on_two_photos_are_both_kept(page: Any, story: Any) -> None:
    """What is drawn while the stroke of another photo is on its way is kept, too."""
    late: list[Any] = []
    page.route(
        "**/api/photos/1/strokes",
        lambda route: late.append(route) if route.request.method == "PUT" else route.continue_(),
    )
    go(page, story, "annotate/1")
    for name in ("1", "2"):
        page.locator(f"button[aria-label='Photo {name}'][aria-pressed='true']").wait_for()
        page.get_by_text("Found automatically").wait_for()
        page.locator(".stage canvas").click()
        page.keyboard.press("d")
    kept_strokes(story, 1, "002.json")
    late[0].continue_()
    kept_strokes(story, 1, "001.json")


def kept_strokes(story: Any, count: int, name: str = "001.json") -> list[dict[str, Any]]:
    """Wait until that many strokes of a photo are kept, and return them."""
    path = story.folder / "strokes" / name
    end = time.monotonic() + SLOW_S
    while True:  # the page counts a stroke before it is saved
        document = json.loads(path.read_text()) if path.is_file() else {"shapes": []}
        if len(document["shapes"]) == count:
            assert document["flags"] == {"corrects": True}
            return list(document["shapes"])
        assert time.monotonic() < end, document
        time.sleep(0.1)


def test_landmarks_are_moved_by_keys(page: Any, story: Any) -> None:
    """Arrow keys move a landmark, which is kept and can be given back."""
    step(page, "pose")
    page.get_by_text("Face found").wait_for()
    tab_to(page, "Photo with the fitted head")
    for key in ("n", "Shift+ArrowRight"):
        page.keyboard.press(key)
    tab_to(page, "Keep landmarks")
    page.keyboard.press("Enter")
    page.get_by_text("Kept; the hair is made again.").wait_for()
    assert json.loads((story.folder / "landmarks.json").read_text())["views"]
    tab_to(page, "Use automatic ones")
    page.keyboard.press("Enter")
    page.get_by_text("Automatic landmarks are used.").wait_for()


def test_the_head_is_moved_by_keys(page: Any, story: Any) -> None:
    """Keys move the head in every photo, the residual follows, and the fit can be had again."""
    go(page, story, "pose/1")
    stage = page.locator(".stage")
    page.locator(".stage[data-residual]:not([data-residual=''])").wait_for()
    fitted = float(stage.get_attribute("data-residual"))
    tab_to(page, "Move the head")
    page.keyboard.press("Enter")
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("q")
    page.get_by_role("button", name="As it was fitted").and_(page.locator(":enabled")).wait_for()
    assert "[fitted_head]" in (story.folder / "capture.toml").read_text()
    page.wait_for_function(
        "before => Math.abs(document.querySelector('.stage').dataset.residual - before) > 1",
        arg=fitted,
    )
    tab_to(page, "As it was fitted")
    page.keyboard.press("Enter")
    page.get_by_role("button", name="As it was fitted").and_(page.locator(":disabled")).wait_for()
    assert stage.get_attribute("data-residual") == f"{fitted:.2f}"


def test_photos_change_places_by_keys(page: Any, story: Any) -> None:
    """A photo goes on in the turn and back again, and the keyboard goes with it."""
    step(page, "pose")
    page.get_by_role("button", name="Photo 2 later").wait_for(timeout=1000 * SLOW_S)
    tab_to(page, "Photo 2 later")
    page.keyboard.press("Enter")
    moved = "(name) => document.activeElement.ariaLabel?.startsWith(name)"
    page.wait_for_function(moved, arg="Photo 3 later")
    kept = json.loads((story.folder / "studio.json").read_text())["photos"]
    assert [photo["id"] for photo in kept[:3]] == [1, 3, 2]
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Enter")
    page.wait_for_function(moved, arg="Photo 2 earlier")


def test_the_hair_moves(page: Any, story: Any) -> None:
    """The hair hangs still without wind, moves in wind, keeps its lengths, and settles again."""
    go(page, story, "hair")
    page.locator("#hair[data-frames]").wait_for()
    still, blown, stretched, settled = page.evaluate(MEASURE_MOTION)
    assert still < 1e-3
    assert blown > 5e-3
    assert stretched < 1e-3
    assert settled < 2e-3


def test_hair_at_rest_is_drawn_once(page: Any, story: Any) -> None:
    """Hair that hangs still is drawn by all strands and then no more, until the view turns."""
    go(page, story, "hair")
    page.locator("#hair[data-skin]").wait_for()
    view = "document.querySelector('#hair').hairView"
    page.wait_for_function(f"() => {view}.drawn === 1")
    page.evaluate(f"""() => {{
      const draw = {view}.drawHair;
      window.pictures = 0;
      {view}.drawHair = function (...all) {{ window.pictures += 1; draw.apply(this, all); }};
    }}""")
    frames = int(page.locator("#hair").get_attribute("data-frames"))
    page.wait_for_function(f"() => document.querySelector('#hair').dataset.frames > {frames + 5}")
    assert page.evaluate("window.pictures") == 0
    page.evaluate(f"{view}.azimuth += 0.3")
    page.wait_for_function(f"() => window.pictures > 1 && {view}.drawn === 1")


def test_hair_that_comes_late_is_not_drawn_over_another_page(page: Any, story: Any) -> None:
    """Who leaves the page of the hair before it is read sees what was asked for instead."""
    held: list[Any] = []
    page.route("**/api/result/hair*", lambda route: held.append(route))
    go(page, story, "hair")
    page.wait_for_timeout(100)
    while not held:
        page.wait_for_timeout(20)
    go(page, story, "photos")
    page.locator(".card").first.wait_for()
    for route in held:
        with page.expect_event("requestfinished"):
            route.continue_()
    page.wait_for_timeout(500)
    assert page.locator(".card").count()
    assert not page.locator("#hair").count()


def test_a_strand_is_held_by_keys(page: Any, story: Any) -> None:
    """P takes a strand of the hair, which has the photos' skin below it, and lets it go."""
    go(page, story, "hair")
    page.locator("#hair[data-skin]").wait_for()
    tab_to(page, "Hair on a head")
    held = "document.querySelector('#hair').hairMotion.held"
    page.keyboard.press("p")
    before = page.evaluate(f"{held}.at")
    page.keyboard.press("ArrowRight")
    assert page.evaluate(f"{held}.at") != before
    page.keyboard.press("p")
    assert page.evaluate(held) is None


def test_every_format_is_downloaded(page: Any, story: Any, tmp_path: Path) -> None:
    """Every format comes from the page, and what hairkit reads is read.

    USD comes with the picture of the skin, cards with theirs.
    """
    go(page, story, "hair")
    page.locator("a[download='groom.npz']").wait_for()
    offered = page.locator("a[download]").all()
    names = [link.get_attribute("download") for link in offered]
    assert {"groom.apx", "groom.npz", "groom-unreal.zip", "result.html"} < set(names)
    for link, name in zip(offered, names, strict=True):
        path = tmp_path / name
        given = download(page, link, path)
        assert given in (name, f"{name}.zip")
        if given != name:
            shutil.unpack_archive(path, tmp_path / "several", "zip")
            path = tmp_path / "several" / name
        assert path.stat().st_size > LEAST_FILE
        if not name.endswith(WRITTEN_ONLY):
            assert main(["info", str(path)]) == 0, name
    assert (tmp_path / "several" / "groom.albedo.jpg").is_file()
    with zipfile.ZipFile(tmp_path / "groom-maya.zip") as archive:
        assert archive.namelist() == [f"maya/{file.name}" for file in ENGINES["maya"]]
    made = (story.folder / "result" / "groom.apx").read_bytes()
    assert (tmp_path / "groom.apx").read_bytes() == made


def test_the_result_moves_without_a_server(
    page: Any, story: Any, browser: Any, tmp_path: Path
) -> None:
    """`result.html` shows moving hair and asks for nothing."""
    go(page, story, "hair")
    download(page, page.get_by_text("Save result.html"), tmp_path / "result.html")
    go(page, story, "photos")  # where no hair is drawn beside that of the file
    alone = browser.new_page()
    asked: list[str] = []
    alone.on("request", lambda request: asked.append(request.url))
    alone.on("pageerror", lambda error: page.trouble.append(str(error)))
    alone.goto((tmp_path / "result.html").as_uri(), timeout=1000 * SLOW_S)
    alone.locator("#hair[data-skin]").wait_for(timeout=1000 * SLOW_S)
    assert alone.evaluate("document.querySelector('#hair').hairMotion.count") > 0
    assert asked == [(tmp_path / "result.html").as_uri()]
    alone.close()


def download(page: Any, link: Any, path: Path) -> str:
    """Save what a link of the page downloads, which the keyboard follows; return its name."""
    link.focus()
    with page.expect_download(timeout=1000 * SLOW_S) as caught:
        page.keyboard.press("Enter")
    caught.value.save_as(path)
    return str(caught.value.suggested_filename)
