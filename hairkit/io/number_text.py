"""Read and write numbers in text files with array operations instead of Python loops."""

from __future__ import annotations

import os
import warnings

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import FormatError

_LARGEST = float(np.finfo(np.float32).max) * (1 + 1e-8)
"""Nine digits of the largest float32 lie just above it, and are rounded to it."""


def read_numbers(text: str, source: str | os.PathLike[str], name: str) -> Float64Array:
    """Return all numbers (N,) of a text, separated by white space.

    Raises `FormatError` naming the source when there is anything else between them, or a number is
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


def format_rows(pattern: bytes, rows: Float32Array) -> bytes:
    """Return the text of rows (N, C) by a pattern with C places `%.9g`, which hold any float32.

    >>> format_rows(b"v %.9g %.9g\\n", np.array([[0.5, 2], [-3, 1e-7]], np.float32))
    b'v 0.5 2\\nv -3 1.00000001e-07\\n'
    """
    return pattern * len(rows) % tuple(rows.ravel().tolist())
