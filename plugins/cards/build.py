"""All levels of a groom's cards, with one atlas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float32Array, Int32Array
from hairkit.types.groom import Groom

from .locks import course, sort_into_locks
from .maps import encode_maps
from .options import Options
from .packing import Places, pack
from .painting import blank_atlas, paint
from .strips import Cards, make_cards

FEWER = 0.55
"""Cards of a level, of those of the level before."""
FEWEST = 8
"""Cards of a level at least."""
DRAWN_POINTS = 32
"""Points of a strand, at most, that are drawn on its card."""


@dataclass(frozen=True, eq=False)
class Level:
    """The mesh of one level of detail."""

    cards: Cards
    vertices: Float32Array
    """(V, 3) metres: both edges of each station of each card."""
    normals: Float32Array
    """(V, 3)."""
    tangents: Float32Array
    """(V, 4) along the picture's rows, and the sign of the bitangent."""
    uv: Float32Array
    """(V, 2) in the atlas, from its upper left corner."""
    faces: Int32Array
    """(F, 3)."""


@dataclass(frozen=True, eq=False)
class CardSet:
    """The levels of detail, the finest first, and the maps that they share."""

    levels: list[Level]
    maps: dict[str, bytes]
    """PNG files by name: albedo (with alpha), alpha, normal, flow, depth, id."""
    courses: Float32Array
    """(S, 24) eight points of each strand, metres."""


def build_cards(groom: Groom, options: Options) -> CardSet:
    """Return the cards of all strands of a groom whose widths are known."""
    strands = groom.strands
    if strands.counts.max() > DRAWN_POINTS:
        strands = strands.resampled(DRAWN_POINTS)
    courses = course(strands)
    wanted = min(options.cards, len(strands))
    counts = [max(round(wanted * FEWER**n), min(FEWEST, wanted)) for n in range(options.levels)]
    middle = groom.head.vertices.mean(axis=0, dtype=np.float64)
    locks = sort_into_locks(courses, counts, options.seed)
    levels = [make_cards(strands, lock, options.stations, middle) for lock in locks]
    places = pack(levels, options.atlas)
    atlas = blank_atlas(options.atlas)
    widths = strands.widths
    if widths is None:
        widths = np.full(len(strands.points), groom.material.width, np.float32)
    for cards, at in zip(levels, places, strict=True):
        paint(atlas, strands, widths, cards, at, places[0].texel / at.texel)
    meshes = [_mesh(cards, at, options.atlas) for cards, at in zip(levels, places, strict=True)]
    return CardSet(meshes, encode_maps(atlas, strands, groom.material), courses)


def _mesh(cards: Cards, at: Places, edge: int) -> Level:
    """Return the mesh of cards at their places in an atlas of `edge` texels."""
    count, stations = cards.half.shape
    pairs = np.broadcast_to(cards.outward[:, :, None], (count, stations, 2, 3))
    across = np.broadcast_to(cards.across[:, :, None], (count, stations, 2, 3))
    uv = np.empty((count, stations, 2, 2))
    uv[..., 0] = at.corner[:, None, None, 0] + at.size[:, None, None, 0] * np.array([0.0, 1.0])
    along = np.linspace(0, 1, stations)[None, :, None]
    uv[..., 1] = at.corner[:, None, None, 1] + at.size[:, None, None, 1] * along
    # the picture's rows run down the card, so that the bitangent of glTF points to the root
    sign = np.ones((count * stations * 2, 1), np.float32)
    tangents = np.concatenate([across.reshape(-1, 3).astype(np.float32), sign], axis=1)
    return Level(
        cards,
        cards.corners().reshape(-1, 3),
        pairs.reshape(-1, 3).astype(np.float32),
        tangents,
        (uv / edge).reshape(-1, 2).astype(np.float32),
        cards.faces(),
    )
