"""`--set` has one grammar in every verb: plugin.option=value, or option=value where clear."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

from hairkit.cli import main
from hairkit.cli.settings import split_settings
from hairkit.errors import OptionError
from hairkit.manager import Manager
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache

VERBS = {
    "reconstruct": ["capture", "-o", "out", "--recipe", "ball.toml", "--no-sheet", "--quiet"],
    "export": ["bare.data", "-o", "back.npz"],
    "convert": ["bare.data", "back.npz"],
    "info": ["bare.data"],
    "render": ["bare.data", "-o", "picture.png", "--size", "64x48", "--hairs", "200"],
    "simulate": ["bare.data", "-o", "cache.npz", "--frames", "2", "--quiet", "--using", "rods"],
    "view": ["bare.data", "--headless", "--script", "steps.toml", "--simulator", "none"],
}
"""A command line of every verb with `--set` that reads a file whose unit must be stated."""
FILE_VERBS = sorted(set(VERBS) - {"reconstruct"})


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the commands name, not to be changed."""
    folder = tmp_path_factory.mktemp("inputs")
    write_capture(folder / "capture")
    (folder / "ball.toml").write_text(RECIPE)
    (folder / "steps.toml").write_text("hairs = 100\n")
    bristle_groom().save(folder / "groom.npz")
    words = [str(folder / "groom.npz"), "-o", str(folder / "bare.data"), "--set", "scale=0.01"]
    assert main(["export", *words]) == 0
    return folder


