"""Curves of Maya scenes, read: where transforms put them, whatever else the scene holds."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import maya
from rich_groom import rich_groom
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from hairkit.errors import FormatError
from hairkit.manager import Manager
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom

ROWS = np.array([[0, 0.10, 0], [0.01, 0.12, 0], [0.02, 0.14, 0.01], [0.0, 0.16, 0.02], [0, 0.2, 0]])
HEADER = "//Maya ASCII 2022 scene\ncurrentUnit -l meter;\n"


def curve(rows: np.ndarray, parent: str, degree: int = 1, knots: str = "", more: str = "") -> str:
    """Return the statements of a curve below a transform."""
    count = len(rows)
    knots = knots or " ".join(map(str, range(count)))
    text = " ".join(f"{number:.9g}" for number in rows.ravel())
    return (
        f'createNode nurbsCurve -n "{parent}Shape" -p "{parent}";\n{more}'
        f'\tsetAttr -k off ".v";\n\tsetAttr ".cc" -type "nurbsCurve"\n'
        f"{degree} {count - degree} 0 no 3\n{count + degree - 1} {knots}\n{count} {text}\n;\n"
    )


def read(folder: Path, text: str, **options: object) -> Groom:
    """Return the groom of a scene's text."""
    (folder / "a.ma").write_text(text)
    return maya.import_groom(folder / "a.ma", maya.Options(**options))  # type: ignore[arg-type]


def points(folder: Path, text: str) -> np.ndarray:
    """Return the points (P, 3) of the only curve."""
    return np.asarray(read(folder, text).strands.points, np.float64)


def test_own_scenes_come_back(manager: Manager, tmp_path: Path) -> None:
    """Points, order, groups and guides, of several groups and of one."""
    for groom in (rich_groom(), bristle_groom()):
        if groom.strands.group is None:
            five = np.full(len(groom.strands), -5)
            groom = replace(groom, strands=replace(groom.strands, group=five))
        manager.call("export_groom", "maya", groom=groom, path=tmp_path / "a.ma")
        back = manager.call("import_groom", "maya", path=tmp_path / "a.ma").strands
        np.testing.assert_allclose(back.points, groom.strands.points, rtol=3e-7, atol=1e-8)
        np.testing.assert_array_equal(back.offsets, groom.strands.offsets)
        np.testing.assert_array_equal(back.group, groom.strands.group)


def test_transforms_put_curves_in_place(tmp_path: Path) -> None:
    """Translation, rotation in its order and about its pivot, scale about its own, and parents."""
    text = (
        HEADER + 'createNode transform -n "top";\n\tsetAttr ".t" -type "double3" 0 0.3 0.1 ;\n'
        '\tsetAttr ".s" -type "double3" 2 1 0.5 ;\n\tsetAttr ".sp" -type "double3" 0.1 0 0.2 ;\n'
        'createNode transform -n "hair" -p "|top";\n\tsetAttr ".r" -type "double3" 20 -30 50 ;\n'
        '\tsetAttr ".ro" 4;\n\tsetAttr ".rp" -type "double3" 0 0.1 0.05 ;\n'
        '\tsetAttr ".tx" 0.02;\n' + curve(ROWS, "hair")
    )
    pivot = np.array([0, 0.1, 0.05])
    # Maya's order 4 is yxz: about Y first
    turned = Rotation.from_euler("yxz", [-30, 20, 50], degrees=True).apply(ROWS - pivot) + pivot
    fixed = np.array([0.1, 0, 0.2])
    scaled = (turned + np.array([0.02, 0, 0]) - fixed) * [2, 1, 0.5] + fixed
    np.testing.assert_allclose(points(tmp_path, text), scaled + np.array([0, 0.3, 0.1]), atol=1e-7)


def test_cubic_curves_become_points_on_them(tmp_path: Path) -> None:
    """As many as control points, from end to end; Maya leaves the outermost knots out."""
    inner = np.array([0, 0, 0, 1, 2, 2, 2.0])
    text = HEADER + 'createNode transform -n "h";\n'
    text += curve(ROWS, "h", 3, " ".join(map(str, inner)))
    spline = BSpline(np.concatenate([[0], inner, [2]]), ROWS, 3)
    np.testing.assert_allclose(points(tmp_path, text), spline(np.linspace(0, 2, 5)), atol=1e-7)


@pytest.mark.parametrize(("unit", "metres"), [("centimeter", 0.01), ("m", 1.0), ("", 0.01)])
def test_the_scene_says_its_unit(tmp_path: Path, unit: str, metres: float) -> None:
    """Without a word, centimetres; `scale` overrules it."""
    text = f"currentUnit -l {unit} -a degree;\n" if unit else ""
    text += 'createNode transform -n "h";\n' + curve(ROWS / metres, "h")
    np.testing.assert_allclose(points(tmp_path, text), ROWS, atol=1e-7)
    found = read(tmp_path, text, scale=metres / 2).strands.points
    np.testing.assert_allclose(found, ROWS / 2, atol=1e-7)


def test_only_curves_that_are_seen_are_hair(tmp_path: Path) -> None:
    """Meshes, texts with semicolons, comments and intermediate curves are passed over."""
    text = HEADER + 'createNode transform -n "h"; // a curve; of hair\n' + curve(ROWS, "h")
    text += 'createNode transform -n "old";\n' + curve(ROWS, "old", more='\tsetAttr ".io" yes;\n')
    text += 'createNode mesh -n "m" -p "old";\n\tsetAttr ".cc" -type "nurbsCurve" no;\n'
    text += 'createNode script -n "s";\n\tsetAttr ".b" -type "string" "a; \\"// b\\";\n c";\n'
    np.testing.assert_allclose(points(tmp_path, text), ROWS, atol=1e-7)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("1 4 0 no 3", "1 4 2 no 3"), "is closed"),
        (("1 4 0 no 3", "1 4 0 yes 3"), "5 points|rational"),
        (("5 0 1 2 3 4", "4 0 1 2 3"), "knots"),
        (("-l meter", "-l furlong"), "unknown unit 'furlong'"),
        (('nurbsCurve -n "hShape"', 'nurbsSurface -n "hShape"'), "holds no nurbsCurve"),
        (('"h";', '"h";\n\tsetAttr ".sh" -type "double3" 0 1 0 ;'), "sheared"),
        (('"h";', '"h";\n\tsetAttr ".t" -type "double3" 0 x 0 ;'), "no 3 numbers"),
        (('"h";', '"h";\n\tsetAttr ".ro" 9;'), "rotate order 9"),
    ],
)
def test_what_is_not_read_is_refused(tmp_path: Path, change: tuple[str, str], reason: str) -> None:
    """One line that says why."""
    text = HEADER + 'createNode transform -n "h";\n' + curve(ROWS, "h")
    assert change[0] in text
    with pytest.raises(FormatError, match=reason):
        read(tmp_path, text.replace(*change))


def test_texts_that_never_end_take_no_time(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Half a megabyte of quotes and escapes is read through once."""
    with caplog.at_level(logging.ERROR), pytest.raises(FormatError, match="ends within a command"):
        read(tmp_path, 'createNode x "' + '\\"' * 250_000)


def test_a_scene_that_was_cut_off_is_refused(manager: Manager, tmp_path: Path) -> None:
    """Half of the curves is not silently taken for all."""
    manager.call("export_groom", "maya", groom=bristle_groom(), path=tmp_path / "a.ma")
    text = (tmp_path / "a.ma").read_text()
    with pytest.raises(FormatError, match=r"a\.ma: ends within a command"):
        read(tmp_path, text[: len(text) // 2])
