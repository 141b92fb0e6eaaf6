"""Laws of .tfx files and the .tfxbone beside them."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import tressfx
from references import reference
from rich_groom import rich_groom

from hairkit.errors import FormatError
from hairkit.grooming.prepare_export import SHORTEST


@pytest.mark.parametrize("count", [4, 8, 16, 32, 64])
def test_the_layout_is_the_published_one(tmp_path: Path, count: int) -> None:
    """Header of 160 bytes; positions with inverse masses, 0 for the two points at the root."""
    groom, path = rich_groom(), tmp_path / "a.tfx"
    tressfx.export_groom(groom, path, tressfx.Options(points_per_strand=count))
    data, strands = path.read_bytes(), len(groom.strands)
    version, *header = struct.unpack_from("<f7I", data)
    assert (version, header[0], header[1], header[2]) == (4.0, strands, count, 160)
    assert data[32:160] == bytes(128)
    assert all(at % 8 == 0 for at in header[2:])
    rows = np.frombuffer(data, "<f4", 4 * strands * count, 160).reshape(strands, count, 4)
    assert np.array_equal(rows[0, :, :3], groom.strands.resampled(count).points[:count])
    assert (rows[:, :2, 3] == 0).all()
    assert (rows[:, 2:, 3] == 1).all()
    uv = np.frombuffer(data, "<f4", 2 * strands, header[3]).reshape(-1, 2)
    assert groom.strands.root_uv is not None
    assert np.allclose(uv, groom.strands.root_uv * [1, -1] + [0, 1], atol=1e-7)


def test_every_strand_is_bound_to_the_head_joint(tmp_path: Path) -> None:
    """The bone file names the joints, then gives each strand four weights that sum to one."""
    tressfx.export_groom(rich_groom(), tmp_path / "a.tfx", tressfx.Options())
    data, at, names = (tmp_path / "a.tfxbone").read_bytes(), 4, []
    for index in range(struct.unpack_from("<i", data)[0]):
        number, length = struct.unpack_from("<ii", data, at)
        assert number == index
        names.append(data[at + 8 : at + 8 + length].decode())
        at += 8 + length
    assert names == ["root\0", "neck\0", "head\0"]
    count = struct.unpack_from("<i", data, at)[0]
    assert len(data) == at + 4 + 36 * count
    for strand in range(count):
        number, *pairs = struct.unpack_from("<i" + "if" * 4, data, at + 4 + 36 * strand)
        assert number == strand
        assert pairs[:2] == [2, 1.0]
        assert sum(pairs[1::2]) == 1.0


def test_the_bone_file_can_be_left_out(tmp_path: Path) -> None:
    """bones=false writes the .tfx alone."""
    tressfx.export_groom(rich_groom(), tmp_path / "a.tfx", tressfx.Options(bones=False))
    assert [path.name for path in tmp_path.iterdir()] == ["a.tfx"]


@pytest.mark.parametrize("colours", [True, False])
def test_write_read_write_gives_the_same_bytes(tmp_path: Path, colours: bool) -> None:
    """What was written here is read without any loss."""
    options = tressfx.Options(colours=colours)
    for name, groom in (("1", rich_groom()), ("2", None)):
        source = groom or tressfx.import_groom(tmp_path / "1.tfx", options)
        tressfx.export_groom(source, tmp_path / f"{name}.tfx", options)
    for suffix in (".tfx", ".tfxbone"):
        assert (tmp_path / f"1{suffix}").read_bytes() == (tmp_path / f"2{suffix}").read_bytes()


def test_strands_of_the_right_count_are_not_resampled(tmp_path: Path) -> None:
    """Points stand where they stood, however unevenly they are spaced."""
    groom = rich_groom()
    even = groom.strands.resampled(16)
    uneven = replace(
        even,
        points=even.points + np.float32([0, 1e-4, 0]) * np.arange(len(even.points))[:, None] % 7,
    )
    tressfx.export_groom(
        replace(groom, strands=uneven), tmp_path / "a.tfx", tressfx.Options(points_per_strand=16)
    )
    back = tressfx.import_groom(tmp_path / "a.tfx", tressfx.Options())
    assert np.array_equal(back.strands.points, uneven.points)


def test_files_of_version_3_are_read(tmp_path: Path) -> None:
    """`TressFXFileObject`: a header of 296 bytes, three numbers a point, where the header says."""
    rng = np.random.default_rng(0)
    points = np.cumsum(rng.normal(scale=0.01, size=(9, 4, 3)), axis=1).astype("<f4")
    points[:, :, 0] += 0.1 * np.linspace(-1, 1, 9)[:, None]
    width = np.full(9, 0.0001, "<f4")
    header = struct.pack("<f4I31I6I32I", 3.0, 9, 4, 0, 1, *[0] * 31, 296, 296 + points.nbytes,
                         0, 0, 0, 0, *[0] * 32)  # fmt: skip
    path = tmp_path / "old.tfx"
    path.write_bytes(header + points.tobytes() + width.tobytes())
    groom = tressfx.import_groom(path, tressfx.Options())
    np.testing.assert_array_equal(groom.strands.points, points.reshape(-1, 3))
    np.testing.assert_array_equal(groom.strands.widths, np.repeat(width, 4))
    path.write_bytes(struct.pack("<f", 5.0) + header[4:])
    with pytest.raises(FormatError, match="at byte 0, the version is 5, expected 3 or 4"):
        tressfx.import_groom(path, tressfx.Options())


TEXT = """version 2.0
scale 2.0
rotation 0 0 0
translation 0 0.01 0
bothEndsImmovable 0
numStrands 2
is sorted 1
strand 0 numVerts 3 texcoord 0.25 0.5
0 0.05 0
0 0.06 0
0 0.07 0.01
strand 1 numVerts 2 texcoord 0.75 0.125
0.05 0.01 0
0.07 0.01 0
"""


def test_text_files_are_read(tmp_path: Path) -> None:
    """Points are scaled, then moved; texture coordinates are turned upright."""
    (tmp_path / "a.tfx").write_text(TEXT)
    strands = tressfx.import_groom(tmp_path / "a.tfx", tressfx.Options()).strands
    assert strands.counts.tolist() == [3, 2]
    assert np.allclose(strands.points[:2], [[0, 0.11, 0], [0, 0.13, 0]])
    assert np.allclose(strands.root_uv, [[0.25, 0.5], [0.75, 0.875]])


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("numStrands 2", "numStrands 3", "numStrands differs"),
        ("numVerts 3", "numVerts 4", "expected 18"),
        ("numVerts 3", "numVerts -3", "numVerts holds -3"),
        ("0 0.06 0", "0 nan 0", "not finite"),
        ("0 0.06 0", "0 x 0", "no number"),
        ("scale 2.0", "scale 0", "scale is not one number above 0"),
        ("texcoord 0.25", "texcoord", "a line is not"),
        ("strand", "hair", "no line that begins with 'strand'"),
    ],
)
def test_damaged_text_is_refused(tmp_path: Path, old: str, new: str, reason: str) -> None:
    """Each kind of damage is one FormatError that says what is wrong."""
    (tmp_path / "a.tfx").write_text(TEXT.replace(old, new))
    with pytest.raises(FormatError, match=reason):
        tressfx.import_groom(tmp_path / "a.tfx", tressfx.Options())


def test_files_of_another_author_are_read(tmp_path: Path) -> None:
    """AMD's mohawk keeps its positions when it is written again; the text fringe is read."""
    source = reference("Ratboy_mohawk.tfx")
    options = tressfx.Options(scale=0.4)
    groom = tressfx.import_groom(source, options)
    tressfx.export_groom(groom, tmp_path / "a.tfx", options)
    theirs = np.frombuffer(source.read_bytes(), "<f4", 2228 * 128, 160).reshape(2228, 32, 4)
    steps = np.linalg.norm(np.diff(theirs[..., :3], axis=1), axis=2)
    theirs = theirs[0.4 * steps.sum(axis=1) > SHORTEST]
    ours = np.frombuffer((tmp_path / "a.tfx").read_bytes(), "<f4", theirs.size, 160)
    assert np.allclose(ours.reshape(theirs.shape), theirs, rtol=3e-7, atol=1e-8)
    fringe = tressfx.import_groom(reference("text_v2_front.tfx"), tressfx.Options(scale=0.0023))
    assert len(fringe.strands) == 93
    assert set(fringe.strands.counts) == {16}
