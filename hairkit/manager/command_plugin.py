"""A plugin that runs as a command, in an environment of its own: `[plugins.NAME]` of a recipe.

To the manager it is a plugin like any other: its functions, found by asking the command, send their
arguments to the process and check what comes back. Arguments and results travel as JSON and npz in
a folder that exists for the call. The child answers by `hairkit.worker`.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import json
import os
import queue
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit import hookspecs, worker
from hairkit.child_process import ChildError, ChildProcess, Limits, call_folder, shortened
from hairkit.errors import DataError, HairkitError, OptionError, PluginError
from hairkit.manager.guard import subject
from hairkit.options import option, unknown_name
from hairkit.stages import OF_HOOK
from hairkit.storage import Stored, from_arrays, open_file, parsing, read_text

KINDS: dict[str, type] = {"bool": bool, "int": int, "float": float, "str": str, "path": Path}
"""Types of options by the names that `hairkit.worker.option` gives them."""
CLEARED = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "__PYVENV_LAUNCHER__")
"""Environment variables of this Python that would lead another one to the wrong packages."""
LONGEST_TEXT = 2**24
"""Bytes of a result's JSON."""


@dataclass(frozen=True)
class PluginCommand:
    """How a plugin is started, and what it may take."""

    name: str
    command: tuple[str, ...]
    folder: str | None = None
    """Folder in which it starts: that of the recipe's file."""
    seconds: float = 600.0
    """Limit of one call."""
    start_seconds: float = 120.0
    """Limit of the start: importing a large framework takes a while."""
    memory_gib: float | None = None
    """Limit of its resident memory; None for no limit."""
    processes: int = 1
    """Calls that run at the same time, each in a process of its own."""
    environment: Mapping[str, str] = field(default_factory=dict)
    """Variables added to this process's environment."""

    def __post_init__(self) -> None:
        if not self.command or not all(isinstance(w, str) and w for w in self.command):
            raise OptionError(f"command is {list(self.command)!r}, expected a list of words")
        for name in ("seconds", "start_seconds", "memory_gib"):
            value = getattr(self, name)
            if value is not None and not (type(value) in (int, float) and value > 0):
                raise OptionError(f"{name} is {value!r}, expected a number above 0")
        if type(self.processes) is not int or self.processes < 1:
            raise OptionError(f"processes is {self.processes!r}, expected 1 or more")
        texts = [*self.environment.values()] if isinstance(self.environment, Mapping) else [None]
        if not all(isinstance(value, str) for value in texts):
            raise OptionError("environment is no table of texts")

    @property
    def line(self) -> str:
        """The command as a shell takes it."""
        return shlex.join(self.command)


def read_command(name: str, values: Mapping[str, Any], folder: str | None) -> PluginCommand:
    """Return the command of a recipe's table; raises `OptionError` for what it must not hold."""
    known = [f.name for f in dataclasses.fields(PluginCommand) if f.name not in ("name", "folder")]
    for key in values:
        if key not in known:
            raise OptionError(unknown_name("key", key, known))
    words = values.get("command")
    if not isinstance(words, list):
        raise OptionError(f"command is {words!r}, expected a list of words")
    return PluginCommand(name, folder=folder, **{**values, "command": tuple(words)})


