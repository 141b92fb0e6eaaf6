"""Properties that are made once, when they are first asked for, whichever thread asks."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Generic, TypeVar

from hairkit.stages import Stage

_Value = TypeVar("_Value")


class Found(Generic[_Value]):
    """A property that is made once, on the thread that first asks for it; others wait."""

    def __init__(self, make: Callable[[Any], _Value], stage: Stage[Any] | None = None) -> None:
        self._make, self._stage = make, stage

    def __get__(self, owner: Any, kind: type | None = None) -> _Value:
        """Return the value; the `owner` has a `guard`, what was `made`, and what is `kept`."""
        with owner.guard:
            first = self not in owner.made
            made: Future[_Value] = owner.made.setdefault(self, Future())
        if first:
            try:
                kept = None if self._stage is None else owner.kept(self._stage)
                made.set_result(self._make(owner) if kept is None else kept)
            except BaseException as error:
                made.set_exception(error)
        return made.result()


def found(make: Callable[[Any], _Value]) -> Found[_Value]:
    """Make a method a property that is made once."""
    return Found(make)


def result_of(stage: Stage[Any]) -> Callable[[Callable[[Any], _Value]], Found[_Value]]:
    """Make a method a property that is made once, the result of a stage."""
    return lambda make: Found(make, stage)
