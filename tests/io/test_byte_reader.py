"""Laws of reading binary files: every size is checked before memory is asked for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import FormatError
from hairkit.io.byte_reader import ByteReader, finite
from hairkit.io.byte_writer import join_bytes

KINDS = ("<u2", ">i4", "<f4", "<f8", "u1")
arrays = st.lists(st.tuples(st.sampled_from(KINDS), st.lists(st.integers(0, 99), max_size=9)))


@given(parts=arrays)
def test_reading_undoes_joining(parts: list[tuple[str, list[int]]]) -> None:
    """Arrays come back in their order, and nothing is left over."""
    reader = ByteReader(bytes(join_bytes(parts)), "a.bin")
    for kind, values in parts:
        assert reader.array(kind, len(values), "values").tolist() == values
    assert reader.left == 0


@given(count=st.integers(-(2**70), 2**70) | st.integers(-2, 20), width=st.integers(1, 2**40))
def test_no_array_goes_beyond_the_end(count: int, width: int) -> None:
    """Sizes that the file has no room for, or below 0, are one FormatError, whatever they are."""
    reader = ByteReader(bytes(64), "a.bin")
    if 0 <= 4 * count * width <= 64:
        assert reader.array("<f4", (count, width), "values").shape == (count, width)
        return
    with pytest.raises(FormatError, match=r"a\.bin: damaged or another format"):
        reader.array("<f4", (count, width), "values")
    assert reader.at == 0


def test_errors_name_file_byte_and_cause() -> None:
    """The message says where reading stopped and what was asked for."""
    reader = ByteReader(bytes(10), "hair.bin")
    reader.number("<u4", "count")
    with pytest.raises(FormatError, match=r"^hair\.bin: .*at byte 4, points has 3 x 3 values of 4"):
        reader.array("<f4", (3, 3), "points")
    with pytest.raises(FormatError, match=r"table would be at byte 11 of 10"):
        reader.seek(11, "table")
    reader.seek(10, "end")
    assert reader.left == 0


def test_text_ends_at_the_first_nul() -> None:
    """Names in fixed fields are cut at NUL; bytes that are no UTF-8 do not stop reading."""
    reader = ByteReader(b"head\0\0\xff\xfeab", "a.bin")
    assert reader.text(6, "name") == "head"
    assert reader.text(4, "name").endswith("ab")


def test_only_finite_numbers_pass() -> None:
    """NaN and infinity are counted in the error."""
    good = np.arange(3.0)
    assert finite(good, "a.bin", "points") is good
    with pytest.raises(FormatError, match="2 of the points are not finite"):
        finite(np.array([0.0, np.nan, np.inf]), "a.bin", "points")
