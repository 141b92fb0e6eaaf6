"""Laws of what a plugin does to its host: it is named, one line, and nothing else happens."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from answering_plugin import manager_answering

from hairkit.cli import main
from hairkit.errors import InputError, PluginError
from hairkit.manager.guard import results_on_stdout
from hairkit.stages import OF_HOOK
from hairkit.testing import bristle_groom, stage_arguments


class Quit(BaseException):
    """What a library may raise that nobody is meant to catch."""


class MuteError(Exception):
    """An error whose text cannot be made."""

    def __str__(self) -> str:
        raise ZeroDivisionError


EXITS = [SystemExit(0), SystemExit("bye"), GeneratorExit(), Quit("now"), MemoryError("8 GiB")]
EXITS += [StopIteration(), ZeroDivisionError("two\nlines"), OSError("no place"), MuteError()]


def raising(error: BaseException) -> Any:
    def answer(_: dict[str, Any]) -> None:
        raise error

    return answer


@pytest.mark.parametrize("hook", OF_HOOK)
@pytest.mark.parametrize("error", EXITS, ids=lambda e: type(e).__name__)
def test_whatever_a_plugin_raises_is_one_line_with_its_place(
    hook: str, error: BaseException, tmp_path: Path
) -> None:
    """`sys.exit` too: the error names plugin, distribution, hook and view, and keeps its cause."""
    arguments = stage_arguments(hook, tmp_path)
    with pytest.raises(PluginError) as caught:
        manager_answering(hook, raising(error)).call(hook, "odd", **arguments)
    text = str(caught.value)
    assert text.startswith(f"plugin 'odd' of studio-hair 1.2 failed in '{hook}'")
    assert ("of view 'front'" in text) == ("view" in arguments)
    assert type(error).__name__ in text
    assert "\n" not in text
    assert caught.value.__cause__ is error


@pytest.mark.parametrize("hook", OF_HOOK)
@pytest.mark.parametrize("error", [InputError("the photo is black"), KeyboardInterrupt()])
def test_messages_to_the_user_and_ctrl_c_pass(
    hook: str, error: BaseException, tmp_path: Path
) -> None:
    """What a plugin says on purpose is shown as it is; Ctrl-C is the user's."""
    with pytest.raises(type(error)) as caught:
        manager_answering(hook, raising(error)).call(hook, "odd", **stage_arguments(hook, tmp_path))
    assert caught.value is error


@pytest.mark.parametrize("hook", ["export_groom", "import_groom"])
def test_a_file_at_fault_is_named_as_such(hook: str, tmp_path: Path) -> None:
    """A full disk is no fault of the plugin; a file of its own that it lacks is one."""
    arguments = stage_arguments(hook, tmp_path)
    full = OSError(28, "No space left on device", str(arguments["path"]))
    with pytest.raises(OSError, match="No space left") as caught:
        manager_answering(hook, raising(full)).call(hook, "odd", **arguments)
    assert caught.value is full
    own = OSError(2, "No such file or directory", "/usr/share/odd/table.bin")
    with pytest.raises(PluginError, match=r"plugin 'odd' of .*table\.bin"):
        manager_answering(hook, raising(own)).call(hook, "odd", **arguments)


def arrays_in(value: Any) -> Iterator[np.ndarray]:
    """Yield every array in a stage's argument."""
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from arrays_in(item)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from arrays_in(getattr(value, field.name))


@pytest.mark.parametrize("hook", OF_HOOK)
def test_a_plugin_cannot_change_what_it_is_given(hook: str, tmp_path: Path) -> None:
    """Every array of every argument is read-only, and the error names who tried to write."""
    arguments = stage_arguments(hook, tmp_path)
    arrays = [array for value in arguments.values() for array in arrays_in(value)]
    assert arrays or hook in ("capture", "import_groom")
    for array in arrays:

        def write(_: dict[str, Any], array: np.ndarray = array) -> None:
            array[...] = 0

        with pytest.raises(PluginError, match=f"plugin 'odd' of .* '{hook}'.*read-only"):
            manager_answering(hook, write).call(hook, "odd", **arguments)


@pytest.mark.parametrize("hook", OF_HOOK)
def test_what_a_plugin_prints_is_no_result(
    hook: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a command it goes to stderr; what the command itself prints goes to stdout."""

    def chat(_: dict[str, Any]) -> None:
        print("from the plugin")
        sys.stdout.write("and again\n")

    manager = manager_answering(hook, chat)
    with results_on_stdout():
        with pytest.raises(PluginError, match="returned nothing"):
            manager.call(hook, "odd", **stage_arguments(hook, tmp_path))
        print("result")
    printed = capsys.readouterr()
    assert printed.out == "result\n"
    assert printed.err == "from the plugin\nand again\n"
    print("after")
    assert capsys.readouterr().out == "after\n"


SIMULATOR = '''
"""Fails while it runs."""
import sys
import numpy as np
from hairkit import hookimpl
from hairkit.simulation import Measures

class Odd:
    options, time = None, 0.0
    def __init__(self, groom):
        self.strands, self.points = groom.strands, groom.strands.points
    def reset(self, head_from_rest=None):
        pass
    def retune(self, options):
        pass
    def measure(self):
        return Measures(0.0, 0.0, 0.0)
    def advance(self, seconds, surroundings):
        print("step")
        WAY

@hookimpl
def make_simulator(groom):
    return Odd(groom)
'''


@pytest.mark.parametrize(
    ("way", "said"),
    [
        ("sys.exit(0)", "failed in 'make_simulator': SystemExit: 0"),
        ("1 / 0", "failed in 'make_simulator': ZeroDivisionError"),
        ("self.points = self.points * np.nan", "'make_simulator': the simulation diverged at"),
        ("self.points = self.points[0]", "'make_simulator': points has shape (3,)"),
    ],
)
def test_a_simulator_that_fails_while_it_runs_is_named(
    way: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`hairkit simulate` ends with exit code 2, one line and no file."""
    bristle_groom().save(tmp_path / "groom.npz")
    (tmp_path / "odd.py").write_text(SIMULATOR.replace("WAY", way))
    words = [str(tmp_path / "groom.npz"), "-o", str(tmp_path / "cache.npz"), "--using", "odd"]
    assert main(["simulate", *words, "--plugin", str(tmp_path / "odd.py"), "--quiet"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert said in printed.err.splitlines()[-1]
    assert f"plugin 'odd' of {tmp_path / 'odd.py'}" in printed.err
    assert not (tmp_path / "cache.npz").exists()
