"""Read and write numbers in text files with array operations instead of Python loops."""

from __future__ import annotations

import itertools
import os
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array, UInt8Array
from hairkit.errors import FormatError

_LARGEST = float(np.finfo(np.float32).max) * (1 + 1e-8)
"""Nine digits of the largest float32 lie just above it, and are rounded to it."""
_DIGITS = 9
"""Digits that hold any float32."""
_LOWEST, _HIGHEST = -4, 8
"""Decimal exponents that are not written out (`e-05`), and need no zeros behind the digits."""
_BELOW = (0, 0, -1, -2, -3)
"""Exponents below which a number begins with each of the characters `0.000`."""
_PLACE, _ZERO = b"%.9g", np.uint8(ord("0"))
_POWERS = 10.0 ** np.arange(_LOWEST, _HIGHEST + 2)
_SCALES = 10.0 ** (_HIGHEST - np.arange(_LOWEST, _HIGHEST + 1))
"""What brings nine digits before the point of a number, by its exponent's step from the lowest.

A float32 times 5**12 has 52 bits: the product is exact, and so its rounding is Python's."""
_BINARY = np.floor(np.log10(2.0) * (np.arange(256) - 127))
_STEPS = np.clip(_BINARY - _LOWEST, 0, _HIGHEST - _LOWEST).astype(np.int64)
"""Steps from the lowest decimal exponent, or one too few, by a float32's binary exponent."""


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


def format_rows(pattern: bytes, rows: Float32Array) -> tuple[bytes, Int64Array]:
    """Return the text of rows (N, C), and where in it each row ends (N,).

    The pattern has C places `%.9g`; the text is what Python's `%` makes of them, only faster.

    >>> format_rows(b"v %.9g %.9g\\n", np.array([[0.5, 2], [-3, 1e-7]], np.float32))
    (b'v 0.5 2\\nv -3 1.00000001e-07\\n', array([ 8, 28]))
    """
    between = [np.frombuffer(literal, np.uint8) for literal in pattern.split(_PLACE)]
    parts = [_constant(between[0], len(rows))]
    for column, literal in enumerate(between[1:]):
        parts += [_format_numbers(rows[:, column]), _constant(literal, len(rows))]
    return strip_slots(np.concatenate(parts))


def strip_slots(slots: UInt8Array) -> tuple[bytes, Int64Array]:
    """Return the characters of slots (W, N) text after text, and where each ends (N,).

    Bytes of zero are no characters.
    """
    lengths = (slots != 0).sum(axis=0, dtype=np.int32)
    return slots.T.tobytes().translate(None, b"\0"), np.cumsum(lengths, dtype=np.int64)


def whole_digits(numbers: Int64Array) -> UInt8Array:
    """Return slots (D, N) of whole numbers from 1 to 10**9 - 1.

    >>> strip_slots(whole_digits(np.array([7, 120])))
    (b'7120', array([1, 4]))
    """
    digits = _digits(numbers)
    return (digits + _ZERO) * ~_zeros_from(digits)


def _constant(literal: UInt8Array, count: int) -> UInt8Array:
    return np.broadcast_to(literal[:, None], (len(literal), count))


def _digits(numbers: npt.NDArray[Any]) -> UInt8Array:
    """Return the nine decimal digits (9, N) of whole numbers below 10**9."""
    digits = np.empty((_DIGITS, len(numbers)), np.uint8)
    rest = numbers.astype(np.uint32)
    for place in reversed(range(_DIGITS)):
        upper = rest // 10
        digits[place] = rest - 10 * upper
        rest = upper
    return digits


def _zeros_from(digits: UInt8Array) -> BoolArray:
    """Return (9, N) which digits are zeros with nothing but zeros in the rows above them."""
    zeros: BoolArray = digits == 0
    for above, row in itertools.pairwise(zeros):  # ten times as fast as NumPy's accumulate
        row &= above
    return zeros


def _format_numbers(numbers: Float32Array) -> UInt8Array:
    """Return slots (W, N) of numbers as `%.9g`.

    They are a sign, `0.000` where the number is below 1, nine digits, and a point behind each digit
    that a number here has it behind. Unused ones are zero.
    """
    exact = np.abs(numbers.astype(np.float64))
    raw = np.ascontiguousarray(numbers, np.float32).view(np.uint32)
    step = _STEPS[(raw >> 23) & 255]
    step += exact >= _POWERS[step + 1]
    step = np.minimum(step, len(_SCALES) - 1)
    nine = np.rint(exact * _SCALES[step])
    plain = (exact >= _POWERS[0]) & (nine < 10**_DIGITS)
    exponent = (step + _LOWEST).astype(np.int8)
    digits = _digits(np.where(plain, nine, 1))
    places = np.arange(_DIGITS, dtype=np.int8)[:, None]
    # %g leaves out the zeros at the end, but none before the point
    dropped = _zeros_from(digits[::-1])[::-1] & (places > exponent)
    used = (digits + _ZERO) * ~dropped
    slots = [(raw >> 31).astype(np.uint8) * np.uint8(ord("-"))]
    slots += [
        (exponent < most) * np.uint8(kind) for most, kind in zip(_BELOW, b"0.000", strict=True)
    ]
    present = np.bincount(step, minlength=len(_SCALES))[-_LOWEST:]
    for place in range(_DIGITS):
        slots.append(used[place])
        if place < _DIGITS - 1 and present[place]:
            slots.append(((exponent == place) & ~dropped[place + 1]) * np.uint8(ord(".")))
    found = np.stack(slots)
    odd = np.flatnonzero(~plain)
    if len(odd):
        texts = [b"%.9g" % number for number in numbers[odd].tolist()]
        found[:, odd] = np.array(texts, f"S{len(found)}").view(np.uint8).reshape(len(odd), -1).T
    return found
