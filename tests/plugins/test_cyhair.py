"""Laws of .hair files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import cyhair
from references import reference
from rich_groom import rich_groom

from hairkit.errors import FormatError, InputError
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands


def by_hand(data: bytes) -> tuple[list[int], list[float], list[float]]:
    """Return segments, points and thickness as the format's description has them."""
    _, strands, points, arrays = struct.unpack_from("<4s3I", data)
    assert arrays & 7 == 7
    at = 128 + 2 * strands
    segments = list(struct.unpack_from(f"<{strands}H", data, 128))
    return (
        segments,
        list(struct.unpack_from(f"<{3 * points}f", data, at)),
        list(struct.unpack_from(f"<{points}f", data, at + 12 * points)),
    )


def test_the_layout_is_the_published_one(tmp_path: Path) -> None:
    """Header of 128 bytes, then the arrays one after the other and nothing else."""
    groom, path = rich_groom(), tmp_path / "a.hair"
    cyhair.export_groom(groom, path, cyhair.Options())
    data, strands = path.read_bytes(), groom.strands
    assert data[:4] == b"HAIR"
    assert struct.unpack_from("<3I", data, 4) == (len(strands), len(strands.points), 1 + 2 + 4 + 16)
    segments, points, thickness = by_hand(data)
    assert segments == (strands.counts - 1).tolist()
    assert points == strands.points.reshape(-1).tolist()
    assert np.array_equal(np.float32(thickness), strands.widths)
    assert len(data) == 128 + 2 * len(strands) + 28 * len(strands.points)


@pytest.mark.parametrize("colours", [True, False])
def test_write_read_write_gives_the_same_bytes(tmp_path: Path, colours: bool) -> None:
    """What was written here is read without any loss."""
    options, first, second = (
        cyhair.Options(colours=colours),
        tmp_path / "1.hair",
        tmp_path / "2.hair",
    )
    cyhair.export_groom(rich_groom(), first, options)
    cyhair.export_groom(cyhair.import_groom(first, options), second, options)
    assert first.read_bytes() == second.read_bytes()


def test_every_array_but_points_may_be_missing(tmp_path: Path) -> None:
    """Segments, thickness and colour then come from the header."""
    groom, path = bristle_groom(), tmp_path / "a.hair"
    points = groom.strands.points
    header = struct.pack(
        "<4s4I5f88s", b"hair", len(points) // 5, len(points), 2, 4, 1e-4, 0, 0.2, 0.1, 0.05, b""
    )
    path.write_bytes(header + points.tobytes())
    back = cyhair.import_groom(path, cyhair.Options())
    assert np.array_equal(back.strands.points, points)
    assert set(back.strands.counts) == {5}
    assert back.material.width == pytest.approx(1e-4)
    assert np.allclose(back.material.root_colour, [0.2, 0.1, 0.05])


def test_too_many_points_are_refused(tmp_path: Path) -> None:
    """Segments are counted in 16 bits; nothing is left half-written."""
    groom = bristle_groom()
    line = np.zeros((2**16 + 1, 3), np.float32)
    line[:, 1] = np.linspace(0.1, 0.2, len(line))
    strands = Strands(line, np.array([0, len(line)]))
    long = Groom(strands, groom.head, groom.root_triangle[:1], groom.root_barycentric[:1])
    with pytest.raises(InputError, match="65536 at most"):
        cyhair.export_groom(long, tmp_path / "a.hair", cyhair.Options())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("at", "value", "reason"),
    [
        (0, b"HARE", "signature"),
        (4, struct.pack("<I", 2**32 - 1), "bytes are left"),
        (8, struct.pack("<I", 2**31), "the header says 2147483648"),
        (12, struct.pack("<I", 1), "the points are left out"),
        (12, struct.pack("<I", 2), "strands have 0 points"),
        (128, struct.pack("<H", 65535), "the header says"),
    ],
)
def test_lies_are_found_out(tmp_path: Path, at: int, value: bytes, reason: str) -> None:
    """Sizes are compared with each other and with the file."""
    path = tmp_path / "a.hair"
    cyhair.export_groom(rich_groom(), path, cyhair.Options())
    data = path.read_bytes()
    path.write_bytes(data[:at] + value + data[at + len(value) :])
    with pytest.raises(FormatError, match=reason):
        cyhair.import_groom(path, cyhair.Options())


def test_a_file_of_another_author_keeps_its_data(tmp_path: Path) -> None:
    """12,468 strands with a lower-case signature: read, written, and nothing moved."""
    source, path = reference("26266.hair"), tmp_path / "a.hair"
    groom = cyhair.import_groom(source, cyhair.Options())
    assert (len(groom.strands), groom.strands.counts.min(), groom.strands.counts.max()) == (
        12_468,
        5,
        33,
    )
    cyhair.export_groom(groom, path, cyhair.Options())
    theirs, ours = source.read_bytes(), path.read_bytes()
    points = 128 + 2 * 12_468 + 12 * 186_280
    assert ours[128:points] == theirs[128:points]
