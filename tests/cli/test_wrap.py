"""Laws of `hairkit wrap`: files in, a file out, one line about the fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from foreign_heads import make_coarse_head

import hairkit
from hairkit.cli import main
from hairkit.head_model.template import default_head
from hairkit.io.head_reader import BareHead
from hairkit.synth import grow


def _write_zup_centimetres(head: BareHead, path: Path) -> Path:
    """Write a head as OBJ with +Z up, the face along -Y, in centimetres; return the path."""
    x, y, z = 100 * head.vertices.T
    lines = [f"v {a:.5f} {b:.5f} {c:.5f}" for a, b, c in zip(x, -z, y, strict=True)]
    lines += ["f {} {} {}".format(*face) for face in (head.faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_groom_is_wrapped_onto_a_file_in_other_axes_and_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The groom lies on the head in metres with +Y up; the source head is written beside."""
    grow("short", default_head(), 60, 0).save(tmp_path / "groom.npz")
    head = _write_zup_centimetres(make_coarse_head(), tmp_path / "other.obj")
    words = ["wrap", str(tmp_path / "groom.npz"), "--head", str(head), "--units", "cm"]
    words += ["--up", "z", "-o", str(tmp_path / "out.npz")]
    assert main([*words, "--source-head", str(tmp_path / "source.fbx")]) == 0
    out = hairkit.read_groom(tmp_path / "out.npz")
    assert len(out.strands) == 60
    np.testing.assert_allclose(out.head.vertices, make_coarse_head().vertices, atol=1e-5)
    assert (tmp_path / "source.fbx").stat().st_size > 10_000
    assert "60 strands on a head of" in capsys.readouterr().out


def test_a_missing_head_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 2, and nothing is written."""
    grow("short", default_head(), 20, 0).save(tmp_path / "groom.npz")
    out = tmp_path / "out.npz"
    words = ["wrap", str(tmp_path / "groom.npz"), "--head", "no.obj", "-o", str(out)]
    assert main(words) == 2
    assert "no.obj: no such file" in capsys.readouterr().err
    assert not out.exists()
