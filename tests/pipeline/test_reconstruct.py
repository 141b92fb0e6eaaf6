"""The pipeline runs a recipe, keeps what it can, and ends the same however it is interrupted."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import ball_plugin
import numpy as np
import pytest
from ball import RECIPE
from hairkit_plugins import brushes

from hairkit import Capture, Groom, Mask, Roots, ScalpDistance, Strands, Waves, hookimpl
from hairkit.errors import InputError, PluginError, RenderError
from hairkit.manager import Manager
from hairkit.pipeline.recipe import parse_recipe
from hairkit.pipeline.reconstruct import export_paths, reconstruct
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.storage import to_arrays
from hairkit.testing import ball_head, turn_capture, turn_scene
from hairkit.types.chosen import Chosen, ChosenHair
from hairkit.types.edits import Brush, Edit, Edits
from hairkit.types.scene import read_cameras

STAGES = ["segment", "scene", "fit", "orient", "hull", "field", "track"]


def run(out: Path, *settings: str, extra: dict[str, object] | None = None, **choices: Any) -> Groom:
    """Reconstruct the small capture with the test plugin."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    for name, plugin in (extra or {}).items():
        manager.register(plugin, name)
    recipe = parse_recipe(RECIPE.encode(), "ball", "test").with_set(settings)
    capture = choices.pop("capture", None) or turn_capture()
    choices = {"guides": 40, "head": ball_head(), "sheet": False} | choices
    return reconstruct(capture, out, recipe, manager, **choices)


def ran(out: Path, *settings: str, **choices: Any) -> list[str]:
    """Reconstruct and return the stages that were run, each once."""
    ball_plugin.CALLS.clear()
    run(out, *settings, **choices)
    return sorted({call.partition(" ")[0] for call in ball_plugin.CALLS})


def files(out: Path) -> dict[str, bytes]:
    """The content of everything in the output folder but log and record, which hold times."""
    timed = ("hairkit.log", RECORD)
    return {p.name: p.read_bytes() for p in out.iterdir() if p.is_file() and p.name not in timed}


def figures(out: Path) -> list[tuple[str, float]]:
    """Return the figures of health of a run."""
    return [(figure.name, figure.value) for figure in read_record(out / RECORD).health]


