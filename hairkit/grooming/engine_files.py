"""What an engine or program takes of a groom: its files, each in a format and with options.

The pages on the engines in the documentation say why, and what becomes of the files there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial


@dataclass(frozen=True)
class EngineFile:
    """One file of an engine."""

    name: str
    plugin: str
    """The export plugin that writes it."""
    options: Mapping[str, object] = field(default_factory=dict)


_hair = partial(EngineFile, "hair.abc", "alembic")
_HEAD = EngineFile("head.fbx", "fbx")
ENGINES = {
    "unreal": (_hair({"axis": "unreal", "hairs": 50_000}), _HEAD),
    "unity": (_hair({"hairs": 20_000}), _HEAD),
    "blender": (_hair({"hairs": 20_000, "split": True}), _HEAD),
    "maya": (
        _hair({"axis": "y_up_centimetres", "hairs": 20_000}),
        EngineFile("guides.ma", "maya", {"strands": "guides"}),
        _HEAD,
    ),
    "houdini": (_hair({"hairs": 20_000}), _HEAD),
    "hairworks": (EngineFile("hair.apx", "hairworks", {"maps": True}),),
    "web": (EngineFile("hair.glb", "gltf"),),
}
"""The files of each engine; the first is the hair, which `hairkit validate --for` checks."""
