"""The command line: one verb, one small file `hairkit/cli/VERB.py`.

Its `DESCRIPTION` begins with an example, `add_arguments(add)` adds to its parser, and `run(args)`
does the work and returns the exit code. Only the verb that is asked for is imported.
Results go to stdout, progress and logs to stderr. Exit codes: 0 done, 1 a bug, 2 one line says why,
3 a simulation diverged, 4 a file that was validated breaks a rule, 130 ended by a second Ctrl-C.

* `arguments`: arguments that several verbs have
* `batch`: many captures
* `batch_table`: its table on a terminal
* `convert`: read hair of one format, write another
* `doctor`: check this machine
* `edit`: brushes over a groom
* `evaluate`: scores against the truth
* `export`: write a groom for an engine
* `format_table`: the table of file formats
* `head`: photos to a head with its skin
* `info`: what a file holds
* `masks`: the hair in single photos
* `models`: networks that plugins use
* `new_plugin`: a plugin to start from
* `plugins`: list of plugins and options
* `reader_settings`: options of the verbs that read hair of any format
* `reconstruct`: photos to groom
* `render`: pictures of a groom
* `rerun`: a recorded run once more
* `scaffold`: the files that `new-plugin` writes
* `scaffold_sketches`: the simplest method for every hook, which it writes
* `settings`: `--set` of all verbs
* `simulate`: simulation to a cache
* `studio`: photos to moving hair in a browser
* `synth`: procedural captures
* `study`: questionnaires
* `texture`: textures made finer, filtered, or turned into bump and normal maps
* `validate`: a hair file checked for an engine
* `view`: the viewer
* `written`: what verbs that write files print
* `wrap`: a groom carried to another head
"""

from __future__ import annotations

import argparse
import difflib
import errno
import importlib
import logging
import os
import re
import sys
import traceback
from collections.abc import Sequence
from typing import Any, NoReturn

from hairkit.errors import DivergedError, HairkitError, InputError, one_line
from hairkit.system import utf8_name

VERBS = {
    "reconstruct": "turn photos of a head, or a video, into a groom",
    "masks": "find the hair in photos, as masks to be painted over",
    "head": "turn photos into a head with the person's skin, without hair",
    "studio": "from a camera to moving hair, in a browser",
    "batch": "turn many captures into grooms, a process for each",
    "rerun": "run a reconstruction again from its record",
    "evaluate": "score a groom against the truth",
    "synth": "make a procedural groom and photos of it, with their truth",
    "study": "make a questionnaire: which hair is whose",
    "texture": "sharpen or filter a texture, make bump and normal maps",
    "render": "draw a groom on its head",
    "view": "show a groom in motion, in a window or by a script",
    "export": "write a groom in an engine's format",
    "convert": "read hair of one format, write another",
    "edit": "comb, cut, curl, thin or fill up a groom by brushes",
    "wrap": "carry a groom to another head",
    "validate": "check a hair file for an engine",
    "simulate": "simulate a groom, its head shaken and in wind",
    "info": "print what a file contains",
    "plugins": "list the plugins, or describe one",
    "models": "list the networks that plugins use, or install them",
    "new-plugin": "start a plugin of your own",
    "doctor": "check this machine and print what to install",
}

_COMMAND_COLUMNS = 28
"""Characters of the help's left column, indent included: no option of a verb breaks its line."""
_EXAMPLE = "Example: hairkit reconstruct photos/ -o out/"


class _HelpFormatter(argparse.RawDescriptionHelpFormatter):
    """Keeps the description's lines and leaves room for the longest command."""

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **{"max_help_position": _COMMAND_COLUMNS, **settings})


