"""Maya ASCII: a strict parser of the text finds the strands, in clean names."""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich_groom import rich_groom, with_degenerate

from hairkit.arrays import Float64Array
from hairkit.errors import InputError, OptionError
from hairkit.manager import Manager
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom

METRES = {"centimeter": 0.01, "meter": 1.0, "inch": 0.0254}
STATEMENT = re.compile(r'createNode (\w+) -n "(\w+)"(?: -p "([\w|]+)")?')


@dataclass
class Scene:
    """What the text says."""

    metres: float
    transforms: set[str]
    """Full paths."""
    curves: dict[str, Float64Array]
    """Points (n, 3) by full path, in the file's order."""


def parsed(text: str) -> Scene:
    """Return the scene; fails at anything but the few statements that are needed."""
    assert text.startswith("//Maya ASCII 2018 scene\n")
    text = "\n".join(line for line in text.split("\n") if not line.startswith("//"))
    statements = [statement.strip() for statement in text.split(";")]
    assert statements.pop() == ""
    assert statements.pop(0) == 'requires maya "2018"'
    unit = re.fullmatch(r"currentUnit -l (\w+) -a degree -t film", statements.pop(0))
    assert unit
    scene, shape = Scene(METRES[unit[1]], set(), {}), ""
    for statement in statements:
        if statement.startswith("createNode"):
            shape = created(scene, statement)
        elif statement != 'setAttr -k off ".v"':
            scene.curves[shape] = curve(statement)
    return scene


def created(scene: Scene, statement: str) -> str:
    """Return the path of a new node, whose parent is there and whose name is new."""
    match = STATEMENT.fullmatch(statement)
    assert match, statement
    kind, name, parent = match.groups()
    path = f"{parent or ''}|{name}"
    assert parent is None or parent in scene.transforms
    assert path not in scene.transforms | set(scene.curves)
    assert re.fullmatch(r"[A-Za-z]\w*", name)
    if kind == "transform":
        scene.transforms.add(path)
    else:
        assert kind == "nurbsCurve"
        assert path.endswith(f"{str(parent).rpartition('|')[2]}Shape")
    return path


def curve(statement: str) -> Float64Array:
    """Return the points of an open, plain curve of degree 1 with knots 0, 1, 2 ..."""
    words = statement.split()
    assert words[:4] == ["setAttr", '".cc"', "-type", '"nurbsCurve"']
    degree, spans, form, rational, dimensions, knots = words[4:10]
    count = int(knots)
    assert (degree, form, rational, dimensions) == ("1", "0", "no", "3")
    assert int(spans) == count - 1
    assert words[10 : 10 + count] == [str(number) for number in range(count)]
    assert words[10 + count] == knots
    return np.array(words[11 + count :], np.float64).reshape(count, 3)


def written(manager: Manager, groom: Groom, path: Path, **values: Any) -> Scene:
    """Return the parsed file that the groom was written to."""
    manager.call("export_groom", "maya", values, groom=groom, path=path)
    return parsed(path.read_text("ascii"))


@pytest.mark.parametrize(
    ("axis", "metres"),
    [("y_up_centimetres", 0.01), ("y_up_metres", 1.0), ("z_up_centimetres", 0.01)],
)
def test_curves_are_the_strands(manager: Manager, tmp_path: Path, axis: str, metres: float) -> None:
    """The points come back within float32 through the file's unit and axes."""
    groom = rich_groom()
    scene = written(manager, groom, tmp_path / "a.ma", axis=axis)
    assert scene.metres == metres
    assert len(scene.curves) == len(groom.strands)
    turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) if axis.startswith("z") else np.eye(3)
    offsets = groom.strands.offsets
    for path, points in scene.curves.items():
        strand = int(re.search(r"_(\d+)Shape", path)[1])  # type: ignore[index]
        wanted = groom.strands.points[offsets[strand] : offsets[strand + 1]]
        np.testing.assert_allclose(points * metres @ turn.T, wanted, rtol=3e-7, atol=1e-9)


def test_groups_hold_their_strands(manager: Manager, tmp_path: Path) -> None:
    """Guides and hair of each group of the groom lie below a transform of their own."""
    groom = rich_groom()
    scene = written(manager, groom, tmp_path / "a.ma")
    strands = groom.strands
    assert strands.guide is not None
    assert strands.group is not None
    for path in scene.curves:
        _, top, group, name, _ = path.split("|")
        strand = int(name.rpartition("_")[2])
        guide = bool(strands.guide[strand])
        assert top == "groom"
        assert name.startswith("guide_" if guide else "hair_")
        assert group == f"{'guides' if guide else 'hair'}_{strands.group[strand]}"
    plain = written(manager, bristle_groom(), tmp_path / "b.ma")
    assert {path.split("|")[2] for path in plain.curves} == {"guides"}


def test_guides_alone_are_for_xgen(manager: Manager, tmp_path: Path) -> None:
    """`strands=guides` leaves the hair out; `hairs` puts new hair between the guides."""
    groom = rich_groom()
    guides = int(np.count_nonzero(groom.strands.guide))
    scene = written(manager, groom, tmp_path / "a.ma", strands="guides")
    assert len(scene.curves) == guides
    assert len(written(manager, groom, tmp_path / "a.ma", hairs=70).curves) == 70


def test_units_without_a_name_are_refused(manager: Manager, tmp_path: Path) -> None:
    """Maya's unit must have a name, and its scenes are right-handed."""
    assert written(manager, bristle_groom(), tmp_path / "a.ma", scale=0.0254).metres == 0.0254
    with pytest.raises(InputError, match=r"0\.02 m has no name in Maya"):
        written(manager, bristle_groom(), tmp_path / "b.ma", scale=0.02)
    with pytest.raises(OptionError, match="axis is 'unreal'"):
        written(manager, bristle_groom(), tmp_path / "b.ma", axis="unreal")
    assert not (tmp_path / "b.ma").exists()


def test_strands_without_length_are_left_out(
    manager: Manager, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """They are counted in a warning."""
    groom = with_degenerate(rich_groom())
    with caplog.at_level(logging.WARNING, "hairkit"):
        scene = written(manager, groom, tmp_path / "a.ma")
    assert "1 strands without length" in caplog.text
    assert len(scene.curves) == len(groom.strands) - 1


def test_negative_groups_have_clean_names(manager: Manager, tmp_path: Path) -> None:
    """Any group number makes a name that Maya takes."""
    groom = bristle_groom()
    group = np.where(np.arange(len(groom.strands)) % 2, -1, 3)
    groom = replace(groom, strands=replace(groom.strands, group=group))
    scene = written(manager, groom, tmp_path / "a.ma")
    assert {path.split("|")[2] for path in scene.curves} == {"guides_minus1", "guides_3"}


def test_equal_grooms_are_equal_files_and_failures_leave_none(
    manager: Manager, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same bytes each time; an interrupted export leaves nothing."""
    for name in "ab":
        written(manager, bristle_groom(), tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()

    def interrupted(source: object, target: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        written(manager, bristle_groom(), tmp_path / "c")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a", "b"]
