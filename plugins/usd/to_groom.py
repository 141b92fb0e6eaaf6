"""A groom from what a USD file holds."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Int64Array
from hairkit.errors import FormatError, InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt
from hairkit.grooming.curve_sets import VERTEX, CurveSet, Spread, join_sets, on_curve, strands_of
from hairkit.io.coordinate_space import FileSpace
from hairkit.io.glb_file import readable
from hairkit.io.plain_settings import made, ties_of
from hairkit.io.spline_curves import BASES, cubic_map, nurbs_map
from hairkit.types.groom import Groom, HairMaterial, HairPhysics

from .body_reading import read_head
from .guarded import Contents, contents
from .options import Options
from .settings import plain_settings_of

_log = logging.getLogger("hairkit")

_SCOPES = {"varying": VERTEX}
"""Interpolations of USD with another name here."""
_THROUGH = ("catmullRom", True)
"""Basis and pinning of curves that run through all their control points: these are the strand."""


def read_groom(path: Path, options: Any) -> Groom:
    """Return all curves of the file as one groom; options are `ImportOptions` with `scale`."""
    found = contents(path)
    space = _space(found, options, path)
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused
        every = [_curves(found, curves, space, path) for curves in found.description["curves"]]
        with readable(path, "USD groom"):
            settings = plain_settings_of(found.description["settings"])
            head = read_head(found, settings, space, path)
    every = [curves for curves in every if len(curves.counts)]
    if not every:
        raise FormatError(f"{path}: holds no BasisCurves or NurbsCurves with points")
    strands, kept = strands_of(join_sets(every), path)
    with readable(path, "USD groom"):
        look, physics = settings.get("material"), made(HairPhysics, settings.get("physics", {}))
        material = made(HairMaterial, look) if look else None
        ties = ties_of(settings)
    groom = replace(adopt(strands, options, path, material, head), physics=physics, ties=ties)
    return _bound(groom, kept, options) if head is not None else groom


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


def _curves(found: Contents, description: dict[str, Any], space: FileSpace, path: Path) -> CurveSet:
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
    values = _Values(found, description, counts, where)
    growth = float(np.cbrt(abs(np.linalg.det(matrix[:3, :3])))) * space.metres
    widths = on_curve(spline, values.of_points("widths"))
    return CurveSet(
        on_curve(spline, placed),
        counts,
        None if widths is None else np.maximum(widths * np.float32(growth), 0),
        values.of_strands("groom_root_uv", "st", columns=2),
        on_curve(spline, values.of_points("groom_color", "displayColor", columns=3)),
        values.of_strands("groom_group_id"),
        values.of_strands("groom_guide"),
        values.of_strands("hairkit:root_triangle"),
        values.of_strands("hairkit:root_barycentric", columns=3),
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


class _Values:
    """Widths and primvars of one prim, brought to one value a point or a strand."""

    def __init__(
        self, found: Contents, description: dict[str, Any], counts: Int64Array, where: str
    ) -> None:
        self.found, self.description, self.where = found, description, where
        self.spread = Spread(counts)

    def of_points(self, *names: str, columns: int = 1) -> Any:
        """Return (P,) or (P, columns) float32 of the first name there is; None without any."""
        return self._first(names, columns, self.spread.to_points)

    def of_strands(self, *names: str, columns: int = 1) -> Any:
        """Return (S,) or (S, columns), the root's value where there is one a point; or None."""
        return self._first(names, columns, self.spread.to_strands)

    def _first(
        self, names: tuple[str, ...], columns: int, spread: Callable[[Any, str], Any]
    ) -> Any:
        for name in names:
            array = self.found.arrays.get(self.description["name"] + name)
            if array is None or array.ndim < 1:
                continue
            shape = (len(array),) if columns == 1 else (len(array), columns)
            said = self.description["interpolation"].get(name, "")
            fits = array.shape == shape and np.isfinite(array).all()
            values = spread(array, _SCOPES.get(said, said)) if fits else None
            if values is not None:
                return values.astype(np.float32) if values.dtype.kind == "f" else values
            _log.warning("%s: %s does not match its curves and is ignored", self.where, name)
        return None


def _bound(groom: Groom, kept: CurveSet, options: ImportOptions) -> Groom:
    """Return the groom bound as the file says, where hairkit wrote it and its head is used."""
    triangle, barycentric = kept.triangle, kept.barycentric
    if triangle is None or barycentric is None or options.head is not None or options.reverse:
        return groom
    if len(kept.counts) != len(groom.strands):
        return groom
    try:
        return replace(groom, root_triangle=triangle.astype(np.int32), root_barycentric=barycentric)
    except InputError:
        _log.warning("the file's root binding does not match its head; the nearest faces are taken")
        return groom
