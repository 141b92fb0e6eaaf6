"""Objects of an FBX document and how they are connected, while they are put together."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

from hairkit.io.coordinate_space import FileSpace

from .records import Record, number, object_name, record, text

SCENE = 0
"""The id of the scene's root, which is no object."""
_FIRST_ID = 1_000_000
_VALUES = {"int": "I", "enum": "I", "double": "D"}


@dataclass
class Scene:
    """Objects and connections while they are put together."""

    space: FileSpace
    objects: list[Record] = field(default_factory=list)
    connections: list[tuple[int, int, str]] = field(default_factory=list)

    def add(self, kind: str, name: str, subkind: str, *children: Record, label: str = "") -> int:
        """Add an object and return its id; `label` is the class in its name, if not `kind`."""
        number_ = _FIRST_ID + len(self.objects)
        values = (number("L", number_), object_name(name, label or kind), text(subkind))
        self.objects.append(record(kind, *values, children=children))
        return number_

    def add_model(self, name: str, subkind: str, parent: int, *properties: Record) -> int:
        """Add a node of the hierarchy below `parent` and return its id."""
        version, always, *drawn = _of_models()
        own = properties70(*properties, *always.children) if properties else always
        model = self.add("Model", name, subkind, version, own, *drawn)
        self.connect(model, parent)
        return model

    def connect(self, child: int, parent: int, drives: str = "") -> None:
        """Say that an object belongs to another, or drives that property of it."""
        self.connections.append((child, parent, drives))


def properties70(*properties: Record) -> Record:
    """Return an object's block of properties."""
    return record("Properties70", children=properties)


def one(name: str, kind: str, label: str, flags: str, *values: float) -> Record:
    """Return one property; its values are doubles unless its kind is a whole number."""
    code = _VALUES.get(kind, "D")
    numbers = [number(code, value) for value in values]
    return record("P", text(name), text(kind), text(label), text(flags), *numbers)


@cache
def _of_models() -> tuple[Record, ...]:
    """Return what all models have: version, properties, and how they are drawn."""
    return (
        record("Version", number("I", 232)),
        properties70(
            one("DefaultAttributeIndex", "int", "Integer", "", 0),
            one("InheritType", "enum", "", "", 1),
        ),
        record("Shading", number("C", True)),
        record("Culling", text("CullingOff")),
    )
