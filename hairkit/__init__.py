"""hairkit: eight photos around a head in, simulation-ready guide hair out."""

from __future__ import annotations

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
