"""Where model files lie: `HAIRKIT_MODELS`, or the platform's folder for data of programs."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from hairkit.nets.known_models import known_model
from hairkit.system import data_folder

VARIABLE = "HAIRKIT_MODELS"
"""Environment variable that names another folder of models."""


def model_folder() -> Path:
    """Return the folder of model files; it need not exist."""
    chosen = os.environ.get(VARIABLE)
    return Path(chosen).expanduser() if chosen else data_folder() / "hairkit" / "models"


def find_model(name: str) -> Path | None:
    """Return the file of a known model, or None when it is not installed.

    Raises `InputError` for a name that is not in the table of known models. A file of another size
    does not count as installed.
    """
    model = known_model(name)
    path = model_folder() / model.file
    return path if path.is_file() and path.stat().st_size == model.size else None


def missing_models(names: Iterable[str]) -> tuple[str, ...]:
    """Return those of `names` that are not installed, in their order."""
    return tuple(name for name in names if find_model(name) is None)
