"""Laws of saving and loading: nothing is lost, nothing is half-written, nothing bad is believed."""

from __future__ import annotations

import dataclasses
import os
import pickle
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit import storage, testing
from hairkit.arrays import frozen_array
from hairkit.errors import FormatError, InputError
from hairkit.storage import Stored, read_npz, write_bytes, write_npz
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

ITEMS: dict[str, Stored] = {
    "camera": testing.turn_scene().cameras[1],
    "scene": testing.turn_scene(),
    "head": testing.ball_head(),
    "roots": testing.scalp_roots(testing.ball_head()),
    "mask": testing.ball_mask(testing.turn_scene().cameras[0]),
    "orientation": testing.combed_orientation(testing.ball_mask(testing.turn_scene().cameras[0])),
    "hull": testing.shell_hull(0.03),
    "field": testing.combed_field(testing.shell_hull(0.03).grid),
    "strands": testing.bristle_groom().strands,
    "groom": testing.bristle_groom(),
}


def assert_equal(first: Any, second: Any) -> None:
    """Compare two stored things field by field, dtypes too."""
    assert type(first) is type(second)
    if isinstance(first, Stored):
        for field in dataclasses.fields(first):  # type: ignore[arg-type]  # all are dataclasses
            assert_equal(getattr(first, field.name), getattr(second, field.name))
    elif isinstance(first, tuple):
        assert len(first) == len(second)
        for one, other in zip(first, second, strict=True):
            assert_equal(one, other)
    elif isinstance(first, np.ndarray):
        assert first.dtype == second.dtype
        np.testing.assert_array_equal(first, second)
    else:
        assert first == second


@pytest.mark.parametrize("name", ITEMS)
def test_load_gives_back_what_save_wrote(name: str, tmp_path: Path) -> None:
    """Every field comes back with its value, its type and its precision."""
    item = ITEMS[name]
    item.save(tmp_path / "x.npz")
    assert_equal(type(item).load(tmp_path / "x.npz"), item)


