"""Runs the reading program apart, so that a crash of the USD library is one error."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy.typing as npt

from hairkit.child_process import ChildError, Limits, ask_for_arrays
from hairkit.errors import FormatError, InputError, MissingExtraError
from hairkit.storage import open_file
from hairkit.system import utf8_name

from .stage import MISSING

MAX_BYTES = 2 * 2**30
"""Files larger than this are refused."""
SECONDS = 30.0
"""Time for reading, and one second on top for every megabyte."""
MEMORY = 4 * 2**30
"""Bytes of memory for reading, and eight times the file's size on top."""
_PROGRAM = Path(__file__).with_name("reading_child.py")


@dataclass(frozen=True, eq=False)
class Contents:
    """Result of the reading process."""

    arrays: Mapping[str, npt.NDArray[Any]]
    description: Mapping[str, Any]


def contents(path: Path) -> Contents:
    """Return the curves, meshes and settings of a USD file.

    Raises
    ------
    InputError
        The file is missing, too large, or refers to other files.
    FormatError
        It is damaged or no USD file.
    MissingExtraError
        usd-core is not installed.
    """
    if importlib.util.find_spec("pxr") is None:
        raise MissingExtraError(MISSING)
    open_file(path).close()  # it is there, and a file
    utf8_name(path.resolve())
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise InputError(f"{path}: {size} bytes, hairkit reads up to {MAX_BYTES}")
    question = {"do": "read", "source": str(path.resolve())}
    memory = MEMORY + 8 * size
    limits = Limits(SECONDS + size / 1e6, memory)
    try:
        answer, arrays = ask_for_arrays(_PROGRAM, question, limits, memory)
    except ChildError as error:
        raise FormatError(f"{path}: damaged or hostile: the USD library {error}") from error
    if "error" in answer:
        kind = InputError if answer.get("kind") == "refused" else FormatError
        start = f"{path}: " if kind is InputError else f"{path}: not a readable USD file: "
        raise kind(start + str(answer["error"]))
    description = json.loads(arrays["description"].tobytes())
    return Contents(arrays, description)
