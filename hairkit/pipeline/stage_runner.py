"""Runs the stages of a recipe, each once or once per view, and keeps their results."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

import cv2
import numba
import numpy as np
import scipy

from hairkit.errors import PluginError
from hairkit.manager import Manager
from hairkit.memory import give_back_memory
from hairkit.pipeline.module_digest import module_digest
from hairkit.pipeline.recipe import Recipe, Stage, stage_digest
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.work_folder import WorkFolder, digest_of
from hairkit.storage import Stored, from_arrays, to_arrays
from hairkit.types.capture import View
from hairkit.types.groom import Groom
from hairkit.version import __version__

_Value = TypeVar("_Value")
_Result = TypeVar("_Result", bound=Stored)


@dataclass(frozen=True)
class Given(Generic[_Value]):
    """A value with the digest of everything it was made from."""

    value: _Value
    digest: str

    @classmethod
    def of(cls, value: _Value) -> Self:
        """Return an input of the run, with the digest of its content."""
        return cls(value, digest_of(value))


Argument = Given[Any] | Sequence[Future[Given[Any]]]
"""One value, or one per view that may still be computed."""


class StageRunner:
    """Calls the recipe's plugins; results that are valid in the work folder are read from there."""

    def __init__(
        self,
        recipe: Recipe,
        manager: Manager,
        work: WorkFolder,
        log: RunLog,
        pool: Executor,
    ) -> None:
        self._recipe = recipe
        self._manager = manager
        self._work = work
        self._log = log
        self._pool = pool

    def has(self, table: str) -> bool:
        """Return whether the recipe has the stage."""
        return self._recipe.stage(table) is not None

    def once(
        self, table: str, kind: type[_Result], name: str = "", /, **arguments: Argument
    ) -> Given[_Result]:
        """Return the result of a stage that sees all views; waits for its arguments.

        `name` is that of the result where a stage runs a second time.
        """
        ready, stage = _all_ready(arguments), self._stage(table)
        steps = self._steps_of(stage, 1, name or table)
        result = steps.run(0, kind, self._code(stage), "", ready)
        give_back_memory()
        return result

    def derive(
        self, name: str, kind: type[_Result], make: Callable[..., _Result], **arguments: Argument
    ) -> Given[_Result]:
        """Return what a function of hairkit makes of other results, kept as a stage's result is."""
        ready, code = _all_ready(arguments), module_digest(make.__module__)
        steps = _Steps(self, name, 1, lambda values: make(**values))
        return steps.run(0, kind, code, "", ready)

    def every_view(
        self,
        table: str,
        kind: type[_Result],
        views: Sequence[Given[View]],
        absent: Callable[[], _Result] | None = None,
        **arguments: Sequence[Future[Given[Any]]],
    ) -> list[Future[Given[_Result]]]:
        """Start a stage on every view; a view's step waits only for that view's arguments.

        `absent` makes the result where the recipe leaves the stage out or no plugin has an answer.
        """
        if absent is not None and not self.has(table):
            return [completed(Given.of(absent())) for _ in views]
        stage = self._stage(table)
        steps = self._steps_of(stage, len(views), table, absent)
        code = self._code(stage)

        def run(index: int, view: Given[View]) -> Given[_Result]:
            # tasks start in the order of submission, so what is waited for is already running
            own = {name: futures[index].result() for name, futures in arguments.items()}
            return steps.run(index, kind, code, view.value.name, {"view": view} | own)

        return [self._pool.submit(run, index, view) for index, view in enumerate(views)]

    def beside(self, work: Callable[..., _Value], *args: Any) -> Future[_Value]:
        """Start what nothing waits for yet on another thread."""
        return self._pool.submit(work, *args)

    def export(self, plugin: str, groom: Groom, path: Path) -> None:
        """Write one of the recipe's files."""
        stage = self._stage("export")
        options = next(choice.options for choice in stage.choices if choice.plugin == plugin)
        started = time.perf_counter()
        self._log.started(plugin, 1)
        self._manager.call("export_groom", plugin, options, groom=groom, path=path)
        self._log.finished(plugin, time.perf_counter() - started, False)

    def call(
        self, stage: Stage, values: dict[str, Any], absent: Callable[[], Any] | None = None
    ) -> Any:
        """Call the plugin of a stage, the first of several that has an answer."""
        choices = [(choice.plugin, choice.options) for choice in stage.choices]
        if absent is not None:
            found = self._manager.find_first(stage.hook, choices, **values)
            return absent() if found is None else found[1]
        if len(choices) == 1:
            return self._manager.call(stage.hook, *choices[0], **values)
        return self._manager.call_first(stage.hook, choices, **values)[1]

    def _stage(self, table: str) -> Stage:
        stage = self._recipe.stage(table)
        if stage is None:
            raise PluginError(f"recipe {self._recipe.name} has no stage {table!r}")
        return stage

    def _steps_of(
        self, stage: Stage, count: int, name: str, absent: Callable[[], Any] | None = None
    ) -> _Steps:
        return _Steps(
            self, name, count, lambda values: self.call(stage, values, absent), stage.hook
        )

    def _code(self, stage: Stage) -> str:
        return stage_digest(self._manager, stage)


