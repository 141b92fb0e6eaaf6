"""What the viewer's shaders need to know of hair at rest: guides, and hair that follows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.densify import densify
from hairkit.errors import InputError
from hairkit.groom import Groom, HairMaterial
from hairkit.guide_weights import closest_guides, guide_mask
from hairkit.head import Head
from hairkit.scalp import sample_roots
from hairkit.stored import Float32Array, Int32Array, Int64Array
from hairkit.strands import Strands

FEWEST_POINTS, MOST_POINTS = 8, 64
"""Points of every drawn strand, by how much the guides bend."""
TOLERANCE = 8e-4
"""Root mean square distance that drawn strands may keep from the guides, metres."""
MAX_HAIRS = 200_000
MAX_GUIDES = 2_000
"""Of a groom without marked guides, so many strands at most are guides; the rest follow them."""


@dataclass(frozen=True, eq=False)
class HairBody:
    """Hair at rest in the form that follows moving guides; all strands have equal point counts."""

    guides: Strands
    """The guides, with their own points."""
    guide_rest: Float32Array
    """(G, m, 3) the guides with the drawn number of points, metres."""
    followed: Int32Array
    """(S, 3) the guides of every hair; the first G hairs are the guides themselves."""
    weights: Float32Array
    """(S, 3) of these guides, sum 1."""
    offsets: Float32Array
    """(S, m, 3) from the mix of the guides to the hair, metres."""
    widths: Float32Array
    """(S, m) diameters, metres."""

    @property
    def points_each(self) -> int:
        """Points of every drawn strand, m."""
        return int(self.guide_rest.shape[1])

    def __len__(self) -> int:
        return len(self.followed)

    @classmethod
    def of(
        cls,
        guides: Strands,
        head: Head,
        material: HairMaterial,
        hairs: int,
        own: Strands | None = None,
        seed: int = 0,
    ) -> HairBody:
        """Return guides made up to `hairs` strands, by `own` hair first, then by interpolation.

        Beyond the guides, any first part of the hair is spread evenly over the scalp. Raises
        `InputError` when there are no guides or too many hairs are asked for.
        """
        if not len(guides):
            raise InputError("the groom has no strands to look at")
        if not 0 <= hairs <= MAX_HAIRS:
            raise InputError(f"{hairs} hairs, expected 0 to {MAX_HAIRS}")
        points = points_needed(guides)
        rest = GuideSampler(guides, points)(guides.points)
        hair = _hair(guides, head, material, hairs, own, seed, points)
        mix = closest_guides(hair)
        shape = hair.points.reshape(-1, points, 3)
        course = np.einsum("sk,skmc->smc", mix.weights, rest[mix.guides], optimize=True)
        offsets = (shape - course).astype(np.float32)
        offsets[: len(guides)] = 0  # a guide is where it is
        widths = np.full(shape.shape[:2], material.width, np.float32)
        if hair.widths is not None:
            widths = hair.widths.reshape(shape.shape[:2])
        return cls(guides, rest, mix.guides, mix.weights, offsets, widths)


class GuideSampler:
    """Brings guides' points to equal counts, at equal shares of the arc length at rest."""

    def __init__(self, guides: Strands, count: int) -> None:
        self._before, self._part = _places(guides, count)

    def __call__(self, points: Float32Array) -> Float32Array:
        """Return points (P, 3) as (G, count, 3)."""
        low = points[self._before]
        rows: Float32Array = low + (points[self._before + 1] - low) * self._part
        return rows


def split_guides(groom: Groom, most: int = MAX_GUIDES) -> tuple[Groom, Strands | None]:
    """Return the groom of the guides alone, and its other strands or None where it has none.

    Where no strand is marked as a guide and there are more than `most`, every so many-th is taken.
    """
    strands = groom.strands
    guide = guide_mask(strands)
    if strands.guide is None and len(strands) > most:
        guide = np.zeros(len(strands), bool)
        guide[np.linspace(0, len(strands) - 1, most).astype(int)] = True
    if guide.all() or not guide.any():
        return groom, None
    index = np.flatnonzero(guide)
    alone = Groom(
        strands.select(index),
        groom.head,
        groom.root_triangle[index],
        groom.root_barycentric[index],
        groom.material,
        groom.physics,
    )
    return alone, strands.select(~guide)


def points_needed(guides: Strands) -> int:
    """Return the fewest points a strand that keep the guides' shape within `TOLERANCE`."""
    some = guides.select(np.arange(0, len(guides), max(1, len(guides) // 100)))
    fine = some.resampled(4 * MOST_POINTS)
    for count in (FEWEST_POINTS, 12, 16, 24, 32, 48):
        gap = some.resampled(count).resampled(4 * MOST_POINTS).points - fine.points
        if np.sqrt((gap**2).sum(axis=1).mean()) < TOLERANCE:
            return count
    return MOST_POINTS


def _places(guides: Strands, count: int) -> tuple[Int64Array, Float32Array]:
    arc = guides.arc_lengths()
    before = np.zeros((len(guides), count), np.int64)
    part = np.zeros((len(guides), count, 1), np.float32)
    for index, low in enumerate(guides.offsets[:-1]):
        own = arc[low : guides.offsets[index + 1]]
        wanted = np.linspace(0, own[-1], count)
        at = np.clip(np.searchsorted(own, wanted, side="right"), 1, len(own) - 1) - 1
        before[index] = low + at
        span = np.maximum(own[at + 1] - own[at], 1e-12)
        part[index, :, 0] = np.clip((wanted - own[at]) / span, 0, 1)
    return before, part


def _hair(
    guides: Strands,
    head: Head,
    material: HairMaterial,
    hairs: int,
    own: Strands | None,
    seed: int,
    points: int,
) -> Strands:
    """Return the guides, then hair in random order, as `closest_guides` wants them marked."""
    count = len(guides)
    even = Strands(guides.points, guides.offsets).resampled(points)
    parts = [even]
    order = np.random.default_rng(seed)
    if own is not None:
        bare = Strands(own.points, own.offsets).resampled(points)
        parts.append(bare.select(order.permutation(len(bare))[: max(hairs - count, 0)]))
    missing = hairs - sum(len(part) for part in parts)
    if missing > 0 and own is None:
        roots = sample_roots(head, missing, seed)
        new = densify(guides, hairs, seed, roots=roots, material=material).resampled(points)
        parts.append(new.select(count + order.permutation(len(new) - count)))
    total = sum(len(part) for part in parts)
    return Strands(
        np.concatenate([part.points for part in parts]),
        np.arange(total + 1) * points,
        guide=np.arange(total) < count,
    )
