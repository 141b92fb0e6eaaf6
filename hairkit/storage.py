"""Files on disk: guarded reading, atomic writing, and frozen types as one `.npz` and back.

Every file that a user names is opened by `open_file`, and read by it, `read_bytes` or `read_text`.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import secrets
import stat
import threading
import tokenize
import tomllib
import types
import typing
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
import numpy.typing as npt

from hairkit.errors import FormatError, InputError
from hairkit.system import utf8_name

MAX_FILE_BYTES = 4 * 2**30
"""Files larger than this are refused."""
MAX_UNPACKED_RATIO, FREE_UNPACKED_BYTES = 32, 64 * 2**20
"""An npz may unpack to 32 times its own size, and to 64 MiB whatever its size.

Deflate reaches 1030 : 1 on zeros. Grooms are packed 1.5 : 1 and volumes 8 : 1; masks, 65 : 1, are
below 64 MiB.
"""
_POINTER = b"version https://git-lfs.github.com/spec/"
"""Begin of a text that stands for a large file in a clone without Git LFS."""
_CHUNK_BYTES = 2**20
"""Arrays are unpacked in pieces of this size, straight into their memory."""
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a named pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}

parsing = threading.Lock()
"""Held while Python parses source, as which it reads the headers of arrays: Python before 3.11.8
counts the depth of all threads together and may raise `SystemError` (python/cpython 106905)."""
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
"""Exceptions of zipfile and NumPy for damaged or encrypted archives and invalid headers."""
_EPOCH = (1980, 1, 1, 0, 0, 0)
_NAME_KEPT = 32
"""Characters of a file's name that its temporary file bears; file systems allow 255 bytes."""


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
    with (
        replace_file(path, durable=durable) as part,
        part.open("wb") as file,
        zipfile.ZipFile(file, "w", method, compresslevel=1) as archive,
    ):
        for name, array in arrays.items():
            info = zipfile.ZipInfo(name + ".npy", _EPOCH)
            info.compress_type = method
            with archive.open(info, "w", force_zip64=array.nbytes > 2**31) as member:
                np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)


def open_file(path: str | os.PathLike[str]) -> BinaryIO:
    """Return a file opened for reading in binary.

    Raises
    ------
    InputError
        It is missing, cannot be read, a pointer of Git LFS, or a folder, pipe, socket or device:
        reading one of these may wait forever or never end.
    """
    try:
        _check_kind(path, os.stat(path).st_mode)
        # without O_NONBLOCK this would wait, if a pipe took the file's place since
        handle = os.open(
            path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        )
        try:
            _check_kind(path, os.fstat(handle).st_mode)
            file = os.fdopen(handle, "rb")
        except BaseException:
            os.close(handle)
            raise
        if file.peek(len(_POINTER)).startswith(_POINTER):
            file.close()
            raise InputError(f"{path}: a pointer of Git LFS, not the file itself; git lfs pull")
        return file
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such file") from error
    except (OSError, ValueError) as error:  # ValueError: a NUL within the name
        reason = getattr(error, "strerror", None) or error
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: cannot be read ({reason})") from error


def file_state(path: str | os.PathLike[str]) -> tuple[int, int, int] | None:
    """Return inode, size and time, which writing changes; None where there is no file."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns


def read_bytes(path: str | os.PathLike[str], limit: int = MAX_FILE_BYTES) -> bytes:
    """Return a file's bytes; `InputError` where `open_file` raises it, or above `limit` bytes."""
    with open_file(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > limit:
            raise InputError(f"{path}: {size} bytes, hairkit reads up to {limit}")
        try:
            return file.read(size)
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror})") from error


def read_text(path: str | os.PathLike[str], limit: int = MAX_FILE_BYTES) -> str:
    """Return a file's UTF-8 text; `FormatError` when it is none, `InputError` as `read_bytes`."""
    try:
        return read_bytes(path, limit).decode()
    except UnicodeDecodeError as error:
        raise FormatError(
            f"{path}: not UTF-8 text ({error.reason} at byte {error.start})"
        ) from error


def read_toml(path: str | os.PathLike[str], limit: int = MAX_FILE_BYTES) -> dict[str, Any]:
    """Return the tables of a TOML file; `InputError` when it is none, or as `read_text`."""
    try:
        return tomllib.loads(read_text(path, limit))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not a TOML file: {error}") from error


def toml_value(value: object) -> str:
    """Return a text, a path, a number, a list or a table of these as TOML writes it.

    >>> toml_value({"size": (1, 2.5), "on": True})
    '{"size" = [1, 2.5], "on" = true}'
    """
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, Mapping):
        pairs = [f"{json.dumps(key)} = {toml_value(item)}" for key, item in value.items()]
        return f"{{{', '.join(pairs)}}}"
    return json.dumps(value, ensure_ascii=False, default=str)


