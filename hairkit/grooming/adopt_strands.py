"""Make a groom of bare strands, from files without a head or roots.

Missing parts get stated defaults, each with a warning. Importers inherit `ImportOptions` and
return what `adopt` makes of the strands they read.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Int64Array
from hairkit.errors import FormatError, InputError
from hairkit.grooming.prepare_export import shorter_than
from hairkit.head_model.placement import find_place, place_head
from hairkit.head_model.scalp import bind, roots_at
from hairkit.head_model.template import default_head
from hairkit.io.coordinate_space import SpaceOptions
from hairkit.io.head_reader import read_head
from hairkit.options import option
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.head import Head
from hairkit.types.strand_blocks import bounds, colours
from hairkit.types.strands import Strands

__all__ = [
    "ImportOptions",
    "adopt",
    "mean_look",
    "pack_strands",
    "place_head",
    "plain_widths",
    "reverse_strands",
]

SMALLEST, LARGEST = 0.015, 0.6
"""Roots of a head of hair spread over between these many metres."""
NO_LENGTH = 1e-6
"""Strands shorter than this share of the whole hair's extent have no direction."""
REACH = 1e6
"""Metres; beyond them, squares of lengths leave what a float32 can hold."""
FARTHEST = 0.03
"""Roots of a head's hair lie within this many metres of it, in the mean."""
SAME_COLOUR = 0.01
"""Difference of the square roots of colours that nobody sees; 8 bits have less."""
_OUTER = (1.0, 99.0)
_TYPICAL_SPREAD = 0.2
_TIP_FIRST = 0.5
_SAMPLES = 1000

_log = logging.getLogger("hairkit")


@dataclass(frozen=True)
class ImportOptions:
    """Options of every importer of files without a head."""

    head: Path | None = option(
        None,
        doc="Head under the strands: .obj, .ply, .glb or a groom's .npz; else the default head,"
        " moved and scaled to the roots.",
    )
    reverse: bool = option(
        False, doc="Turn every strand over: for files that draw hair from tip to root."
    )


def pack_strands(
    points: Float32Array, counts: Int64Array, source: object
) -> tuple[Strands, Int64Array]:
    """Return strands (points (P, 3), metres) and the numbers (S',) of those that were kept.

    Strands of fewer than two points are dropped and counted in a warning.

    Raises
    ------
    FormatError
        No strand is left, or a point lies where no hair can.
    """
    farthest = float(np.abs(points).max(initial=0.0))
    if not farthest <= REACH:
        raise FormatError(f"{source}: a point lies {farthest:.3g} m away, expected hair on a head")
    keep = counts >= 2
    if not keep.any():
        raise FormatError(f"{source}: holds no strand of two or more points")
    if not keep.all():
        _log.warning("%s: %d strands of fewer than two points dropped", source, (~keep).sum())
        points = points[np.repeat(keep, counts)]
    offsets = np.concatenate([[0], np.cumsum(counts[keep])])
    return Strands(points, offsets), np.flatnonzero(keep)


def plain_widths(thickness: npt.NDArray[Any], metres: float, source: object) -> Float32Array:
    """Return diameters in metres of a file's, of `metres` a unit; what is below 0 becomes 0.

    Raises `FormatError` when one is not finite or beyond all reason.
    """
    limit = REACH / metres
    if not (thickness <= limit).all():  # so NaN is refused too
        raise FormatError(f"{source}: a thickness is no number, or wider than {REACH:g} m")
    return np.asarray(np.maximum(thickness, 0).astype(np.float32) * np.float32(metres))


def adopt(
    strands: Strands,
    options: ImportOptions,
    source: object,
    material: HairMaterial | None = None,
    head: Head | None = None,
) -> Groom:
    """Return strands in the head frame as a groom, bound to a head.

    Strands without length are dropped and counted in a warning.

    Parameters
    ----------
    strands
        Metres; with the widths, root uv and colours that the file had, else None.
    options
        Names the head, if any, and says whether to turn the strands over.
    source
        The file, for messages.
    material
        Look; where None, the mean of the strands' widths and colours, as far as there are any.
    head
        The head that came with the file, which the option overrules.

    Raises
    ------
    InputError
        The roots spread over what cannot be a head, so the unit must be given.
    FormatError
        No strand has any length.
    """
    strands = _with_length(strands, source)
    if strands.guide is not None and not strands.guide.any():
        _log.warning("%s: no strand is marked as a guide; all are taken as guides", source)
        strands = replace(strands, guide=None)
    if options.reverse:
        strands = reverse_strands(strands)
        if material is not None:
            material = replace(
                material, root_colour=material.tip_colour, tip_colour=material.root_colour
            )
    _check_spread(strands, options, source)
    material = mean_look(strands) if material is None else material
    strands = _without_ramp(strands, material)
    head = _head(strands, options, head, source)
    if not options.reverse:
        _warn_of_tips(strands, head, source)
    if strands.widths is None:
        _log.warning("%s: no widths; strands are %g mm wide", source, 1000 * material.width)
    triangle, barycentric = bind(strands.roots, head)
    if strands.root_uv is None:
        _log.warning("%s: no root uv; that of the head is taken", source)
        strands = replace(strands, root_uv=roots_at(head, triangle, barycentric).uv)
    groom = Groom(strands, head, triangle, barycentric, material)
    groom.check_reach(source)
    return groom


