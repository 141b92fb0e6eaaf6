"""The curves objects of an Alembic file: points in the world, widths and groom attributes."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.grooming.curve_sets import CONSTANT, UNIFORM, VERTEX, CurveSet, Spread, on_curve
from hairkit.io.spline_curves import cubic_map, nurbs_map

from .contents import Object, Values, read_objects

_CUBIC, _LINEAR, _NON_PERIODIC = 0, 1, 0
_CUBIC_ORDER = 4
_BASES = {1: "bezier", 2: "bspline", 3: "catmullRom"}
"""Alembic's numbers of bases (`AbcGeom::BasisType`)."""
_SCOPES = {"con": CONSTANT, "uni": UNIFORM, "vtx": VERTEX}
_IDENTITY = np.eye(4)

_log = logging.getLogger("hairkit")


def read_curve_sets(path: Path) -> list[CurveSet]:
    """Return every curves object with curves in it, in the file's order.

    Raises
    ------
    FormatError
        The file is damaged, or has no curves.
    InputError
        The file is missing, or of the HDF5 kind.
    """
    curves = (each for each in read_objects(path) if each.is_a("AbcGeom_Curve"))
    sets = [found for each in curves if (found := _curve_set(each)) is not None]
    if not sets:
        raise FormatError(f"{path}: an Alembic file without curves")
    return sets


def _curve_set(node: Object) -> CurveSet | None:
    found, world = node.values, node.world
    points = found["P"].floats() if "P" in found else None
    if points is None:
        return None
    counts = _counts(found, points, node)
    spread = Spread(counts)

    def at_points(*names: str, columns: int) -> Any:
        values = _values(node, names, columns, "f")
        return values and _fit(spread.to_points(*values), node, names)

    def at_strands(*names: str, columns: int, kind: str) -> Any:
        values = _values(node, names, columns, kind)
        return values and _fit(spread.to_strands(*values), node, names)

    if found["P"].samples > 1:
        frames = found["P"].samples
        _log.warning("%s: animated, %d frames; the first is read", node.path, frames)
    spline = _spline(found, counts, node)
    widths = on_curve(spline, at_points("groom_width", "width", columns=1))
    group = at_strands("groom_group_id", columns=1, kind="i")
    guide = at_strands("groom_guide", columns=1, kind="i")
    return CurveSet(
        points=_move(on_curve(spline, points), world),
        counts=counts,
        widths=None if widths is None else _scale(widths[:, 0], world),
        root_uv=at_strands("groom_root_uv", "uv", columns=2, kind="f"),
        colour=on_curve(spline, at_points("groom_color", columns=3)),
        group=None if group is None else group[:, 0],
        guide=None if guide is None else guide[:, 0],
    )


def _counts(found: Mapping[str, Values], points: Float32Array, node: Object) -> Int64Array:
    counts = found["nVertices"].integers() if "nVertices" in found else None
    if points.shape[1] != 3 or counts is None or counts.min() < 0:
        raise node.error("has no points or counts of points")
    # each count is at most the number of points, so that their sum cannot overflow
    if counts.max() > len(points) or counts.sum() != len(points):
        raise node.error(f"has {len(points)} points, its curves ask for another number")
    return counts[:, 0]


def _spline(found: Mapping[str, Values], counts: Int64Array, node: Object) -> Any | None:
    """Return the map (P, P) from control points to points on the curves.

    None for polylines, for Catmull-Rom curves, which run through their control points, and for
    closed ones and rare bases, whose control points are taken.
    """
    header = found.get("curveBasisAndType")
    numbers = None if header is None else header.integers()
    if numbers is None or numbers.size < 3:
        return None
    kind, wrap, basis = (int(number) for number in numbers.ravel()[:3])
    knots = found[".knots"].floats() if ".knots" in found else None
    if wrap == _NON_PERIODIC and kind != _LINEAR and knots is not None and len(knots):
        orders = found[".orders"].integers() if ".orders" in found else None
        order = np.full(len(counts), _CUBIC_ORDER) if orders is None else orders.ravel()
        weights = found["w"].floats() if "w" in found else None
        if len(order) != len(counts) or (weights is not None and len(weights) != counts.sum()):
            raise node.error("has orders or weights of other curves")
        rational = None if weights is None else weights.ravel().astype(np.float64)
        places = knots.ravel().astype(np.float64)
        return nurbs_map(counts, order, places, rational, node.name)
    if wrap == _NON_PERIODIC and (kind == _LINEAR or _BASES.get(basis) == "catmullRom"):
        return None
    if wrap == _NON_PERIODIC and kind == _CUBIC and basis in _BASES:
        return cubic_map(counts, _BASES[basis])
    _log.warning(
        "%s: closed or Hermite curves; their control points are taken as open polylines", node.path
    )
    return None


def _move(points: Float32Array, world: Float64Array) -> Float32Array:
    if np.array_equal(world, _IDENTITY):
        return points
    with np.errstate(over="ignore", invalid="ignore"):
        moved: Float32Array = (points @ world[:3, :3] + world[3, :3]).astype(np.float32)
    return moved


def _scale(widths: Float32Array, world: Float64Array) -> Float32Array:
    """Return widths times the mean scale of the transform."""
    if np.array_equal(world, _IDENTITY):
        return widths
    with np.errstate(over="ignore", invalid="ignore"):
        scale = np.cbrt(np.abs(np.linalg.det(world[:3, :3])))
        scaled: Float32Array = (widths * scale).astype(np.float32)
    return scaled


def _values(
    node: Object, names: tuple[str, ...], columns: int, kind: str
) -> tuple[npt.NDArray[Any], str] | None:
    """Return (N, columns) of the first of the names that there are, and the scope that is said."""
    for name in names:
        found = node.values.get(name)
        values: npt.NDArray[Any] | None = None
        if found is not None:
            values = found.integers() if kind == "i" else found.floats()
        if found is not None and values is not None and values.shape[1] == columns:
            return values, _SCOPES.get(found.scope, "")
        if found is not None and found.samples:
            _log.warning("%s of %s is of another type; left out", name, node.name)
    return None


def _fit(values: npt.NDArray[Any] | None, node: Object, names: tuple[str, ...]) -> Any:
    """Return values; raises `FormatError` where their number fits neither curves nor points."""
    if values is None:
        raise node.error(f"has values of {names[0]} for other curves or points")
    return values
