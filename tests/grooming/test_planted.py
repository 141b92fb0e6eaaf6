"""Laws of brows, lashes and beard: groups of their own, planted by strokes on the face."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit import Brush, Edit, Edits, Groom, write_groom
from hairkit.cli import main
from hairkit.grooming.brushed_hair import CLEARANCE
from hairkit.grooming.brushes import BRUSHES, edit_groom
from hairkit.grooming.density import SHORTER, USUAL
from hairkit.grooming.prepare_export import point_colours
from hairkit.head_model.scalp import evaluate
from hairkit.head_model.signed_distance import distance_to
from hairkit.manager import Manager
from hairkit.testing import bristle_groom
from hairkit.types.strands import PLANTED

GROOM = bristle_groom()
DOWN = np.array([[0.0, -0.03, 0.11], [0.0, -0.08, 0.08]])
EVERYWHERE = np.zeros((0, 3))


def planted(group: str, path: np.ndarray[tuple[int, int], np.dtype[np.float64]] = DOWN) -> Groom:
    """Return the ball with hair of a group, planted along a path below its scalp."""
    return edit_groom(GROOM, Edits((Edit(path, Brush("add", 0.02, group=group)),)))


@pytest.mark.parametrize("group", PLANTED)
def test_a_stroke_plants_hair_of_a_group(group: str) -> None:
    """It is bound to the skin, of the group's number and length, outside the head, and the head's
    own hair and density stay as they are."""
    groom = planted(group)
    strands, new = groom.strands, groom.strands.planted
    assert 30 < new.sum() < 3000
    assert (strands.group == np.where(new, PLANTED[group], 0)).all()
    np.testing.assert_array_equal(strands.select(~new).points, GROOM.strands.points)
    roots = evaluate(groom.head, groom.root_triangle, groom.root_barycentric)
    np.testing.assert_allclose(strands.roots, roots, atol=1e-6)
    longest = USUAL[group].length
    lengths = strands.lengths()[new]
    assert (lengths < 1.001 * longest).all()
    assert (lengths > 0.999 * (1 - SHORTER) * longest).all()
    own = strands.select(new)
    free = np.delete(own.points, own.offsets[:-1], axis=0)
    assert distance_to(groom.head, free).min() > -CLEARANCE / 2
    assert groom.head.density is None


def test_hair_is_planted_along_the_stroke() -> None:
    """A beard drawn to the left lies to the left, one drawn to the right to the right."""
    across = np.array([[-0.03, -0.06, 0.08], [0.03, -0.06, 0.08]])
    for path, sign in ((across, 1), (across[::-1], -1)):
        own = planted("beard", path).strands
        own = own.select(own.planted)
        ways = (own.tips - own.roots)[:, 0]
        assert (sign * ways > 0).mean() > 0.95
        assert ((own.tips - own.roots)[:, 1] < 0).mean() > 0.7  # and down, as beards do


@pytest.mark.parametrize("brush", [*BRUSHES])
@pytest.mark.parametrize("group", ["hair", "brows"])
def test_a_brush_acts_on_its_group_alone(brush: str, group: str) -> None:
    """Strokes over the hair leave brows as they are to the last bit, and the other way round."""
    before = planted("brows")
    path = EVERYWHERE if brush not in ("comb", "part") else np.concatenate([DOWN, -DOWN])
    stroke = Edit(path, Brush(brush, 0.1, group=group))
    after = edit_groom(before, Edits((stroke,)))
    dyed = [replace(each.strands, colours=point_colours(each)) for each in (before, after)]
    kept = [each.select(each.planted == (group == "hair")) for each in dyed]
    np.testing.assert_array_equal(*[each.points for each in kept])
    np.testing.assert_array_equal(*[each.colours for each in kept])
    if brush not in ("add", "trim") or group == "hair":
        points, colours = ([getattr(e, of) for e in dyed] for of in ("points", "colours"))
        assert not np.array_equal(*(colours if brush == "dye" else points))


@pytest.mark.parametrize("name", ["alembic", "ply", "usd", "maya", "native", "gltf"])
def test_groups_are_exported(name: str, tmp_path: Path) -> None:
    """Formats that hold groups give planted hair back as groups of their own."""
    groom, manager = planted("lashes"), Manager.loaded()
    path = (tmp_path / "groom").with_suffix(manager.info(name).suffixes[0])
    manager.call("export_groom", name, None, groom=groom, path=path)
    back = manager.call("import_groom", name, None, path=path)
    assert back.strands.group.tolist() == groom.strands.group.tolist()


def test_unreal_gets_names_of_groups(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its groups are numbered from 0 on and named, so that no rule for the file warns."""
    groom, out = tmp_path / "groom.npz", tmp_path / "unreal"
    write_groom(planted("beard"), groom)
    assert main(["export", str(groom), "--for", "unreal", "-o", f"{out}/"]) == 0
    capsys.readouterr()
    [path] = out.glob("*.abc")
    assert b"beard" in path.read_bytes()
    assert main(["validate", str(path), "--for", "unreal", "--json"]) == 0
    assert {each["level"] for each in json.loads(capsys.readouterr().out)} == {"passed"}
