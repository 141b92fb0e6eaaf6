"""USD files of other programs, and damaged or hostile ones."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hairkit_plugins.usd import guarded, reading_child
from references import reference

from hairkit.errors import FormatError, InputError
from hairkit.manager import Manager
from hairkit.storage import read_npz
from hairkit.types.groom import Groom

CASES = os.environ.get("HAIRKIT_FUZZ_CASES", "6")
Reader = Callable[..., Groom]

pytest.importorskip("pxr", reason="usd-core is not installed")

HEADER = '#usda 1.0\n(\n metersPerUnit = 1\n upAxis = "Y"\n)\n'
CURVES = """
def BasisCurves "{name}" {{
    uniform token type = "{type}"
    int[] curveVertexCounts = [3, 3, 3]
    point3f[] points{when} = [(0, 0, 0), (0, 0.1, 0), (0, 0.2, 0),
        (0.1, 0, 0), (0.1, 0.1, 0), (0.1, 0.2, 0), (0, 0, 0.1), (0, 0.1, 0.1), (0, 0.2, 0.1)]
    {more}
}}
"""


def curves(name: str = "hair", kind: str = "linear", when: str = "", more: str = "") -> str:
    """Return the text of a prim with three strands of 20 cm along +Y, 10 cm apart."""
    return CURVES.format(name=name, type=kind, when=when, more=more)


@pytest.fixture
def read(manager: Manager, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Reader:
    """Return a function that reads the text of a stage as a groom, in this process: faster."""

    def run(program: Path, question: dict[str, str], *limits: object) -> tuple[Any, Any]:
        target = tmp_path / "arrays.npz"
        target.unlink(missing_ok=True)
        answer = reading_child.read(question["source"], str(target))
        return answer, read_npz(target) if target.exists() else {}

    monkeypatch.setattr(guarded, "ask_for_arrays", run)

    def from_text(text: str, **values: object) -> Groom:
        path = tmp_path / "a.usda"
        path.write_text(text)
        groom = manager.call("import_groom", "usd", values, path=path)
        assert isinstance(groom, Groom)
        return groom

    return from_text


def test_transforms_units_and_axes_are_undone(read: Reader) -> None:
    """A Z-up stage in centimetres, its curves moved and enlarged, comes out in the head frame."""
    placed = (
        'def Xform "a" {{ double3 xformOp:translate = (10, 20, 30)\n'
        " double3 xformOp:scale = (50, 50, 50)\n"
        ' uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]\n{}\n}}'
    )
    widths = 'float[] widths = [0.0002] (\n interpolation = "constant"\n)'
    header = '#usda 1.0\n(\n metersPerUnit = 0.01\n upAxis = "Z"\n)\n'
    groom = read(header + placed.format(curves(more=widths)))
    # stage (10, 20, 30) cm is (0.1, 0.3, -0.2) m of the head frame, half of each length is left
    wanted = [[0.1, 0.3, -0.2], [0.1, 0.3, -0.25], [0.1, 0.3, -0.3]]
    np.testing.assert_allclose(groom.strands.points[:3], wanted, atol=1e-7)
    np.testing.assert_allclose(groom.strands.widths, 0.0001, rtol=1e-5)


def test_prims_are_joined_as_groups(read: Reader) -> None:
    """Curves of several prims become one groom, whose groups number the prims."""
    moved = "double3 xformOp:translate = (0.02, 0, 0)\n"
    moved += 'uniform token[] xformOpOrder = ["xformOp:translate"]'
    groom = read(HEADER + curves("a") + curves("b", more=moved))
    assert groom.strands.group.tolist() == [0, 0, 0, 1, 1, 1]
    np.testing.assert_allclose(groom.strands.roots[3], [0.02, 0, 0])


BENT = """
def {kind} "hair" {{
    {more}
    int[] curveVertexCounts = [4, 4]
    point3f[] points = [(0, 0, 0), (0, 0.1, 0.1), (0, 0.2, 0.1), (0, 0.3, 0),
        (0.1, 0, 0), (0.1, 0.1, 0.1), (0.1, 0.2, 0.1), (0.1, 0.3, 0)]
    float[] widths = [0, 0.003, 0.006, 0.009, 0, 0.003, 0.006, 0.009] (
        interpolation = "vertex"
    )
}}
"""
BEZIER = 'uniform token type = "cubic"\n uniform token basis = "bezier"'
NURBS = "int[] order = [4, 4]\n double[] knots = [0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 1, 1, 1, 1]"


@pytest.mark.parametrize(("kind", "more"), [("BasisCurves", BEZIER), ("NurbsCurves", NURBS)])
def test_splines_are_read_as_points_on_the_curve(read: Reader, kind: str, more: str) -> None:
    """A Bezier cubic, also as NURBS, runs at 3/4 of its control points' height, from end to end."""
    groom = read(HEADER + BENT.format(kind=kind, more=more))
    third = np.array([1, 2]) / 3
    high = 0.3 * third * (1 - third)
    wanted = [[0, 0, 0], [0, 0.1, high[0]], [0, 0.2, high[1]], [0, 0.3, 0]]
    np.testing.assert_allclose(groom.strands.points[:4], wanted, atol=1e-7)
    np.testing.assert_allclose(groom.strands.widths[:4], [0, 0.003, 0.006, 0.009], atol=1e-7)


