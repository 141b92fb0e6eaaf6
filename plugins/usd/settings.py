"""Settings of a groom without a USD equivalent, as custom data in SI units."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar, get_args

import numpy as np
import numpy.typing as npt

from hairkit.errors import DataError, FormatError
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Capsules
from hairkit.types.tie import Tie, TieKind

_KINDS: tuple[str, ...] = get_args(TieKind)
"""A tie's kind is stored as its place in this list."""
_T = TypeVar("_T", HairMaterial, HairPhysics)


def settings_of(groom: Groom) -> dict[str, Any]:
    """Return nested dictionaries: material, physics, capsules, ties and landmarks."""
    from pxr import Vt

    shapes, landmarks = groom.head.capsules, groom.head.landmark_vertices
    settings: dict[str, Any] = {
        "material": _numbers(groom.material),
        "physics": _numbers(groom.physics),
        "capsules": {
            "first": Vt.Vec3fArray.FromNumpy(shapes.first),
            "second": Vt.Vec3fArray.FromNumpy(shapes.second),
            "radius": Vt.Vec2fArray.FromNumpy(shapes.radius),
        },
    }
    if groom.ties:
        settings["ties"] = {
            "centre": Vt.Vec3fArray.FromNumpy(np.stack([tie.centre for tie in groom.ties])),
            "axis": Vt.Vec3fArray.FromNumpy(np.stack([tie.axis for tie in groom.ties])),
            "radius": Vt.FloatArray([tie.radius for tie in groom.ties]),
            "kind": Vt.IntArray([_KINDS.index(tie.kind) for tie in groom.ties]),
        }
    if landmarks is not None:
        settings["landmarks"] = Vt.IntArray.FromNumpy(landmarks)
    return settings


def _numbers(value: HairMaterial | HairPhysics) -> dict[str, Any]:
    from pxr import Gf

    return {
        field.name: Gf.Vec3f(*map(float, number)) if np.ndim(number) else float(number)
        for field in dataclasses.fields(value)
        for number in (getattr(value, field.name),)
    }


def material_from(settings: Mapping[str, Any], source: object) -> HairMaterial | None:
    """Return the look that the settings (as plain numbers and lists) hold, or None."""
    return _make(HairMaterial, settings.get("material"), source)


def physics_from(settings: Mapping[str, Any], source: object) -> HairPhysics | None:
    """Return the physics that the settings hold, or None."""
    return _make(HairPhysics, settings.get("physics"), source)


def ties_from(settings: Mapping[str, Any], source: object) -> tuple[Tie, ...]:
    """Return the ties; none where the settings have none."""
    found = settings.get("ties")
    if not isinstance(found, Mapping):
        return ()
    centre = numbers(found.get("centre", ()), (-1, 3), source, "ties")
    axis = numbers(found.get("axis", ()), centre.shape, source, "ties")
    radius, kind = (
        numbers(found.get(name, ()), (len(centre),), source, "ties") for name in ("radius", "kind")
    )
    try:
        return tuple(
            Tie(c.astype(np.float32), a.astype(np.float32), float(r), _KINDS[int(k)])
            for c, a, r, k in zip(centre, axis, radius, kind, strict=True)
        )
    except (IndexError, DataError) as error:
        raise FormatError(f"{source}: hairkit's ties are wrong: {error}") from error


def capsules_from(settings: Mapping[str, Any], source: object) -> Capsules:
    """Return the head's collision capsules; none where the settings have none."""
    found = settings.get("capsules")
    held = found if isinstance(found, Mapping) else {}
    return Capsules(
        numbers(held.get("first", ()), (-1, 3), source, "capsules"),
        numbers(held.get("second", ()), (-1, 3), source, "capsules"),
        numbers(held.get("radius", ()), (-1, 2), source, "capsules"),
    )


def numbers(value: Any, shape: tuple[int, ...], source: object, name: str) -> npt.NDArray[Any]:
    """Return lists of finite numbers as an array of `shape`; raises `FormatError`."""
    try:
        array = np.asarray(value, np.float64).reshape(shape)
    except (TypeError, ValueError) as error:
        raise FormatError(f"{source}: hairkit's {name} are not numbers of shape {shape}") from error
    if not np.isfinite(array).all():
        raise FormatError(f"{source}: hairkit's {name} are not finite")
    return array


def _make(kind: type[_T], found: Any, source: object) -> _T | None:
    """Return the dataclass with the fields found, the others at their defaults."""
    if not isinstance(found, Mapping):
        return None
    values: dict[str, Any] = {}
    for field in dataclasses.fields(kind):
        if field.name in found:
            array = numbers(found[field.name], np.shape(found[field.name]), source, field.name)
            values[field.name] = array if array.ndim else float(array)
    try:
        return kind(**values)
    except (ValueError, TypeError) as error:
        raise FormatError(f"{source}: {error}") from error
