"""Laws of numbers in text."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.arrays import Float32Array
from hairkit.errors import FormatError
from hairkit.io.number_text import format_rows, read_numbers, strip_slots, whole_digits

floats = st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(rows=st.lists(st.tuples(floats, floats, floats), max_size=20))
def test_nine_digits_hold_a_float32(rows: list[tuple[float, float, float]]) -> None:
    """Writing rows and reading the numbers gives every bit back."""
    table = np.array(rows, np.float32).reshape(-1, 3)
    text = format_rows(b"%.9g %.9g %.9g\n", table)[0].decode("ascii")
    assert np.array_equal(read_numbers(text, "a.txt", "points").astype(np.float32), table.ravel())
    assert text.count("\n") == len(table)


@given(numbers=st.lists(floats, max_size=30))
def test_texts_are_those_of_python(numbers: list[float]) -> None:
    """Every number, large, small or odd, is written as `%` writes it, and ends where it says."""
    _assert_as_python_writes(np.array(numbers, np.float32))


def test_texts_are_those_of_python_in_every_decade() -> None:
    """Short numbers, ties and powers of ten in and around the decades without exponents."""
    rng = np.random.default_rng(5)
    decades = 10.0 ** rng.integers(-6, 11, 4000)
    for numbers in (
        rng.normal(size=4000) * decades,
        np.round(rng.normal(size=4000), 2) * decades,
        rng.integers(-(10**9), 10**9, 4000) / 2.0 ** rng.integers(0, 40, 4000),
        10.0 ** np.arange(-8, 12),
        np.nextafter((10.0 ** np.arange(-8, 12)).astype(np.float32), np.float32(0)),
        np.array([0.0, -0.0, 999999999.0, 305861792.0]),
    ):
        _assert_as_python_writes(numbers.astype(np.float32))


def _assert_as_python_writes(numbers: Float32Array) -> None:
    texts = [b"v %.9g;" % number for number in numbers.tolist()]
    text, ends = format_rows(b"v %.9g;", numbers[:, None])
    assert text == b"".join(texts)
    assert ends.tolist() == np.cumsum([len(part) for part in texts], dtype=np.int64).tolist()


@given(numbers=st.lists(st.integers(1, 10**9 - 1), max_size=30))
def test_whole_numbers_have_no_zeros_before_them(numbers: list[int]) -> None:
    """They are written as `str` writes them."""
    text = strip_slots(whole_digits(np.array(numbers, np.int64)))[0]
    assert text.decode("ascii") == "".join(map(str, numbers))


@pytest.mark.parametrize("text", ["1 x 2", "1,2", "1 2 0x", "--1", "1e", "1 nan", "inf", "1e999"])
def test_anything_but_finite_numbers_is_refused(text: str) -> None:
    """The error names the file and what was read."""
    with pytest.raises(FormatError, match=r"^a\.txt: points hold"):
        read_numbers(text, "a.txt", "points")
