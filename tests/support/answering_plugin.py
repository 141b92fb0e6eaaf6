"""A plugin that answers one hook as a test wishes."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from types import ModuleType
from typing import Any

from hairkit import hookspecs
from hairkit.hookspecs import hookimpl
from hairkit.manager import Manager


def answering(hook: str, answer: Callable[[dict[str, Any]], Any]) -> object:
    """Return a plugin whose `hook` returns what `answer` returns for its arguments."""
    names = [n for n in inspect.signature(getattr(hookspecs, hook)).parameters if n != "options"]
    given = ", ".join(f"{name}={name}" for name in names)
    scope: dict[str, Any] = {"answer": answer}
    exec(f"def {hook}({', '.join(names)}): return answer(dict({given}))", scope)
    plugin = ModuleType("odd")
    setattr(plugin, hook, hookimpl(scope[hook]))
    return plugin


def manager_answering(hook: str, answer: Callable[[dict[str, Any]], Any]) -> Manager:
    """Return a manager whose one plugin `odd` of `studio-hair 1.2` answers so."""
    manager = Manager()
    manager.register(answering(hook, answer), "odd", "studio-hair", "1.2")
    return manager
