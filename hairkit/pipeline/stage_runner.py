"""Runs the stages of a recipe, each once or once per view, and keeps their results."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

import cv2
import numba
import numpy as np
import scipy

from hairkit.manager import Manager
from hairkit.memory import give_back_memory
from hairkit.pipeline.module_digest import module_digest
from hairkit.pipeline.recipe import Choice, Recipe, stage_digest
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.work_folder import Results, digest_of
from hairkit.stages import EXPORT, Stage
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


Views = Sequence[Future[Given[_Value]]]
"""A result for each view, which may still be computed."""


def given_photo(view: View) -> Given[View]:
    """Return a photo without its place in the turn; its name does not count in the digest."""
    alone = view.alone()
    return Given(alone, digest_of(replace(alone, name="")))


def gather(views: Views[_Value]) -> Given[tuple[_Value, ...]]:
    """Return the results of all views as one, after waiting for those that are not done."""
    parts = [future.result() for future in views]
    return Given(tuple(part.value for part in parts), digest_of([part.digest for part in parts]))


class StageRunner:
    """Calls the recipe's plugins; results that are valid in the work folder are read from there.

    Without a work folder none is kept.
    """

    def __init__(
        self, recipe: Recipe, manager: Manager, work: Results | None, log: RunLog, pool: Executor
    ) -> None:
        self.recipe = recipe
        self.manager = manager
        self.log = log
        self.work = work
        self._pool = pool

    def once(
        self, stage: Stage[_Result], evidence: Given[Any] | None = None, /, **arguments: Given[Any]
    ) -> Given[_Result]:
        """Return the result of a stage that sees all views.

        The fields of `evidence`, a dataclass, are arguments, too.
        """
        fields = {} if evidence is None else vars(evidence.value)
        digest = "" if evidence is None else evidence.digest
        selection = self.recipe.stage(stage.table)
        code = "" if selection is None else stage_digest(self.manager, selection)
        steps = _Steps(self, stage, 1, code + digest)

        def ask(values: dict[str, Any]) -> _Result:
            return self.recipe.ask(self.manager, stage, **fields, **values)

        return steps.run(ask, 0, "", arguments)

    def derive(
        self, stage: Stage[_Result], make: Callable[..., _Result], **arguments: Given[Any]
    ) -> Given[_Result]:
        """Return what a function of hairkit makes of other results, kept as a stage's result is."""
        steps = _Steps(self, stage, 1, module_digest(make.__module__))
        return steps.run(lambda values: make(**values), 0, "", arguments)

    def every_view(
        self, stage: Stage[_Result], views: Sequence[Given[View]], **arguments: Views[Any]
    ) -> Views[_Result]:
        """Start a stage on every view; a view's step waits only for that view's arguments."""
        selection = self.recipe.stage(stage.table)
        if selection is None and stage.absent is not None:
            return [completed(Given.of(stage.absent())) for _ in views]
        code = "" if selection is None else stage_digest(self.manager, selection)
        steps = _Steps(self, stage, len(views), code)

        def ask(values: dict[str, Any]) -> _Result:
            return self.recipe.ask(self.manager, stage, **values)

        def run(index: int, view: Given[View]) -> Given[_Result]:
            # tasks start in the order of submission, so what is waited for is already running
            own = {name: futures[index].result() for name, futures in arguments.items()}
            return steps.run(ask, index, view.value.name, {"view": view} | own)

        return [self._pool.submit(run, index, view) for index, view in enumerate(views)]

    def keep(self, stage: Stage[_Result], result: Given[_Result], view: str) -> None:
        """Keep a result of a single photo as that of the view which the photo turned out to be."""
        if self.work is not None:
            self.work.put(stage, result.value, result.digest, view)

    def beside(self, work: Callable[..., _Value], *args: Any) -> Future[_Value]:
        """Start what nothing waits for yet on another thread."""
        return self._pool.submit(work, *args)

    def export(self, choice: Choice, groom: Groom, path: Path) -> None:
        """Write one of the recipe's files."""
        started, shown = time.perf_counter(), choice.file or choice.plugin
        self.log.started(shown, 1)
        self.manager.call(EXPORT.hook, choice.plugin, choice.options, groom=groom, path=path)
        self.log.finished(shown, time.perf_counter() - started, False)


class _Steps:
    """The steps of one stage: runs them, counts them, and reports the end of the last."""

    def __init__(self, runner: StageRunner, stage: Stage[Any], count: int, code: str) -> None:
        self._runner = runner
        self._stage = stage
        self._code = code
        """Digest of what makes the results."""
        self._results: list[Any] = [None] * count
        self._left = count
        self._reused = True
        self._began: float | None = None
        self._guard = threading.Lock()
        runner.log.started(stage.name, count)

    def run(
        self,
        make: Callable[[dict[str, Any]], Any],
        index: int,
        view: str,
        arguments: Mapping[str, Given[Any]],
    ) -> Given[Any]:
        """Return the step's result, from the work folder or newly made of the arguments' values."""
        work, stage = self._runner.work, self._stage
        inputs = [(name, arguments[name].digest) for name in sorted(arguments)]
        digest = digest_of(_own_digest(), self._code, inputs)
        with self._guard:
            self._began = self._began or time.perf_counter()
        result = None if work is None else work.get(stage, digest, view)
        reused = result is not None
        if result is None:
            made = make({name: given.value for name, given in arguments.items()})
            # as a run that was interrupted reads it: a float of NumPy's counts in another precision
            result = from_arrays(stage.makes, to_arrays(made), stage.name)
            if work is not None:
                work.put(stage, result, digest, view)
        self._ended(index, result, reused)
        return Given(result, digest)

    def _ended(self, index: int, result: Any, reused: bool) -> None:
        with self._guard:
            self._results[index] = result
            self._reused &= reused
            self._left -= 1
            last = not self._left
        runner, stage = self._runner, self._stage
        runner.log.stepped(stage.name)
        if last:
            give_back_memory()
            seconds = time.perf_counter() - (self._began or 0.0)
            runner.log.finished(stage.name, seconds, self._reused)
            whole = tuple(self._results) if len(self._results) > 1 else self._results[0]
            if stage.hook:
                runner.manager.notify(
                    "stage_finished", stage=stage.hook, seconds=seconds, result=whole
                )


def completed(value: Given[_Value]) -> Future[Given[_Value]]:
    """Return a future that holds a value already."""
    future: Future[Given[_Value]] = Future()
    future.set_result(value)
    return future


@cache
def _own_digest() -> str:
    """Return a digest of the versions of hairkit and of the libraries that compute results."""
    libraries = (np, scipy, numba, cv2)
    return digest_of(__version__, *(library.__version__ for library in libraries))
