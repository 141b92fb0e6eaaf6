"""The whole document: header, settings, objects and how they are connected."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import cache

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.head_model.bust import Bust
from hairkit.io.coordinate_space import FileSpace
from hairkit.types.head import Head
from hairkit.types.strands import Strands

from .body import add_body, add_bust
from .builder import SCENE, Scene, one, properties70
from .records import (
    CREATION_TIME,
    FILE_ID,
    VERSION,
    Record,
    array,
    file_pieces,
    number,
    raw,
    record,
    text,
)

CREATOR = "hairkit"
_AXES = {"y_up": (1, 1, 2, 1, 0, 1), "z_up": (2, 1, 1, -1, 0, 1)}
_AXIS_NAMES = ("UpAxis", "UpAxisSign", "FrontAxis", "FrontAxisSign", "CoordAxis", "CoordAxisSign")
ORDER = 2


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


def add_curves(scene: Scene, strands: Strands) -> None:
    """Add all strands below the nodes `guides` and `hair`, which are there where they have any.

    Each is a NURBS curve of degree 1 with a node of its own: FBX has no sets of curves.
    """
    points = np.ones((len(strands.points), 4))
    points[:, :3] = scene.space.points_to_file(strands.points)
    guide = np.ones(len(strands), bool) if strands.guide is None else strands.guide
    for name, mask in (("guide", guide), ("hair", ~guide)):
        numbers = np.flatnonzero(mask)
        if len(numbers):
            parent = _add_group(scene, {"guide": "guides"}.get(name, name))
        digits = len(str(len(strands)))
        for strand in numbers.tolist():
            rows = points[strands.offsets[strand] : strands.offsets[strand + 1]]
            _add_curve(scene, f"{name}_{strand:0{digits}}", parent, rows)


def _add_group(scene: Scene, name: str) -> int:
    group = scene.add_model(name, "Null", SCENE)
    scene.connect(
        scene.add("NodeAttribute", name, "Null", record("TypeFlags", text("Null"))), group
    )
    return group


def _add_curve(scene: Scene, name: str, parent: int, points: Float64Array) -> None:
    """Add one curve through points (n, 4), the last column weights of 1."""
    geometry = scene.add(
        "Geometry",
        name,
        "NurbsCurve",
        *_of_curves(),
        record("Points", array("d", points)),
        _knots(len(points)),
    )
    scene.connect(geometry, scene.add_model(name, "NurbsCurve", parent))


@cache
def _of_curves() -> tuple[Record, ...]:
    """Return what all curves have."""
    return (
        record("GeometryVersion", number("I", 124)),
        record("Type", text("NurbsCurve")),
        record("NurbsCurveVersion", number("I", 100)),
        record("Order", number("I", ORDER)),
        record("Dimension", number("I", 3)),
        record("Form", text("Open")),
        record("Rational", number("I", 0)),
    )


@cache
def _knots(count: int) -> Record:
    """Return the knots of a curve of `count` points, the first and the last twice."""
    knots = np.concatenate([[0.0], np.arange(count), [count - 1.0]])
    return record("KnotVector", array("d", knots))