class CommandPlugin:
    """The plugin object: functions for the hooks that the command has, and its `Options`."""

    def __init__(self, command: PluginCommand) -> None:
        """Start the command and ask what it can do; raises `PluginError`."""
        self._command = command
        environment = {k: v for k, v in os.environ.items() if k not in CLEARED}
        environment |= command.environment
        self._processes: queue.LifoQueue[ChildProcess] = queue.LifoQueue()
        for _ in range(command.processes):
            self._processes.put(
                ChildProcess(command.command, environment=environment, folder=command.folder)
            )
        memory = None if command.memory_gib is None else int(command.memory_gib * 2**30)
        self._limits = Limits(command.seconds, memory)
        try:
            self._describe(self._ask({"do": "describe"}, Limits(command.start_seconds, memory)))
        except (HairkitError, KeyError, TypeError, ValueError, AttributeError) as error:
            self.close()
            if isinstance(error, HairkitError):
                raise
            raise PluginError(f"described itself wrongly: {shortened(repr(error))}") from error

    def close(self) -> None:
        """End the processes; the next call starts others."""
        for process in tuple(self._processes.queue):
            process.close()

    def _describe(self, told: Mapping[str, Any]) -> None:
        if told["protocol"] != worker.PROTOCOL:
            raise PluginError(
                f"speaks version {shortened(repr(told['protocol']))} of the protocol, this hairkit"
                f" {worker.PROTOCOL}; use the worker.py of this hairkit"
            )
        self.__doc__ = str(told["summary"])
        self.version = shortened(str(told["version"]))
        self.digest = str(told["digest"])
        """Digest of its sources and of the files that it names."""
        if told["options"]:
            self.Options = options_of(told["options"])
        possible = [hook for hook, stage in OF_HOOK.items() if stage.command]
        for hook, parameters in told["hooks"].items():
            if hook not in possible:
                raise PluginError(unknown_name("hook of commands", shortened(hook), possible))
            setattr(self, hook, self._function(hook, parameters))

    def _function(self, hook: str, parameters: list[str]) -> Callable[..., Any]:
        """Return the hook's implementation, which sends the arguments that the command wants."""
        spec = getattr(hookspecs, hook)
        names = tuple(inspect.signature(spec).parameters)
        for name in parameters:
            if name not in names:
                wrong = unknown_name("argument", shortened(str(name)), names)
                raise PluginError(f"{hook}: {wrong}")

        @functools.wraps(spec)  # pluggy and the manager read its parameters from the wrapped one
        def call(*values: Any) -> Any:
            given = zip(names, values, strict=True)
            return self._call(hook, {name: value for name, value in given if name in parameters})

        return hookspecs.hookimpl(call)

    def _call(self, hook: str, arguments: dict[str, Any]) -> Any:
        options = arguments.pop("options", None)
        values = {} if options is None else dataclasses.asdict(options)
        question = {"hook": hook, "options": values, "arguments": arguments}
        with call_folder() as at:
            folder = Path(at)
            worker.write_tree(question, folder / "call.json", folder / "arguments.npz")
            try:
                self._ask({"do": "call", "folder": at}, self._limits)
            except PluginError as error:
                who = f"plugin {self._command.name!r}, {self._command.line}"
                raise PluginError(f"{who}, {hook!r}{subject(arguments)}: {error}") from error
            return read_result(OF_HOOK[hook].makes, folder)

    def _ask(self, question: Mapping[str, Any], limits: Limits) -> dict[str, Any]:
        """Return an answer."""
        process = self._processes.get()
        try:
            message = process.ask_twice(question, limits)
        except ChildError as error:
            raise PluginError(str(error)) from error
        finally:
            self._processes.put(process)
        if "error" in message:
            raise PluginError(shortened(str(message["error"])))
        result = message.get("result")
        return result if isinstance(result, dict) else {}


def read_result(kind: type, folder: Path) -> Any:
    """Return what a command wrote as a type of hairkit; raises `DataError` for anything else."""
    try:
        text = read_text(folder / "result.json", LONGEST_TEXT)
        arrays = _read_arrays(folder / "result.npz")
        tree = worker.put_arrays(json.loads(text), arrays)["result"]
        if tree is None or not issubclass(kind, Stored):
            return tree
        names = [each.name for each in dataclasses.fields(kind)]  # type: ignore[arg-type]
        if not isinstance(tree, dict):
            raise DataError(f"is a {type(tree).__name__}, expected {kind.__name__}: {names}")
        for name in tree:
            if name not in names:
                raise DataError(unknown_name(f"field of {kind.__name__}", name, names))
        with np.errstate(invalid="raise"):  # a NaN is no grey level
            return from_arrays(kind, _flat(tree, ""), "result")
    except (ValueError, ArithmeticError, LookupError, TypeError, RecursionError, OSError) as error:
        said = shortened(str(error).replace(f"{folder}/", ""))
        raise DataError(f"its result cannot be used: {said}") from error


def _read_arrays(path: Path) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of a file, copied out of it: its writer may still change the file."""
    arrays = {}
    with open_file(path) as file, parsing:
        for name, dtype, shape, start in worker.find_members(file):
            array = np.empty(shape, dtype)
            file.seek(start)
            if array.size:
                stream: Any = file
                stream.readinto(array.reshape(-1).view(np.uint8).data)
            array.setflags(write=False)  # so that the types take it as it is
            arrays[name] = array
    return arrays


def _flat(tree: Any, place: str) -> dict[str, Any]:
    """Return a tree as the arrays of `hairkit.storage.to_arrays`."""
    if tree is None:
        return {}
    if isinstance(tree, dict):
        parts = [_flat(value, f"{place}{name}.") for name, value in tree.items()]
    elif isinstance(tree, list) and all(isinstance(item, (dict, str)) for item in tree):
        parts = [{f"{place}count": np.asarray(len(tree))}]
        parts += [_flat(item, f"{place}{index}.") for index, item in enumerate(tree)]
    else:
        return {place[:-1]: np.asarray(tree)}
    return {name: value for part in parts for name, value in part.items()}


def options_of(described: Mapping[str, Mapping[str, Any]]) -> type:
    """Return the `Options` of a plugin from the descriptions of its worker."""
    fields: list[tuple[str, Any, Any]] = []
    for name, given in described.items():
        default, kind = given["default"], given["kind"]
        if kind not in KINDS:
            found = shortened(str(kind))
            raise PluginError(f"option {name} is of kind {found}, expected one of {list(KINDS)}")
        form: Any = KINDS[kind] if default is not None else KINDS[kind] | None
        if kind == "path" and default is not None:
            default = Path(default)
        extras = {key: given.get(key) for key in ("low", "high", "choices", "unit")}
        fields.append((name, form, option(default, doc=str(given.get("doc", "")), **extras)))
    return dataclasses.make_dataclass("Options", fields, frozen=True)
