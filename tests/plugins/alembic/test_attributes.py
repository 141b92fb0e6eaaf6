"""What an Alembic file keeps when the attributes of grooms are left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import alembic
from rich_groom import rich_groom

from hairkit.grooming.prepare_export import complete_groom

pytest.importorskip("alembic3d")


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
