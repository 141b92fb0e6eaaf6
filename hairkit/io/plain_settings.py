"""Settings of a groom that file formats have no place for, as numbers, texts and lists; SI units.

glTF keeps them as JSON, USD as custom data. Readers work inside `hairkit.io.glb_file.readable`,
which turns what malformed values raise into one error.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Capsules
from hairkit.types.tie import Tie
from hairkit.types.torso_shape import TorsoShape

_Settings = TypeVar("_Settings", HairMaterial, HairPhysics, Tie, TorsoShape)


def plain_settings(groom: Groom) -> dict[str, Any]:
    """Return material, physics, capsules, ties and landmarks."""
    return {
        "material": plain(groom.material),
        "physics": plain(groom.physics),
        "capsules": plain(groom.head.capsules),
        "ties": [plain(tie) for tie in groom.ties],
        "landmark_vertices": plain_array(groom.head.landmark_vertices),
    }


def plain(value: HairMaterial | HairPhysics | Capsules | Tie | TorsoShape) -> dict[str, Any]:
    """Return the fields of a value."""
    held = {each.name: getattr(value, each.name) for each in fields(value)}
    return {
        name: each if isinstance(each, str) else plain_array(each) for name, each in held.items()
    }


def plain_array(value: Any) -> Any:
    """Return an array or number as lists or a number; None stays."""
    return None if value is None else np.asarray(value).tolist()


def made(kind: type[_Settings], values: Mapping[str, Any]) -> _Settings:
    """Return what `plain` was made of; fields that are missing have their defaults."""
    names = [each.name for each in fields(kind) if each.name in values]
    return kind(**{name: _own(values[name]) for name in names})


def capsules_of(settings: Mapping[str, Any]) -> Capsules:
    """Return the collision capsules; none where the settings have none."""
    values = settings.get("capsules", {})
    columns = {"first": 3, "second": 3, "radius": 2}
    return Capsules(
        *(np.array(values.get(name, ()), np.float32).reshape(-1, n) for name, n in columns.items())
    )


def ties_of(settings: Mapping[str, Any]) -> tuple[Tie, ...]:
    """Return the ties; none where the settings have none."""
    return tuple(made(Tie, tie) for tie in settings.get("ties", ()))


def _own(value: Any) -> Any:
    """Return a text as it is, one number as a float, and lists of numbers as an array."""
    if isinstance(value, str):
        return value
    array = np.asarray(value, np.float64)
    return array if array.ndim else float(array)
