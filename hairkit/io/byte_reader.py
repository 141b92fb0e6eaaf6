"""Parse binary files, with every size checked before memory is allocated."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.errors import FormatError


class ByteReader:
    """A cursor over a file's bytes."""

    def __init__(self, data: bytes, source: str | os.PathLike[str], at: int = 0) -> None:
        self.data, self.source, self.at = data, source, at

    @property
    def left(self) -> int:
        """Bytes from here to the end."""
        return len(self.data) - self.at

    def seek(self, at: int, name: str) -> None:
        """Go to byte `at`; raises `FormatError` when the file ends before it."""
        if not 0 <= at <= len(self.data):
            raise self.error(f"{name} would be at byte {at} of {len(self.data)}")
        self.at = at

    def array(self, dtype: npt.DTypeLike, shape: int | tuple[int, ...], name: str) -> Any:
        """Return the next numbers, read-only, of the file's own type.

        Raises `FormatError` when they go beyond the file's end or a size is negative.
        """
        wanted = (int(shape),) if isinstance(shape, (int, np.integer)) else tuple(map(int, shape))
        kind, count = np.dtype(dtype), 1
        for size in wanted:
            count *= size
        if min(wanted, default=0) < 0 or count * kind.itemsize > self.left:
            raise self.error(
                f"{name} has {' x '.join(map(str, wanted))} values of {kind.itemsize} bytes,"
                f" but {self.left} bytes are left"
            )
        result = np.frombuffer(self.data, kind, count, self.at).reshape(wanted)
        self.at += count * kind.itemsize
        return result

    def number(self, dtype: npt.DTypeLike, name: str) -> Any:
        """Return the next number as a Python int or float."""
        return self.array(dtype, 1, name)[0].item()

    def text(self, length: int, name: str) -> str:
        """Return the next `length` bytes up to the first NUL as text."""
        raw = self.array(np.uint8, length, name).tobytes().partition(b"\0")[0]
        return str(raw.decode("utf-8", "replace"))

    def error(self, reason: str) -> FormatError:
        """Return the error to raise: it names the file and the byte."""
        return FormatError(f"{self.source}: damaged or another format: at byte {self.at}, {reason}")


def finite(array: npt.NDArray[Any], source: str | os.PathLike[str], name: str) -> npt.NDArray[Any]:
    """Return the array; raises `FormatError` when it holds NaN or infinity."""
    bad = int(np.count_nonzero(~np.isfinite(array)))
    if bad:
        raise FormatError(f"{source}: {bad} of the {name} are not finite numbers")
    return array
