"""Named presets of simulator options, in a TOML file beside the groom: `groom.presets.toml`.

Each preset is a table: the plugin, and its options that differ from the defaults.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from hairkit.errors import InputError
from hairkit.options import unknown_name
from hairkit.storage import read_toml, toml_value, write_text

Preset = dict[str, Any]


def presets_path(groom: Path) -> Path:
    """Return the path of a groom's presets."""
    return groom.with_name(f"{groom.stem}.presets.toml")


def read_presets(path: Path) -> dict[str, Preset]:
    """Return presets by name; empty if the file does not exist."""
    if not os.path.lexists(path):
        return {}
    document = read_toml(path)
    for name, table in document.items():
        if not isinstance(table, Mapping):
            raise InputError(f"{path}: {name!r} is not a table; start it with [{name}]")
    return document


def preset_names(path: Path) -> tuple[str, ...]:
    """Return the names of the presets, none if the file cannot be read; cached."""
    try:
        return _names(path, path.stat().st_mtime_ns)
    except (OSError, InputError):  # reported when a preset is loaded
        return ()


@lru_cache(maxsize=1)
def _names(path: Path, changed: int) -> tuple[str, ...]:
    return tuple(read_presets(path))


def read_preset(path: Path, name: str) -> Preset:
    """Return one preset; raises `InputError` if there is none of that name."""
    presets = read_presets(path)
    if name not in presets:
        raise InputError(f"{path}: {unknown_name('preset', name, presets)}")
    return presets[name]


def write_preset(path: Path, name: str, preset: Mapping[str, Any]) -> None:
    """Add a preset to the file, or replace it."""
    presets = read_presets(path) | {name: dict(preset)}
    lines = []
    for title, table in presets.items():
        lines += [f"[{json.dumps(title)}]"]
        lines += [f"{json.dumps(key)} = {toml_value(value)}" for key, value in table.items()]
        lines += [""]
    write_text(path, "\n".join(lines))
