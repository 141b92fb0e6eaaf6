"""Tells when files change: the groom that is shown, the shaders it is drawn with."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import resources
from pathlib import Path

EVERY = 0.5
"""Seconds between two looks."""


class Watch:
    """Looks at files from time to time."""

    def __init__(self, paths: Iterable[Path]) -> None:
        self._paths = tuple(paths)
        self._seen = self._states()
        self._looked = 0.0

    def changed(self, now: float) -> bool:
        """Return whether a file has changed since the last time; looks every half second."""
        if now - self._looked < EVERY:
            return False
        self._looked = now
        states = self._states()
        differ, self._seen = states != self._seen, states
        return differ

    def _states(self) -> list[tuple[int, int] | None]:
        return [_state(path) for path in self._paths]


def shader_files() -> list[Path]:
    """Return the shaders' files; none where the package is not a folder."""
    folder = Path(str(resources.files("hairkit.shaders")))
    return sorted(folder.glob("*.*")) if folder.is_dir() else []


def _state(path: Path) -> tuple[int, int] | None:
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_mtime_ns, stat.st_size
