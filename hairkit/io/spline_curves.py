"""Points on spline curves instead of the control points that files hold.

Every curve keeps its number of points: n control points become n points on the curve, evenly
spaced in its parameter from end to end. The map is linear and its rows add to 1, so that widths
and colours of control points are mapped alike. Bases are those of RenderMan (Pixar, *RI Spec 3.2*,
5.5: Curves) and of USD (`UsdGeomBasisCurves`); NURBS are evaluated by Cox and de Boor.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_matrix, vstack

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError

_BASES = {
    "bezier": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]], float),
    "bspline": np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]], float) / 6,
    "catmullRom": np.array([[-1, 3, -3, 1], [2, -5, 4, -1], [-1, 0, 1, 0], [0, 2, 0, 0]], float)
    / 2,
}
"""Rows are powers of t from t^3 to 1, columns control points."""
_STEPS = {"bezier": 3, "bspline": 1, "catmullRom": 1}
"""Control points from one cubic to the next."""
BASES = tuple(_BASES)
_FEWEST = 4
"""Control points of a cubic."""


def cubic_map(counts: Int64Array, basis: str, *, pinned: bool = False) -> Any:
    """Return the sparse (P, P) map from control points to points on uniform cubic curves.

    Parameters
    ----------
    counts
        (S,) control points of each curve; curves of fewer than four, or that are no whole number of
        Bezier cubics, stay as they are.
    basis
        One of `BASES`.
    pinned
        The curve reaches its first and last control point, as by USD's wrap `pinned`.
    """
    step, pinned = _STEPS[basis], pinned and basis != "bezier"
    segments = (counts - 1) // step if pinned or step > 1 else counts - 3
    kept = (counts < (2 if pinned else _FEWEST)) | ((counts - 1) % step > 0) | (segments < 1)
    segments = np.where(kept, 1, segments)
    owner = np.repeat(np.arange(len(counts)), counts)
    start = (np.cumsum(counts) - counts)[owner]
    rank = np.arange(len(owner)) - start
    along = rank / np.maximum(counts[owner] - 1, 1) * segments[owner]
    segment = np.minimum(along.astype(np.int64), segments[owner] - 1)
    powers = (along - segment)[:, None] ** np.arange(3, -1, -1)
    weight = powers @ _BASES[basis]
    control = segment[:, None] * step + np.arange(4) - int(pinned)
    control, weight = _without_phantoms(control, weight, counts[owner][:, None] - 1)
    control[kept[owner]] = rank[kept[owner], None]
    weight[kept[owner]] = np.eye(control.shape[1])[0]
    index = (np.repeat(np.arange(len(owner)), control.shape[1]), (control + start[:, None]).ravel())
    return csr_matrix((weight.ravel(), index), (len(owner), len(owner)))


def _without_phantoms(
    control: Int64Array, weight: Float64Array, last: Int64Array
) -> tuple[Int64Array, Float64Array]:
    """Return controls and weights (N, 8) in which points beyond an end are mirrored through it.

    A phantom before the first point is 2 P0 - P1, one behind the last likewise.
    """
    low, high = control < 0, control > last
    end = np.clip(control, 0, last)
    mirrored = np.clip(
        np.where(low, -control, np.where(high, 2 * last - control, control)), 0, last
    )
    beyond = low | high
    at = np.concatenate([end, mirrored], axis=1)
    shares = np.concatenate([np.where(beyond, 2, 1) * weight, np.where(beyond, -weight, 0)], axis=1)
    return at, shares


def nurbs_map(
    counts: Int64Array,
    orders: Int64Array,
    knots: Float64Array,
    weights: Float64Array | None,
    source: object,
) -> Any:
    """Return the sparse (P, P) map from control points to points on NURBS curves.

    Parameters
    ----------
    counts
        (S,) control points of each curve.
    orders
        (S,) degree + 1 of each.
    knots
        All curves' knots, counts + orders of each.
    weights
        (P,) of the control points; None: all alike.
    source
        For errors.

    Raises
    ------
    FormatError
        Knots, orders or weights do not fit the curves.
    """
    sizes = counts + orders
    if (orders < 1).any() or (counts < orders).any() or sizes.sum() != len(knots):
        raise FormatError(f"{source}: knots and orders do not fit its NURBS curves")
    if not np.isfinite(knots).all() or (weights is not None and not (weights > 0).all()):
        raise FormatError(f"{source}: knots or weights of its NURBS curves are no numbers above 0")
    made: dict[bytes, Any] = {}
    blocks = []
    for count, order, last in zip(counts, orders, np.cumsum(sizes), strict=True):
        own = knots[last - count - order : last]
        key = own.tobytes() + bytes([order % 256])
        if key not in made:
            made[key] = _one_nurbs(own, int(order), int(count), source)
        blocks.append(made[key])
    placed = [
        csr_matrix((b.data, b.indices + first, b.indptr), (b.shape[0], int(counts.sum())))
        for b, first in zip(blocks, np.cumsum(counts) - counts, strict=True)
    ]
    whole = vstack(placed, format="csr")
    if weights is None:
        return whole
    rational = whole.multiply(weights[None, :]).tocsr()
    return rational.multiply(1 / np.asarray(rational.sum(axis=1))).tocsr()


def _one_nurbs(knots: Float64Array, order: int, count: int, source: object) -> Any:
    low, high = knots[order - 1], knots[count]
    if (np.diff(knots) < 0).any() or not high > low:
        raise FormatError(f"{source}: the knots of a NURBS curve do not ascend")
    return BSpline.design_matrix(np.linspace(low, high, count), knots, order - 1).tocsr()
