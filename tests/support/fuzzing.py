"""Files damaged on purpose: a Hypothesis strategy that reader tests draw from."""

from __future__ import annotations

import math
import os
import re
import struct
from collections.abc import Callable
from random import Random

from hypothesis import settings
from hypothesis import strategies as st

CASES = int(os.environ.get("HAIRKIT_FUZZ_CASES", "60"))
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


def damaged(whole: bytes) -> st.SearchStrategy[bytes]:
    """Return a strategy of injured copies of a valid file; see `injured`."""
    return st.integers(0, 2**40).map(lambda seed: injured(whole, seed))


def injured(whole: bytes, seed: int) -> bytes:
    """Return a valid file with one to four injuries, the same ones for equal seeds.

    Flipped bits, words overwritten by extreme numbers, numbers of a text replaced by extreme ones,
    parts cut out or doubled elsewhere, and truncation.
    """
    chance, data = Random(seed), whole
    for _ in range(chance.randint(1, _MOST_EDITS)):
        if data:
            data = chance.choice(_EDITS)(chance, data)
    return data


def _place(chance: Random, data: bytes) -> int:
    """Half of the places are near the start, where headers are."""
    return chance.randrange(min(len(data), chance.choice((256, 2**40))))


def _flip(chance: Random, data: bytes) -> bytes:
    at = _place(chance, data)
    return data[:at] + bytes([data[at] ^ (1 << chance.randrange(8))]) + data[at + 1 :]


def _truncate(chance: Random, data: bytes) -> bytes:
    return data[: _place(chance, data)]


def _overwrite(chance: Random, data: bytes) -> bytes:
    at = _place(chance, data)
    at -= chance.choice((at % 4, 0))
    word = chance.choice(_WORDS)
    return data[:at] + word + data[at + len(word) :]


def _renumber(chance: Random, data: bytes) -> bytes:
    start = _place(chance, data)
    found = _NUMBER.search(data, start, start + 4096)
    if found is None:
        return data
    return data[: found.start()] + chance.choice(_TEXTS) + data[found.end() :]


def _cut(chance: Random, data: bytes) -> bytes:
    at = _place(chance, data)
    return data[:at] + data[at + chance.randint(1, _LONGEST) :]


def _splice(chance: Random, data: bytes) -> bytes:
    at, other = _place(chance, data), _place(chance, data)
    return data[:at] + data[other : other + chance.randint(1, _LONGEST)] + data[at:]


_EDITS: tuple[Callable[[Random, bytes], bytes], ...] = (
    _flip,
    _truncate,
    _overwrite,
    _overwrite,
    _renumber,
    _cut,
    _splice,
)
