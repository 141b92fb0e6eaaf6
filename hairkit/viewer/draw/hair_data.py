"""What the viewer's shaders need to know of hair at rest: guides, and hair that follows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.errors import InputError
from hairkit.grooming.densify import densify
from hairkit.grooming.guide_weights import closest_guides, guide_mask
from hairkit.head_model.scalp import sample_roots
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.head import Head
from hairkit.types.strands import Strands

MOST_POINTS = 64
"""Points of every drawn strand at most."""
TOLERANCE = 8e-4
"""Root mean square distance that drawn strands may keep from the guides, metres."""
COUNTS, POWERS = (8, 10, 12, 14, 16, 20, 24, 32, 48), (1.0, 1.5, 2.0)
"""Numbers of points tried, and how they crowd towards the root: most hair bends there."""
TUFT = 8
"""Neighbouring hairs that are drawn side by side."""
FINE = 256
"""Points of the strands from which these are taken."""
MAX_HAIRS = 200_000
MAX_GUIDES = 2_000
"""Of a groom without marked guides, so many strands at most are guides; the rest follow them."""


@dataclass(frozen=True, eq=False)
class HairBody:
    """Hair at rest in the form that follows moving guides; all strands have equal point counts."""

    guides: Strands
    """The guides, with their own points."""
    shares: Float64Array
    """(m,) places of the drawn points, in shares of the strand's length."""
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
        shares = shares_needed(guides)
        rest = GuideSampler(guides, shares)(guides.points)
        hair = _hair(guides, head, material, hairs, own, seed, shares)
        mix = closest_guides(hair)
        shape = hair.points.reshape(-1, len(shares), 3)
        course = np.einsum("sk,skmc->smc", mix.weights, rest[mix.guides], optimize=True)
        offsets = (shape - course).astype(np.float32)
        offsets[: len(guides)] = 0  # a guide is where it is
        widths = np.full(shape.shape[:2], material.width, np.float32)
        return cls(guides, shares, rest, mix.guides, mix.weights, offsets, widths)


class GuideSampler:
    """Brings guides' points to equal counts, at shares (m,) of the arc length at rest."""

    def __init__(self, guides: Strands, shares: Float64Array) -> None:
        self.before, self.part = _places(guides, shares)
        """(G, m) points before the places, and (G, m, 1) how far these are on to the next ones."""

    def __call__(self, points: Float32Array) -> Float32Array:
        """Return points (P, 3) as (G, m, 3)."""
        low = points[self.before]
        rows: Float32Array = low + (points[self.before + 1] - low) * self.part
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


def shares_needed(guides: Strands) -> Float64Array:
    """Return (m,) as few places along strands as keep the guides' shape within `TOLERANCE`."""
    some = guides.select(np.arange(0, len(guides), max(1, len(guides) // 100)))
    fine = _fine(some)
    for count in COUNTS:
        for power in POWERS:
            shares = np.linspace(0, 1, count) ** power
            if _misfit(fine, shares) < TOLERANCE:
                return shares
    return np.linspace(0, 1, MOST_POINTS)


def _misfit(fine: Float32Array, shares: Float64Array) -> float:
    """Return the root mean square distance between strands and their chords through `shares`."""
    coarse = _at(fine, shares)
    wanted = np.linspace(0, 1, FINE)
    after = np.clip(np.searchsorted(shares, wanted, side="right"), 1, len(shares) - 1)
    span = shares[after] - shares[after - 1]
    part = ((wanted - shares[after - 1]) / span)[:, None]
    chords = coarse[:, after - 1] * (1 - part) + coarse[:, after] * part
    return float(np.sqrt(((chords - fine) ** 2).sum(axis=2).mean()))


def _fine(strands: Strands) -> Float32Array:
    """Return (S, FINE, 3) the strands with very many points, at equal shares."""
    return Strands(strands.points, strands.offsets).resampled(FINE).points.reshape(-1, FINE, 3)


def _at(fine: Float32Array, shares: Float64Array) -> Float32Array:
    """Return (S, m, 3) points at shares of the length."""
    place = shares * (FINE - 1)
    low = np.minimum(place.astype(int), FINE - 2)
    part = (place - low).astype(np.float32)[:, None]
    rows: Float32Array = fine[:, low] * (1 - part) + fine[:, low + 1] * part
    return rows


def _places(guides: Strands, shares: Float64Array) -> tuple[Int64Array, Float32Array]:
    arc = guides.arc_lengths()
    before = np.zeros((len(guides), len(shares)), np.int64)
    part = np.zeros((len(guides), len(shares), 1), np.float32)
    for index, low in enumerate(guides.offsets[:-1]):
        own = arc[low : guides.offsets[index + 1]]
        wanted = shares * own[-1]
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
    shares: Float64Array,
) -> Strands:
    """Return the guides, then hair in tufts in random order, as `closest_guides` wants it."""
    count = len(guides)
    parts = [_at(_fine(guides), shares)]
    order = np.random.default_rng(seed)
    if own is not None:
        chosen = _scattered(own.roots, order)[: max(hairs - count, 0)]
        parts.append(_at(_fine(own.select(chosen)), shares))
    elif hairs > count:
        roots = sample_roots(head, hairs - count, seed, first=count)
        new = densify(guides, hairs, seed, roots=roots, material=material)
        shuffled = new.select(count + _scattered(new.roots[count:], order))
        parts.append(_at(_fine(shuffled), shares))
    total = sum(len(part) for part in parts)
    return Strands(
        np.concatenate(parts).reshape(-1, 3),
        np.arange(total + 1) * len(shares),
        guide=np.arange(total) < count,
    )


def _scattered(roots: Float32Array, generator: np.random.Generator) -> Int64Array:
    """Return an order (N,) of hairs: tufts of neighbours, the tufts in random order.

    Neighbours are hidden together and equally long: software renderers draw 8 hairs side by side.
    """
    low, high = roots.min(axis=0), roots.max(axis=0)
    cell = ((roots - low) / np.maximum(high - low, 1e-9) * 1023).astype(np.int64)
    code = np.zeros(len(roots), np.int64)  # along a Morton curve neighbours stay together
    for bit in range(10):
        for axis in range(3):
            code |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    sorted_ = np.argsort(code, kind="stable")
    whole = len(roots) // TUFT * TUFT
    tufts = generator.permutation(sorted_[:whole].reshape(-1, TUFT)).ravel()
    result: Int64Array = np.concatenate([tufts, sorted_[whole:]])
    return result
