"""Frozen types that can be written to one `.npz` and read back: the lossless native form."""

from __future__ import annotations

import dataclasses
import io
import os
import tempfile
import tokenize
import types
import typing
import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from hairkit.errors import FormatError, InputError

MAX_UNPACKED_BYTES = 4 * 2**30
"""Refuse archives that claim to unpack to more than this many bytes."""

_UNREADABLE = (
    zipfile.BadZipFile,
    zlib.error,
    ValueError,
    OSError,
    EOFError,
    MemoryError,
    NotImplementedError,
    RuntimeError,
    SyntaxError,
    KeyError,
    tokenize.TokenError,
)
"""What zipfile and NumPy raise on damaged archives, encrypted members and wild headers included."""
_EPOCH = (1980, 1, 1, 0, 0, 0)


class Stored:
    """Base of the frozen dataclasses between stages: gives them `save` and `load`.

    Fields may be arrays, numbers, strings, `None`, other `Stored` types and tuples of them.
    """

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write every field to `path` (npz, compressed), atomically and byte for byte the same."""
        write_npz(path, to_arrays(self))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` wrote; raises `FormatError` naming `path` when it is anything else."""
        return from_arrays(cls, read_npz(path), str(path))


_StoredType = typing.TypeVar("_StoredType", bound=Stored)


def to_arrays(value: Stored) -> dict[str, npt.NDArray[Any]]:
    """Return every field as an array, named `field` or `field.field`; None is left out."""
    return _to_arrays(value, "")


def from_arrays(
    kind: type[_StoredType], arrays: dict[str, npt.NDArray[Any]], source: str
) -> _StoredType:
    """Return the object that `to_arrays` took apart; `FormatError` begins with `source`."""
    try:
        return typing.cast(_StoredType, _from_arrays(kind, arrays, ""))
    except (KeyError, TypeError, ValueError) as error:
        raise FormatError(f"{source}: not a stored {kind.__name__}: {error}") from error


def write_npz(
    path: str | os.PathLike[str],
    arrays: dict[str, npt.NDArray[Any]],
    *,
    packed: bool = True,
    durable: bool = True,
) -> None:
    """Write arrays to an npz file with fixed time stamps, through a temporary file and a rename.

    Parameters
    ----------
    path
        The file; it is either the old one or the whole new one at any moment.
    arrays
        Arrays by name.
    packed
        False leaves the arrays uncompressed, which is many times faster.
    durable
        False does not wait for the disk: a power failure, not a crash, may lose the file.
    """
    method = zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method, compresslevel=1) as archive:
        for name, array in arrays.items():
            info = zipfile.ZipInfo(name + ".npy", _EPOCH)
            info.compress_type = method
            with archive.open(info, "w", force_zip64=array.nbytes > 2**31) as member:
                np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)
    write_bytes(path, buffer.getbuffer(), durable=durable)


def read_npz(path: str | os.PathLike[str]) -> dict[str, npt.NDArray[Any]]:
    """Read every array of an npz file; `FormatError` for pickles, bombs and damaged files."""
    try:
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(info.file_size for info in archive.infolist())
        if unpacked > MAX_UNPACKED_BYTES:
            raise FormatError(
                f"{path}: claims to unpack to {unpacked} bytes, more than {MAX_UNPACKED_BYTES}"
            )
        with np.load(path, allow_pickle=False) as data:
            return {name: data[name] for name in data.files}
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except _UNREADABLE as error:
        if isinstance(error, FormatError):
            raise
        reason = str(error).partition("\n")[0][:120]  # zipfile quotes the damaged bytes in full
        raise FormatError(f"{path}: not a readable .npz file ({reason})") from error


def write_bytes(
    path: str | os.PathLike[str], data: bytes | memoryview, *, durable: bool = True
) -> None:
    """Write `data` to `path` so that the file is either the old one or the whole new one."""
    write_pieces(path, (data,), durable=durable)


def write_pieces(
    path: str | os.PathLike[str], pieces: Iterable[bytes | memoryview], *, durable: bool = True
) -> None:
    """Write pieces one after the other as `write_bytes` does, without joining them in memory."""
    target = Path(path)
    handle, temporary = tempfile.mkstemp(
        prefix=f".{target.name}.", suffix=".part", dir=target.parent
    )
    try:
        with os.fdopen(handle, "wb") as file:
            for piece in pieces:
                file.write(piece)
            file.flush()
            if durable:
                os.fsync(file.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, target)
    except BaseException as error:
        Path(temporary).unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(target)  # a failed write does not say which file it was
        raise


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write UTF-8 text as `write_bytes` does."""
    write_bytes(path, text.encode())


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _to_arrays(value: Any, prefix: str) -> dict[str, npt.NDArray[Any]]:
    if value is None:
        return {}
    if isinstance(value, tuple):
        arrays = {prefix + "count": np.asarray(len(value))}
        for index, item in enumerate(value):
            arrays |= _to_arrays(item, f"{prefix}{index}.")
        return arrays
    if isinstance(value, Stored):
        arrays = {}
        for field in dataclasses.fields(typing.cast(Any, value)):
            arrays |= _to_arrays(getattr(value, field.name), f"{prefix}{field.name}.")
        return arrays
    return {prefix[:-1]: np.asarray(value)}


def _from_arrays(kind: Any, arrays: dict[str, npt.NDArray[Any]], prefix: str) -> Any:
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        kinds = [option for option in typing.get_args(kind) if option is not types.NoneType]
        present = any(name == prefix[:-1] or name.startswith(prefix) for name in arrays)
        return _from_arrays(kinds[0], arrays, prefix) if present else None
    if typing.get_origin(kind) is tuple:
        item = typing.get_args(kind)[0]
        return tuple(
            _from_arrays(item, arrays, f"{prefix}{i}.")
            for i in range(int(arrays[prefix + "count"]))
        )
    if isinstance(kind, type) and issubclass(kind, Stored):
        hints = typing.get_type_hints(kind)
        names = [field.name for field in dataclasses.fields(typing.cast(Any, kind))]
        return kind(
            **{name: _from_arrays(hints[name], arrays, f"{prefix}{name}.") for name in names}
        )
    array = arrays[prefix[:-1]]
    return kind(array[()]) if kind in (bool, int, float, str) else _scalar_or_array(kind, array)


def _scalar_or_array(kind: Any, array: npt.NDArray[Any]) -> Any:
    return str(array[()]) if typing.get_origin(kind) is typing.Literal else array