def test_strokes_are_done_again_and_can_be_left_out(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Strokes change the strands alone; a stroke that reaches none is named; `edit` is a switch."""
    plain = run(tmp_path / "plain").strands
    trim = Edit(np.zeros((0, 3)), Brush("trim", amount=0.01))
    away = Edit(np.full((1, 3), 9.0), Brush("comb"))
    drawn = replace(turn_capture(), chosen=Chosen(edits=Edits((trim, away))))
    given = {"capture": drawn, "extra": {"brushes": brushes}}
    made = run(tmp_path / "out", "edit=brushes", **given).strands
    np.testing.assert_allclose(made.lengths(), 0.01, rtol=1e-3)
    assert "stroke 2 (comb) reaches no hair; it is kept" in caplog.text
    same, told = (figures(tmp_path / name) for name in ("plain", "out"))
    assert told == same  # photos judge what was made of them, not what was drawn over it
    assert ran(tmp_path / "out", "edit=brushes", **given) == ["export"]
    without = run(tmp_path / "out", "edit=none", **given).strands
    np.testing.assert_array_equal(without.points, plain.points)


def test_photos_become_a_groom_and_its_files(tmp_path: Path) -> None:
    """Every root grows a strand; groom, cameras, export and log lie in the folder."""
    groom = run(tmp_path / "out")
    assert len(groom.strands) == 40
    assert groom.head.torso is not None
    assert groom.head.torso.breadth == 1.1
    assert set(files(tmp_path / "out")) == {"groom.npz", "scene.json", "groom.ball"}
    kept = to_arrays(Groom.load(tmp_path / "out" / "groom.npz"))
    assert all(np.array_equal(array, kept[name]) for name, array in to_arrays(groom).items())
    log = (tmp_path / "out" / "hairkit.log").read_text()
    assert all(f"\n{stage} " in log for stage in [*STAGES, "ball_plugin"])
    assert "delay=0.0" in log


def test_two_runs_give_identical_files(tmp_path: Path) -> None:
    """Nothing of time, folder or threads is in the results."""
    run(tmp_path / "a", sheet=True)
    run(tmp_path / "b", sheet=True)
    assert "contact_sheet.png" in files(tmp_path / "a")
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_without_opengl_only_the_sheet_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rest is made, one line says why, and no sheet of another groom is left."""
    run(tmp_path)
    (tmp_path / "contact_sheet.png").write_bytes(b"of this groom")

    def refuse(*_: object) -> None:
        raise RenderError("no OpenGL 4.3 context")

    monkeypatch.setattr("hairkit.pipeline.contact_sheet.write_contact_sheet", refuse)
    run(tmp_path, sheet=True, seed=1)
    assert set(files(tmp_path)) == {"groom.npz", "scene.json", "groom.ball"}
    assert "no contact sheet: no OpenGL 4.3 context" in (tmp_path / "hairkit.log").read_text()


def test_cameras_are_for_the_photos_on_disk(tmp_path: Path) -> None:
    """Photos that were scaled down get the cameras of their own size."""
    views = tuple(
        type(view)(view.name, view.azimuth_deg, view.image, photo_size=(192, 256))
        for view in turn_capture().views
    )
    run(tmp_path, capture=Capture(views))
    names, cameras = read_cameras(tmp_path / "scene.json")
    point = np.array([0.02, 0.03, 0.01])
    assert names == turn_scene().names
    for small, large in zip(turn_scene().cameras, cameras, strict=True):
        assert large.project(point) == pytest.approx(2 * small.project(point))


def test_unchanged_stages_are_not_run_again(tmp_path: Path) -> None:
    """A second run only exports; the result is the same."""
    assert ran(tmp_path) == sorted([*STAGES, "export"])
    before = files(tmp_path)
    assert ran(tmp_path) == ["export"]
    assert files(tmp_path) == before
    assert ran(tmp_path, reuse=False) == sorted([*STAGES, "export"])


def test_what_is_chosen_replaces_what_was_found(tmp_path: Path) -> None:
    """Cameras follow the moved head, colour and curl are those chosen, and a tone is for `orient`;
    stages before them are not run again."""
    run(tmp_path)
    names, found = read_cameras(tmp_path / "scene.json")
    pose = np.diag([1.1, 1.1, 1.1, 1.0])
    pose[:3, 3] = (0.01, 0.02, 0.03)
    hair = ChosenHair("#ff0000", width_mm=0.2, curl_radius_mm=4.0, curl_pitch_mm=30.0)
    capture = replace(turn_capture(), chosen=Chosen(hair, pose))
    assert ran(tmp_path, capture=capture) == ["export", "field", "hull", "track"]
    groom = Groom.load(tmp_path / "groom.npz")
    assert groom.material.root_colour == pytest.approx([1, 0, 0])
    assert groom.material.width == pytest.approx(2e-4)
    assert (groom.material.curl_radius, groom.material.curl_pitch) == pytest.approx((4e-3, 3e-2))
    point = np.array([0.02, 0.03, 0.01])
    moved = pose[:3, :3] @ point + pose[:3, 3]
    for before, after in zip(found, read_cameras(tmp_path / "scene.json")[1], strict=True):
        assert after.project(point) == pytest.approx(before.project(moved))
    views = [replace(v, contrast=1.5 if k == 2 else 1.0) for k, v in enumerate(capture.views)]
    ball_plugin.CALLS.clear()
    run(tmp_path, capture=replace(capture, views=tuple(views)))
    assert [call for call in ball_plugin.CALLS if " " in call] == [f"orient {names[2]}"]


def test_what_stages_share_is_kept_and_handed_to_them(tmp_path: Path) -> None:
    """Waves and the scalp distance are results in the work folder, made once for all stages."""
    handed = {}

    class Tracker:
        @hookimpl
        def track(self, roots: Roots, waves: Waves, scalp_distance: ScalpDistance) -> Strands:
            handed.update(waves=waves, distance=scalp_distance)
            return ball_plugin.track(roots, ball_plugin.Options())

    run(tmp_path, "track=tracker", extra={"tracker": Tracker()})
    for name, value in handed.items():
        kept, given = np.load(tmp_path / "work" / f"{name}.npz"), to_arrays(value)
        assert all(np.array_equal(kept[key], given[key]) for key in given)
    run(tmp_path, "track=tracker", extra={"tracker": Tracker()}, guides=50)
    stages = read_record(tmp_path / RECORD).stages
    again = {stage.stage for stage in stages if not stage.reused}
    assert again == {"track", "ball_plugin"}


def test_what_depends_on_a_change_is_run_again(tmp_path: Path) -> None:
    """Roots change the strands only; a photo changes all; an option all stages of its plugin."""
    run(tmp_path)
    assert ran(tmp_path, guides=50) == ["export", "track"]
    assert ran(tmp_path, guides=50, seed=1) == ["export", "track"]
    assert ran(tmp_path, "fit=none", guides=50, seed=1) == ["export", "field", "hull", "track"]
    views = list(turn_capture().views)
    views[3] = type(views[3])(views[3].name, views[3].azimuth_deg, 255 - views[3].image)
    ball_plugin.CALLS.clear()
    run(tmp_path, "fit=none", guides=50, seed=1, capture=Capture(tuple(views)))
    steps = [call for call in ball_plugin.CALLS if " " in call]
    assert steps == ["segment back-left", "orient back-left"]
    assert ran(tmp_path, "ball_plugin.length=0.04") == sorted([*STAGES, "export"])


def test_the_plugins_own_file_is_part_of_the_digest(tmp_path: Path) -> None:
    """A plugin that is edited runs again, without a new version."""
    source = Path(ball_plugin.__file__).read_text()
    for text in (source, source + "\n# edited\n"):
        (tmp_path / "ball_plugin.py").write_text(text)
        manager = Manager.loaded([tmp_path / "ball_plugin.py"], autoload=False)
        recipe = parse_recipe(RECIPE.encode(), "ball", "test")
        reconstruct(
            turn_capture(), tmp_path / "out", recipe, manager,
            head=ball_head(), guides=40, sheet=False,
        )  # fmt: skip
        stages = read_record(tmp_path / "out" / RECORD).stages
        assert len(stages) > 2
        photos_alone = ("region", "frame")  # where no plugin finds faces or persons
        assert not any(stage.reused for stage in stages if stage.stage not in photos_alone)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of a run that nothing disturbs."""
    out = tmp_path_factory.mktemp("whole")
    run(out)
    return files(out)


@pytest.mark.parametrize("stage", [*STAGES, "export"])
def test_a_run_that_was_interrupted_goes_on_to_the_same_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: dict[str, bytes], stage: str
) -> None:
    """Ctrl-C in any stage leaves no result; the next run keeps what was done and ends the same."""
    original = ball_plugin._begin
    ball_plugin.CALLS.clear()

    def interrupted(name: str, *rest: Any) -> None:
        if name == stage:
            raise KeyboardInterrupt
        original(name, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(ball_plugin, "_begin", interrupted)
        with pytest.raises(KeyboardInterrupt):
            run(tmp_path / "out")
    if stage != "export":
        assert not (tmp_path / "out" / "groom.npz").exists()
    done = {call for call in ball_plugin.CALLS if call in STAGES}
    ball_plugin.CALLS.clear()
    run(tmp_path / "out")
    assert not done & set(ball_plugin.CALLS)
    assert files(tmp_path / "out") == whole


@pytest.mark.parametrize("writes", [0, 5, 12, 20, 21, 22, 23])
def test_a_full_disk_leaves_nothing_half_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: dict[str, bytes], writes: int
) -> None:
    """Wherever the disk fills up, an error names a file, and the next run is whole."""
    count, original = iter(range(1000)), Path.open

    def nearly_full(path: Path, mode: str = "r", *rest: Any, **words: Any) -> Any:
        file = original(path, mode, *rest, **words)
        return file if "w" not in mode or next(count) < writes else FullFile(file)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", nearly_full)
        with pytest.raises(OSError, match="No space left") as caught:
            run(tmp_path / "out")
    assert str(tmp_path / "out") in str(caught.value.filename)
    assert not list((tmp_path / "out").rglob("*.part"))
    run(tmp_path / "out")
    assert files(tmp_path / "out") == whole


class FullFile:
    """A file on a disk without room."""

    def __init__(self, file: Any) -> None:
        self.file = file

    def __enter__(self) -> FullFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()

    def write(self, _: object) -> None:
        """Fail as the system does."""
        raise OSError(errno.ENOSPC, "No space left on device")


class Wrong:
    """A plugin that answers for one stage in a way of its own."""

    def __init__(self, answer: Any) -> None:
        self.answer = answer

    @hookimpl
    def segment(self, view: Any) -> Any:
        return self.answer(view)


def fails(_: Any) -> Any:
    raise ZeroDivisionError("of my own\nmaking")


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (fails, " failed in 'segment' of view 'front': ZeroDivisionError: of my own"),
        (lambda _: None, " returned nothing from 'segment' of view 'front'"),
        (lambda _: 3, ", 'segment' of view 'front': returned int, expected Mask"),
        (
            lambda _: Mask(np.full((4, 5), 255), True),
            ", 'segment' of view 'front': the mask has 5 x 4 pixels, expected 96 x 128",
        ),
    ],
)
def test_a_wrong_plugin_is_named(tmp_path: Path, answer: Any, reason: str) -> None:
    """A plugin that raises or answers nonsense gives one line, and no groom."""
    with pytest.raises(PluginError, match=f"plugin 'wrong' of this program{reason}") as caught:
        run(tmp_path, "segment=wrong", extra={"wrong": Wrong(answer)})
    assert "\n" not in str(caught.value)
    assert not files(tmp_path)


def test_wrong_settings_touch_nothing(tmp_path: Path) -> None:
    """A wrong recipe or number of guides is refused before the folder is made."""
    for settings, choices, reason in [
        (["segment=nobody"], {}, "no plugin named 'nobody'"),
        (["ball_plugin.size=3"], {}, "no option 'size'"),
        (["ball_plugin.delay=-3"], {}, "delay is '-3', expected"),
        ([], {"guides": 0}, "0 guides, expected 1 to"),
        ([], {"guides": 10**9}, "guides, expected 1 to"),
    ]:
        with pytest.raises((PluginError, InputError), match=reason):
            run(tmp_path / "out", *settings, **choices)
        assert not (tmp_path / "out").exists()


class Listener:
    """A plugin that only listens."""

    def __init__(self) -> None:
        self.heard: list[tuple[str, Any]] = []

    @hookimpl
    def stage_finished(self, stage: str, seconds: float, result: Any) -> None:
        assert seconds >= 0
        self.heard.append((stage, result))

    @hookimpl
    def groom_ready(self, groom: Groom) -> None:
        self.heard.append(("groom", groom))


@pytest.mark.parametrize("at_fault", ["out", "photo"])
def test_names_that_are_not_utf8_are_refused_before_any_work(at_fault: str, tmp_path: Path) -> None:
    """No stage runs and nothing is written, whether a photo or the results have such a name."""
    bad = os.fsdecode(b"IMG\xff.jpg")
    (tmp_path / bad).write_bytes(b"")
    capture = turn_capture()
    if at_fault == "photo":
        first = replace(capture.views[0], photo_path=tmp_path / bad)
        capture = replace(capture, views=(first, *capture.views[1:]))
    out = tmp_path / "out" / (bad if at_fault == "out" else "x")
    ball_plugin.CALLS.clear()
    with pytest.raises(InputError, match="not UTF-8"):
        run(out, capture=capture)
    assert ball_plugin.CALLS == []
    assert not out.parent.exists()


def test_listeners_hear_every_stage_once(tmp_path: Path) -> None:
    """Each stage is told once, with its result, those of single views as a tuple."""
    listener = Listener()
    groom = run(tmp_path, extra={"listener": listener})
    heard = dict(listener.heard)
    assert len(listener.heard) == len(heard) == 8
    assert heard["groom"] is groom
    assert [type(mask) for mask in heard["segment"]] == [Mask] * 8
    assert len(heard["orient"]) == 8


def test_an_exporter_without_suffix_gets_its_name() -> None:
    """Exports are named after the plugin's first ending, or else after the plugin."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    recipe = parse_recipe(RECIPE.encode(), "ball", "test")
    [(choice, path)] = export_paths("out", recipe, manager)
    assert (choice.plugin, path) == ("ball_plugin", Path("out/groom.ball"))
    assert export_paths("out", recipe.with_set(["export=none"]), manager) == ()
