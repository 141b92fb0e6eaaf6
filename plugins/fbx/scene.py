"""The whole document: header, settings, objects and how they are connected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from hairkit.head_model.bust import Bust
from hairkit.io.coordinate_space import FileSpace
from hairkit.types.head import Head
from hairkit.types.strands import Strands

from .body import add_body, add_bust
from .builder import SCENE, Scene, one, properties70
from .curves import add_curves
from .records import (
    CREATION_TIME,
    FILE_ID,
    VERSION,
    Record,
    file_pieces,
    number,
    raw,
    record,
    text,
)

CREATOR = "hairkit"
_AXES = {"y_up": (1, 1, 2, 1, 0, 1), "z_up": (2, 1, 1, -1, 0, 1)}
_AXIS_NAMES = ("UpAxis", "UpAxisSign", "FrontAxis", "FrontAxisSign", "CoordAxis", "CoordAxisSign")


def scene_pieces(
    head: Head, strands: Strands | None, space: FileSpace, bust: Bust | None = None
) -> list[bytes]:
    """Return the file, in pieces, of a head, and of strands and a bust where there are some."""
    scene = Scene(space)
    add_body(scene, head)
    if bust is not None:
        add_bust(scene, bust)
    if strands is not None:
        add_curves(scene, strands)
    return file_pieces(_document(scene))


def _document(scene: Scene) -> list[Record]:
    connections = [
        record(
            "C",
            text("OP" if drives else "OO"),
            number("L", child),
            number("L", parent),
            *([text(drives)] if drives else []),
        )
        for child, parent, drives in scene.connections
    ]
    return [
        _header(),
        record("FileId", raw(FILE_ID)),
        record("CreationTime", text(CREATION_TIME)),
        record("Creator", text(CREATOR)),
        _settings(scene.space),
        _documents(),
        record("References"),
        _definitions(scene.objects),
        record("Objects", children=scene.objects),
        record("Connections", children=connections),
        record("Takes", children=[record("Current", text(""))]),
    ]


def _header() -> Record:
    stamp = ("Year", 1970), ("Month", 1), ("Day", 1), ("Hour", 10), ("Minute", 0), ("Second", 0)
    times = [("Version", 1000), *stamp, ("Millisecond", 0)]
    return record(
        "FBXHeaderExtension",
        children=[
            record("FBXHeaderVersion", number("I", 1003)),
            record("FBXVersion", number("I", VERSION)),
            record("EncryptionType", number("I", 0)),
            record(
                "CreationTimeStamp",
                children=[record(name, number("I", value)) for name, value in times],
            ),
            record("Creator", text(CREATOR)),
        ],
    )


def _settings(space: FileSpace) -> Record:
    """Return axes and unit; UnitScaleFactor is in centimetres."""
    axes = [
        one(name, "int", "Integer", "", value)
        for name, value in zip(_AXIS_NAMES, _AXES[space.axes], strict=True)
    ]
    centimetres = round(100 * space.metres, 12)
    return record(
        "GlobalSettings",
        children=[
            record("Version", number("I", 1000)),
            properties70(
                *axes,
                one("OriginalUpAxis", "int", "Integer", "", -1),
                one("OriginalUpAxisSign", "int", "Integer", "", 1),
                one("UnitScaleFactor", "double", "Number", "", centimetres),
                one("OriginalUnitScaleFactor", "double", "Number", "", centimetres),
            ),
        ],
    )


def _documents() -> Record:
    document = record(
        "Document",
        number("L", 1),
        text("Scene"),
        text("Scene"),
        children=[record("RootNode", number("L", SCENE))],
    )
    return record("Documents", children=[record("Count", number("I", 1)), document])


def _definitions(objects: Sequence[Record]) -> Record:
    """Return how many objects there are of each kind."""
    counts = Counter({"GlobalSettings": 1})
    counts.update(entry.name.decode() for entry in objects)
    kinds = [
        record("ObjectType", text(kind), children=[record("Count", number("I", count))])
        for kind, count in counts.items()
    ]
    total = record("Count", number("I", len(objects) + 1))
    return record("Definitions", children=[record("Version", number("I", 100)), total, *kinds])
