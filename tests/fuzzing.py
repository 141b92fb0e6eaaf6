"""Files damaged on purpose: a Hypothesis strategy that reader tests draw from."""

from __future__ import annotations

import math
import os
import re
import struct
from collections.abc import Callable

from hypothesis import settings
from hypothesis import strategies as st

CASES = int(os.environ.get("HAIRKIT_FUZZ_CASES", "100"))
"""Damaged files for each reader; set the environment variable for a long run."""

_INTEGERS = (0, 1, 2, 7, 255, 65_535, 2**31 - 1, 2**31, 2**32 - 1, -1, -(2**31))
_FLOATS = (0.0, -1.0, 1e-30, 1e30, 3e38, math.nan, math.inf, -math.inf)
_WORDS = tuple(struct.pack("<I", number % 2**32) for number in _INTEGERS)
_WORDS += tuple(struct.pack("<f", number) for number in _FLOATS)
_WORDS += tuple(struct.pack("<Q", number) for number in (2**31, 2**63, 2**64 - 1))
_TEXTS = tuple(
    text.encode()
    for text in ("0", "-1", "1e999", "nan", "inf", "-2147483648", "4294967296", "9" * 40, "", "x")
)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_MOST_EDITS = 4
_LONGEST = 64


def long_run(cases: int) -> settings:
    """Return the settings of a test over so many damaged files, the same ones every time."""
    return settings(max_examples=cases, database=None, derandomize=True)


@st.composite
def damaged(draw: st.DrawFn, whole: bytes) -> bytes:
    """Return a valid file with one to four injuries.

    Flipped bits, words overwritten by extreme numbers, numbers of a text replaced by extreme ones,
    parts cut out, doubled or moved, and truncation.
    """
    data = whole
    for _ in range(draw(st.integers(1, _MOST_EDITS))):
        if data:
            data = draw(st.sampled_from(_EDITS))(draw, data)
    return data


def _place(draw: st.DrawFn, data: bytes) -> int:
    """Half of the places are near the start, where headers are."""
    head = min(len(data), 256)
    return draw(st.one_of(st.integers(0, head - 1), st.integers(0, len(data) - 1)))


def _flip(draw: st.DrawFn, data: bytes) -> bytes:
    at = _place(draw, data)
    return data[:at] + bytes([data[at] ^ (1 << draw(st.integers(0, 7)))]) + data[at + 1 :]


def _truncate(draw: st.DrawFn, data: bytes) -> bytes:
    return data[: _place(draw, data)]


def _overwrite(draw: st.DrawFn, data: bytes) -> bytes:
    at = _place(draw, data)
    at -= draw(st.sampled_from((at % 4, 0)))
    word = draw(st.sampled_from(_WORDS))
    return data[:at] + word + data[at + len(word) :]


def _renumber(draw: st.DrawFn, data: bytes) -> bytes:
    start = _place(draw, data)
    found = _NUMBER.search(data, start, start + 4096)
    if found is None:
        return data
    return data[: found.start()] + draw(st.sampled_from(_TEXTS)) + data[found.end() :]


def _cut(draw: st.DrawFn, data: bytes) -> bytes:
    at = _place(draw, data)
    return data[:at] + data[at + draw(st.integers(1, _LONGEST)) :]


def _splice(draw: st.DrawFn, data: bytes) -> bytes:
    at, other = _place(draw, data), _place(draw, data)
    return data[:at] + data[other : other + draw(st.integers(1, _LONGEST))] + data[at:]


_EDITS: tuple[Callable[[st.DrawFn, bytes], bytes], ...] = (
    _flip,
    _truncate,
    _overwrite,
    _overwrite,
    _renumber,
    _cut,
    _splice,
)
