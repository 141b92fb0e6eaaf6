"""The native groom is lossless, plain to read, and refused when it is anything else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hairkit.errors import FormatError, InputError
from hairkit.storage import read_npz, to_arrays, write_npz
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom


def test_what_is_written_is_read(tmp_path: Path) -> None:
    """Every field comes back equal in every bit."""
    bristle_groom().save(tmp_path / "a.npz")
    before, after = to_arrays(bristle_groom()), to_arrays(Groom.load(tmp_path / "a.npz"))
    assert before.keys() == after.keys()
    for name, array in before.items():
        assert array.dtype == after[name].dtype
        assert np.array_equal(array, after[name])


def test_equal_grooms_give_equal_files(tmp_path: Path) -> None:
    """No time, name or order of this run goes into the file."""
    for name in ("a", "b"):
        bristle_groom().save(tmp_path / f"{name}.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_numpy_alone_reads_points_and_offsets(tmp_path: Path) -> None:
    """`points` (P, 3) and `offsets` (S + 1,) stand at the top."""
    groom = bristle_groom()
    groom.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as data:
        assert np.array_equal(data["points"], groom.strands.points)
        assert np.array_equal(data["offsets"], groom.strands.offsets)


def test_anything_else_is_refused(tmp_path: Path) -> None:
    """Another npz, a newer version, missing and inconsistent arrays, text and nothing: one line."""
    bristle_groom().save(tmp_path / "a.npz")
    arrays = read_npz(tmp_path / "a.npz")
    wrong = {
        "not a groom": {"x": np.zeros(3)},
        "a groom of version 2": arrays | {"hairkit_groom": np.asarray(2)},
        "not a stored Groom": {k: v for k, v in arrays.items() if k != "head.vertices"},
        "strand offsets must run": arrays | {"points": arrays["points"][:-1]},
        "expected": arrays | {"root_triangle": arrays["root_triangle"][:-1]},
    }
    for reason, content in wrong.items():
        write_npz(tmp_path / "b.npz", content)
        with pytest.raises(FormatError, match=reason):
            Groom.load(tmp_path / "b.npz")
    (tmp_path / "c.npz").write_text("hello")
    with pytest.raises(FormatError, match=r"not a readable \.npz"):
        Groom.load(tmp_path / "c.npz")
    with pytest.raises(InputError, match="no such file"):
        Groom.load(tmp_path / "d.npz")


def test_strands_are_selected_with_their_roots() -> None:
    """A mask and an array of numbers pick the same strands, in the order of the numbers."""
    groom = bristle_groom()
    numbers = np.array([7, 3, 5])
    mask = np.isin(np.arange(len(groom.strands)), numbers)
    assert groom.select(np.ones(len(groom.strands), bool)) is groom
    some, ordered = groom.select(mask), groom.select(numbers)
    assert np.array_equal(some.strands.roots, groom.strands.roots[[3, 5, 7]])
    assert np.array_equal(ordered.strands.roots, groom.strands.roots[numbers])
    assert np.array_equal(ordered.root_triangle, groom.root_triangle[numbers])
