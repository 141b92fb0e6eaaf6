"""Detect changes of files: the open groom and the shaders."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import resources
from pathlib import Path

from hairkit.storage import file_state

POLL_INTERVAL = 0.5
"""Seconds between two checks."""


class FileWatcher:
    """Polls the modification times of files."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._paths = tuple(paths)
        self._seen = self._states()
        self._looked = 0.0

    def changed(self, now: float) -> bool:
        """Return whether a file has changed since the last check; checks every `POLL_INTERVAL`."""
        if now - self._looked < POLL_INTERVAL:
            return False
        self._looked = now
        states = self._states()
        differ, self._seen = states != self._seen, states
        return differ

    def _states(self) -> list[tuple[int, int, int] | None]:
        return [file_state(path) for path in self._paths]


def shader_files() -> list[Path]:
    """Return the shader files; empty if the package is not a folder."""
    folder = Path(str(resources.files("hairkit_shaders")))
    return sorted(folder.glob("*.*")) if folder.is_dir() else []
