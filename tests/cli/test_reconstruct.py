"""`hairkit reconstruct`: what it prints, and that nothing breaks it."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture, write_grey
from waiting import wait_for

from hairkit.cli import main
from hairkit.head_model import photo_skin


@pytest.fixture
def words(tmp_path: Path) -> list[str]:
    """A command line that reconstructs the small capture with the test plugin."""
    recipe = tmp_path / "ball.toml"
    recipe.write_text(RECIPE)
    capture = write_capture(tmp_path / "capture", masks=True)
    return [
        "reconstruct", str(capture), "-o", str(tmp_path / "out"), "--recipe", str(recipe),
        "--plugin", str(PLUGIN_FILE), "--guides", "30", "--no-sheet",
    ]  # fmt: skip


def start(words: list[str]) -> subprocess.Popen[str]:
    """Start hairkit as a process of its own, with skins as small as here."""
    code = (
        "import signal, sys\nfrom hairkit.cli import main\n"
        "from hairkit.head_model import photo_skin\n"
        f"photo_skin.SIZE, photo_skin.COARSE = {photo_skin.SIZE}, {photo_skin.COARSE}\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored in background jobs
        "sys.exit(main())"
    )
    return subprocess.Popen(
        [sys.executable, "-c", code, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )


def results(out: Path) -> dict[str, bytes]:
    """The content of what was made, log and record apart."""
    timed = ("hairkit.log", "run.json")
    return {p.name: p.read_bytes() for p in out.glob("*") if p.is_file() and p.name not in timed}


def test_results_on_stdout_progress_on_stderr(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Files and figures are printed; stages are told on stderr, unless --quiet."""
    words.remove("--no-sheet")
    assert main(words) == 0
    printed = capsys.readouterr()
    assert printed.out.startswith("30 guides of 30 roots, mean length 3.0 cm")
    for name in ("groom.ball", "contact_sheet.png"):
        assert str(tmp_path / "out" / name) in printed.out
    told = [line.split()[0] for line in printed.err.splitlines()]
    assert told.index("skin") < told.index("ball_plugin")
    told.remove("skin")  # photographed beside hull, field and track, and may end after them
    assert told[told.index("track") + 1 :][:2] == ["ball_plugin", "sheet"]
    assert told[-1] in ("green", "amber", "red")
    assert "\nhealth: " in printed.out
    assert main([*words, "--no-sheet", "--quiet"]) == 0
    assert capsys.readouterr().err == ""


