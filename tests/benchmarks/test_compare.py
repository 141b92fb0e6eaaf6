"""Laws of kept benchmarks: a slower machine changes no ratio, and a slower program does."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

PROJECT = Path(__file__).parents[2]
sys.path.insert(0, str(PROJECT))
from benchmarks import bench, compare  # noqa: E402 - the folder is no installed package

PROGRAM = 'print("| what | s | share |\\n|---|---|---|\\n| a | 0.50 | 12 % |\\n| a | 1,200 | - |")'


def run(seconds: float, yardstick: float, share: float = 12.0) -> dict[str, Any]:
    """Return a kept run of one program."""
    table = {"a": {"share": share}}
    return {
        "skin": {
            "processor_s": seconds,
            "wall_s": seconds,
            "yardstick_s": yardstick,
            "table": table,
        }
    }


def test_tables_are_read_by_row_and_column() -> None:
    """Units and thousands are understood, words are left out, and equal rows are numbered."""
    text = "intro\n| what | s | share |\n|---|---|---|\n| a | 0.50 | 12 % |\n| a | 1,200 | none |\n"
    assert bench.read_tables(text) == {"a": {"s": 0.5, "share": 12.0}, "a (2)": {"s": 1200.0}}


def test_a_slower_machine_is_not_a_slower_program() -> None:
    """Seconds count in yardsticks of their own run; other numbers count as they are."""
    ratios = {c.place[2]: c.ratio for c in compare.changes(run(2.0, 0.1), run(4.0, 0.2, 24.0))}
    assert ratios == {"processor_s": 1.0, "wall_s": 1.0, "share": 2.0}
    ratios = {c.place[2]: c.ratio for c in compare.changes(run(2.0, 0.1), run(4.0, 0.1))}
    assert ratios == {"processor_s": 2.0, "wall_s": 2.0, "share": 1.0}
    assert not compare.beyond(1.05, 1.1)
    assert compare.beyond(1 / 1.2, 1.1)
    assert compare.beyond(float("inf"), 1.1)


def test_runs_are_kept_and_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program's tables and seconds are in the file; one that fails makes the run fail."""
    (tmp_path / "skin.py").write_text(PROGRAM)
    monkeypatch.setattr(bench, "FOLDER", tmp_path)
    monkeypatch.setattr(bench, "NUMBERS", 1000)
    kept = tmp_path / "bench.json"
    monkeypatch.setattr(sys, "argv", ["bench.py", "-o", str(kept)])
    assert bench.main() == 0
    measured = json.loads(kept.read_text())["programs"]["skin"]
    assert measured["table"]["a (2)"] == {"s": 1200.0}
    assert 0 < measured["processor_s"] < 60
    (tmp_path / "skin.py").write_text("raise SystemExit(3)")
    assert bench.main() == 1
    monkeypatch.setattr(sys, "argv", ["bench.py", "nothing"])
    assert bench.main() == 2
    words = [sys.executable, "-m", "benchmarks.compare", str(kept), str(tmp_path / "none.json")]
    done = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    monkeypatch.setattr(sys, "argv", ["compare.py", str(kept), str(kept)])
    capsys.readouterr()
    assert compare.main() == 0
    assert len(capsys.readouterr().out.splitlines()) == 2
