"""Ribbons and cards of a groom's hair, at several levels of detail, with their morph targets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.grooming.guide_weights import follow, guide_mask
from hairkit.grooming.prepare_export import bound_roots, dense_groom, point_colours
from hairkit.types.groom import Groom

from .options import Options
from .ribbons import Locks, Ribbons, frames, gather_locks, make_ribbons, outward

RIBBONS, CARDS = 4000, 800
"""Strips where the options say 0."""
_HAIRS_OF_A_HEAD = 100_000
_NARROWEST, _WIDEST = 2e-4, 0.02
_STRANDS_PER_CARD = 8
_CARD_SPREAD = 3.0
"""Widths of a card in root mean square distances of its strands from the middle."""
_FEWEST_POINTS = 4
_COARSER = 0.75
"""Points of a strip in shares of those one level of detail finer."""
_DIMMEST = 0.8
"""Brightness of the darkest strips, so that neighbours can be told apart."""
_ROOT_WIDTH, _TAPER = 0.7, 0.65
"""Width of a strip at its root, and how much it loses towards its tip, in shares of the whole."""


@dataclass(frozen=True, eq=False)
class HairMesh:
    """Triangles of one level of detail."""

    ribbons: Ribbons
    root_uv: Float32Array
    """(V, 2) of the strip's root, v upwards."""
    colour: Float32Array
    """(V, 3) linear RGB; some strips are a little darker."""
    shapes: Float32Array
    """(M, V, 3) shifts from rest."""


def hair_meshes(groom: Groom, shapes: Float32Array, options: Options) -> Iterator[HairMesh]:
    """Yield the levels of detail, the finest first.

    Parameters
    ----------
    groom
        Strands with all that `complete_groom` fills in.
    shapes
        (M, P, 3) shifts of the strands' points.
    options
        Where more strips are wanted than there are strands, hair is interpolated between guides.
    """
    wanted = options.strips or (CARDS if options.hair == "cards" else RIBBONS)
    needed = wanted if options.hair == "ribbons" else wanted * _STRANDS_PER_CARD
    if len(groom.strands) < needed:
        groom, shapes = _denser(groom, shapes, needed, options)
    for level in range(options.lods):
        count = max(wanted >> level, 1)
        points = max(
            round(options.strip_points * _COARSER**level), min(_FEWEST_POINTS, options.strip_points)
        )
        yield _level(groom, shapes, count, points, options, 2**level)


def _denser(
    groom: Groom, shapes: Float32Array, wanted: int, options: Options
) -> tuple[Groom, Float32Array]:
    """Return `wanted` strands and their shapes; without guides, what there is."""
    guide = guide_mask(groom.strands)
    if not guide.any():
        return groom, shapes
    shapes = shapes[:, guide[groom.strands.strand_of_point]]
    guides = groom.select(guide)
    points = options.strip_points
    even = gather_locks(guides.strands, len(guides.strands), points, mean=False)
    rest = even.moved(guides.strands.points).reshape(-1, 3)
    moved = np.stack([rest, *(rest + even.moved(shape).reshape(-1, 3) for shape in shapes)])
    strands = replace(
        guides.strands,
        points=rest,
        offsets=np.arange(len(guides.strands) + 1) * points,
        widths=None,
        colours=even.moved(point_colours(guides)).reshape(-1, 3),
    )
    dense = dense_groom(replace(guides, strands=strands), wanted, options.seed)
    # the first frame is rest itself, which following may round
    followed = follow(dense.strands, moved)
    return dense, followed[1:] - followed[:1]


def _level(
    groom: Groom, shapes: Float32Array, count: int, points: int, options: Options, wider: int
) -> HairMesh:
    strands = groom.strands
    locks = gather_locks(strands, count, points, mean=options.hair == "cards", seed=options.seed)
    lines = locks.moved(strands.points)
    out = outward(lines, groom.head)
    ribbons = make_ribbons(lines, out, _widths(groom, locks, lines, out, options, wider))
    beside = ribbons.point_of_vertex
    moved = [locks.moved(shape).reshape(-1, 3)[beside] for shape in shapes]
    strip = beside // points
    uv = strands.root_uv if strands.root_uv is not None else bound_roots(groom).uv
    shade = np.random.default_rng(options.seed).uniform(_DIMMEST, 1, len(locks.strand))
    colour = locks.moved(point_colours(groom)).reshape(-1, 3)[beside] * shade[strip, None]
    return HairMesh(
        ribbons,
        uv[locks.strand][strip],
        colour.astype(np.float32),
        np.stack(moved) if moved else np.zeros((0, len(beside), 3), np.float32),
    )


def _widths(
    groom: Groom, locks: Locks, lines: Float32Array, out: Float32Array, options: Options, wider: int
) -> Float32Array:
    """Return (N, K) widths in metres: a little narrower at the root, narrow at the tip."""
    count, points = lines.shape[:2]
    width = options.strip_width * wider
    if width == 0:
        width = _HAIRS_OF_A_HEAD * groom.material.width / count
    whole = np.full((count, points), np.clip(width, _NARROWEST, _WIDEST))
    if options.hair == "cards" and options.strip_width == 0:
        across = frames(lines, out)[1]
        gathered_within = np.sqrt(((locks.spread * across) ** 2).sum(axis=-1))
        whole = np.clip(_CARD_SPREAD * gathered_within, 0.5 * width, _WIDEST * wider)
    share = np.linspace(0, 1, points)
    profile = np.minimum(_ROOT_WIDTH + 3 * share, 1.0) * (1 - _TAPER * share**4)
    return (whole * profile).astype(np.float32)
