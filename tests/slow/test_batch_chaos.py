"""Laws of the program that lets all go wrong at once: it says what was lost, and what is equal."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

PROGRAM = Path(__file__).with_name("batch_chaos.py")


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The program as a module."""
    monkeypatch.syspath_prepend(str(PROGRAM.parent))
    import batch_chaos

    return batch_chaos


def test_the_quiet_batch_is_one_of_hairkit(program: Any, tmp_path: Path) -> None:
    """A batch with the poisonous plugin does good captures, and says how the others ended."""
    write_capture(tmp_path / "given" / "anna", masks=True)
    (tmp_path / "ball.toml").write_text(RECIPE)
    (tmp_path / "poison.py").write_text(program.POISON)
    args = SimpleNamespace(
        given=tmp_path / "given", captures=0, recipe=str(tmp_path / "ball.toml"),
        plugin=[str(PLUGIN_FILE)], set=["ball_plugin.delay=0.0"], time_limit=60.0, memory=1.0,
    )  # fmt: skip
    program.draw_captures(tmp_path / "captures", args)
    assert {path.name for path in (tmp_path / "captures").iterdir()} == {"anna", *program.BAD}
    only = ["--only", "anna", "--only", "eat", "--workers", "1"]
    said = program.run_batch(args, tmp_path, "quiet", only)
    assert (said["done"], said["failed"]) == (1, 1)
    assert any(text.startswith("eat: its process took 1.0") for text in said)
    assert not program.other_files(tmp_path / "quiet" / "anna", tmp_path / "quiet" / "anna")


def test_other_bytes_are_told(
    program: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A capture whose files differ or are missing does not count as equal."""
    for place, names in (("quiet", "abc"), ("chaos", "ab")):
        for name in names:
            (tmp_path / place / name).mkdir(parents=True)
            (tmp_path / place / name / "groom.npz").write_bytes(name.encode())
    (tmp_path / "chaos" / "b" / "groom.npz").write_bytes(b"other")
    farm = program.Farm(tmp_path, 1, killed=Counter(worker=2))
    assert program.print_verdict(tmp_path, ["a", "b", "c"], farm, [Counter()]) == 2
    said = capsys.readouterr().out
    assert "1 of 3 good captures" in said
    assert "b: other bytes in groom.npz" in said
    assert "killed: 2 x worker" in said
    assert "hang: NOT MET" in said


def test_processes_below_processes_are_found(program: Any) -> None:
    """Children and their children, with the words that they were started with."""
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'input()', 'below'])"
    child = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    found: list[int] = []
    for _ in range(200):
        found = program.descendants(os.getpid())
        if any(b"below" in program.words_of(pid).split(b"\0") for pid in found):
            break
        time.sleep(0.05)
    assert child.pid in found
    assert len(found) >= 2
    child.communicate(b"\n")
