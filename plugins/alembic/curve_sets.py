"""The curves objects of an Alembic file: points in the world, widths and groom attributes."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.io.spline_curves import cubic_map, nurbs_map

from .contents import Object, Values, read_objects

_CUBIC, _LINEAR, _NON_PERIODIC = 0, 1, 0
_CUBIC_ORDER = 4
_BASES = {1: "bezier", 2: "bspline", 3: "catmullRom"}
"""Alembic's numbers of bases (`AbcGeom::BasisType`)."""
_IDENTITY = np.eye(4)

_log = logging.getLogger("hairkit")


@dataclass(frozen=True, eq=False)
class CurveSet:
    """One curves object at its first frame; None where the file says nothing."""

    points: Float32Array
    """(P, 3) in the world, in the file's axes and unit."""
    counts: Int64Array
    """(S,) points of each curve."""
    widths: Float32Array | None
    """(P,) diameters in the file's unit."""
    root_uv: Float32Array | None
    """(S, 2)."""
    colour: Float32Array | None
    """(P, 3)."""
    group: Int64Array | None
    """(S,)."""
    guide: Int64Array | None
    """(S,)."""
    frames: int
    """Samples of the points in time."""
    plain: bool
    """False where the points stay control points: of closed curves, or of rare bases."""


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
    values = _Spread(node, counts)
    spline, plain = _spline(found, counts, node)
    widths = values.per_point(found.get("groom_width"), 1)
    if widths is None:
        widths = values.per_point(found.get("width"), 1)
    uv = values.per_strand(found.get("groom_root_uv"), 2, "f")
    if uv is None:
        uv = values.per_strand(found.get("uv"), 2, "f")
    group = values.per_strand(found.get("groom_group_id"), 1, "i")
    guide = values.per_strand(found.get("groom_guide"), 1, "i")
    return CurveSet(
        points=_move(_on_curve(spline, points), world),
        counts=counts,
        widths=None if widths is None else _scale(_on_curve(spline, widths)[:, 0], world),
        root_uv=uv,
        colour=_on_curve(spline, values.per_point(found.get("groom_color"), 3)),
        group=None if group is None else group[:, 0],
        guide=None if guide is None else guide[:, 0],
        frames=found["P"].samples,
        plain=plain,
    )


def _counts(found: Mapping[str, Values], points: Float32Array, node: Object) -> Int64Array:
    counts = found["nVertices"].integers() if "nVertices" in found else None
    if points.shape[1] != 3 or counts is None or counts.min() < 0:
        raise node.error("has no points or counts of points")
    # each count is at most the number of points, so that their sum cannot overflow
    if counts.max() > len(points) or counts.sum() != len(points):
        raise node.error(f"has {len(points)} points, its curves ask for another number")
    return counts[:, 0]


def _spline(
    found: Mapping[str, Values], counts: Int64Array, node: Object
) -> tuple[Any | None, bool]:
    """Return the map (P, P) from control points to points on the curves, and whether all is told.

    None for polylines, and for Catmull-Rom curves, which run through their control points.
    """
    header = found.get("curveBasisAndType")
    numbers = None if header is None else header.integers()
    if numbers is None or numbers.size < 3:
        return None, True
    kind, wrap, basis = (int(number) for number in numbers.ravel()[:3])
    if wrap != _NON_PERIODIC:
        return None, False
    knots = found[".knots"].floats() if ".knots" in found else None
    if kind != _LINEAR and knots is not None and len(knots):
        orders = found[".orders"].integers() if ".orders" in found else None
        order = np.full(len(counts), _CUBIC_ORDER) if orders is None else orders.ravel()
        weights = found["w"].floats() if "w" in found else None
        if len(order) != len(counts) or (weights is not None and len(weights) != counts.sum()):
            raise node.error("has orders or weights of other curves")
        rational = None if weights is None else weights.ravel().astype(np.float64)
        places = knots.ravel().astype(np.float64)
        return nurbs_map(counts, order, places, rational, node.name), True
    if kind == _LINEAR or _BASES.get(basis) == "catmullRom":
        return None, True
    if kind != _CUBIC or basis not in _BASES:
        return None, False
    return cubic_map(counts, _BASES[basis]), True


def _on_curve(spline: Any | None, values: Float32Array | None) -> Any:
    """Return values (P, C) of control points at the points on the curves."""
    return values if spline is None or values is None else (spline @ values).astype(np.float32)


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


class _Spread:
    """Values of geometry parameters, spread to points or strands by their scope."""

    def __init__(self, node: Object, counts: Int64Array) -> None:
        self.node, self.counts = node, counts

    def per_point(self, header: Values | None, extent: int) -> Any:
        """Return (P, extent) float32 or None."""
        values = self._values(header, extent, "f")
        if values is None:
            return None
        scope = self._scope(header, len(values))
        if scope == "con":
            return np.repeat(values[:1], self.counts.sum(), axis=0)
        return np.repeat(values, self.counts, axis=0) if scope == "uni" else values

    def per_strand(self, header: Values | None, extent: int, kind: str) -> Any:
        """Return (S, extent) float32 or int64, of values at points the root's, or None."""
        values = self._values(header, extent, kind)
        if values is None:
            return None
        scope = self._scope(header, len(values))
        if scope == "con":
            return np.repeat(values[:1], len(self.counts), axis=0)
        if scope == "uni":
            return values
        roots = np.minimum(np.cumsum(self.counts) - self.counts, len(values) - 1)
        return values[roots]

    def _values(self, header: Values | None, extent: int, kind: str) -> npt.NDArray[Any] | None:
        """Return (N, extent) the values."""
        if header is None:
            return None
        values: npt.NDArray[Any] | None = header.integers() if kind == "i" else header.floats()
        if values is None or values.shape[1] != extent:
            if header.samples:
                _log.warning("%s of %s is of another type; left out", header.name, self.node.name)
            return None
        return values

    def _scope(self, header: Values | None, have: int) -> str:
        """Return the scope by the number of values, which the metadata only breaks ties of."""
        sizes = {"con": 1, "uni": len(self.counts), "vtx": int(self.counts.sum())}
        fitting = [scope for scope, size in sizes.items() if size == have]
        said = "" if header is None else header.scope
        if not fitting:
            raise self.node.error(
                f"has {have} values of {header.name if header else ''} for"
                f" {sizes['uni']} curves of {sizes['vtx']} points"
            )
        return said if said in fitting else fitting[-1]
