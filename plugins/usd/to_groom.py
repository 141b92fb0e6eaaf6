"""A groom from what a USD file holds."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Int32Array, Int64Array
from hairkit.errors import FormatError, InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt, mean_look, pack_strands, rows_kept
from hairkit.io.coordinate_space import FileSpace
from hairkit.io.spline_curves import BASES, cubic_map, nurbs_map
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

from .body_reading import read_head
from .guarded import Contents, contents
from .options import Options
from .settings import material_from, physics_from, ties_from

_log = logging.getLogger("hairkit")

_THROUGH = ("catmullRom", True)
"""Basis and pinning of curves that run through all their control points: these are the strand."""


@dataclass(frozen=True, eq=False)
class _Curves:
    """The curves of one prim, in the head frame; None for what the file does not say."""

    points: Float32Array
    counts: Int64Array
    widths: Float32Array | None
    root_uv: Float32Array | None
    group: Int32Array | None
    guide: Int32Array | None
    colour: Float32Array | None
    triangle: Int32Array | None
    barycentric: Float32Array | None


def read_groom(path: Path, options: Any) -> Groom:
    """Return all curves of the file as one groom; options are `ImportOptions` with `scale`."""
    found = contents(path)
    space = _space(found, options, path)
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
        every = [_curves(found, curves, space, path) for curves in found.description["curves"]]
        head = read_head(found, space, path)
    every = [curves for curves in every if len(curves.counts)]
    if not every:
        raise FormatError(f"{path}: holds no BasisCurves or NurbsCurves with points")
    joined = _join(every)
    strands, kept = pack_strands(joined.points, joined.counts, path)
    strands = _complete(strands, joined, kept)
    settings = found.description["settings"]
    rows, colours = rows_kept(joined.counts, kept), joined.colour
    look = mean_look(strands, None if colours is None else colours[rows])
    material = material_from(settings, path) or look
    groom = adopt(strands, options, path, material, head)
    groom = replace(
        groom,
        physics=physics_from(settings, path) or groom.physics,
        ties=ties_from(settings, path),
    )
    return _bound(groom, joined, kept, options) if head is not None else groom


def _space(found: Contents, options: Options, path: Path) -> FileSpace:
    axes = {"Y": "y_up", "Z": "z_up"}.get(found.description["up"])
    if axes is None:
        raise FormatError(f"{path}: upAxis is {found.description['up']!r}, expected Y or Z")
    if options.scale > 0:
        return FileSpace(axes, options.scale)
    metres = float(found.description["metres"])
    if not (np.isfinite(metres) and metres > 0):
        raise FormatError(f"{path}: metersPerUnit is {metres}, expected a number above 0")
    if not found.description["metres_known"]:
        _log.warning("%s: no metersPerUnit; USD's default of %g is taken", path, metres)
    return FileSpace(axes, metres)


def _curves(found: Contents, description: dict[str, Any], space: FileSpace, path: Path) -> _Curves:
    where, name = f"{path}: {description['path']}", description["name"]
    counts = found.arrays.get(name + "curveVertexCounts", np.zeros(0)).astype(np.int64)
    points = found.arrays.get(name + "points", np.zeros((0, 3), np.float32))
    if (counts < 0).any() or counts.sum() != len(points):
        raise FormatError(f"{where} has {len(points)} points, its curves {counts.sum()}")
    _say_what_changes(description, where)
    matrix = np.array(description["to_stage"], np.float64)
    if not (np.isfinite(points).all() and np.isfinite(matrix).all()):
        raise FormatError(f"{where} has points or transforms that are not finite numbers")
    if not np.array_equal(matrix, np.eye(4)):
        points = points @ matrix[:3, :3] + matrix[3, :3]
    placed = space.points_to_head(points)
    if not np.isfinite(placed).all():
        raise FormatError(f"{where} has points too far away")
    spline = _spline(found, description, counts, where)
    placed = _on_curve(spline, placed)
    values = _Values(found, description, counts, where)
    growth = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3])))) * space.metres
    widths = _on_curve(spline, values.of_points("widths"))
    colour = _on_curve(spline, values.of_points("groom_color", 3))
    triangle = values.of_strands("hairkit:root_triangle")
    group = values.of_strands("groom_group_id")
    guide = values.of_strands("groom_guide")
    uv = values.of_strands("groom_root_uv", 2)
    return _Curves(
        placed,
        counts,
        None if widths is None else np.maximum(widths * np.float32(growth), 0),
        values.of_strands("st", 2) if uv is None else uv,
        None if group is None else group.astype(np.int32),
        None if guide is None else guide.astype(np.int32),
        _on_curve(spline, values.of_points("displayColor", 3)) if colour is None else colour,
        None if triangle is None else triangle.astype(np.int32),
        values.of_strands("hairkit:root_barycentric", 3),
    )


def _say_what_changes(description: dict[str, Any], where: str) -> None:
    if description["wrap"] == "periodic":
        _log.warning("%s: closed curves are read as open ones of their control points", where)
    if description["frames"] > 1:
        _log.warning("%s: animated, %d frames; only one is read", where, description["frames"])


def _spline(
    found: Contents, description: dict[str, Any], counts: Int64Array, where: str
) -> Any | None:
    """Return the map (P, P) from control points to points on the curves; None for polylines."""
    name, shape = description["name"], description["shape"]
    if shape == "nurbs":
        orders = found.arrays.get(name + "order", np.zeros(0)).astype(np.int64)
        knots = found.arrays.get(name + "knots", np.zeros(0)).astype(np.float64)
        weights = found.arrays.get(name + "pointWeights")
        if len(orders) != len(counts) or (weights is not None and len(weights) != counts.sum()):
            raise FormatError(f"{where} has orders or weights that do not fit its curves")
        return nurbs_map(counts, orders, knots, weights, where)
    pinned = description["wrap"] == "pinned"
    if shape not in BASES or description["wrap"] == "periodic" or (shape, pinned) == _THROUGH:
        return None
    return cubic_map(counts, shape, pinned=pinned)


def _on_curve(spline: Any | None, values: Float32Array | None) -> Any:
    """Return values of control points (P,) or (P, C) at the points on the curves."""
    return values if spline is None or values is None else (spline @ values).astype(np.float32)


class _Values:
    """Widths and primvars of one prim, brought to one value a point or a strand."""

    def __init__(
        self, found: Contents, description: dict[str, Any], counts: Int64Array, where: str
    ) -> None:
        self.found, self.description, self.counts, self.where = found, description, counts, where

    def of_points(self, name: str, columns: int = 1) -> Any:
        """Return (P,) or (P, columns) float32, or None where there is no such value."""
        array, interpolation = self._array(name, columns)
        points, strands = int(self.counts.sum()), len(self.counts)
        if array is None:
            return None
        if interpolation in ("vertex", "varying") and len(array) == points:
            return array
        if interpolation == "uniform" and len(array) == strands:
            return np.repeat(array, self.counts, axis=0)
        if len(array) == 1:
            return np.repeat(array, points, axis=0)
        self._ignore(name)
        return None

    def of_strands(self, name: str, columns: int = 1) -> Any:
        """Return (S,) or (S, columns), the root's value where there is one a point; or None."""
        array, interpolation = self._array(name, columns)
        points, strands = int(self.counts.sum()), len(self.counts)
        if array is None:
            return None
        if interpolation == "uniform" and len(array) == strands:
            return array
        if interpolation in ("vertex", "varying") and len(array) == points > 0:
            first = np.cumsum(self.counts) - self.counts
            return array[np.minimum(first, points - 1)]
        if len(array) == 1:
            return np.repeat(array, strands, axis=0)
        self._ignore(name)
        return None

    def _array(self, name: str, columns: int) -> tuple[Any, str]:
        array = self.found.arrays.get(self.description["name"] + name)
        interpolation = self.description["interpolation"].get(name, "")
        if array is None or array.ndim < 1:
            return None, interpolation
        shape = (len(array),) if columns == 1 else (len(array), columns)
        if array.shape != shape or not np.isfinite(array).all():
            self._ignore(name)
            return None, interpolation
        if array.dtype.kind == "f":
            array = array.astype(np.float32)
        return array, interpolation

    def _ignore(self, name: str) -> None:
        _log.warning("%s: %s does not match its curves and is ignored", self.where, name)