def read_npz(path: str | os.PathLike[str]) -> dict[str, npt.NDArray[Any]]:
    """Return every array of an npz file.

    Sizes are checked before memory is allocated: the archive's claims against the file's size, and
    each array's header against the archive. `FormatError` for pickles, archives that unpack to
    more than `MAX_UNPACKED_RATIO` allows, and damaged files; `InputError` as `open_file`.
    """
    try:
        with open_file(path) as file, zipfile.ZipFile(file) as archive:
            members = archive.infolist()
            unpacked = sum(info.file_size for info in members)
            size = os.fstat(file.fileno()).st_size
            if unpacked > max(MAX_UNPACKED_RATIO * size, FREE_UNPACKED_BYTES):
                raise FormatError(
                    f"{path}: {size} bytes that unpack to {unpacked}, more than any groom would"
                )
            return {info.filename.removesuffix(".npy"): _member(archive, info) for info in members}
    except InputError:
        raise
    except _UNREADABLE as error:
        reason = str(error).partition("\n")[0][:120]  # zipfile quotes the damaged bytes in full
        raise FormatError(f"{path}: not a readable .npz file ({reason})") from error


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> npt.NDArray[Any]:
    """Return one array of an open npz file, whose header must account for all of its bytes."""
    with archive.open(info) as member:
        version = np.lib.format.read_magic(member)
        with parsing:
            if version == (1, 0):
                shape, fortran_order, dtype = np.lib.format.read_array_header_1_0(member)
            else:
                shape, fortran_order, dtype = np.lib.format.read_array_header_2_0(member)
        if dtype.hasobject or not dtype.itemsize:
            raise ValueError(f"{info.filename} holds no numbers or texts")
        count = math.prod(shape)
        if min(shape, default=0) < 0 or member.tell() + count * dtype.itemsize != info.file_size:
            raise ValueError(f"{info.filename} has {info.file_size} bytes, its header says {shape}")
        flat = np.empty(count, dtype)
        buffer = flat.view(np.uint8).data
        at = 0
        while at < len(buffer):
            piece = member.read(min(_CHUNK_BYTES, len(buffer) - at))
            if not piece:
                raise ValueError(f"{info.filename} ends too early")
            buffer[at : at + len(piece)] = piece
            at += len(piece)
        member.read(1)  # at the end the checksum is compared
    return flat.reshape(shape, order="F" if fortran_order else "C")


def write_bytes(
    path: str | os.PathLike[str], data: bytes | memoryview, *, durable: bool = True
) -> None:
    """Write `data` to `path` so that the file is either the old one or the whole new one."""
    write_pieces(path, (data,), durable=durable)


def write_pieces(
    path: str | os.PathLike[str], pieces: Iterable[bytes | memoryview], *, durable: bool = True
) -> None:
    """Write pieces one after the other as `write_bytes` does, without joining them in memory."""
    with replace_file(path, durable=durable) as part, part.open("wb") as file:
        for piece in pieces:
            file.write(piece)


@contextlib.contextmanager
def replace_file(
    path: str | os.PathLike[str], suffix: str = ".part", *, durable: bool = True
) -> Iterator[Path]:
    """Yield an empty file beside `path`, which takes its place when the block ends without error.

    Parameters
    ----------
    path
        The file; it is either the old one or the whole new one at any moment.
    suffix
        Ending of the temporary file's name, for libraries that go by it.
    durable
        False does not wait for the disk: a power failure, not a crash, may lose the file.

    Raises
    ------
    InputError
        There is something other than a file in the place, such as a device, or its name is not
        UTF-8.
    OSError
        The folder cannot be written to, or there is no room. It names `path`.
    """
    utf8_name(path)
    target, temporary = Path(path), None
    try:
        with contextlib.suppress(FileNotFoundError):
            _check_kind(target, os.stat(target).st_mode)
        temporary = target.with_name(f".{target.name[:_NAME_KEPT]}.{secrets.token_hex(4)}{suffix}")
        temporary.touch(exist_ok=False)
        yield temporary
        if durable:
            with open(temporary, "rb+") as file:
                os.fsync(file.fileno())
        os.replace(temporary, target)
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            error.filename, error.filename2 = str(target), None  # not the temporary file
        raise


def _check_kind(path: str | os.PathLike[str], mode: int) -> None:
    """Raise `InputError` for the mode of anything but a regular file."""
    if not stat.S_ISREG(mode):
        kind = _KINDS.get(stat.S_IFMT(mode), "no regular file")
        raise InputError(f"{path}: is {kind}, expected a file")


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write UTF-8 text as `write_bytes` does."""
    write_bytes(path, text.encode())


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
        count = int(arrays.get(prefix + "count", 0))  # older files lack tuples that came later
        return tuple(_from_arrays(item, arrays, f"{prefix}{i}.") for i in range(count))
    if isinstance(kind, type) and issubclass(kind, Stored):
        hints = typing.get_type_hints(kind)
        names = [field.name for field in dataclasses.fields(typing.cast(Any, kind))]
        return kind(
            **{name: _from_arrays(hints[name], arrays, f"{prefix}{name}.") for name in names}
        )
    array = arrays[prefix[:-1]]
    kind = str if typing.get_origin(kind) is typing.Literal else kind
    return kind(array[()]) if kind in (bool, int, float, str) else array
