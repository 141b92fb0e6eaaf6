"""Runs the code of a plugin: whatever it raises becomes one line that names the plugin."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TextIO

from hairkit.errors import DataError, HairkitError, PluginError, ResultError, one_line

_in_plugin: ContextVar[bool] = ContextVar("in_plugin", default=False)


@contextmanager
def guard_hook(who: str, hook: str, arguments: Mapping[str, Any]) -> Iterator[None]:
    """Run a hook of a plugin; its errors name the plugin, the hook and the view or file.

    Parameters
    ----------
    who
        The plugin in words: `plugin 'gabor' of hairkit 0.2.0`.
    hook, arguments
        What is called, with which arguments.

    Raises
    ------
    ResultError
        The plugin made a value that breaks the rules of its type.
    PluginError
        The plugin raised anything else, `SystemExit` included. Its own `HairkitError` and
        Ctrl-C pass unchanged, and so does an `OSError` about the file to read or write.
    """
    place = f"{hook!r}{subject(arguments)}"
    try:
        with quiet_stdout():
            yield
    except DataError as error:
        raise ResultError(f"{who}, {place}: {one_line(error)}") from error
    except (HairkitError, KeyboardInterrupt):
        raise
    except BaseException as error:
        if isinstance(error, OSError) and _about_file(error, arguments.get("path")):
            raise
        raise PluginError(f"{who} failed in {place}: {describe_error(error)}") from error


@contextmanager
def quiet_stdout() -> Iterator[None]:
    """Mark the code inside as a plugin's, see `results_on_stdout`."""
    token = _in_plugin.set(True)
    try:
        yield
    finally:
        _in_plugin.reset(token)


@contextmanager
def results_on_stdout() -> Iterator[None]:
    """Send what plugins print to stderr, so that stdout holds the results of the command alone."""
    stdout = sys.stdout
    sys.stdout = _Results(stdout)
    try:
        yield
    finally:
        sys.stdout = stdout


class _Results:
    """The stream stdout, but for plugins stderr."""

    def __init__(self, stdout: TextIO) -> None:
        self._stdout = stdout

    def __getattr__(self, name: str) -> Any:
        return getattr(sys.stderr if _in_plugin.get() else self._stdout, name)


def subject(arguments: Mapping[str, Any]) -> str:
    """Return what a call is about, where it is one view or one file: ` of view 'front'`."""
    view, path = arguments.get("view"), arguments.get("path")
    if view is not None:
        return f" of view {view.name!r}"
    return f" of {path}" if path is not None else ""


def describe_error(error: BaseException) -> str:
    """Return the kind and the text of an error in one line."""
    try:
        text = str(error)
    except Exception:  # a plugin's own error class may be broken, too
        text = "(no text)"
    return one_line(f"{type(error).__name__}: {text}" if text else type(error).__name__)


def _about_file(error: OSError, path: Path | None) -> bool:
    """Return whether the file or its disk is at fault, not the plugin."""
    return (
        path is not None
        and isinstance(error.filename, (str, Path))
        and Path(error.filename).absolute().parent in (path.absolute().parent, path.absolute())
    )
