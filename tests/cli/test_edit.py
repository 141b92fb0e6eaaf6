"""Laws of `hairkit edit`: files in, a brushed file out, errors of one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import hairkit
from hairkit import Brush, Edit, Edits
from hairkit.cli import main
from hairkit.grooming.brushes import edit_groom
from hairkit.testing import bristle_groom


@pytest.fixture
def groom(tmp_path: Path) -> Path:
    """The bristles in a file."""
    bristle_groom().save(tmp_path / "groom.npz")
    return tmp_path / "groom.npz"


def test_a_brush_goes_over_all_hair(groom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A trim to 1 cm leaves strands of 1 cm, in any format; one line says so."""
    for name in ("short.npz", "short.abc"):
        out = groom.parent / name
        words = ["edit", str(groom), "--brush", "trim", "--amount", "0.01", "-o", str(out)]
        assert main(words) == 0
        assert "264 strands, mean length 1.0 cm" in capsys.readouterr().out
        np.testing.assert_allclose(hairkit.read_groom(out).strands.lengths(), 0.01, rtol=1e-3)


def test_strokes_of_a_file_come_first(groom: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Strokes of an edits.json, then the brush: what the functions give."""
    thin, trim = Brush("thin", 0.05), Brush("trim", amount=0.02)
    strokes = Edits((Edit(np.array([[0, 0.1, 0.0]]), thin),))
    strokes.write(groom.parent / "edits.json")
    both = Edits((*strokes.strokes, Edit(np.zeros((0, 3)), trim)))
    out, file = groom.parent / "out.npz", groom.parent / "edits.json"
    words = ["edit", str(groom), "--strokes", str(file), "--brush", "trim", "--amount", "0.02"]
    assert main([*words, "-o", str(out), "--json"]) == 0
    wanted = edit_groom(bristle_groom(), both).strands
    assert json.loads(capsys.readouterr().out)["strands"] == len(wanted) < 264
    np.testing.assert_allclose(hairkit.read_groom(out).strands.points, wanted.points, atol=1e-6)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--brush", "trimm"], "no brush 'trimm'"),
        (["--brush", "trim", "--amount", "-1"], "option amount is '-1'"),
        (["--brush", "trim", "--group", "moustache"], "option group"),
        (["--amount", "0.1"], "--amount is of a brush; give --brush NAME, too"),
        ([], "nothing to do; give --brush NAME or --strokes edits.json"),
        (["--strokes", "no.json"], "no.json: no such file"),
    ],
)
def test_errors_are_one_line(
    groom: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, one line that says why, and nothing is written."""
    out = groom.parent / "out.npz"
    assert main(["edit", str(groom), *words, "-o", str(out)]) == 2
    error = capsys.readouterr().err.strip()
    assert said in error
    assert "\n" not in error
    assert not out.exists()
