"""Curves of files: values spread to points and strands, sets joined, and strands made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int64Array
from hairkit.errors import FormatError
from hairkit.grooming.adopt_strands import pack_strands
from hairkit.types.strands import Strands

CONSTANT, UNIFORM, VERTEX = "constant", "uniform", "vertex"
"""Scopes of values: one for all, one a strand, one a point."""


@dataclass(frozen=True, eq=False)
class CurveSet:
    """The curves of one object at one frame; None where the file says nothing."""

    points: Float32Array
    """(P, 3)."""
    counts: Int64Array
    """(S,) points of each curve."""
    widths: Float32Array | None = None
    """(P,) diameters."""
    root_uv: Float32Array | None = None
    """(S, 2)."""
    colour: Float32Array | None = None
    """(P, 3)."""
    group: Int64Array | None = None
    """(S,)."""
    guide: Int64Array | None = None
    """(S,)."""
    triangle: Int64Array | None = None
    """(S,) the head's face under each root."""
    barycentric: Float32Array | None = None
    """(S, 3) weights of its corners there."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Brings values of any scope to one a point or one a strand."""

    counts: Int64Array
    """(S,) points of each strand."""

    def to_points(self, values: npt.NDArray[Any], said: str) -> Any:
        """Return (P, ...) values (N, ...); None where N fits no scope."""
        scope = self._scope(len(values), said)
        if scope == CONSTANT:
            return np.repeat(values, self.counts.sum(), axis=0)
        return np.repeat(values, self.counts, axis=0) if scope == UNIFORM else scope and values

    def to_strands(self, values: npt.NDArray[Any], said: str) -> Any:
        """Return (S, ...) values (N, ...), the root's of those at points; None as `to_points`."""
        scope = self._scope(len(values), said)
        if scope == CONSTANT:
            return np.repeat(values, len(self.counts), axis=0)
        if scope == VERTEX:
            roots = np.cumsum(self.counts) - self.counts
            return values[np.minimum(roots, len(values) - 1)]
        return scope and values

    def _scope(self, have: int, said: str) -> str | None:
        """Return the scope by the number of values, of which what is said only breaks ties."""
        sizes = {CONSTANT: 1, UNIFORM: len(self.counts), VERTEX: int(self.counts.sum())}
        fitting = [scope for scope, size in sizes.items() if size == have]
        return said if said in fitting else fitting[-1] if fitting else None


def on_curve(spline: Any | None, values: Float32Array | None) -> Any:
    """Return values (P, ...) of control points at the points on the curves; None is no spline."""
    return values if spline is None or values is None else (spline @ values).astype(np.float32)


def join_sets(sets: Sequence[CurveSet]) -> CurveSet:
    """Return the curves of all sets; values that only some have are left out.

    Groups and guides that only some have are 0 in the others. Sets without groups are groups.
    """
    sizes = [len(each.counts) for each in sets]

    def column(name: str) -> Any:
        parts = [getattr(each, name) for each in sets]
        if name in ("group", "guide") and any(part is not None for part in parts):
            zeros = [np.zeros(size, np.int64) for size in sizes]
            parts = [
                zero if part is None else part for part, zero in zip(parts, zeros, strict=True)
            ]
        return None if any(part is None for part in parts) else np.concatenate(parts)

    joined = CurveSet(**{field.name: column(field.name) for field in fields(CurveSet)})
    if joined.group is None and len(sets) > 1:
        return replace(joined, group=np.repeat(np.arange(len(sets)), sizes))
    return joined


def strands_of(joined: CurveSet, source: object) -> tuple[Strands, CurveSet]:
    """Return the strands of curves in metres, and the curves that `pack_strands` kept.

    Raises `FormatError` as it does, and for groups that 32 bits do not hold.
    """
    strands, kept = pack_strands(joined.points, joined.counts, source)
    rows: Any = slice(None)
    if len(kept) < len(joined.counts):
        rows = np.repeat(joined.counts >= 2, joined.counts)
    if joined.group is not None and np.abs(joined.group).max() > np.iinfo(np.int32).max:
        raise FormatError(f"{source}: a group of number {np.abs(joined.group).max()}")
    parts: dict[str, Any] = {}
    for field in fields(CurveSet):
        value, of_points = getattr(joined, field.name), field.name in ("points", "widths", "colour")
        parts[field.name] = None if value is None else value[rows if of_points else kept]
    left = CurveSet(**parts)
    strands = replace(
        strands,
        widths=left.widths,
        root_uv=left.root_uv,
        group=None if left.group is None else left.group.astype(np.int32),
        guide=None if left.guide is None else left.guide != 0,
        colours=left.colour,
    )
    return strands, left