class Parser(argparse.ArgumentParser):
    """An argument parser whose help begins with the example and whose errors are one line."""

    def __init__(self, **settings: Any) -> None:
        settings.setdefault("formatter_class", _HelpFormatter)
        settings.setdefault("allow_abbrev", False)
        super().__init__(**settings)

    def format_help(self) -> str:
        """Return the help, the description (which begins with an example) before the usage."""
        description, self.description = self.description, None
        try:
            return f"{description or _EXAMPLE}\n\n{super().format_help()}"
        finally:
            self.description = description

    def error(self, message: str) -> NoReturn:
        """Print one line on stderr and leave with exit code 2."""
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; `argv` is `sys.argv[1:]` by default."""
    words = list(sys.argv[1:] if argv is None else argv)
    debug = "--debug" in words
    words = [word for word in words if word != "--debug"]
    _log_to_stderr(logging.DEBUG if debug else logging.WARNING)
    try:
        for word in words:
            if not utf8_name(word):  # refused before any work
                raise InputError("an argument is empty; is a variable of the shell not set?")
        return _run(words)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # so that the exit's flush stays quiet too
        return 0
    except (Exception, KeyboardInterrupt) as error:
        if debug:
            traceback.print_exc()
        line, code = explain(error)
        print(f"hairkit: {line}", file=sys.stderr)
        return code


def explain(error: BaseException) -> tuple[str, int]:
    """Return one line that explains an error to a user, and the exit code."""
    if _is_interrupt(error):
        said = str(error) if isinstance(error, KeyboardInterrupt) else ""
        return f"interrupted; {said or 'run it again to continue where it stopped'}", 2
    if isinstance(error, DivergedError):
        return one_line(error), 3
    if isinstance(error, HairkitError):
        return one_line(error), 2
    if isinstance(error, MemoryError):
        return f"out of memory; use smaller pictures or larger voxels ({one_line(error)})", 2
    if isinstance(error, OSError):
        named = f"{error.filename}: " if error.filename is not None else ""
        cure = "; free some space and run it again" if error.errno == errno.ENOSPC else ""
        return f"{named}{error.strerror or one_line(error)}{cure}", 2
    kind = type(error).__name__
    return f"unexpected {kind}: {one_line(error)}; run it again with --debug to see where", 1


def _run(words: list[str]) -> int:
    verb = next((word for word in words if not word.startswith("-")), None)
    if verb is not None and verb not in VERBS:
        close = difflib.get_close_matches(verb, VERBS, 1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        raise _UsageError(f"no command {verb!r}{hint}; commands: {', '.join(VERBS)}")
    parser, verb_parser, module = _build(verb)
    if verb is None and not {"-h", "--help", "--version"} & set(words):
        parser.print_help(sys.stderr)
        return 2
    args, unknown = parser.parse_known_args(_vectors_joined(words))
    if unknown:
        _refuse(verb_parser or parser, unknown)
    from hairkit.manager.guard import results_on_stdout

    with results_on_stdout():
        return int(module.run(args))


def _vectors_joined(words: list[str]) -> list[str]:
    """Return `--wind -3,0,0` as `--wind=-3,0,0`, which argparse would take for two options."""
    joined: list[str] = []
    for word in words:
        if re.fullmatch(r"-[\d.][\d.e+,-]*,[\d.e+,-]+", word) and joined and joined[-1][:2] == "--":
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class _UsageError(HairkitError):
    """The command line itself cannot be understood."""


def _build(verb: str | None) -> tuple[Parser, Parser | None, Any]:
    """Make the parser; only the module of `verb` is imported."""
    from hairkit.version import __version__

    parser = Parser(prog="hairkit", description=_EXAMPLE)
    parser.add_argument("--version", action="version", version=f"hairkit {__version__}")
    parser.add_argument("--debug", action="store_true", help="show tracebacks and debug messages")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND [-h]", parser_class=Parser)
    module = None
    for name, summary in VERBS.items():
        if name == verb:
            module = importlib.import_module(f"hairkit.cli.{name.replace('-', '_')}")
            parts = verbs.add_parser(name, help=summary, description=module.DESCRIPTION)
            module.add_arguments(parts.add_argument)
        else:
            verbs.add_parser(name, help=summary)
    return parser, verbs.choices[verb] if verb is not None else None, module


def _refuse(parser: Parser, unknown: list[str]) -> NoReturn:
    known = sorted(set(re.findall(r"--[\w-]+", parser.format_help())))
    word = unknown[0]
    if not word.startswith("-"):
        parser.error(f"unexpected argument {word!r}")
    close = difflib.get_close_matches(word.partition("=")[0], known, 1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    parser.error(f"no option {word!r}{hint}")


def _log_to_stderr(level: int) -> None:
    logger = logging.getLogger("hairkit")
    logger.setLevel(level)
    if not logger.handlers:
        handler = logging.StreamHandler()
        handler.setFormatter(_OneLine("hairkit: %(levelname)s: %(message)s"))
        logger.addHandler(handler)


class _OneLine(logging.Formatter):
    """Writes messages that a terminal shows as they are, whatever file they quote."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 (logging's name)
        return one_line(super().formatMessage(record))


def _is_interrupt(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error: a library may turn it into an ImportError."""
    if error is None or isinstance(error, KeyboardInterrupt):
        return error is not None
    return _is_interrupt(error.__cause__ or error.__context__)