def test_damaged_nurbs_are_refused(read: Reader) -> None:
    """Knots that are too few or descend are told in one line."""
    for old, new in (
        ("[4, 4]", "[4]"),
        ("1, 1, 1, 1]", "1, 1, 1]"),
        ("0, 0, 0, 0, 1", "5, 0, 0, 0, 1"),
    ):
        with pytest.raises(FormatError, match="hair"):
            read(HEADER + BENT.format(kind="NurbsCurves", more=NURBS.replace(old, new, 1)))


def test_the_first_frame_of_an_animation_is_read(
    read: Reader, caplog: pytest.LogCaptureFixture
) -> None:
    """Where no rest pose is written, the first sample stands for it."""
    text = curves(when=".timeSamples").replace("= [(0, 0, 0), (0, 0.1", "= {5: [(0, 0, 0), (0, 0.1")
    text = text.replace("(0, 0.2, 0.1)]", "(0, 0.2, 0.1)],\n 6: []}")
    with caplog.at_level(logging.WARNING, "hairkit"):
        groom = read(HEADER + text)
    assert "animated, 2 frames" in caplog.text
    np.testing.assert_allclose(groom.strands.tips[0], [0, 0.2, 0])


def test_a_file_without_a_unit_says_what_is_taken(
    read: Reader, caplog: pytest.LogCaptureFixture
) -> None:
    """USD's default is the centimetre; the option overrules it."""
    with pytest.raises(InputError, match="spread over"):
        read("#usda 1.0\n" + curves())
    assert len(read("#usda 1.0\n" + curves(), scale=1.0).strands) == 3
    assert "no metersPerUnit; USD's default of 0.01 is taken" in caplog.text


