"""Convert arrays to the bytes of binary files."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt


def as_bytes(kind: npt.DTypeLike, values: npt.ArrayLike) -> memoryview:
    """Return an array as bytes, converted to its type in the file; copied only where it must be.

    >>> bytes(as_bytes("<u2", [1, 2]))
    b'\\x01\\x00\\x02\\x00'
    """
    return np.ascontiguousarray(values, kind).reshape(-1).view(np.uint8).data


def join_bytes(parts: Sequence[tuple[npt.DTypeLike, npt.ArrayLike]]) -> memoryview:
    """Return arrays one after the other as bytes, each converted to its type in the file.

    >>> bytes(join_bytes([("<u2", [1, 2]), ("<f4", [1.0])]))
    b'\\x01\\x00\\x02\\x00\\x00\\x00\\x80?'
    """
    arrays = [(np.dtype(kind), np.asarray(values)) for kind, values in parts]
    buffer = np.empty(sum(kind.itemsize * values.size for kind, values in arrays), np.uint8)
    at = 0
    for kind, values in arrays:
        size = kind.itemsize * values.size
        place = buffer[at : at + size].view(kind)
        place.reshape(values.shape)[...] = values
        at += size
    return buffer.data