@pytest.fixture
def folder(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the folder with what the commands name; it is the current one."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(inputs, tmp_path, dirs_exist_ok=True)
    return tmp_path


def command(verb: str, *settings: str) -> list[str]:
    """Return a verb's command line with settings."""
    plugin = ["--plugin", str(PLUGIN_FILE)] if verb == "reconstruct" else []
    return [verb, *VERBS[verb], *plugin, *(word for text in settings for word in ("--set", text))]


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("text", ["x", "=3", ".x=3", "rods.=3", "a.b"])
def test_a_setting_of_another_form_is_refused_alike(
    verb: str, text: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every verb repeats the text and says the one form."""
    capsys.readouterr()
    assert main(command(verb, text)) == 2
    assert capsys.readouterr().err == f"hairkit: --set {text}: expected plugin.option=value\n"


@pytest.mark.parametrize("verb", VERBS)
def test_a_plugin_that_is_not_used_is_refused(
    verb: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The line names the setting and what could have been meant."""
    capsys.readouterr()
    assert main(command(verb, "nobody.x=3")) == 2
    line = capsys.readouterr().err
    assert "--set nobody.x=3: " in line
    assert "no plugin 'nobody'; valid: " in line


@pytest.mark.parametrize("verb", FILE_VERBS)
@pytest.mark.parametrize("target", ["scale", "usc_data.scale", "reader.scale"])
def test_a_reader_takes_its_option_in_every_verb(verb: str, target: str, folder: Path) -> None:
    """Bare, by the plugin's name and by its role the option reaches the plugin that reads."""
    assert main(command(verb, f"{target}=0.01")) == 0


def test_the_value_is_used(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Twice the unit is twice the length."""
    capsys.readouterr()
    lengths = []
    for scale in ("0.01", "0.02"):
        assert main([*command("info", f"scale={scale}"), "--json"]) == 0
        lengths.append(json.loads(capsys.readouterr().out)["mean_length_m"])
    assert lengths[1] == pytest.approx(2 * lengths[0], rel=1e-3)


def test_a_recipe_takes_options_and_plugins(folder: Path) -> None:
    """`plugin.option=value` and `stage=plugin` go together."""
    settings = ["ball_plugin.length=0.07", "orient=ball_plugin", "export=none"]
    assert main(command("reconstruct", *settings)) == 0
    assert not (folder / "out" / "groom.ball").exists()


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_set_alike(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The help has the same metavar and begins with the same words."""
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert "--set P.X=V set an option: plugin.option=V, or" in text


def test_an_option_of_two_plugins_must_say_whose_it_is(manager: Manager) -> None:
    """Both are named; a plugin in two roles takes the value in both."""
    plugins = {"reader": "ply", "writer": "obj"}
    with pytest.raises(OptionError, match=r"write ply\.axis or obj\.axis"):
        split_settings(manager, plugins, ["axis=z_up_metres"])
    assert split_settings(manager, plugins, ["obj.axis=unreal"]) == {
        "reader": {},
        "writer": {"axis": "unreal"},
    }
    both = split_settings(manager, {"reader": "ply", "writer": "ply"}, ["axis=unreal"])
    assert both == {"reader": {"axis": "unreal"}, "writer": {"axis": "unreal"}}
    with pytest.raises(OptionError, match=r"no option 'axes' .did you mean 'axis'"):
        split_settings(manager, plugins, ["axes=unreal"])


@pytest.mark.parametrize("edge", ["0", "-5", "127", "8193"])
def test_an_edge_out_of_range_is_refused(
    edge: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """0 is a number of pixels like any other, and too small."""
    capsys.readouterr()
    assert main([*command("reconstruct"), "--max-edge", edge]) == 2
    line = f"hairkit: --max-edge is {edge}, expected 128 to 8192 pixels\n"
    assert capsys.readouterr().err == line


@pytest.fixture
def turning(folder: Path) -> PointCache:
    """A simulation in cache.npz of two frames: groom and head turn by 30 degrees."""
    turn, angle = np.eye(4), np.radians(30)
    turn[:3, :3] = [
        [np.cos(angle), 0, np.sin(angle)],
        [0, 1, 0],
        [-np.sin(angle), 0, np.cos(angle)],
    ]
    points = Groom.load("groom.npz").strands.points
    frames = np.stack([points, (points @ turn[:3, :3].T).astype(np.float32)])
    cache = PointCache(frames, np.array([0.0, 0.1]), np.stack([np.eye(4), turn]))
    cache.save("cache.npz")
    return cache


def test_info_knows_a_simulation(turning: PointCache, capsys: pytest.CaptureFixture[str]) -> None:
    """Frames, points, times and the head's turn are printed."""
    capsys.readouterr()
    assert main(["info", "cache.npz", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["kind"] == "simulation"
    assert (facts["frames"], facts["points"]) == turning.points.shape[:2]
    assert facts["frames_per_second"] == 10
    assert facts["largest_head_turn_deg"] == pytest.approx(30)


def test_render_draws_a_frame_of_a_simulation(
    turning: PointCache, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first frame is the groom itself, the last another picture; there is no third."""
    words = ["render", "groom.npz", "--size", "96x72", "--hairs", "300", "--camera", "0,0"]
    assert main([*words, "-o", "rest.png"]) == 0
    assert main([*words, "-o", "first.png", "--cache", "cache.npz"]) == 0
    assert main([*words, "-o", "last.png", "--cache", "cache.npz", "--frame", "-1"]) == 0
    assert Path("rest.png").read_bytes() == Path("first.png").read_bytes()
    assert Path("rest.png").read_bytes() != Path("last.png").read_bytes()
    capsys.readouterr()
    assert main([*words, "-o", "x.png", "--cache", "cache.npz", "--frame", "2"]) == 2
    assert "frame 2 of a cache of 2 frames" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [["render", "cache.npz", "-o", "x.png"], ["export", "cache.npz", "-o", "x.ply"]]
)
def test_a_simulation_is_no_groom(
    words: list[str], turning: PointCache, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line says what to pass instead."""
    capsys.readouterr()
    assert main(words) == 2
    assert "hairkit render GROOM --cache cache.npz" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        ["--set", "pbd.bend=0.5"],
        ["--using", "pbd", "--set", "pbd.cohesion=2"],
        ["--using", "pbd", "--set", "cohesion=2"],
        ["--using", "pbd", "--set", "pbd.bend=0.5"],
    ],
)
def test_options_of_what_was_called_otherwise_name_it(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`pbd` was what is `rods` now: its options are refused with one line that says so."""
    bristle_groom().save(tmp_path / "groom.npz")
    out = str(tmp_path / "cache.npz")
    assert main(["simulate", str(tmp_path / "groom.npz"), "-o", out, "--frames", "2", *words]) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.endswith("what was pbd is rods since 0.3: write rods")
