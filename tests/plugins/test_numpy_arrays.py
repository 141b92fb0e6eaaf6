"""Laws of .npy and .convdata files."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hairkit_plugins import numpy_arrays
from references import reference

from hairkit.errors import FormatError
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom


def strands() -> Any:
    """Return (S, P, 3) hair of one number of points."""
    whole = bristle_groom().strands.resampled(7)
    return whole.points.reshape(-1, 7, 3)


def read(path: Path, array: Any) -> Groom:
    """Return the groom in an array's file."""
    with path.open("wb") as file:
        np.save(file, array)
    return numpy_arrays.import_groom(path, numpy_arrays.Options())


@pytest.mark.parametrize("change", [np.ascontiguousarray, np.asfortranarray, np.float64])
def test_an_array_is_its_strands(tmp_path: Path, change: Any) -> None:
    """In either order of its numbers and either precision."""
    found = read(tmp_path / "a.npy", change(strands())).strands
    np.testing.assert_array_equal(found.points.reshape(strands().shape), strands())


def test_a_map_of_roots_is_the_strands_that_it_shows(tmp_path: Path) -> None:
    """Row after row, without the places that are 0, the curvature passed over."""
    hair = strands()[:20]
    table = np.zeros((4, 6, 7, 4), np.float32)
    table.reshape(24, 7, 4)[2:22, :, :3] = hair
    table[..., 3] = 5.0
    maps = table.transpose(2, 3, 0, 1).reshape(28, 4, 6)
    found = read(tmp_path / "a.convdata", maps).strands
    np.testing.assert_array_equal(found.points.reshape(hair.shape), hair)


@pytest.mark.parametrize(
    ("name", "array", "reason"),
    [
        ("a.npy", np.zeros((4, 3)), "expected strands x points x 3"),
        ("a.npy", np.zeros((4, 2, 4)), "expected strands x points x 3"),
        ("a.npy", np.zeros((0, 2, 3)), "expected strands x points x 3"),
        ("a.npy", np.zeros((4, 2, 3), int), "expected floating point numbers"),
        ("a.npy", np.full((4, 2, 3), np.nan), "24 of the points are not finite"),
        ("a.npy", np.float32(1), "an array of no numbers"),
        ("a.convdata", np.zeros((8, 2, 2)), "holds no hair"),
        ("a.convdata", np.zeros((7, 2, 2)), "expected 4 for each point"),
    ],
)
def test_other_arrays_are_refused(tmp_path: Path, name: str, array: Any, reason: str) -> None:
    """One line that says what an array of hair is."""
    with pytest.raises(FormatError, match=reason):
        read(tmp_path / name, array)


def test_python_objects_are_not_made(tmp_path: Path) -> None:
    """A pickle in an array could run a program; it is refused unread."""
    with pytest.raises(FormatError, match="array of object"):
        read(tmp_path / "a.npy", np.array([{}, {}], object))


def test_a_header_may_not_claim_more_than_there_is(tmp_path: Path) -> None:
    """Before any memory is taken."""
    stream = io.BytesIO()
    header = {"descr": "<f4", "fortran_order": False, "shape": (2**40, 2, 3)}
    np.lib.format.write_array_header_1_0(stream, header)
    (tmp_path / "a.npy").write_bytes(stream.getvalue())
    with pytest.raises(FormatError, match="but 0 bytes are left"):
        numpy_arrays.import_groom(tmp_path / "a.npy", numpy_arrays.Options())


def test_a_file_of_hairnet_is_read() -> None:
    """A map of 32 x 32 roots with 100 points each, of its authors' tools."""
    path = reference("strands00014_00035_00010.convdata")
    found = numpy_arrays.import_groom(path, numpy_arrays.Options()).strands
    assert (found.counts == 100).all()
    assert 900 < len(found) <= 32 * 32
