"""What an Alembic file says of strands: left out, or in an object for each group."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import alembic
from rich_groom import rich_groom

from hairkit.grooming.prepare_export import complete_groom
from hairkit.types.strands import PLANTED

Abc = pytest.importorskip("alembic3d").Abc


def test_attributes_can_be_left_out(tmp_path: Path) -> None:
    """Points, widths and uv stay; what only grooms have is not in the file, which is smaller."""
    groom, whole, bare = rich_groom(), tmp_path / "whole.abc", tmp_path / "bare.abc"
    alembic.export_groom(groom, whole, alembic.Options())
    alembic.export_groom(groom, bare, alembic.Options(attributes=False))
    assert bare.stat().st_size < 0.8 * whole.stat().st_size
    assert b"groom_id" in whole.read_bytes()
    assert b"groom_id" not in bare.read_bytes()
    back = alembic.import_groom(bare, alembic.Options()).strands
    np.testing.assert_array_equal(back.points, groom.strands.points)
    np.testing.assert_array_equal(back.widths, complete_groom(groom).strands.widths)
    assert back.guide is None


def test_groups_can_be_objects(tmp_path: Path) -> None:
    """Each group is an object of its name, and comes back whole; hair of one group is one object,
    as it is by default."""
    rich, path = rich_groom(), tmp_path / "groups.abc"
    group = np.arange(len(rich.strands)) % 2 * PLANTED["brows"]
    two = replace(rich, strands=replace(rich.strands, group=group))
    one = replace(rich, strands=replace(rich.strands, group=0 * group))
    for groom, names in ((two, ["brows", "hair_0"]), (one, ["strands"])):
        alembic.export_groom(groom, path, alembic.Options(split=True))
        top = Abc.IArchive(str(path)).getTop().getChild(0)
        found = [top.getChild(k).getName() for k in range(top.getNumChildren())]
        assert sorted(found) == names
        wanted = complete_groom(groom).strands
        wanted = wanted.select(np.argsort(-groom.strands.group, kind="stable"))  # brows first
        back = alembic.import_groom(path, alembic.Options()).strands
        for name in ("points", "widths", "group", "guide", "root_uv"):
            np.testing.assert_array_equal(getattr(back, name), getattr(wanted, name))
