"""Laws of .data and .bin files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import usc_data
from references import reference
from rich_groom import rich_groom

from hairkit.errors import FormatError
from hairkit.testing import bristle_groom


@pytest.mark.parametrize(("suffix", "width"), [(".data", 3), (".bin", 7)])
@pytest.mark.parametrize("make", [rich_groom, bristle_groom])
def test_counts_stand_before_each_strand(
    tmp_path: Path, suffix: str, width: int, make: object
) -> None:
    """Read by hand, word after word, the file gives the strands, and reading gives them back."""
    assert callable(make)
    groom, path = make(), tmp_path / f"a{suffix}"
    usc_data.export_groom(groom, path, usc_data.Options())
    data, at = path.read_bytes(), 4
    assert struct.unpack_from("<i", data)[0] == len(groom.strands)
    for strand in range(len(groom.strands)):
        count = struct.unpack_from("<i", data, at)[0]
        rows = np.frombuffer(data, "<f4", count * width, at + 4).reshape(count, width)
        start, end = groom.strands.offsets[strand : strand + 2]
        assert np.array_equal(rows[:, :3], groom.strands.points[start:end])
        assert not rows[:, 3:].any()
        at += 4 + 4 * width * count
    assert at == len(data)
    back = usc_data.import_groom(path, usc_data.Options()).strands
    assert np.array_equal(back.points, groom.strands.points)
    assert np.array_equal(back.offsets, groom.strands.offsets)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ([0], "0 strands"),
        ([-5, 0], "-5 strands"),
        ([2**31 - 1, 2], "2147483647 strands"),
        ([1, 2**31 - 1, 0], "no room for"),
        ([1, -1, 0], "-1 points"),
        ([1, 2, 0, 0, 0, 0, 0, 0, 9], "1 numbers follow"),
        ([2, 1, 0, 0, 0, 7], "no room for"),
    ],
)
def test_lying_counts_are_found_out(tmp_path: Path, words: list[int], reason: str) -> None:
    """Each count must leave room for what it claims, and the last strand must end the file."""
    (tmp_path / "a.data").write_bytes(np.array(words, "<i4").tobytes())
    with pytest.raises(FormatError, match=reason):
        usc_data.import_groom(tmp_path / "a.data", usc_data.Options())


def test_a_file_of_another_author_is_read(caplog: pytest.LogCaptureFixture) -> None:
    """1,024 roots with normals: those without any are dropped, the rest keeps its places."""
    path = reference("map_roots1024.data")
    strands = usc_data.import_groom(path, usc_data.Options()).strands
    rows = np.frombuffer(path.read_bytes(), "<f4", -1, 4).reshape(1024, 7)[:, 1:].reshape(-1, 2, 3)
    there = np.abs(rows[:, 1] - rows[:, 0]).max(axis=1) > 0
    assert np.array_equal(strands.points.reshape(-1, 2, 3), rows[there])
    assert f"{np.count_nonzero(~there)} strands without length dropped" in caplog.text
