"""Numbers in text files, read and written without a Python step for each."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from hairkit.errors import FormatError
from hairkit.stored import Float64Array

_ROWS_AT_ONCE = 65_536
_LARGEST = float(np.finfo(np.float32).max) * (1 + 1e-8)
"""Nine digits of the largest float32 lie just above it, and are rounded to it."""


def read_numbers(text: str, source: str | os.PathLike[str], name: str) -> Float64Array:
    """Return all numbers (N,) of a text, parted by white space.

    Raises `FormatError` naming the source when something else stands between them, or a number is
    not finite.

    >>> read_numbers("1 2e1", "a.txt", "points")
    array([ 1., 20.])
    """
    if not text or text.isspace():
        return np.zeros(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            numbers = np.fromstring(text, np.float64, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise FormatError(f"{source}: {name} hold something that is no number") from error
    if not (np.abs(numbers) <= _LARGEST).all():
        raise FormatError(f"{source}: {name} hold numbers that are not finite in 32 bits")
    return numbers


def written_rows(pattern: str, rows: npt.NDArray[np.generic]) -> Iterator[str]:
    """Yield texts of rows (N, C), each by `pattern` with C places: `"v %.9g %.9g %.9g\\n"`."""
    for start in range(0, len(rows), _ROWS_AT_ONCE):
        part = rows[start : start + _ROWS_AT_ONCE]
        yield (pattern * len(part)) % tuple(part.reshape(-1).tolist())