@pytest.mark.parametrize(
    "text",
    [
        "(\n subLayers = [@other.usda@]\n)\n",
        'def "A" (\n references = @other.usda@</A>\n) {}\n',
        'def "A" (\n payload = @other.usda@</A>\n) {}\n',
        'def "A" (\n clips = {\n dictionary default = {\n asset[] assetPaths = [@other.usda@]\n'
        ' string primPath = "/A"\n}\n}\n) {}\n',
    ],
)
def test_other_files_are_never_opened(read: Reader, tmp_path: Path, text: str) -> None:
    """Layers, references, payloads and clips are refused, before they are looked for."""
    (tmp_path / "other.usda").write_text(HEADER + curves("A"))
    with pytest.raises(InputError, match=r"other file.*; flatten it first"):
        read("#usda 1.0\n" + text)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("", "not a readable USD file"),
        ("#usda 1.0\nx", "not a readable USD file"),
        (HEADER, "no BasisCurves or NurbsCurves"),
        (HEADER + curves().replace("[3, 3, 3]", "[3, 3, 4]"), "9 points, its curves 10"),
        (HEADER + curves().replace("[3, 3, 3]", "[3, 9, -3]"), "9 points, its curves 9"),
        (HEADER + curves().replace("(0, 0.2, 0)", "(0, nan, 0)"), "not finite"),
        (HEADER + curves().replace("[3, 3, 3]", "[1, 1, 1, 1, 1, 1, 1, 1, 1]"), "two or more"),
        (HEADER.replace("metersPerUnit = 1", "metersPerUnit = -1") + curves(), "metersPerUnit"),
        (HEADER.replace("metersPerUnit = 1", "metersPerUnit = 1e300") + curves(), "too far away"),
    ],
)
def test_damage_is_one_clear_error(read: Reader, text: str, wanted: str) -> None:
    """It names the file and the reason in one line."""
    with pytest.raises(FormatError, match=wanted) as caught:
        read(text)
    assert "a.usda" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_crash_of_the_library_is_an_error(manager: Manager, tmp_path: Path) -> None:
    """Nesting that overflows the library's stack ends its process, not this one."""
    path = tmp_path / "a.usda"
    path.write_text("#usda 1.0\n" + '\ndef "A" {' * 100_000)
    with pytest.raises(FormatError, match=r"the USD library|not a readable USD file"):
        manager.call("import_groom", "usd", path=path)


def test_a_reader_that_stands_still_is_ended(
    manager: Manager, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a time that grows with the file its process is stopped."""
    path = tmp_path / "a.usda"
    path.write_text(HEADER + curves())
    monkeypatch.setattr(guarded, "SECONDS", 0.0)
    with pytest.raises(FormatError, match="no answer within 0"):
        manager.call("import_groom", "usd", path=path)


@pytest.mark.parametrize(
    "line", ["double width = -1", "float3 root_colour = (1, 2, nan)", "float3 width = (1, 2, 3)"]
)
def test_hairkits_values_must_fit(read: Reader, line: str) -> None:
    """Settings of a wrong shape or range are an error, not a guess."""
    data = f"dictionary hairkit = {{\n dictionary material = {{\n {line}\n}}\n}}"
    component = f'def Scope "G" (\n customData = {{\n {data}\n}}\n) {{\n{curves()}\n}}'
    with pytest.raises(FormatError, match=r"a\.usda"):
        read(HEADER.replace(")\n", ' defaultPrim = "G"\n)\n') + component)


def test_damaged_files_never_break_the_reader() -> None:
    """Of damaged crate and text files each gives a groom or one clear error.

    `HAIRKIT_FUZZ_CASES` says how many; by default few, as each is a process.
    """
    if not hasattr(os, "fork"):
        pytest.skip("the fuzzing program needs fork")
    program = Path(__file__).with_name("fuzzing.py")
    done = subprocess.run(
        [sys.executable, str(program), CASES], capture_output=True, text=True, check=True
    )
    for line in done.stdout.splitlines():
        counts = json.loads(line)
        assert counts["files"] == int(CASES)
        assert "broken" not in counts


@pytest.mark.parametrize("name", ["blender_4.5.15_hair_curves.usda", "groom_skel_valid.usda"])
def test_reference_files_are_read(manager: Manager, name: str) -> None:
    """Hair curves that Blender wrote and a skinned groom come with their points and widths."""
    groom = manager.call("import_groom", "usd", path=reference(f"usd/{name}"))
    assert groom.strands.counts.tolist() == [5, 5, 5, 5]
    np.testing.assert_allclose(groom.strands.widths, 1e-4, rtol=1e-5)
    np.testing.assert_allclose(groom.strands.roots[:, 0], [0, 0.01, 0.02, 0.03], atol=1e-6)
