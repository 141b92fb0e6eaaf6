"""PLY and OBJ in Blender: the strands as chains of edges, point by point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from blender_session import BlenderSession, only, z_up
from client_groom import read_back, written

from hairkit.grooming.prepare_export import point_colours
from hairkit.manager import Manager
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

OPERATORS = {".ply": "wm.ply_import", ".obj": "wm.obj_import"}
AXES = {"forward_axis": "NEGATIVE_Z", "up_axis": "Y"}
"""What Blender's importers have to be told of a file that is Y up; the default for OBJ."""


def edges_of(strands: Strands) -> npt.NDArray[np.int64]:
    """Return (E, 2) each point and the next one of its strand."""
    first = strands.segments()[1]
    return np.stack([first, first + 1], axis=1)


@pytest.mark.parametrize("ending", OPERATORS)
def test_strands_arrive_as_edges(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, ending: str
) -> None:
    """Vertices are the points in their order, edges run along each strand and nowhere else."""
    path = written(manager, groom, tmp_path / f"hair{ending}")
    things = blender.call("contents.imported", path=path, operator=OPERATORS[ending], options=AXES)
    mesh = only(things, "MESH")
    np.testing.assert_allclose(mesh["positions"], z_up(groom.strands.points), atol=1e-7)
    np.testing.assert_array_equal(np.sort(mesh["edges"], axis=1), edges_of(groom.strands))


def test_ply_carries_width_and_colour(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path
) -> None:
    """The attribute `thickness` is each point's width, the colour attribute its 8-bit colour."""
    path = written(manager, groom, tmp_path / "hair.ply")
    mesh = only(blender.call("contents.imported", path=path, operator="wm.ply_import"), "MESH")
    np.testing.assert_allclose(mesh["attributes"]["thickness"], groom.strands.widths, rtol=1e-6)
    colours = mesh["attributes"]["Col"][:, :3]
    np.testing.assert_allclose(colours, point_colours(groom), atol=0.01)


@pytest.mark.parametrize("ending", OPERATORS)
def test_what_blender_writes_is_read(
    blender: BlenderSession, manager: Manager, groom: Groom, tmp_path: Path, ending: str
) -> None:
    """A mesh of edges that Blender exports becomes the same strands again."""
    there, back = tmp_path / f"there{ending}", tmp_path / f"back{ending}"
    written(manager, groom, there)
    arguments = {"source": there, "operator": OPERATORS[ending], "target": back, "axes": AXES}
    blender.call("exports.again", **arguments)
    read = read_back(manager, back).strands
    np.testing.assert_array_equal(read.offsets, groom.strands.offsets)
    np.testing.assert_allclose(read.points, groom.strands.points, atol=2e-6)