class _Steps:
    """The steps of one stage: runs them, counts them, and reports the end of the last."""

    def __init__(
        self,
        runner: StageRunner,
        table: str,
        count: int,
        call: Callable[[dict[str, Any]], Any],
        hook: str | None = None,
    ) -> None:
        self._runner = runner
        self._table = table
        self._call = call
        self._hook = hook
        self._results: list[Any] = [None] * count
        self._left = count
        self._reused = True
        self._began: float | None = None
        self._guard = threading.Lock()
        runner._log.started(table, count)

    def run(
        self,
        index: int,
        kind: type[_Result],
        code: str,
        view: str,
        arguments: dict[str, Given[Any]],
    ) -> Given[_Result]:
        """Return the step's result, from the work folder or newly made by `code`, a digest."""
        runner, table = self._runner, self._table
        digest = digest_of(_own_digest(), code, [given.digest for given in arguments.values()])
        with self._guard:
            self._began = self._began or time.perf_counter()
        result = runner._work.get(kind, digest, table, view)
        reused = result is not None
        if result is None:
            made: _Result = self._call({name: given.value for name, given in arguments.items()})
            # as a run that was interrupted reads it: a float of NumPy's counts in another precision
            result = from_arrays(kind, to_arrays(made), table)
            runner._work.put(result, digest, table, view)
        self._ended(index, result, reused)
        return Given(result, digest)

    def _ended(self, index: int, result: Any, reused: bool) -> None:
        with self._guard:
            self._results[index] = result
            self._reused &= reused
            self._left -= 1
            last = not self._left
        runner, table = self._runner, self._table
        runner._log.stepped(table)
        if last:
            seconds = time.perf_counter() - (self._began or 0.0)
            runner._log.finished(table, seconds, self._reused)
            whole = tuple(self._results) if len(self._results) > 1 else self._results[0]
            if self._hook is not None:
                runner._manager.notify(
                    "stage_finished", stage=self._hook, seconds=seconds, result=whole
                )


def completed(value: Given[_Value]) -> Future[Given[_Value]]:
    """Return a future that holds a value already."""
    future: Future[Given[_Value]] = Future()
    future.set_result(value)
    return future


def _all_ready(arguments: dict[str, Argument]) -> dict[str, Given[Any]]:
    return {name: _ready(argument) for name, argument in arguments.items()}


def _ready(argument: Argument) -> Given[Any]:
    """Return the argument as one value, after waiting for views that are not done."""
    if isinstance(argument, Given):
        return argument
    parts = [future.result() for future in argument]
    return Given(tuple(part.value for part in parts), digest_of([part.digest for part in parts]))


@cache
def _own_digest() -> str:
    """Return a digest of the versions of hairkit and of the libraries that compute results."""
    libraries = (np, scipy, numba, cv2)
    return digest_of(__version__, *(library.__version__ for library in libraries))
