"""Strands as NURBS curves of degree 1, one node each, as FBX has no sets of curves."""

from __future__ import annotations

from functools import cache

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.types.strands import Strands

from .builder import SCENE, Scene
from .records import Record, array, number, record, text

ORDER = 2


def add_curves(scene: Scene, strands: Strands) -> None:
    """Add all strands below the nodes `guides` and `hair`, which are there where they have any."""
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
