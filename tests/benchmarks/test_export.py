"""Laws of the table that benchmarks/export.py prints."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from hairkit.grooming.prepare_export import bound_roots


@pytest.fixture
def export(project: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The program as a module."""
    spec = importlib.util.spec_from_file_location("export", project / "benchmarks" / "export.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "export", module)
    spec.loader.exec_module(module)
    return module


def printed(
    export: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *words: str,
) -> list[list[str]]:
    """Return the cells of the lines that the program prints."""
    monkeypatch.setattr(sys, "argv", ["export.py", *words])
    assert export.main() == 0
    return [line.strip("| ").split(" | ") for line in capsys.readouterr().out.splitlines()]


def test_each_format_has_a_row_with_its_file(
    export: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    """A row a format, in the order asked for; 12 bytes a point are in every file; tidy after."""
    small = ["--strands", "2000", "--points", "16", "--rounds", "1", "--formats", ".data,.hair"]
    rows = printed(
        export, monkeypatch, capsys, *small, "--folder", str(tmp_path), "--blender", "/nowhere"
    )
    assert rows[0][0] == "2000 strands x 16 points"
    assert [row[0] for row in rows[2:]] == [".data", ".hair"]
    assert all(len(row) == len(rows[0]) for row in rows[2:])
    assert all(float(row[5]) >= 0.3 for row in rows[2:])
    assert all(row[6:] == ["-"] * 4 for row in rows[2:])
    assert not list(tmp_path.iterdir())


def test_the_strands_say_all_that_files_carry(export: ModuleType) -> None:
    """They start at their roots on the head, and have widths, root uv, groups and guides."""
    groom = export.combed(1000, 8)
    np.testing.assert_allclose(groom.strands.roots, bound_roots(groom).positions, atol=1e-5)
    assert (groom.strands.counts == 8).all()
    assert groom.strands.guide.sum() == export.GUIDES
    assert (groom.strands.widths > 0).all()
    assert set(groom.strands.group) == {0, 1}
    assert groom.strands.root_uv.shape == (1000, 2)


def test_an_unknown_format_is_one_line(
    export: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is not measured is named, with what is."""
    monkeypatch.setattr(sys, "argv", ["export.py", "--formats", ".abc,.doc"])
    assert export.main() == 2
    said = capsys.readouterr().err
    assert said.startswith("no format '.doc'; known: .abc")
    assert said.count("\n") == 1