def _join(every: list[_Curves]) -> _Curves:
    """Return one set of curves; values that only some have are left out, groups number the sets."""

    def column(name: str) -> Any:
        parts = [getattr(curves, name) for curves in every]
        return None if any(part is None for part in parts) else np.concatenate(parts)

    group = column("group")
    if group is None and len(every) > 1:
        sizes = [len(curves.counts) for curves in every]
        group = np.repeat(np.arange(len(every), dtype=np.int32), sizes)
    return replace(
        every[0],
        group=group,
        **{
            name: column(name)
            for name in (
                "points",
                "counts",
                "widths",
                "root_uv",
                "guide",
                "colour",
                "triangle",
                "barycentric",
            )
        },
    )


def _complete(strands: Strands, joined: _Curves, kept: Int64Array) -> Strands:
    rows = rows_kept(joined.counts, kept)
    return replace(
        strands,
        widths=None if joined.widths is None else joined.widths[rows],
        root_uv=None if joined.root_uv is None else joined.root_uv[kept],
        group=None if joined.group is None else joined.group[kept],
        guide=None if joined.guide is None else joined.guide[kept] != 0,
    )


def _bound(groom: Groom, joined: _Curves, kept: Int64Array, options: ImportOptions) -> Groom:
    """Return the groom bound as the file says, where hairkit wrote it and its head is used."""
    triangle, barycentric = joined.triangle, joined.barycentric
    if triangle is None or barycentric is None or options.head is not None or options.reverse:
        return groom
    if len(kept) != len(groom.strands):
        return groom
    try:
        return replace(groom, root_triangle=triangle[kept], root_barycentric=barycentric[kept])
    except InputError:
        _log.warning("the file's root binding does not match its head; the nearest faces are taken")
        return groom
