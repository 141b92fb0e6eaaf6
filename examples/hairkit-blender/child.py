"""hairkit as a child process: it is found, it is run, and what went wrong is one line."""

import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

VARIABLE = "HAIRKIT_PYTHON"
"""Environment variable that names hairkit's Python where the preferences do not."""


class ChildError(Exception):
    """hairkit is not there or has failed; the text is one line for the user."""


class Answer(NamedTuple):
    """What a run of hairkit that went well has said."""

    output: str
    warnings: list
    """One line each."""


class Child:
    """One run of hairkit, which goes on beside Blender until `poll` says that it is over."""

    def __init__(self, command):
        """Start a command, a list of texts; `ChildError` when it does not start."""
        # Both stay open as long as the child runs.
        self._output = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115
        self._said = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=self._said,
                env=_outer_environment(),
            )
        except OSError as error:
            self.close()
            raise ChildError(
                f"hairkit's Python does not start ({command[0]}: {error.strerror}); set it in"
                " Edit > Preferences > Add-ons > hairkit"
            ) from error

    def over(self):
        """Return True once it has ended."""
        return self._process.poll() is not None

    def result(self):
        """Wait for the end and return its `Answer`; `ChildError` when it failed."""
        code = self._process.wait()
        output, said, last = _text(self._output), _text(self._said), self.last_line()
        self.close()
        if code:
            raise ChildError(_reason(last, code))
        mark = "hairkit: WARNING: "
        warnings = [line.partition(mark)[2] for line in said.splitlines() if mark in line]
        return Answer(output, warnings)

    def last_line(self):
        """Return the last line of what it has said so far about its progress."""
        lines = [line for line in _text(self._said).splitlines() if line.strip()]
        return lines[-1].strip() if lines else ""

    def stop(self):
        """End it before its time."""
        self._process.terminate()
        self._process.wait()
        self.close()

    def close(self):
        """Let go of its streams."""
        self._output.close()
        self._said.close()


def run(command, limit=600.0):
    """Return the `Answer` of a command; `ChildError` when it fails or takes more than `limit` s."""
    child, end = Child(command), time.monotonic() + limit
    while not child.over():
        if time.monotonic() > end:
            child.stop()
            raise ChildError(f"hairkit did not answer in {limit:.0f} s and was stopped")
        time.sleep(0.02)
    return child.result()


def hairkit(chosen=""):
    """Return the words that run hairkit's command line.

    `chosen` is a Python, the folder of a virtual environment or the command `hairkit`; empty: the
    environment variable HAIRKIT_PYTHON, then the command `hairkit` on the PATH.
    """
    named = chosen or os.environ.get(VARIABLE, "")
    if not named:
        command = shutil.which("hairkit")
        if command is None:
            raise ChildError(
                "hairkit's Python is not known; set it in Edit > Preferences > Add-ons > hairkit"
            )
        return [command]
    places = [Path(named) / "bin" / "python", Path(named) / "Scripts" / "python.exe", Path(named)]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        raise ChildError(
            f"hairkit's Python is not at {named}; set it in Edit > Preferences > Add-ons > hairkit"
        )
    if found.stem.lower() == "hairkit":
        return [str(found)]
    return [str(found), "-m", "hairkit"]


def _outer_environment():
    """Return the environment without what was set for another Python, nor the current folder."""
    names = ("PYTHONHOME", "PYTHONPATH", "PYTHONSTARTUP", "VIRTUAL_ENV", "__PYVENV_LAUNCHER__")
    kept = {name: value for name, value in os.environ.items() if name not in names}
    return kept | {"PYTHONSAFEPATH": "1"}


def _reason(said, code):
    if "No module named" in said and "hairkit" in said:
        return (
            "hairkit is not installed in the chosen Python; set another in Edit > Preferences >"
            " Add-ons > hairkit"
        )
    return said or f"hairkit ended with code {code} and said nothing"


def _text(file):
    file.seek(0)
    return file.read()
