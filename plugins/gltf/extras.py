"""Data without a glTF equivalent, as JSON under `extras.hairkit` of the document."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from hairkit.io.plain_settings import made, plain, plain_array, plain_settings
from hairkit.types.groom import Groom
from hairkit.types.head import Head
from hairkit.types.torso_shape import TorsoShape

VERSION = 1


def groom_extras(groom: Groom) -> dict[str, Any]:
    """Return what glTF has no place for: settings of the groom, eyes and torso; SI units."""
    torso = groom.head.torso
    return {
        "version": VERSION,
        "unit": "metre",
        **plain_settings(groom),
        "eye_vertices": plain_array(groom.head.eye_vertices),
        "torso": None if torso is None else plain(torso),
    }


def with_extras(head: Head, extras: dict[str, Any]) -> Head:
    """Return the head with the file's landmarks, eyes and torso; malformed ones raise."""
    torso = extras.get("torso")
    return replace(
        head,
        landmark_vertices=extras.get("landmark_vertices"),
        eye_vertices=extras.get("eye_vertices"),
        torso=None if torso is None else made(TorsoShape, torso),
    )
