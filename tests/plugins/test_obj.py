"""Laws of .obj files with lines."""

from __future__ import annotations

from itertools import chain, pairwise
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import obj
from references import reference
from rich_groom import rich_groom

from hairkit.errors import FormatError


def test_each_strand_is_one_line(tmp_path: Path) -> None:
    """Vertices in order, one `l` a strand over neighbouring numbers from 1."""
    groom, path = rich_groom(), tmp_path / "a.obj"
    obj.export_groom(groom, path, obj.Options())
    lines = path.read_text().splitlines()
    points = np.array([line.split()[1:] for line in lines if line.startswith("v ")], np.float32)
    assert np.array_equal(points, groom.strands.points)
    runs = [list(map(int, line.split()[1:])) for line in lines if line.startswith("l ")]
    assert list(chain.from_iterable(runs)) == list(range(1, len(points) + 1))
    assert [len(run) for run in runs] == groom.strands.counts.tolist()


def test_write_read_write_gives_the_same_bytes(tmp_path: Path) -> None:
    """Nine digits are enough for a float32."""
    obj.export_groom(rich_groom(), tmp_path / "1.obj", obj.Options())
    back = obj.import_groom(tmp_path / "1.obj", obj.Options())
    obj.export_groom(back, tmp_path / "2.obj", obj.Options())
    assert (tmp_path / "1.obj").read_bytes() == (tmp_path / "2.obj").read_bytes()


POINTS = "v 0 0.1 0\nv 0 0.12 0\nv 0 0.13 0\nv 0.1 0 0\nv 0.13 0 0\n"


def test_a_byte_order_mark_is_no_part_of_the_first_vertex(tmp_path: Path) -> None:
    """Editors on Windows write one."""
    (tmp_path / "a.obj").write_text(f"\ufeff{POINTS}l 1 2 3\n", encoding="utf-8")
    read = obj.import_groom(tmp_path / "a.obj", obj.Options(scale=1.0))
    assert len(read.strands.points) == 3


@pytest.mark.parametrize(
    "lines",
    [
        "l 1 2 3\nl 4 5\n",
        "l -5 -4 -3\nl -2 -1\n",
        "l 1/1 2/2 3/3\nl 4/1 5/2\n",
        "l 1 2 \\\n 3\nl 4 5\n",
        "l 1 2\nl 2 3\nl 4 5\n",
        "o hair\nl 4 5\ng x\nl 2 3\nl 1 2\nf 1 2 3\n",
    ],
)
def test_lines_are_read_however_they_are_written(tmp_path: Path, lines: str) -> None:
    """Whole strands or single edges, numbers from the start or back, with texture coordinates."""
    (tmp_path / "a.obj").write_text(POINTS + lines)
    strands = obj.import_groom(tmp_path / "a.obj", obj.Options()).strands
    found = [strands.points[a:b, 1].tolist() for a, b in pairwise(strands.offsets)]
    assert sorted(found, key=len) == [[0, 0], np.float32([0.1, 0.12, 0.13]).tolist()]


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        ("f 1 2 3\n", "holds no lines"),
        ("l 1 2 9\n", "outside 1 to 5"),
        ("l 0 1 2\n", "outside 1 to 5"),
        ("l -6 1 2\n", "outside 1 to 5"),
        ("l 1 x 3\n", "no number"),
        ("l 1 2.5 3\n", "no vertex number"),
        ("v 1 2\nl 1 2\n", "coordinates"),
        ("v 1 2 nan\nl 1 2\n", "not finite"),
        ("l 1 2\nl 2 3\nl 2 4\n", "more than two edges"),
        ("l 1 2\nl 2 3\nl 3 1\n", "closed"),
    ],
)
def test_damage_is_refused(tmp_path: Path, lines: str, reason: str) -> None:
    """Each kind of damage is one FormatError that says what is wrong."""
    (tmp_path / "a.obj").write_text(POINTS + lines)
    with pytest.raises(FormatError, match=reason):
        obj.import_groom(tmp_path / "a.obj", obj.Options())


def test_a_file_of_another_author_is_read() -> None:
    """98 kinky strands in centimetres, on a head that keeps its size."""
    groom = obj.import_groom(reference("curlycue_lines.obj"), obj.Options(scale=0.01))
    assert len(groom.strands) == 98
    assert len(groom.strands.points) == 10_589
    assert 0.6 < groom.strands.lengths().min() < groom.strands.lengths().max() < 1.0
    assert 0.15 < np.ptp(groom.head.vertices[:, 0]) < 0.18
