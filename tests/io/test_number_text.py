"""Laws of numbers in text."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import FormatError
from hairkit.io.number_text import format_rows, read_numbers

floats = st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(rows=st.lists(st.tuples(floats, floats, floats), max_size=20))
def test_nine_digits_hold_a_float32(rows: list[tuple[float, float, float]]) -> None:
    """Writing rows and reading the numbers gives every bit back."""
    table = np.array(rows, np.float32).reshape(-1, 3)
    text = format_rows(b"%.9g %.9g %.9g\n", table).decode("ascii")
    assert np.array_equal(read_numbers(text, "a.txt", "points").astype(np.float32), table.ravel())
    assert text.count("\n") == len(table)


@pytest.mark.parametrize("text", ["1 x 2", "1,2", "1 2 0x", "--1", "1e", "1 nan", "inf", "1e999"])
def test_anything_but_finite_numbers_is_refused(text: str) -> None:
    """The error names the file and what was read."""
    with pytest.raises(FormatError, match=r"^a\.txt: points hold"):
        read_numbers(text, "a.txt", "points")