def test_json_is_for_machines(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """With --json stdout is one JSON document, and a second run says what it has kept."""
    for reused in (False, True):
        assert main([*words, "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        assert document["strands"] == document["roots"] == 30
        assert Path(document["groom"]).is_file()
        kept = {s["stage"]: s["reused"] for s in document["stages"] if s["stage"] != "ball_plugin"}
        assert set(kept.values()) == {reused}
    assert main([*words, "--json", "--no-cache"]) == 0
    assert not any(s["reused"] for s in json.loads(capsys.readouterr().out)["stages"])


def test_settings_reach_the_plugin(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """--set, --guides and --seed change what is made."""
    assert main([*words, "--json", "--set", "ball_plugin.length=0.07", "--guides", "11"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["strands"] == 11
    assert document["mean_length_m"] == pytest.approx(0.07, abs=1e-3)


def empty_mask(folder: Path) -> None:
    write_grey(folder / "masks" / "4_back.png", np.zeros((128, 96), np.uint8))


WRONG = {
    "no such file": (shutil.rmtree, []),
    "0 photos, expected 1 to 36": (
        lambda f: [p.unlink() for p in (f / "photos").glob("*")],
        [],
    ),
    "not a picture": (lambda f: (f / "photos" / "4_back.png").write_text("hello"), []),
    "no pixel is marked as hair": (empty_mask, ["--set", "segment=mask_files"]),
    "no recipe 'best'": (None, ["--recipe", "best"]),
    "no plugin named 'x' implements 'orient'": (None, ["--set", "orient=x"]),
    "no option 'size'": (None, ["--set", "ball_plugin.size=3"]),
    "delay is 'x', expected a number from 0.0 to 60.0": (None, ["--set", "ball_plugin.delay=x"]),
    "delay is '99', expected": (None, ["--set", "ball_plugin.delay=99"]),
    "0 guides, expected 1": (None, ["--guides", "0"]),
    "invalid int value: 'many'": (None, ["--guides", "many"]),
    "--max-edge is 3": (None, ["--max-edge", "3"]),
    "either photos or --sample": (None, ["--sample"]),
    "none.py: no such file": (None, ["--plugin", "none.py"]),
    "not a folder": (lambda f: (f.parent / "out").write_text("mine"), []),
    "did you mean '--guides'": (None, ["--guide", "3"]),
}


@pytest.mark.parametrize("reason", WRONG)
def test_wrong_input_gets_one_line_and_exit_code_2(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], reason: str
) -> None:
    """Whatever is wrong, one line on stderr says what, and no result is left."""
    spoil, settings = WRONG[reason]
    if spoil is not None:
        spoil(tmp_path / "capture")
    try:
        code = main([*words, *settings, "--quiet"])
    except SystemExit as leaving:
        code = leaving.code
    printed = capsys.readouterr()
    assert code == 2
    assert reason in printed.err
    assert printed.err.count("\n") == 1
    assert printed.out == ""
    assert not (tmp_path / "out" / "groom.npz").exists()
    assert not list(tmp_path.rglob("*.part"))


def test_ctrl_c_is_one_line(words: list[str], tmp_path: Path) -> None:
    """SIGINT ends the run at once with exit code 2; the next run goes on and ends the same."""
    process = start([*words, "--set", "ball_plugin.delay=0.4"])
    wait_for(tmp_path / "out" / "work", "segment-*.npz")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert process.returncode == 2, err
    assert err.splitlines()[-1].startswith("hairkit: interrupted")
    assert "Traceback" not in err
    assert out == ""
    assert not results(tmp_path / "out")
    assert main([*words, "--quiet"]) == 0
    assert main([*words[:3], str(tmp_path / "whole"), *words[4:], "--quiet"]) == 0
    assert results(tmp_path / "out") == results(tmp_path / "whole")


def test_killing_at_any_moment_does_no_harm(words: list[str], tmp_path: Path) -> None:
    """After SIGKILL at random moments a last run gives the files of a run that nobody killed."""
    assert main([*words[:3], str(tmp_path / "whole"), *words[4:], "--quiet"]) == 0
    moments = random.Random(0)
    for _ in range(2):
        process = start([*words, "--set", "ball_plugin.delay=0.02"])
        wait_for(tmp_path / "out" / "work", ".lock")
        time.sleep(moments.uniform(0.0, 0.3))
        process.kill()
        process.communicate()
        (tmp_path / "out" / "work" / ".lock").unlink()
    assert main([*words, "--set", "ball_plugin.delay=0.02", "--quiet"]) == 0
    assert results(tmp_path / "out") == results(tmp_path / "whole")
    assert not list((tmp_path / "out").rglob("*.part"))


def test_two_runs_in_one_folder_do_not_corrupt_each_other(words: list[str], tmp_path: Path) -> None:
    """Started together, both end well, and the files are those of a single run."""
    both = [start([*words, "--set", "ball_plugin.delay=0.05"]) for _ in range(2)]
    for process in both:
        assert process.communicate(timeout=60)[0]
        assert process.returncode == 0
    assert main([*words[:3], str(tmp_path / "whole"), *words[4:], "--quiet"]) == 0
    assert results(tmp_path / "out") == results(tmp_path / "whole")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 400 KB, where the system lets us mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    command = [mount or "mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(disk)]
    if mount is None or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("no disk can be mounted here: needs root")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


def test_a_disk_that_is_really_full_is_one_line(
    words: list[str], small_disk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On a disk without room the line names the file and the cure; nothing is half-written."""
    assert main([*words[:3], str(small_disk / "out"), *words[4:], "--quiet"]) == 2
    printed = capsys.readouterr().err
    assert "No space left on device; free some space" in printed
    assert str(small_disk) in printed
    assert printed.count("\n") == 1
    assert not list(small_disk.rglob("*.part"))
    assert not (small_disk / "out" / "groom.npz").exists()
