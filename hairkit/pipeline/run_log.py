"""What a run leaves for whoever asks how it went: versions, options and times."""

from __future__ import annotations

import dataclasses
import os
import platform
import threading
import time

import cv2
import numpy as np
import scipy

import hairkit
from hairkit.manager import Manager
from hairkit.pipeline.recipe import Recipe
from hairkit.progress import Progress
from hairkit.storage import write_text


class RunLog:
    """Passes progress on and keeps a record of it."""

    def __init__(self, progress: Progress) -> None:
        """Pass everything on to `progress`."""
        self._progress = progress
        self._began = time.perf_counter()
        self._lines: list[str] = []
        self._guard = threading.Lock()

    def started(self, stage: str, steps: int) -> None:
        """Pass on that a stage has begun."""
        with self._guard:
            self._progress.started(stage, steps)

    def stepped(self, stage: str) -> None:
        """Pass on that a step of a stage is done."""
        with self._guard:
            self._progress.stepped(stage)

    def finished(self, stage: str, seconds: float, reused: bool) -> None:
        """Record and pass on that a stage has ended."""
        with self._guard:
            self._lines.append(f"{stage:<12} {seconds:8.3f} s{' (kept)' if reused else ''}")
            self._progress.finished(stage, seconds, reused)

    def message(self, text: str) -> None:
        """Record and pass on one line."""
        with self._guard:
            self._lines.append(text)
            self._progress.message(text)

    def noted(self, text: str) -> None:
        """Record one line without telling it."""
        with self._guard:
            self._lines.append(text)

    def write(self, path: str | os.PathLike[str], recipe: Recipe, manager: Manager) -> None:
        """Write the record."""
        total = time.perf_counter() - self._began
        lines = [*_versions(), "", *_settings(recipe, manager), "", *self._lines]
        write_text(path, "\n".join([*lines, f"{'in all':<12} {total:8.3f} s"]) + "\n")


def _versions() -> list[str]:
    libraries = {"numpy": np, "scipy": scipy, "opencv": cv2}
    versions = [f"{name} {library.__version__}" for name, library in libraries.items()]
    return [
        f"hairkit {hairkit.__version__}, Python {platform.python_version()}, {', '.join(versions)}",
        f"{platform.platform()}, {os.cpu_count()} cores",
    ]


def _settings(recipe: Recipe, manager: Manager) -> list[str]:
    lines = [f"recipe {recipe.name} ({recipe.source})"]
    for stage in recipe.stages:
        for choice in stage.choices:
            options = manager.options(choice.plugin, choice.options)
            values = dataclasses.asdict(options) if options is not None else {}
            said = ", ".join(f"{name}={value}" for name, value in values.items())
            origin = manager.info(choice.plugin).origin
            lines.append(f"{stage.table:<12} {choice.plugin} of {origin}: {said or 'no options'}")
    return lines
