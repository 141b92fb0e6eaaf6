"""Laws of the table that benchmarks/fidelity.py prints."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

from hairkit.evaluation.scorecard import Figure


@pytest.fixture
def fidelity(project: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The program as a module."""
    spec = importlib.util.spec_from_file_location(
        "fidelity", project / "benchmarks" / "fidelity.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "fidelity", module)
    spec.loader.exec_module(module)
    return module


def test_recipes_stand_side_by_side_with_their_means(fidelity: ModuleType) -> None:
    """Each recipe has its captures and their mean; a failed capture has no column."""
    columns = {
        ("default", "a"): (Figure("F", 80.0, ""),),
        ("default", "b"): (Figure("F", 60.0, ""),),
        ("thesis", "a"): (Figure("F", 20.0, ""),),
    }
    table = fidelity._table(columns, ["default", "thesis"], ["a", "b"]).splitlines()
    head = "| figure | default: a | default: b | **default: mean** "
    assert table[0] == head + "| thesis: a | **thesis: mean** |"
    assert table[1] == "|---" * 6 + "|"
    values = [cell.strip() for cell in table[2].split("|")]
    assert values[1:7] == ["F", "80.0", "60.0", "70.0", "20.0", "20.0"]
    assert table[-1] == "default over thesis, F: 3.50"


def test_without_captures_it_says_so(
    fidelity: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A folder without truth gives one line, which is no failure."""
    monkeypatch.setattr(sys, "argv", ["fidelity.py", "--captures", str(tmp_path)])
    assert fidelity.main() == 0
    assert capsys.readouterr().out.count("\n") == 1


def test_a_capture_that_fails_is_told_and_fails(
    fidelity: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A named capture without truth is one line on stderr and exit code 1."""
    monkeypatch.setattr(sys, "argv", ["fidelity.py", "--captures", str(tmp_path), "--names", "x"])
    assert fidelity.main() == 1
    assert "truth.json" in capsys.readouterr().err
