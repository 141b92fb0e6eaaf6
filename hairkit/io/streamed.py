"""Arrays of a glTF buffer that are made while they are written, so that memory never holds them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.types.strand_blocks import Block, blocks
from hairkit.types.strands import Strands


@dataclass(frozen=True)
class Streamed:
    """Description of an array, and its pieces from the first element to the last."""

    dtype: np.dtype[Any]
    shape: tuple[int, ...]
    pieces: Callable[[], Iterator[npt.NDArray[Any]]]

    def __len__(self) -> int:
        return self.shape[0]

    @property
    def nbytes(self) -> int:
        """Bytes of the whole array."""
        return self.dtype.itemsize * prod(self.shape)


def at_points(
    strands: Strands, kind: npt.DTypeLike, values: Callable[[Block], npt.ArrayLike], *size: int
) -> Streamed:
    """Return an array (P, *size) whose values at the points of a block a function makes."""
    dtype = np.dtype(kind)

    def pieces() -> Iterator[npt.NDArray[Any]]:
        for block in blocks(strands):
            yield np.asarray(values(block), dtype)

    return Streamed(dtype, (len(strands.points), *size), pieces)


def repeat_row(row: npt.NDArray[Any], count: int) -> Streamed:
    """Return an array (count, ...) whose elements are all the same."""
    most = 16_384

    def pieces() -> Iterator[npt.NDArray[Any]]:
        block = np.broadcast_to(row, (most, *row.shape)).copy()
        for start in range(0, count, most):
            yield block[: count - start]

    return Streamed(row.dtype, (count, *row.shape), pieces)


def segments(strands: Strands, kind: npt.DTypeLike) -> Streamed:
    """Return (2 (P - S),) the points before and behind each segment."""
    dtype = np.dtype(kind)

    def pieces() -> Iterator[npt.NDArray[Any]]:
        for block in blocks(strands):
            start = block.points.start
            number = np.arange(start, block.points.stop, dtype=dtype)
            first = np.delete(number, strands.offsets[1:][block.strands] - 1 - start)
            yield np.stack([first, first + dtype.type(1)], axis=1)

    return Streamed(dtype, (2 * (len(strands.points) - len(strands)),), pieces)
