"""Data without a glTF equivalent, as JSON under `extras.hairkit` of the document."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np

from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Capsules, Head
from hairkit.types.tie import Tie
from hairkit.types.torso_shape import TorsoShape

VERSION = 1
_PHYSICS = ("stiffness", "bend_stiffness", "damping", "friction", "gravity")


def groom_extras(groom: Groom) -> dict[str, Any]:
    """Return what glTF has no place for: material, physics, capsules, ties, landmarks; SI units."""
    look, head = groom.material, groom.head
    landmarks = head.landmark_vertices
    return {
        "version": VERSION,
        "unit": "metre",
        "material": {
            "root_colour": look.root_colour.tolist(),
            "tip_colour": look.tip_colour.tolist(),
            "width": float(look.width),
            "curl_radius": float(look.curl_radius),
            "curl_pitch": float(look.curl_pitch),
        },
        "physics": {name: float(getattr(groom.physics, name)) for name in _PHYSICS},
        "capsules": {
            "first": head.capsules.first.tolist(),
            "second": head.capsules.second.tolist(),
            "radius": head.capsules.radius.tolist(),
        },
        "ties": [
            {
                "centre": tie.centre.tolist(),
                "axis": tie.axis.tolist(),
                "radius": float(tie.radius),
                "kind": tie.kind,
            }
            for tie in groom.ties
        ],
        "landmark_vertices": None if landmarks is None else landmarks.tolist(),
        "eye_vertices": None if head.eye_vertices is None else head.eye_vertices.tolist(),
        "torso": None if head.torso is None else asdict(head.torso),
    }


def material_of(extras: dict[str, Any]) -> HairMaterial:
    """Return the material; raises what malformed values raise."""
    values = extras["material"]
    return HairMaterial(
        np.array(values["root_colour"], np.float32),
        np.array(values["tip_colour"], np.float32),
        *(_number(values[name]) for name in ("width", "curl_radius", "curl_pitch")),
    )


def physics_of(extras: dict[str, Any]) -> HairPhysics:
    """Return the physics."""
    return HairPhysics(*(_number(extras["physics"][name]) for name in _PHYSICS))


def ties_of(extras: dict[str, Any]) -> tuple[Tie, ...]:
    """Return the ties; none in files of older versions."""
    return tuple(
        Tie(
            np.array(tie["centre"], np.float32),
            np.array(tie["axis"], np.float32),
            _number(tie["radius"]),
            str(tie["kind"]),
        )
        for tie in extras.get("ties", [])
    )


def capsules_of(extras: dict[str, Any]) -> Capsules:
    """Return the collision capsules."""
    values = extras["capsules"]
    first = np.array(values["first"], np.float32).reshape(-1, 3)
    second = np.array(values["second"], np.float32).reshape(-1, 3)
    return Capsules(first, second, np.array(values["radius"], np.float32).reshape(-1, 2))


def with_landmarks(head: Head, extras: dict[str, Any]) -> Head:
    """Return the head with the file's landmarks, eyes and torso, checked."""
    eyes, torso = extras.get("eye_vertices"), extras.get("torso")
    head = replace(
        head,
        eye_vertices=None if eyes is None else np.array(eyes, np.int32),
        torso=None if torso is None else TorsoShape(**{k: float(v) for k, v in torso.items()}),
    )
    numbers = extras.get("landmark_vertices")
    if numbers is None:
        return head
    index = np.array(numbers, np.int32)
    if index.shape != (68,) or index.min() < 0 or index.max() >= len(head.vertices):
        raise ValueError("landmark_vertices are not 68 vertices of the head")
    return replace(head, landmark_vertices=index)


def _number(value: Any) -> float:
    number = float(value)
    if not np.isfinite(number):
        raise ValueError(f"{value} where a number is expected")
    return number
