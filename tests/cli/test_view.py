"""Laws of `hairkit view`."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from hairkit.cli import main
from hairkit.testing import bristle_groom
from hairkit.viewer.actions.actions import ACTIONS


@pytest.fixture
def groom_path(tmp_path: Path) -> Path:
    """A groom on disk."""
    bristle_groom().save(tmp_path / "groom.npz")
    return tmp_path / "groom.npz"


def view(*words: object) -> int:
    """Run the verb on hair that stands still."""
    return main(["view", *map(str, words), "--simulator", "none"])


def test_a_script_without_a_window_prints_the_pictures_it_wrote(
    groom_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Names on stdout, the renderer on stderr, pictures of the size asked for."""
    script = tmp_path / "steps.toml"
    script.write_text("hairs = 300\n[[steps]]\ndo = 'screenshot'\nfile = 'a.png'\n")
    out = tmp_path / "out"
    words = (groom_path, "--headless", "--script", script, "--out", out, "--size", "96x64")
    assert view(*words) == 0
    said = capsys.readouterr()
    assert said.out == f"{out / 'a.png'}\n"
    assert "OpenGL" in said.err
    picture = cv2.imread(str(out / "a.png"))
    assert picture is not None
    assert picture.shape == (64, 96, 3)


def test_films_are_among_the_files_that_are_named(
    groom_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A recording is printed once, with the pictures; one that holds nothing is not."""
    script = tmp_path / "steps.toml"
    steps = ["do = 'record'\nfile = 'film'", "do = 'run'\nseconds = 0.1", "do = 'record'"]
    script.write_text("size = [64, 48]\n" + "".join(f"[[steps]]\n{step}\n" for step in steps))
    assert view(groom_path, "--headless", "--script", script, "--out", tmp_path / "out") == 0
    assert capsys.readouterr().out == f"{tmp_path / 'out' / 'film'}\n"
    assert len(list((tmp_path / "out" / "film").glob("*.png"))) == 3


def test_a_folder_of_results_is_opened_by_its_name(groom_path: Path, tmp_path: Path) -> None:
    """The folder stands for the groom in it."""
    script = tmp_path / "steps.toml"
    script.write_text("size = [64, 48]\n[[steps]]\ndo = 'screenshot'\nfile = 'b.png'\n")
    assert view(groom_path.parent, "--headless", "--script", script, "--out", tmp_path) == 0
    assert (tmp_path / "b.png").is_file()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--headless",), "--headless needs --script"),
        (("--headless", "--script", "nothing.toml"), "nothing.toml: no such file"),
        (("--out", "x"), "--out is for --headless"),
        (("--size", "big"), "--size is 'big'"),
        (("--budget", "-1"), "--budget is -1.0"),
        (("--hairs", "-4"), "--hairs is -4"),
        (("--capture", "nowhere"), "nowhere: no such file, expected a photo or a folder of photos"),
        (("--set", "drag"), "--set drag: expected plugin.option=value"),
        (
            ("--headless", "--script", "S", "--set", "gabor.angles=3"),
            "--set gabor.angles=3: this command uses no plugin 'gabor'",
        ),
        (("--script", "nothing.toml"), "nothing.toml: no such file"),
    ],
)
def test_mistakes_give_one_line(
    groom_path: Path, words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2 and one line that says what was wanted."""
    script = groom_path.with_name("steps.toml")
    script.write_text("")
    assert view(groom_path, *(str(script) if word == "S" else word for word in words)) == 2
    said = capsys.readouterr().err.strip()
    assert message in said
    assert "\n" not in said.replace(f"{renderer_line(said)}\n", "")


def test_what_is_no_groom_is_refused(
    tmp_path: Path, groom_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Missing files, folders without a groom and unknown simulators are named."""
    script = tmp_path / "steps.toml"
    script.write_text("")
    empty = tmp_path / "empty"
    empty.mkdir()
    common = ("--headless", "--script", script)
    for path, message in ((tmp_path / "no.npz", "no such file"), (empty, "no groom.npz")):
        assert view(path, *common) == 2
        assert message in capsys.readouterr().err
    assert main(["view", str(groom_path), *map(str, common), "--simulator", "magic"]) == 2
    assert "no simulator 'magic'" in capsys.readouterr().err


def renderer_line(said: str) -> str:
    """Return the line that names the renderer, empty where there is none."""
    return next((line for line in said.splitlines() if "OpenGL" in line), "-")


def test_options_of_the_file_are_for_the_plugin_that_reads_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Hair in other units is refused with the cure, and the cure works in the same command."""
    turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    points = [f"v {30 * np.cos(t)} {30 * k} {30 * np.sin(t)}" for t in turns for k in range(3)]
    lines = [f"l {3 * k + 1} {3 * k + 2} {3 * k + 3}" for k in range(12)]
    (tmp_path / "hair.obj").write_text("\n".join(points + lines) + "\n")
    (tmp_path / "s.toml").write_text("size = [64, 48]\n[[steps]]\ndo = 'screenshot'\n")
    words = [tmp_path / "hair.obj", "--headless", "--script", tmp_path / "s.toml"]
    assert view(*words, "--out", tmp_path) == 2
    assert "scale=" in capsys.readouterr().err
    assert view(*words, "--out", tmp_path, "--set", "scale=0.002") == 0
    assert (tmp_path / "hairkit.png").is_file()


def test_a_file_that_no_plugin_reads_is_refused_before_a_window_opens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The line tells what can be read, whether there is a display or not."""
    (tmp_path / "notes.txt").write_text("hello")
    assert view(tmp_path / "notes.txt") == 2
    said = capsys.readouterr().err.strip()
    assert "no plugin reads this suffix" in said
    assert "\n" not in said


def test_the_actions_of_scripts_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    """Every action with its values, what has a default with that."""
    with pytest.raises(SystemExit) as left:
        main(["view", "--actions"])
    assert left.value.code == 0
    lines = capsys.readouterr().out.splitlines()
    assert "zoom factor: float" in lines
    assert "pause on: bool | None = None" in lines
    assert {line.split()[0] for line in lines if line[0] != " "} == set(ACTIONS)


def test_a_preset_of_the_window_is_taken(
    groom_path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its simulator and its options; one that is not there is named."""
    presets = groom_path.with_name("groom.presets.toml")
    presets.write_text("[heavy]\nsimulator = 'rods'\noptions = {drag = 7.0}\n")
    script = tmp_path / "steps.toml"
    keep = "[[steps]]\ndo = 'preset_save'\nname = 'again'\n"
    script.write_text(keep)
    words = ["view", str(groom_path), "--headless", "--script", str(script)]
    assert main([*words, "--preset", "heavy", "--set", "friction=0.3"]) == 0
    assert "drag" in presets.read_text().split("again")[1]
    assert "friction" in presets.read_text().split("again")[1]
    assert main([*words, "--preset", "light"]) == 2
    assert "no preset 'light'; valid: heavy, again" in capsys.readouterr().err


def test_without_a_display_one_line_says_what_to_do(groom_path: Path) -> None:
    """A machine without a screen is told of --headless."""
    code = (
        "import os, sys; os.environ.pop('DISPLAY', None); os.environ.pop('WAYLAND_DISPLAY', None);"
        "from hairkit.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code, "view", str(groom_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    lines = done.stderr.strip().splitlines()
    assert "no window" in lines[-1]
    assert "--headless" in lines[-1]
