"""What the child runs: a plugin in an environment of its own answers hairkit by it.

>>> import numpy as np
>>> def segment(view, options):
...     dark = view.image.mean(axis=-1) < options.level
...     return {"labels": np.where(dark, 255, 0).astype("u1"), "person_known": False}
>>> level = option(60, low=0, high=255, doc="Grey level below which is hair.")
>>> serve(segment, options={"level": level})  # doctest: +SKIP

Saved as `matte.py`, this is the plugin that a recipe names by `[plugins.matte]` and
`command = ["/opt/nets/bin/python", "matte.py"]`. The environment of `/opt/nets` needs NumPy, and
this file: by `pip install --no-deps hairkit`, or copied beside the plugin. It runs on Python 3.8
and newer, and uses nothing of hairkit.

Questions come on stdin, one JSON object a line, and answers leave on stdout. `{"id": 1, "do":
"describe"}` is answered by the plugin's functions and options; `{"id": 2, "do": "call", "folder":
"/tmp/x"}` is answered after `call.json` and `arguments.npz` in that folder were read and
`result.json` and `result.npz` written. What a plugin prints goes to stderr.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import math
import mmap
import os
import queue
import signal
import struct
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from zipfile import ZIP_STORED, ZipFile

PROTOCOL = 1
"""Version of the protocol; it grows when a message or a file changes its meaning."""
LONGEST_ERROR = 2000
"""Characters of an error that are sent."""
LENGTHS_AT = 26
"""Bytes from the start of a zip's member to the lengths of its name and its extra field."""
ARRAY = "array"
"""A JSON object with this key alone stands for the array of that name in the `.npz` beside."""


def option(
    default: Any,
    *,
    kind: str | None = None,
    low: float | None = None,
    high: float | None = None,
    choices: Sequence[Any] | None = None,
    doc: str = "",
    unit: str | None = None,
) -> dict[str, Any]:
    """Return the description of an option, checked by hairkit before the plugin sees a value.

    `kind` is bool, int, float, str or path; by default that of the default value. A default of
    None allows None.
    """
    return {
        "default": default,
        "kind": kind or type(default).__name__,
        "low": low,
        "high": high,
        "choices": None if choices is None else list(choices),
        "doc": doc,
        "unit": unit,
    }


def serve(
    *functions: Callable[..., Any],
    options: Mapping[str, Mapping[str, Any]] | None = None,
    version: str = "",
    files: Sequence[Any] = (),
) -> None:
    """Answer hairkit until it closes its end of the pipe.

    Parameters
    ----------
    functions
        One for each hook, with the hook's name; their parameters are those of the hook's arguments
        that they need, and `options`.
    options
        Description of each option, made by `option`.
    version
        Of the plugin.
    files
        Paths of files that results depend on, such as weights: when their content changes, cached
        results of hairkit count as old.
    """
    hooks = {function.__name__: function for function in functions}
    text = inspect.getdoc(sys.modules[functions[0].__module__]) if functions else ""

    def describe(question: dict[str, Any], _tell: Any) -> dict[str, Any]:
        return {
            "protocol": PROTOCOL,
            "hooks": {name: _parameters(function) for name, function in hooks.items()},
            "options": dict(options or {}),
            "summary": " ".join((text or "").partition("\n\n")[0].split()),
            "version": version,
            "digest": _digest(functions, files),
        }

    def call(question: dict[str, Any], _tell: Any) -> dict[str, Any]:
        folder = Path(question["folder"])
        given = read_tree(folder / "call.json", folder / "arguments.npz")
        function = hooks[given["hook"]]
        values = {name: _named(value) for name, value in given["arguments"].items()}
        values["options"] = SimpleNamespace(**given["options"])
        result = function(**{name: values[name] for name in _parameters(function)})
        write_tree({"result": result}, folder / "result.json", folder / "result.npz")
        return {}

    answer_questions({"describe": describe, "call": call})


