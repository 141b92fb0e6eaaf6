"""Settings of a groom without a USD equivalent, as custom data in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

import numpy as np

from hairkit.io.plain_settings import plain_settings
from hairkit.types.groom import Groom
from hairkit.types.tie import TieKind

_KINDS: tuple[str, ...] = get_args(TieKind)
"""A tie's kind is stored as its place in this list."""
_LANDMARKS = "landmark_vertices", "landmarks"
"""Their names here and in the file."""
_TIE = ("centre", "axis", "radius", "kind")


def settings_of(groom: Groom) -> dict[str, Any]:
    """Return nested dictionaries: material, physics, capsules, ties and landmarks."""
    from pxr import Gf, Vt

    settings = plain_settings(groom)
    for part in ("material", "physics"):
        settings[part] = {
            name: Gf.Vec3f(*value) if isinstance(value, list) else value
            for name, value in settings[part].items()
        }
    shapes = groom.head.capsules
    settings["capsules"] = {
        "first": Vt.Vec3fArray.FromNumpy(shapes.first),
        "second": Vt.Vec3fArray.FromNumpy(shapes.second),
        "radius": Vt.Vec2fArray.FromNumpy(shapes.radius),
    }
    here, there = _LANDMARKS
    landmarks = settings.pop(here)
    if landmarks is not None:
        settings[there] = Vt.IntArray(landmarks)
    if not settings.pop("ties"):
        return settings
    return settings | {
        "ties": {
            "centre": Vt.Vec3fArray.FromNumpy(np.stack([tie.centre for tie in groom.ties])),
            "axis": Vt.Vec3fArray.FromNumpy(np.stack([tie.axis for tie in groom.ties])),
            "radius": Vt.FloatArray([tie.radius for tie in groom.ties]),
            "kind": Vt.IntArray([_KINDS.index(tie.kind) for tie in groom.ties]),
        }
    }


def plain_settings_of(held: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a file holds, as plain numbers and lists, in `plain_settings`' form."""
    settings = dict(held)
    here, there = _LANDMARKS
    if there in settings:
        settings[here] = settings.pop(there)
    columns = {name: settings["ties"][name] for name in _TIE} if "ties" in settings else {}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    settings["ties"] = [row | {"kind": _KINDS[int(row["kind"])]} for row in rows]
    return settings
