"""`hairkit convert` and `hairkit plugins --formats`: any importable file to any exportable one."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit.cli import main
from hairkit.manager import DISABLE_AUTOLOAD
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with groom.npz and, in centimetres, bare.data; the current one."""
    monkeypatch.setenv(DISABLE_AUTOLOAD, "1")
    monkeypatch.chdir(tmp_path)
    bristle_groom().save("groom.npz")
    assert main(["export", "groom.npz", "-o", "bare.data", "--set", "scale=0.01"]) == 0
    return tmp_path


def test_converting_keeps_the_points(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the unit said, hair is where it was; one line says what was written."""
    capsys.readouterr()
    assert main(["convert", "bare.data", "b.npz", "--scale", "0.01", "--up", "y"]) == 0
    printed, strands = capsys.readouterr().out, bristle_groom().strands
    assert np.allclose(Groom.load("b.npz").strands.points, strands.points, atol=1e-7)
    wanted = rf"b.npz: {len(strands)} strands, {len(strands.points)} points, {len(strands)} guides"
    assert re.fullmatch(wanted + r", [\d.]+ x [\d.]+ x [\d.]+ m, in [\d.]+ s\n", printed)


def test_what_is_assumed_is_said(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Bare strands get a head, widths and root uv, each with a warning."""
    assert main(["convert", "bare.data", "b.npz", "--scale", "0.01"]) == 0
    for lacking in ("no head", "no widths", "no root uv"):
        assert f"bare.data: {lacking}" in caplog.text


def test_z_up_files_are_turned_upright(folder: Path) -> None:
    """What a z-up file calls z is up in the groom."""
    assert main(["convert", "groom.npz", "z.ply", "--set", "ply.axis=z_up_metres"]) == 0
    words = ["convert", "z.ply", "b.npz", "--up", "z", "--head", "groom.npz"]
    assert main(words) == 0
    back, true = Groom.load("b.npz"), bristle_groom()
    assert np.allclose(back.strands.points, true.strands.points, atol=1e-7)
    assert np.array_equal(back.head.vertices, true.head.vertices)


def test_options_go_to_reader_and_writer(folder: Path) -> None:
    """`--set` takes the plugin's name, or `reader` and `writer` where both are the same plugin."""
    bristle_groom().save("groom.npz")
    assert main(["convert", "groom.npz", "a.hair"]) == 0
    words = ["--set", "reader.reverse=true", "--set", "cyhair.axis=y_up_metres"]
    assert main(["convert", "a.hair", "b.hair", *words, "--set", "writer.colours=no"]) == 0
    assert main(["convert", "b.hair", "b.npz", "--from", "cyhair", "--to", "native"]) == 0
    tips = bristle_groom().strands.tips
    assert np.allclose(Groom.load("b.npz").strands.roots, tips, atol=1e-7)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["none.data", "b.npz"], "none.data: no such file"),
        (["bare.data", "b.xyz"], "no plugin writes this suffix; known: "),
        (["bare.xyz", "b.npz"], "no such file"),
        (["bare.data", "none/b.npz"], "no such folder"),
        (["bare.data", "."], "no plugin writes this suffix"),
        (["bare.data", "bare.data", "--scale", "0.01"], "is the input file"),
        (["bare.data", "b.npz"], "give metres per unit of the file: scale=0.0"),
        (["bare.data", "b.npz", "--scale", "-1"], "scale is '-1', expected a number"),
        (["bare.data", "b.npz", "--up", "x"], "invalid choice: 'x'"),
        (["bare.data", "b.npz", "--head", "none.obj", "--scale", "0.01"], "none.obj"),
        (["groom.npz", "b.hair", "--scale", "2"], "--scale: files of plugin 'native'"),
        (["bare.data", "b.npz", "--set", "x=1"], "--set x=1: no option 'x'"),
        (["bare.data", "b.npz", "--set", "writer.x=1"], "no option 'x'"),
        (["bare.data", "b.npz", "--to", "gabor"], "implements 'export_groom'"),
        (["bare.data", "b.npz", "--from", "ply"], "no PLY file"),
    ],
)
def test_wrong_words_get_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], reason: str
) -> None:
    """What cannot be converted is said in one line, exit code 2, and nothing is written."""
    capsys.readouterr()
    try:
        code = main(["convert", *words])
    except SystemExit as left:  # argparse leaves by itself
        code = int(str(left.code))
    assert code == 2
    printed = capsys.readouterr().err
    assert reason in printed
    assert printed.count("\n") == 1
    assert not Path("b.npz").exists()


