"""Errors for users: one line that says what is wrong, what was expected and what to do."""

from __future__ import annotations


def one_line(text: object) -> str:
    r"""Return a text in one line that a terminal shows as it is, whatever file it quotes.

    >>> one_line("no node \x1b[2J\n named 'a'")
    "no node \\x1b[2J named 'a'"
    """
    line = " ".join(str(text).split())
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


class HairkitError(Exception):
    """Base of every error hairkit raises on purpose; its text is one line for the user."""


class InputError(HairkitError, ValueError):
    """A file, value or array from the user cannot be used."""


class FormatError(InputError):
    """A file is not, or not entirely, in the format that its name or header claims."""


class OptionError(InputError):
    """An option is unknown, of the wrong type or out of bounds."""


class DataError(InputError):
    """A value or array breaks the rules of its type: shape, range, finiteness."""


class DivergedError(DataError):
    """A simulation has left what hair can do; the command line then ends with exit code 3."""


class PluginError(HairkitError, LookupError):
    """A plugin is missing, fails, or does not implement the stage asked of it."""


class ResultError(PluginError, InputError):
    """A plugin made a value that breaks the rules of its type or of the stage."""


class MissingExtraError(HairkitError, ImportError):
    """An optional dependency is not installed; the text names the pip command that installs it."""


class ModelError(HairkitError, RuntimeError):
    """A neural network's file is not what it should be, or the network cannot be run."""


class RenderError(HairkitError, RuntimeError):
    """No OpenGL context could be created, or drawing failed."""
