"""Blender as a child process, which tests talk to: one call, one answer with arrays.

Blender runs in a Python of its own (`make test-clients` makes it), because it pins an old NumPy.
The functions that run there are those of the modules in `tests/clients/inside`.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import threading
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

PROJECT = Path(__file__).parents[2]
INSIDE = Path(__file__).parents[1] / "clients" / "inside"
VARIABLE = "HAIRKIT_BPY_PYTHON"
"""Names Pythons that can `import bpy`, in place of those that `make test-clients` makes."""
LIMIT = 300.0
"""Seconds that one call may take."""


class BlenderError(Exception):
    """Blender raised an error, or it is gone; the text is what it said."""


def blender_pythons() -> list[Path]:
    """Return the Pythons that have Blender as a module, one for each version of Blender."""
    named = os.environ.get(VARIABLE)
    if named:
        return [Path(name) for name in named.split(os.pathsep)]
    made = sorted((PROJECT / ".clients").glob("bpy*"))
    places = [folder / end for folder in made for end in ("bin/python", "Scripts/python.exe")]
    return [place for place in places if place.exists()]


class BlenderSession:
    """One Blender that answers calls; it is started again when a call has killed it."""

    def __init__(self, python: Path, folder: Path) -> None:
        self.python = python
        self._folder = folder
        """Blender's own files, so that nothing of the user's is read or changed."""
        self._child: subprocess.Popen[str] | None = None
        # It stays open as long as the session.
        self._said = tempfile.TemporaryFile("w+", dir=folder, errors="replace")  # noqa: SIM115

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._child is not None:
            self._child.communicate(timeout=30)
        self._said.close()

    def call(self, function: str, **arguments: Any) -> Any:
        """Return what `module.function` of `tests/clients/inside` returns.

        Arguments are numbers, texts, paths, and lists and dicts of them; the result may hold NumPy
        arrays too. Raises `BlenderError` with Blender's traceback.
        """
        if self._child is None or self._child.poll() is not None:
            self._child = self._started()
        child = self._child
        assert child.stdin is not None
        assert child.stdout is not None
        watchdog = threading.Timer(LIMIT, child.kill)
        watchdog.start()
        try:
            request = {"function": function, "arguments": arguments}
            child.stdin.write(json.dumps(request, default=str) + "\n")
            child.stdin.flush()
            answer = child.stdout.readline()
        finally:
            watchdog.cancel()
        if not answer:
            raise BlenderError(f"Blender ended in {function}:\n{self._last_words()}")
        return self._read(json.loads(answer))

    def _started(self) -> subprocess.Popen[str]:
        resources = {"BLENDER_USER_RESOURCES": str(self._folder), "PYTHONDONTWRITEBYTECODE": "1"}
        return subprocess.Popen(
            [str(self.python), str(INSIDE / "serve.py"), str(self._folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            text=True,
            env={**os.environ, **resources},
        )

    def _read(self, answer: dict[str, Any]) -> Any:
        if "error" in answer:
            raise BlenderError(answer["error"])
        with np.load(answer["arrays"]) as stored:
            arrays = {name: stored[name] for name in stored.files}
        Path(answer["arrays"]).unlink()
        return _with_arrays(answer["result"], arrays)

    def _last_words(self) -> str:
        self._said.seek(0)
        return self._said.read()[-2000:]


def z_up(points: npt.ArrayLike) -> npt.NDArray[np.float32]:
    """Return points (..., 3) of the head frame as Blender has them: x, -z, y."""
    turned: npt.NDArray[np.float32] = np.asarray(points, np.float32)[..., [0, 2, 1]]
    return turned * np.array([1, -1, 1], np.float32)


def only(things: list[dict[str, Any]], kind: str, name: str = "") -> dict[str, Any]:
    """Return the only object of a type whose name begins with `name`."""
    found = [t for t in things if t["type"] == kind and t["name"].startswith(name)]
    assert len(found) == 1, [(t["type"], t["name"]) for t in things]
    return found[0]


def _with_arrays(value: Any, arrays: dict[str, np.ndarray[Any, Any]]) -> Any:
    if isinstance(value, dict):
        if set(value) == {"array"}:
            return arrays[value["array"]]
        return {key: _with_arrays(item, arrays) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_arrays(item, arrays) for item in value]
    return value