def reverse_strands(strands: Strands) -> Strands:
    """Return the strands with their points, widths and colours from tip to root."""
    owner = strands.strand_of_point
    rows = (strands.offsets[:-1] + strands.offsets[1:] - 1)[owner] - np.arange(len(owner))
    widths = None if strands.widths is None else strands.widths[rows]
    colours = None if strands.colours is None else strands.colours[rows]
    return replace(strands, points=strands.points[rows], widths=widths, colours=colours)


def mean_look(strands: Strands) -> HairMaterial:
    """Return the look in the mean of widths, and of colours at roots and tips; else the default."""
    widths, colours = strands.widths, strands.colours
    known: dict[str, Any] = {}
    if widths is not None and (widths > 0).any():
        known["width"] = float(widths[widths > 0].mean(dtype=np.float64))
    if colours is not None:
        known["root_colour"] = colours[strands.offsets[:-1]].mean(axis=0, dtype=np.float64)
        known["tip_colour"] = colours[strands.offsets[1:] - 1].mean(axis=0, dtype=np.float64)
    return HairMaterial(**known)


def _without_ramp(strands: Strands, look: HairMaterial) -> Strands:
    """Return the strands without colours where these are what the look says anyway."""
    if strands.colours is None:
        return strands
    plain = replace(strands, colours=None)
    off = np.sqrt(strands.colours.clip(0, 1)) - np.sqrt(colours(look, plain).at().clip(0, 1))
    return plain if np.abs(off).max(initial=0) < SAME_COLOUR else strands


def _with_length(strands: Strands, source: object) -> Strands:
    low, high = bounds(strands.points)
    extent = float((high - low).max())
    keep = ~shorter_than(strands, max(NO_LENGTH * extent, float(np.finfo(np.float32).tiny)))
    if not keep.any():
        raise FormatError(f"{source}: none of its {len(keep)} strands has any length")
    if keep.all():
        return strands
    _log.warning("%s: %d strands without length dropped", source, np.count_nonzero(~keep))
    return strands.select(keep)


def _check_spread(strands: Strands, options: ImportOptions, source: object) -> None:
    """Refuse strands of another unit, unless the user named it; roots far off do not count."""
    low, high = np.percentile(strands.roots, _OUTER, axis=0)
    spread = float((high - low).max())
    lone = len(strands) == 1  # roots tell nothing, the length does
    size = float(strands.lengths()[0]) if lone else spread
    smallest, largest = (0.001, 2.0) if lone else (SMALLEST, LARGEST)
    if smallest <= size <= largest:
        return
    unit = options.space.metres if isinstance(options, SpaceOptions) else 1.0
    longest = float(np.percentile(strands.lengths(), 90))
    guess = unit * _TYPICAL_SPREAD / max(spread, longest / 4, 1e-30)
    wrong = (
        f"{source}: the roots spread over {spread:.4g} m, a head of hair's over about"
        f" {_TYPICAL_SPREAD} m; "
    )
    if isinstance(options, SpaceOptions) and options.scale > 0:
        _log.warning("%sscale=%.2g would make it so", wrong, guess)
    else:
        raise InputError(f"{wrong}give metres per unit of the file: scale={guess:.2g}")


def _head(strands: Strands, options: ImportOptions, own: Head | None, source: object) -> Head:
    """Return the head of the option, else the file's own, else the default one, in its place."""
    if options.head is None and own is not None:
        return own
    if options.head is None:
        head = default_head()
        place = find_place(head, strands)
        _log.warning(
            "%s: no head; the default head, scaled by %.2f and moved by %s m, is put under the"
            " roots, %.1f mm off",
            source,
            place.scale,
            np.array2string(place.shift, precision=3, suppress_small=True, separator=", "),
            1000 * place.distance,
        )
        return place_head(head, place.scale, place.shift)
    head = _read(options.head, strands)
    if _away(strands.roots, head) <= FARTHEST:
        return head
    place = find_place(head, strands, scaled=False)  # a head file is read about its own middle
    _log.warning(
        "%s: the head of %s is moved by %s m to the roots, %.1f mm off",
        source,
        options.head,
        np.array2string(place.shift, precision=3, suppress_small=True, separator=", "),
        1000 * place.distance,
    )
    return place_head(head, 1.0, place.shift)


def _read(path: Path, strands: Strands) -> Head:
    if path.suffix == ".npz":
        return Groom.load(path).head
    return read_head(path, roots=strands.roots)


def _away(points: Float32Array, head: Head) -> float:
    """Return the mean distance of points (N, 3) from the head's vertices, metres."""
    sample = points[:: -(-len(points) // _SAMPLES)]
    return float(cKDTree(head.vertices).query(sample)[0].mean())


def _warn_of_tips(strands: Strands, head: Head, source: object) -> None:
    """Say so where the tips lie on the head and the roots do not."""
    roots, tips = _away(strands.roots, head), _away(strands.tips, head)
    if tips < _TIP_FIRST * roots:
        _log.warning(
            "%s: tips lie nearer to the head (%.1f mm) than roots (%.1f mm); if it draws hair from"
            " tip to root, set reverse=true",
            source,
            1000 * tips,
            1000 * roots,
        )
