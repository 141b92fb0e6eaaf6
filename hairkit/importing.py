"""A groom from bare strands, as files without head or roots hold them.

What lacks is made by stated defaults, and said in warnings. Importers inherit `ImportOptions` and
return what `adopt` makes of the strands they read.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from hairkit.default_head import default_head
from hairkit.errors import FormatError, InputError
from hairkit.groom import Groom, HairMaterial
from hairkit.groom_file import read_groom
from hairkit.head import Capsules, Head
from hairkit.head_files import read_head
from hairkit.options import option
from hairkit.scalp import bind, roots_at
from hairkit.stored import Float32Array, Float64Array, Int64Array
from hairkit.strands import Strands

SMALLEST, LARGEST = 0.03, 0.6
"""Roots of a head of hair spread over between these many metres."""
_ROUNDS = 30
_INNERMOST = 0.9

_log = logging.getLogger("hairkit")


@dataclass(frozen=True)
class ImportOptions:
    """Option of every importer of files without a head."""

    head: Path | None = option(
        None,
        doc="Head under the strands: .obj, .ply, .glb or a groom's .npz; else the default head,"
        " moved and scaled to the roots.",
    )


def packed(points: Float32Array, counts: Int64Array, source: object) -> tuple[Strands, Int64Array]:
    """Return strands (points (P, 3), metres) and the numbers (S',) of those that were kept.

    Strands of fewer than two points are dropped and counted in a warning.

    Raises
    ------
    FormatError
        No strand is left.
    """
    keep = counts >= 2
    if not keep.any():
        raise FormatError(f"{source}: holds no strand of two or more points")
    if not keep.all():
        _log.warning("%s: %d strands of fewer than two points dropped", source, (~keep).sum())
        points = points[np.repeat(keep, counts)]
    offsets = np.concatenate([[0], np.cumsum(counts[keep])])
    return Strands(points, offsets), np.flatnonzero(keep)


def adopt(
    strands: Strands,
    options: ImportOptions,
    source: object,
    material: HairMaterial | None = None,
    head: Head | None = None,
) -> Groom:
    """Return strands in the head frame as a groom, bound to a head.

    Parameters
    ----------
    strands
        Metres; with the widths and root uv that the file had, else None.
    options
        Names the head, if any.
    source
        The file, for messages.
    material
        Look; where None, the default one with the mean of the strands' widths.
    head
        The head that came with the file, which the option overrules.

    Raises
    ------
    InputError
        The roots spread over what cannot be a head, so the unit must be given.
    """
    spread = float(np.ptp(strands.roots, axis=0).max())
    if not SMALLEST <= spread <= LARGEST and len(strands) > 1:
        raise InputError(
            f"{source}: the roots spread over {spread:.4g} m, a head of hair's over about 0.2 m;"
            f" give metres per unit: scale={_guess(spread, strands):.2g}"
        )
    if options.head is not None:
        head = _read(options.head)
    elif head is None:
        head = _fitted(strands.roots.astype(np.float64), source)
    if material is None:
        material = HairMaterial()
        if strands.widths is not None and (strands.widths > 0).any():
            width = float(strands.widths[strands.widths > 0].mean())
            material = replace(material, width=width)
    if strands.widths is None:
        _log.warning("%s: no widths; strands are %g mm wide", source, 1000 * material.width)
    triangle, barycentric = bind(strands.roots, head)
    if strands.root_uv is None:
        _log.warning("%s: no root uv; that of the head is taken", source)
        uv = roots_at(head, triangle, barycentric).uv
        strands = replace(strands, root_uv=uv)
    return Groom(strands, head, triangle, barycentric, material)


def _guess(spread: float, strands: Strands) -> float:
    """Return metres per unit of the file, were its metres units and the hair on a head."""
    return 0.2 / max(spread, float(strands.lengths().max()) / 4, 1e-12)


def _read(path: Path) -> Head:
    return read_groom(path).head if path.suffix == ".npz" else read_head(path)


def _fitted(roots: Float64Array, source: object) -> Head:
    """Return the default head, scaled and moved so that its scalp lies at the roots.

    Iterated closest points with a similarity without turning (Zinsser et al. 2005), the farthest
    tenth of the roots left out in each round.
    """
    head = default_head()
    scalp = head.vertices[head.scalp > 0.5].astype(np.float64)
    scale = float(np.clip(np.ptp(roots, axis=0).max() / np.ptp(scalp, axis=0).max(), 0.5, 2.0))
    shift = roots.mean(axis=0) - scale * scalp.mean(axis=0)
    for _ in range(_ROUNDS):
        tree = cKDTree(scale * scalp + shift)
        distance, near = tree.query(roots)
        inner = distance <= np.quantile(distance, _INNERMOST)
        wanted, have = roots[inner], scalp[near[inner]]
        offset = have - have.mean(axis=0)
        spread = float((offset**2).sum())
        if spread > 1e-9:
            fit = float((offset * (wanted - wanted.mean(axis=0))).sum()) / spread
            scale = float(np.clip(fit, 0.7, 1.4))
        shift = wanted.mean(axis=0) - scale * have.mean(axis=0)
    distance = cKDTree(scale * scalp + shift).query(roots)[0]
    _log.warning(
        "%s: no head; the default head, scaled by %.2f, is put under the roots, %.1f mm off",
        source,
        scale,
        1000 * distance.mean(),
    )
    return placed(head, scale, shift)


def placed(head: Head, scale: float, shift: Float64Array) -> Head:
    """Return the head scaled about the origin, then moved by `shift` (3,), metres."""
    shapes, shift32 = head.capsules, shift.astype(np.float32)
    return replace(
        head,
        vertices=scale * head.vertices + shift32,
        joints=scale * head.joints + shift32,
        capsules=Capsules(
            scale * shapes.first + shift32, scale * shapes.second + shift32, scale * shapes.radius
        ),
    )