def test_saving_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    """Equal content makes equal files, whenever they are written."""
    for name in ("a.npz", "b.npz"):
        ITEMS["groom"].save(tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize("kind", [Groom, Strands])
def test_another_type_is_refused(kind: type[Stored], tmp_path: Path) -> None:
    """A file of something else is no groom, and the error names the file."""
    ITEMS["mask"].save(tmp_path / "x.npz")
    with pytest.raises(
        FormatError,
        match=rf"x\.npz: not a (stored )?{kind.__name__.lower()}|stored {kind.__name__}",
    ):
        kind.load(tmp_path / "x.npz")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    """The error is the user's, one line."""
    with pytest.raises(InputError, match=r"none\.npz: no such file"):
        Strands.load(tmp_path / "none.npz")


def test_a_pointer_of_git_lfs_is_told(tmp_path: Path) -> None:
    """Asset repositories cloned without Git LFS hold pointers; the line says what to do."""
    path = tmp_path / "ponytail.hair"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
    with pytest.raises(InputError, match=r"ponytail\.hair: a pointer of Git LFS.*git lfs pull"):
        storage.open_file(path)


def test_pickles_are_never_opened(tmp_path: Path) -> None:
    """An object array would run code when it is read: it is refused."""
    fired = tmp_path / "fired"

    class Trap:
        def __reduce__(self) -> Any:
            return (os.mkdir, (str(fired),))

    np.savez(tmp_path / "x.npz", points=np.array([Trap()], dtype=object))
    with pytest.raises(FormatError, match=r"x\.npz"):
        Strands.load(tmp_path / "x.npz")
    (tmp_path / "y.npz").write_bytes(pickle.dumps(Trap()))
    with pytest.raises(FormatError):
        Strands.load(tmp_path / "y.npz")
    assert not fired.exists()


def _npz(path: Path, header: bytes, body: bytes, method: int = zipfile.ZIP_DEFLATED) -> None:
    """Write an npz of one array `points`, whose header and body need not agree."""
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    with zipfile.ZipFile(path, "w", method) as archive:
        start = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little")
        archive.writestr("points.npy", start + header + body)


def _header(shape: str, kind: str = "<f4", fortran: bool = False) -> bytes:
    return f"{{'descr': {kind!r}, 'fortran_order': {fortran}, 'shape': {shape}, }}".encode()


@pytest.mark.parametrize(
    ("header", "body"),
    [
        (_header("(50_000_000, 3)"), bytes(600_000_000)),
        (_header("(1_000_000_000_000, 3)"), bytes(12)),
        (_header("(-1, 3)"), bytes(12)),
        (_header("(4, 3)"), bytes(24)),
        (_header("(2, 3)"), bytes(48)),
        (_header("(1_000_000_000,)", "<U0"), b""),
    ],
    ids=["bomb", "wild count", "negative", "too short", "too long", "no size"],
)
def test_reading_asks_for_little_memory(tmp_path: Path, header: bytes, body: bytes) -> None:
    """Whatever a file claims, reading it takes at most 32 times its bytes, or 64 MiB."""
    path = tmp_path / "x.npz"
    _npz(path, header, body)
    del body
    tracemalloc.start()
    with pytest.raises(FormatError, match=r"x\.npz") as caught:
        read_npz(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    limit = max(storage.MAX_UNPACKED_RATIO * path.stat().st_size, storage.FREE_UNPACKED_BYTES)
    assert peak < limit + 2**20
    assert "\n" not in str(caught.value)


@given(
    shape=st.lists(st.integers(0, 4), max_size=3),
    kind=st.sampled_from(["<f4", ">f8", "<i8", "|b1", "|u1", "<U7", "<c16"]),
    fortran=st.booleans(),
    packed=st.booleans(),
)
def test_any_array_comes_back(
    tmp_path_factory: pytest.TempPathFactory,
    shape: list[int],
    kind: str,
    fortran: bool,
    packed: bool,
) -> None:
    """Every shape, type and order of axes is read as NumPy wrote it, to be written to."""
    values = np.arange(int(np.prod(shape))).reshape(shape, order="F" if fortran else "C")
    path = tmp_path_factory.getbasetemp() / "any.npz"
    write_npz(path, {"a": values.astype(kind), "b": np.ones(3)}, packed=packed)
    found = read_npz(path)
    assert found["a"].dtype == kind
    assert found["a"].flags.writeable
    np.testing.assert_array_equal(found["a"], values.astype(kind))
    np.testing.assert_array_equal(found["b"], np.ones(3))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_cut_file_is_refused(tmp_path: Path, share: float) -> None:
    """A file that lost its end is told from a whole one."""
    path = tmp_path / "x.npz"
    ITEMS["groom"].save(path)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(FormatError, match=r"x\.npz"):
        Groom.load(path)


def test_a_damaged_member_is_refused(tmp_path: Path) -> None:
    """A flipped byte inside the archive is found by its checksum."""
    path = tmp_path / "x.npz"
    write_npz(path, {"points": np.random.default_rng(0).random(1000)})
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(FormatError, match=r"x\.npz"):
        read_npz(path)


def test_a_member_that_is_no_array_is_refused(tmp_path: Path) -> None:
    """A zip of something else is not an npz of ours."""
    with zipfile.ZipFile(tmp_path / "x.npz", "w") as archive:
        archive.writestr("points.npy", b"text")
    with pytest.raises(FormatError):
        Strands.load(tmp_path / "x.npz")


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_an_interrupted_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    """Whatever stops a write, the old file is whole and no part of the new one is left."""
    path = tmp_path / "x.bin"
    write_bytes(path, b"old")

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, step, stop)
    with pytest.raises(KeyboardInterrupt):
        write_bytes(path, b"new and longer")
    assert path.read_bytes() == b"old"
    assert [each.name for each in tmp_path.iterdir()] == ["x.bin"]


def test_written_files_have_the_usual_rights(tmp_path: Path) -> None:
    """The file is as readable as any other new file, not private as temporary files are."""
    write_bytes(tmp_path / "a", b"")
    (tmp_path / "b").write_bytes(b"")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


def test_frozen_arrays_are_shared_and_what_others_may_write_to_is_not() -> None:
    """Freezing again costs no copy; a view, or an array that can be written to, is copied."""
    kept = frozen_array(np.ones((4, 3)), np.float32, (None, 3), "points")
    assert frozen_array(kept, np.float32, (None, 3), "points") is kept
    mine = np.ones((4, 3), np.float32)
    view = mine[:]
    view.setflags(write=False)
    for array in (mine, view):
        assert not np.shares_memory(frozen_array(array, np.float32, (None, 3), "points"), mine)


def test_sums_beyond_the_range_are_not_taken_for_values() -> None:
    """Large numbers whose sum overflows are finite; infinities that cancel are not."""
    most = np.finfo(np.float32).max
    assert len(frozen_array([most, most], np.float32, (2,), "points")) == 2
    with pytest.raises(InputError, match="2 values"):
        frozen_array([np.inf, -np.inf], np.float32, (2,), "points")


def test_frozen_arrays_are_checked_copies() -> None:
    """Shape and finiteness are checked; the result is read-only and no longer the caller's."""
    mine = np.zeros((2, 3), np.float32)
    kept = frozen_array(mine, np.float32, (None, 3), "points")
    mine[0, 0] = 1
    assert kept[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        kept[0, 0] = 2
    with pytest.raises(InputError, match=r"points has shape \(2, 3\), expected \(n, 4\)"):
        frozen_array(mine, np.float32, (None, 4), "points")
    with pytest.raises(InputError, match="points has 1 values that are not finite"):
        frozen_array([np.nan, 1], np.float32, (2,), "points")
