"""hairkit: eight photos around a head in, simulation-ready guide hair out.

The names below load when they are first used, so that the command line answers at once.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hairkit.camera import Camera
    from hairkit.capture import Capture, View
    from hairkit.errors import HairkitError
    from hairkit.groom import Groom, HairMaterial, HairPhysics
    from hairkit.head import Capsules, Head, Roots
    from hairkit.hookspecs import hookimpl, hookspec
    from hairkit.mask import Mask
    from hairkit.orientation import OrientationMap
    from hairkit.scene import Scene
    from hairkit.strands import Strands
    from hairkit.volume import Hull, OrientationField, VoxelGrid

__version__ = "0.1.0"

__all__ = [
    "Camera",
    "Capsules",
    "Capture",
    "Groom",
    "HairMaterial",
    "HairPhysics",
    "HairkitError",
    "Head",
    "Hull",
    "Mask",
    "OrientationField",
    "OrientationMap",
    "Roots",
    "Scene",
    "Strands",
    "View",
    "VoxelGrid",
    "hookimpl",
    "hookspec",
]

_HOMES = {
    "camera": ("Camera",),
    "capture": ("Capture", "View"),
    "errors": ("HairkitError",),
    "groom": ("Groom", "HairMaterial", "HairPhysics"),
    "head": ("Capsules", "Head", "Roots"),
    "hookspecs": ("hookimpl", "hookspec"),
    "mask": ("Mask",),
    "orientation": ("OrientationMap",),
    "scene": ("Scene",),
    "strands": ("Strands",),
    "volume": ("Hull", "OrientationField", "VoxelGrid"),
}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"hairkit.{module}"), name)
    raise AttributeError(f"module 'hairkit' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__all__]
