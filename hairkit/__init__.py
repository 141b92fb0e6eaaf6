"""hairkit: eight photos around a head in, simulation-ready guide hair out.

The names below load when they are first used, so that the command line answers at once.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hairkit.errors import HairkitError
    from hairkit.hookspecs import hookimpl, hookspec
    from hairkit.types.camera import Camera
    from hairkit.types.capture import Capture, View
    from hairkit.types.groom import Groom, HairMaterial, HairPhysics
    from hairkit.types.head import Capsules, Head, Roots
    from hairkit.types.mask import Mask
    from hairkit.types.orientation import OrientationMap
    from hairkit.types.scene import Scene
    from hairkit.types.strands import Strands
    from hairkit.types.volume import Hull, OrientationField, VoxelGrid

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
    "types.camera": ("Camera",),
    "types.capture": ("Capture", "View"),
    "errors": ("HairkitError",),
    "types.groom": ("Groom", "HairMaterial", "HairPhysics"),
    "types.head": ("Capsules", "Head", "Roots"),
    "hookspecs": ("hookimpl", "hookspec"),
    "types.mask": ("Mask",),
    "types.orientation": ("OrientationMap",),
    "types.scene": ("Scene",),
    "types.strands": ("Strands",),
    "types.volume": ("Hull", "OrientationField", "VoxelGrid"),
}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"hairkit.{module}"), name)
    raise AttributeError(f"module 'hairkit' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__all__]