def answer_questions(tasks: Mapping[str, Callable[..., Any]]) -> None:
    """Answer each question on stdin by the task that it names, `task(question, tell)`.

    An error of a task is its answer. The process ends when stdin does, whatever it is doing.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which ends this
    answers = os.fdopen(os.dup(1), "wb", 0)
    os.dup2(2, 1)  # what a plugin prints is no answer
    source = os.fdopen(os.dup(0), "rb")
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)  # a program that a plugin starts must not read the questions
    questions: queue.Queue[dict[str, Any]] = queue.Queue()
    threading.Thread(target=_listen, args=(source, questions), daemon=True).start()

    def write(number: int, message: Mapping[str, Any]) -> None:
        answers.write(json.dumps({"id": number, **message}).encode() + b"\n")

    while True:
        question = questions.get()
        number = question["id"]
        try:
            result = tasks[question["do"]](
                question, lambda told, n=number: write(n, {"tell": told})
            )
            write(number, {"result": result})
        except BaseException as error:  # SystemExit of a plugin, too: the next question is answered
            text = f"{type(error).__name__}: {error}"
            write(number, {"error": " ".join(text.split())[:LONGEST_ERROR]})


def write_tree(tree: Any, text_path: Any, arrays_path: Any) -> None:
    """Write a tree of dicts, lists, dataclasses, numbers and texts as JSON, its arrays as .npz."""
    arrays: dict[str, Any] = {}
    text = json.dumps(_plain(tree, "", arrays))
    write_arrays(arrays_path, arrays)
    Path(text_path).write_text(text, encoding="utf-8")


def read_tree(text_path: Any, arrays_path: Any) -> Any:
    """Return the tree that `write_tree` wrote; its arrays are read-only and stay in the file."""
    text = Path(text_path).read_text(encoding="utf-8")
    return put_arrays(json.loads(text), map_arrays(arrays_path))


def put_arrays(tree: Any, arrays: Mapping[str, Any]) -> Any:
    """Return a tree with arrays in the places that name them."""
    if isinstance(tree, dict):
        if len(tree) == 1 and ARRAY in tree:
            return arrays[tree[ARRAY]]
        return {name: put_arrays(value, arrays) for name, value in tree.items()}
    return [put_arrays(item, arrays) for item in tree] if isinstance(tree, list) else tree


def write_arrays(path: Any, arrays: Mapping[str, Any]) -> None:
    """Write arrays to an uncompressed .npz file; faster than `numpy.savez`, which copies pieces."""
    import numpy as np

    with ZipFile(str(path), "w", ZIP_STORED) as archive:
        for name, array in arrays.items():
            whole = np.ascontiguousarray(array).reshape(np.shape(array))
            with archive.open(name + ".npy", "w", force_zip64=whole.nbytes > 2**31) as member:
                header = np.lib.format.header_data_from_array_1_0(whole)
                np.lib.format.write_array_header_1_0(member, header)
                member.write(whole.reshape(-1).view(np.uint8).data)


def map_arrays(path: Any) -> dict[str, Any]:
    """Return the arrays of a file of `write_arrays`, read-only views of the file itself."""
    import numpy as np

    with open(path, "rb") as file:
        members = list(find_members(file))
        whole = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    return {
        name: np.frombuffer(whole, dtype, math.prod(shape), start).reshape(shape)
        for name, dtype, shape, start in members
    }


def find_members(file: Any) -> Iterator[tuple[str, Any, tuple[int, ...], int]]:
    """Yield name, type, shape and place in the file of each array; `ValueError` for other files.

    Pickled, compressed and column-major arrays are refused, and those that claim to be longer than
    they are. Checksums are not compared: the file was written a moment ago.
    """
    import numpy as np

    with ZipFile(file) as archive:
        members = archive.infolist()
    for member in members:
        name = member.filename
        file.seek(member.header_offset + LENGTHS_AT)
        start = file.tell() + 4 + sum(struct.unpack("<HH", file.read(4)))
        file.seek(start)
        if member.compress_type != ZIP_STORED or np.lib.format.read_magic(file) != (1, 0):
            raise ValueError(f"{name} is not as hairkit.worker writes it")
        shape, by_columns, dtype = np.lib.format.read_array_header_1_0(file)
        taken = math.prod(shape) * dtype.itemsize + file.tell() - start
        if dtype.hasobject or by_columns or min(shape, default=0) < 0 or taken != member.file_size:
            raise ValueError(f"{name} is no array of {member.file_size} bytes")
        yield name[: -len(".npy")], dtype, shape, file.tell()


def _plain(value: Any, place: str, arrays: dict[str, Any]) -> Any:
    """Return a value as JSON knows it; arrays are put aside under the name of their place."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if hasattr(value, "__dataclass_fields__"):
        value = {name: getattr(value, name) for name in value.__dataclass_fields__}
    if isinstance(value, SimpleNamespace):
        value = vars(value)
    if isinstance(value, dict):
        return {str(k): _plain(v, f"{place}.{k}", arrays) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item, f"{place}.{index}", arrays) for index, item in enumerate(value)]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if not hasattr(value, "dtype"):
        raise TypeError(f"{place[1:]} is a {type(value).__name__}, expected an array")
    if value.dtype.hasobject:
        raise TypeError(f"{place[1:]} is an array of objects, expected numbers")
    if not value.shape:
        return value.item()
    arrays[place[1:]] = value
    return {ARRAY: place[1:]}


def _named(tree: Any) -> Any:
    """Return a tree whose dicts are objects with attributes: `view.image`."""
    if isinstance(tree, dict):
        return SimpleNamespace(**{name: _named(value) for name, value in tree.items()})
    return [_named(item) for item in tree] if isinstance(tree, list) else tree


def _parameters(function: Callable[..., Any]) -> list[str]:
    return list(inspect.signature(function).parameters)


def _digest(functions: Sequence[Callable[..., Any]], files: Sequence[Any]) -> str:
    """Return a hex digest of the sources of the functions and of the files named."""
    sources = sorted({inspect.getsourcefile(function) or "" for function in functions})
    digest = hashlib.sha256()
    for path in [*sources, *files]:
        with open(path, "rb") as file:
            while piece := file.read(2**20):
                digest.update(piece)
    return digest.hexdigest()


def _listen(source: Any, questions: Any) -> None:
    for line in source:
        questions.put(json.loads(line))
    os._exit(0)
