"""The log file of a run: versions, options and times."""

from __future__ import annotations

import dataclasses
import os
import platform
import threading
import time
from dataclasses import dataclass

import cv2
import numpy as np
import scipy

from hairkit.manager import Manager
from hairkit.pipeline.recipe import Recipe
from hairkit.progress import Progress
from hairkit.storage import write_text
from hairkit.version import __version__


@dataclass(frozen=True)
class StageTime:
    """Duration of one stage of a run."""

    stage: str
    seconds: float
    reused: bool
    """True when the result of an earlier run was taken."""


class RunLog:
    """Forwards progress and records it for `hairkit.log`."""

    def __init__(self, progress: Progress) -> None:
        """Forward to `progress`."""
        self._progress = progress
        self._began = time.perf_counter()
        self._lines: list[str] = []
        self.stages: list[StageTime] = []
        """Stages that have ended, in that order."""
        self._guard = threading.Lock()

    def started(self, stage: str, steps: int) -> None:
        """Forward the start of a stage."""
        with self._guard:
            self._progress.started(stage, steps)

    def stepped(self, stage: str) -> None:
        """Forward one step of a stage."""
        with self._guard:
            self._progress.stepped(stage)

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Record and forward the end of a stage."""
        with self._guard:
            self._lines.append(f"{stage:<12} {seconds:8.3f} s{' (kept)' if reused else ''}")
            self.stages.append(StageTime(stage, round(seconds, 4), reused))
            self._progress.finished(stage, seconds, reused)

    def message(self, text: str) -> None:
        """Record and forward one line."""
        with self._guard:
            self._lines.append(text)
            self._progress.message(text)

    def write(self, path: str | os.PathLike[str], recipe: Recipe, manager: Manager) -> None:
        """Write the log file."""
        total = time.perf_counter() - self._began
        lines = [*_versions(), "", *_settings(recipe, manager), "", *self._lines]
        write_text(path, "\n".join([*lines, f"{'total':<12} {total:8.3f} s"]) + "\n")


def _versions() -> list[str]:
    libraries = {"numpy": np, "scipy": scipy, "opencv": cv2}
    versions = [f"{name} {library.__version__}" for name, library in libraries.items()]
    return [
        f"hairkit {__version__}, Python {platform.python_version()}, {', '.join(versions)}",
        f"{platform.platform()}, {os.cpu_count()} cores",
    ]


def _settings(recipe: Recipe, manager: Manager) -> list[str]:
    lines = [f"recipe {recipe.name} ({recipe.source})"]
    for stage in recipe.stages:
        for choice in stage.choices:
            options = manager.options(choice.plugin, choice.options)
            values = dataclasses.asdict(options) if options is not None else {}
            shown = ", ".join(f"{name}={value}" for name, value in values.items())
            origin = manager.info(choice.plugin).origin
            lines.append(f"{stage.table:<12} {choice.plugin} of {origin}: {shown or 'no options'}")
    return lines
