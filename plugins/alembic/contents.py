"""What an Alembic file holds, read by the Alembic library in a process of its own."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.child_process import ChildError, Limits, ask_for_arrays
from hairkit.errors import FormatError, InputError
from hairkit.io.byte_reader import finite
from hairkit.storage import open_file
from hairkit.system import utf8_name

MAGIC, HDF5, FINISHED = b"Ogawa", b"\x89HDF", 0xFF
"""How files of Alembic begin, of the new and of the old kind, and the byte after the first."""
SECONDS = 30.0
"""Time for reading, and one second on top for every megabyte."""
MEMORY = 4 * 2**30
"""Bytes of memory for reading, and eight times the file's size on top."""
_PROGRAM = Path(__file__).with_name("reading_child.py")


@dataclass(frozen=True, eq=False)
class Values:
    """A property at its first sample."""

    path: Path
    name: str
    array: npt.NDArray[Any] | None
    """(N, C) numbers; None where it has none."""
    scope: str
    """`con`, `uni`, `vtx` ..., empty where the file says nothing."""
    samples: int

    def floats(self) -> Float32Array | None:
        """Return the values; None for other types. Raises `FormatError` if any is not finite."""
        if self.array is None or self.array.dtype.kind != "f":
            return None
        with np.errstate(over="ignore"):
            return finite(self.array, self.path, self.name).astype(np.float32)

    def integers(self) -> Int64Array | None:
        """Return the values; None for other types."""
        if self.array is None or self.array.dtype.kind not in "iub":
            return None
        return self.array.astype(np.int64)


@dataclass(frozen=True, eq=False)
class Object:
    """A node of the scene."""

    path: Path
    """Of the file."""
    name: str
    schema: str
    user: tuple[str, ...]
    """Names of a transform's user properties."""
    world: Float64Array
    """(4, 4), on row vectors, what takes points under the object to the world."""
    values: dict[str, Values]
    """Of curves, by name."""

    def is_a(self, schema: str) -> bool:
        """Return whether the object has a schema of any version: `AbcGeom_Curve`."""
        return self.schema.startswith(f"{schema}_v")

    def error(self, reason: str) -> FormatError:
        """Return the error to raise: it names file and object."""
        return _damaged(self.path, f"{self.name} {reason}")


def read_objects(path: Path) -> list[Object]:
    """Return the objects of a file, parents first, in its order.

    Raises
    ------
    FormatError
        The file is damaged, or of another format.
    InputError
        The file is missing, or of the HDF5 kind.
    """
    _check_kind(path)
    size = path.stat().st_size
    question = {"do": "read", "source": utf8_name(path.resolve())}
    limits = Limits(SECONDS + size / 1e6, MEMORY + 8 * size)
    try:
        _, arrays = ask_for_arrays(_PROGRAM, question, limits)
    except ChildError as error:
        raise _damaged(path, f"the Alembic library {error}") from error
    found = json.loads(arrays["objects"].tobytes())
    return [_object(path, number, each, arrays) for number, each in enumerate(found)]


def _object(
    path: Path, number: int, said: dict[str, Any], arrays: dict[str, npt.NDArray[Any]]
) -> Object:
    values = {
        name: Values(path, name, arrays.get(f"{number}/{name}"), each["scope"], each["samples"])
        for name, each in said["values"].items()
    }
    world = np.array(said["world"], np.float64)
    return Object(path, said["name"], said["schema"], tuple(said["user"]), world, values)


def _check_kind(path: Path) -> None:
    with open_file(path) as file:
        head = file.read(len(MAGIC) + 1)
    if head.startswith(HDF5):
        raise InputError(
            f"{path}: an Alembic file of the old HDF5 kind; convert it with abcconvert -toOgawa"
        )
    if not head.startswith(MAGIC):
        raise FormatError(f"{path}: not an Alembic file; it does not begin with 'Ogawa'")
    if head[-1] != FINISHED:
        raise FormatError(f"{path}: the program that wrote this file did not finish it")


def _damaged(path: Path, reason: str) -> FormatError:
    return FormatError(f"{path}: damaged, or of an unknown Alembic version: {reason}")
