"""Laws of .ply files."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hairkit_plugins import ply
from rich_groom import rich_groom

from hairkit.errors import FormatError


def test_another_reader_sees_the_strands(tmp_path: Path) -> None:
    """trimesh finds the vertices and one edge for each segment."""
    groom, path = rich_groom(), tmp_path / "a.ply"
    ply.export_groom(groom, path, ply.Options())
    with path.open("rb") as file:
        found = trimesh.exchange.ply.load_ply(file)
    assert np.allclose(found["vertices"], groom.strands.points)
    joined = sum(len(entity.points) - 1 for entity in found["entities"])
    assert joined == len(groom.strands.points) - len(groom.strands)


def test_write_read_write_gives_the_same_bytes(tmp_path: Path) -> None:
    """Colours are rounded once; what was read is written again without any loss."""
    groom, files = rich_groom(), [tmp_path / f"{number}.ply" for number in range(3)]
    for file in files:
        ply.export_groom(groom, file, ply.Options())
        groom = ply.import_groom(file, ply.Options())
    assert files[1].read_bytes() == files[2].read_bytes()


def rewritten(path: Path, order: str, edges_only: bool) -> None:
    """Write a file of two strands with the vertices shuffled, in another byte order or as text."""
    vertex = np.array([[0, 0.13, 0], [0.1, 0, 0], [0, 0.1, 0], [0.13, 0, 0], [0, 0.12, 0]])
    edge = np.array([[2, 4], [4, 0], [1, 3]])
    if not edges_only:
        vertex = vertex[[2, 4, 0, 1, 3]]
    header = f"ply\nformat {order} 1.0\nelement vertex 5\nproperty double x\nproperty double y\n"
    header += "property double z\n"
    header += "element edge 3\nproperty int vertex1\nproperty int vertex2\n" if edges_only else ""
    header += "element nothing 4294967295\n" if order != "ascii" else ""
    header += "" if edges_only else "element strand 2\nproperty uchar nsegs\n"
    header += "element face 0\nproperty list uchar int vertex_indices\nend_header\n"
    rows = edge if edges_only else np.array([[2], [1]])
    if order == "ascii":
        text = "\n".join(" ".join(map(str, row)) for row in [*vertex.tolist(), *rows.tolist()])
        path.write_bytes(header.encode() + text.encode() + b"\n")
        return
    sign = {"binary_little_endian": "<", "binary_big_endian": ">"}[order]
    kind = sign + "i4" if edges_only else "u1"
    path.write_bytes(
        header.encode() + vertex.astype(sign + "f8").tobytes() + rows.astype(kind).tobytes()
    )


@pytest.mark.parametrize("edges_only", [True, False])
@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_all_orders_hold_the_same(tmp_path: Path, order: str, edges_only: bool) -> None:
    """Text and both byte orders, with edges or with strands, give the same hair."""
    rewritten(tmp_path / "a.ply", order, edges_only)
    strands = ply.import_groom(tmp_path / "a.ply", ply.Options()).strands
    found = [strands.points[a:b].tolist() for a, b in pairwise(strands.offsets)]
    wanted = np.float32([[0, 0.1, 0], [0, 0.12, 0], [0, 0.13, 0], [0.1, 0, 0], [0.13, 0, 0]])
    assert sorted(found) == [wanted[:3].tolist(), wanted[3:].tolist()]


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("ply\n", "plx\n", "no PLY file"),
        ("vertex 5", "vertex 4294967295", "lines for"),
        ("vertex 5", "vertex -5", "expected a whole number"),
        ("element edge 3", "element vertex 3", "an element twice"),
        ("property double z", "property double x", "cannot understand"),
        ("property double z", "property vec3 z", "cannot understand"),
        ("0 1\n", "0 9\n", "vertex outside 0 to 4"),
        ("0 1\n", "0 0\n", "with itself"),
        ("1 2\n", "1 0\n", "closed"),
        ("format ascii", "format utf8", "cannot understand"),
        ("element edge 3", "element face 3", "neither an element strand nor edges"),
    ],
)
def test_damaged_text_is_refused(tmp_path: Path, old: str, new: str, reason: str) -> None:
    """Each kind of damage is one FormatError that says what is wrong."""
    text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty double x\nproperty double y\n"
    text += "property double z\nelement edge 3\nproperty int vertex1\nproperty int vertex2\n"
    text += "end_header\n0 0.1 0\n0 0.12 0\n0 0.13 0\n0.1 0 0\n0.13 0 0\n0 1\n1 2\n3 4\n"
    assert old in text
    (tmp_path / "a.ply").write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError, match=reason):
        ply.import_groom(tmp_path / "a.ply", ply.Options())