def test_a_link_to_the_source_is_the_source(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A second name does not let a file be overwritten by what is read from it."""
    (folder / "link.data").symlink_to(folder / "bare.data")
    before = (folder / "bare.data").read_bytes()
    assert main(["convert", "bare.data", "link.data", "--scale", "0.01"]) == 2
    assert "is the input file" in capsys.readouterr().err
    assert (folder / "bare.data").read_bytes() == before


def test_info_reads_hair_and_heads_of_one_ending(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An .obj with lines is a groom, one with faces a head; options of the reader can be given."""
    assert main(["export", "groom.npz", "-o", "hair.obj", "--set", "scale=0.01"]) == 0
    (folder / "head.obj").write_text(
        "v -0.1 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0.05 0.1\ng scalp\nf 1 2 3\nf 1 2 4\n"
    )
    capsys.readouterr()
    assert main(["info", "hair.obj", "--scale", "0.01"]) == 0
    assert capsys.readouterr().out.startswith("kind: groom")
    assert main(["info", "head.obj"]) == 0
    assert capsys.readouterr().out.startswith("kind: head")
    assert main(["info", "hair.obj"]) == 2
    assert "give metres per unit" in capsys.readouterr().err


def test_the_format_table_has_every_format(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One column a format, as many cells in each row; notes are numbered from 1."""
    capsys.readouterr()
    assert main(["plugins", "--formats"]) == 0
    rows, _, notes = capsys.readouterr().out.partition("\n\n")
    widths = {line.count("|") for line in rows.splitlines()}
    assert len(widths) == 1
    for name in ("native", "cyhair", "tressfx", "usc_data", "ply", "obj", "hairworks"):
        assert f"`{name}`" in rows
    used = {int(number) for number in re.findall(r"\((\d+)\)", rows)}
    assert used == set(range(1, len(notes.splitlines()) + 1))


def test_guides_are_picked_from_full_hair(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`--guides 20` marks 20 strands; written alone they are 20 of the strands that were read."""
    words = ["convert", "groom.npz", "g.npz", "--guides", "20"]
    assert main([*words, "--set", "writer.strands=guides"]) == 0
    found, full = Groom.load("g.npz").strands, bristle_groom().strands
    assert len(found) == 20
    assert {tuple(p) for p in found.points.tolist()} <= {tuple(p) for p in full.points.tolist()}
    capsys.readouterr()
    assert main(["convert", "groom.npz", "g.npz", "--guides", "0"]) == 2
    assert "0 guides are wanted" in capsys.readouterr().err


def test_curl_is_measured_where_asked(folder: Path) -> None:
    """Coils of 8 mm radius and 4 cm pitch are found; without the word the material stays."""
    straight = bristle_groom()
    t = np.linspace(0, 0.24, 120)
    coil = np.stack([0.008 * np.cos(t * 157.08), -t, 0.008 * np.sin(t * 157.08)], axis=1)
    points = straight.strands.roots[:, None] + (coil - coil[0])
    offsets = np.arange(len(points) + 1) * 120
    strands = Strands(points.reshape(-1, 3).astype(np.float32), offsets)
    replace(straight, strands=strands).save("coils.npz")
    assert main(["convert", "coils.npz", "plain.npz"]) == 0
    assert Groom.load("plain.npz").material.curl_radius == 0
    assert main(["convert", "coils.npz", "known.npz", "--measure-curl"]) == 0
    look = Groom.load("known.npz").material
    assert abs(look.curl_radius - 0.008) < 0.0015
    assert abs(look.curl_pitch - 0.04) < 0.006
