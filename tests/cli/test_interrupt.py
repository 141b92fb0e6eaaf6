"""Laws of Ctrl-C: the first lets what runs end and says so, the second ends the process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture, write_groom_file
from waiting import wait_for

SECONDS = 30
"""Longest that a process may take to answer on a busy machine."""

PLUGIN = '''
"""Hangs for ever in one hook."""
import time
from pathlib import Path
from hairkit import hookimpl
from hairkit.io.file_format import FileFormat

FORMAT = FileFormat("Hang", (".hang",))

def hang():
    (Path(__file__).parent / "hangs").touch()
    WAY

@hookimpl
def HOOK(ARGUMENTS):
    hang()
'''
LOOP = "while True: pass"
SLEEP = "time.sleep(1e6)"
STUBBORN = """
    while True:
        try:
            time.sleep(1e6)
        except BaseException:
            pass
"""
RECONSTRUCT = "reconstruct {capture} -o {out} --recipe {recipe} --plugin {ball} --no-sheet"
PLACES = {
    "a loop in a thread": ("orient", "view", LOOP, RECONSTRUCT + " --set orient=hang"),
    "C code in a thread": ("segment", "view", SLEEP, RECONSTRUCT + " --set segment=hang"),
    "a stage that catches all": ("build_hull", "scene", STUBBORN, RECONSTRUCT + " --set hull=hang"),
    "an export": ("export_groom", "groom", STUBBORN, "export {groom} -o {out}.hang"),
    "an import": ("import_groom", "path", STUBBORN, "convert {plugin} {out}.npz --from hang"),
}
"""Where a plugin hangs: its hook, an argument of it, how it hangs, and the command."""


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """A small capture, its recipe and a groom."""
    recipe = tmp_path / "ball.toml"
    recipe.write_text(RECIPE)
    return {
        "capture": write_capture(tmp_path / "capture", masks=True),
        "recipe": recipe,
        "ball": PLUGIN_FILE,
        "groom": write_groom_file(tmp_path / "groom.npz"),
        "out": tmp_path / "out",
        "plugin": tmp_path / "hang.py",
    }


def start(words: list[str]) -> subprocess.Popen[str]:
    """Start the command line as its entry point does, with Ctrl-C as in a terminal."""
    code = (
        "import signal, sys\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # ignored in background jobs
        "from hairkit.__main__ import main\n"
        "sys.exit(main())"
    )
    return subprocess.Popen(
        [sys.executable, "-c", code, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )


@pytest.mark.parametrize("place", PLACES)
def test_the_second_ctrl_c_ends_a_plugin_that_hangs(
    place: str, files: dict[str, Path], tmp_path: Path
) -> None:
    """Wherever and however it hangs: exit code 130, no traceback, nothing half-written."""
    hook, argument, way, command = PLACES[place]
    text = PLUGIN.replace("HOOK", hook).replace("ARGUMENTS", argument).replace("WAY", way.strip())
    files["plugin"].write_text(text)
    words = command.format(**files).split()
    process = start([*words, "--plugin", str(files["plugin"])])
    wait_for(tmp_path, "hangs", SECONDS)
    process.send_signal(signal.SIGINT)
    assert process.stderr is not None
    said = ""
    while "stopping; press Ctrl-C again" not in said:
        line = process.stderr.readline()
        assert line, said
        said += line
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=SECONDS)
    assert process.returncode == 130, said + err
    assert "Traceback" not in said + err
    assert out == ""
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("codes", [(2,), (2, 130)], ids=["once", "until the process is gone"])
def test_the_first_ctrl_c_is_enough_for_a_plugin_that_listens(
    codes: tuple[int, ...], files: dict[str, Path], tmp_path: Path
) -> None:
    """One line and exit code 2; further ones, while Python ends, do not end it by the signal."""
    hook, argument, _, command = PLACES["an export"]
    text = PLUGIN.replace("HOOK", hook).replace("ARGUMENTS", argument).replace("WAY", SLEEP)
    files["plugin"].write_text(text)
    process = start([*command.format(**files).split(), "--plugin", str(files["plugin"])])
    wait_for(tmp_path, "hangs", SECONDS)
    process.send_signal(signal.SIGINT)
    assert process.stderr is not None
    assert process.stderr.readline().startswith("hairkit: interrupted")
    while len(codes) > 1 and process.poll() is None:
        process.send_signal(signal.SIGINT)
        time.sleep(0.001)
    out, err = process.communicate(timeout=SECONDS)
    assert process.returncode in codes
    assert len(codes) > 1 or (out, err) == ("", "")
