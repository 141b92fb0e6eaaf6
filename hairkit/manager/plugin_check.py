"""A plugin tried on the made-up head: the contract, its options, its texts, and what it takes."""

from __future__ import annotations

import contextlib
import hashlib
import tempfile
import time
import tracemalloc
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.errors import HairkitError, PluginError
from hairkit.io.capture_reader import WORKING_EDGE
from hairkit.manager.loading import PluginInfo
from hairkit.manager.manager import Manager
from hairkit.storage import Stored, read_bytes, to_arrays
from hairkit.testing import stage_arguments
from hairkit.types.capture import Capture

MEBIBYTE = 2**20
"""Bytes."""


@dataclass(frozen=True)
class Check:
    """One thing that was looked at."""

    name: str
    passed: bool
    said: str
    """What was found, one line."""


def check_plugin(manager: Manager, name: str, source: str | None = None) -> Iterator[Check]:
    """Yield what is found about a plugin; raises `PluginError` when there is none of that name.

    `source` is what `capture` is asked for; a folder with photos of the made-up head when None.
    """
    manager.info(name)
    with contextlib.suppress(PluginError):
        manager.implementer("", name)  # loads one that was only described so far
    info = manager.info(name)
    if info.broken:
        yield Check("loads", False, info.broken)
        return
    yield Check("loads", True, f"from {info.origin}")
    yield Check("summary", bool(info.summary), info.summary or "its docstring is empty")
    yield _options(manager, info)
    for stage in info.stages:
        yield from _stage(manager, name, stage, source)


def _options(manager: Manager, info: PluginInfo) -> Check:
    """Try the bounds of every option, and look whether each is explained."""
    bare = [option.name for option in info.options if not option.doc]
    if bare:
        return Check("options", False, f"no doc for {', '.join(bare)}")
    for option in info.options:
        for value in (option.low, option.high, *(option.choices or ())):
            if value is None or isinstance(option.default, tuple):
                continue
            given = int(value) if option.type is int else value
            try:
                manager.options(info.name, {option.name: given})
            except HairkitError as error:
                return Check("options", False, f"refuses a bound of its own: {error}")
    return Check("options", True, f"{len(info.options)}, each explained")


def _stage(manager: Manager, name: str, stage: str, source: str | None) -> Iterator[Check]:
    """Call a stage twice and compare; the second call is measured."""
    try:
        first, _, _ = _called(manager, name, stage, source)
        second, seconds, most = _called(manager, name, stage, source)
    except HairkitError as error:
        yield Check(stage, False, str(error))
        return
    if first is None:
        what = "the made-up head" if stage != "capture" or source is None else repr(source)
        passed = stage != "capture" or source is None
        yield Check(stage, passed, f"has no answer on {what}; nothing was checked")
        return
    size = f"{most / MEBIBYTE:.1f} MiB" if manager.info(name).command is None else "not measured"
    yield Check(stage, True, f"keeps the contract; {seconds:.3f} s, memory {size}")
    same = first == second
    yield Check(f"{stage} twice", same, "equal results" if same else "two calls, two results")


def _called(
    manager: Manager, name: str, stage: str, source: str | None
) -> tuple[str | None, float, int]:
    """Return a digest of the result, None without one, the seconds and the most bytes taken."""
    with tempfile.TemporaryDirectory(prefix="hairkit-check-") as folder:
        arguments = stage_arguments(stage, Path(folder))
        if stage == "capture" and source is not None:
            arguments |= {"source": source, "max_edge": WORKING_EDGE}
        info = manager.info(name)
        if stage == "export_groom" and info.suffixes:
            arguments["path"] = arguments["path"].with_suffix(info.suffixes[0])
        tracemalloc.start()
        began = time.perf_counter()
        try:
            found = manager.find_first(stage, [(name, None)], **arguments)
            seconds, most = time.perf_counter() - began, tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        return (None if found is None else _digest(found[1], arguments)), seconds, most


def _digest(result: Any, arguments: dict[str, Any]) -> str:
    """Return a hex digest of a result, of the file for a stage that writes one."""
    state = hashlib.sha256(type(result).__name__.encode())
    if isinstance(result, Stored):
        values = {key: np.asarray(value) for key, value in to_arrays(result).items()}
    elif isinstance(result, Capture):
        values = {view.name: view.image for view in result.views}
    elif hasattr(result, "points"):
        values = {"points": np.asarray(result.points)}
    else:
        values = {}
        state.update(read_bytes(arguments["path"]))
    for key, value in values.items():
        state.update(f"{key} {value.dtype.str} {value.shape}".encode())
        state.update(np.ascontiguousarray(value).tobytes())
    return state.hexdigest()
