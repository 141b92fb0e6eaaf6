"""Hair at rest as guides and interpolated strands, in the form that the renderers read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.errors import InputError
from hairkit.grooming.densify import densify, roots_between
from hairkit.grooming.guide_weights import closest_guides, guide_mask
from hairkit.grooming.locks import strand_widths
from hairkit.grooming.prepare_export import point_colours
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

MOST_POINTS = 64
"""Largest number of points of a drawn strand."""
TOLERANCE = 8e-4
"""Allowed RMS distance between guides and drawn strands, metres."""
COUNTS, POWERS = (8, 10, 12, 14, 16, 20, 24, 32, 48), (1.0, 1.5, 2.0)
"""Point counts tried, and exponents of their density towards the root, where hair bends most."""
TUFT = 8
"""Neighbouring strands that stay adjacent in the order of drawing."""
BITS = 10
"""Of a place along an axis, in the order of neighbours."""
FINE = 256
"""Points at which strands are compared with the polylines that are drawn."""
BLOCK = 20_000
"""Strands that are made at a time: they have more points until they are resampled."""
MAX_HAIRS = 200_000
MAX_GUIDES = 2_000
"""Most strands taken as guides in a groom that marks none; the others follow them."""


@dataclass(frozen=True, eq=False)
class HairBody:
    """Hair at rest, and the guides that it follows; all strands have equal point counts."""

    guides: Strands
    """The guides, with their own points."""
    shares: Float64Array
    """(m,) positions of the drawn points, as shares of the arc length."""
    guide_rest: Float32Array
    """(G, m, 3) the guides resampled at these shares, metres."""
    followed: Int32Array
    """(S, 3) indices of each strand's guides; the first G strands are the guides themselves."""
    weights: Float32Array
    """(S, 3) weights of these guides, sum 1."""
    edges: Float32Array
    """(S, m, 3) from the weighted mean of the guides' roots to the root, and from each point to the
    next one, metres."""
    widths: Float32Array
    """(S, m) diameters, metres."""
    colours: Float32Array
    """(G, m, 3) linear RGB of the guides; the others mix theirs."""

    @property
    def points_each(self) -> int:
        """Points of every drawn strand, m."""
        return int(self.guide_rest.shape[1])

    def __len__(self) -> int:
        return len(self.followed)

    @classmethod
    def of(
        cls,
        groom: Groom,
        hairs: int,
        own: Strands | None = None,
        seed: int = 0,
        shares: Float64Array | None = None,
    ) -> HairBody:
        """Return `hairs` strands: the guides, then hair of `own` or, without it, interpolated hair.

        They have points at `shares` of their length; None: at `choose_shares` of the guides.
        All strands of the groom are guides. After them the order is random, so that any first part
        covers the scalp evenly. Raises `InputError` if there are no guides or `hairs` is out of
        range.
        """
        guides = groom.strands
        if not len(guides):
            raise InputError("the groom has 0 guides, expected at least 1")
        if not 0 <= hairs <= MAX_HAIRS:
            raise InputError(f"hairs is {hairs}, expected 0 to {MAX_HAIRS}")
        shares = choose_shares(guides) if shares is None else shares
        rest = _sampled(guides, shares)
        shape = _arrange_hair(groom, hairs, own, seed, shares)
        shape[: len(guides)] = rest  # a guide is where it is
        points, count = shape.reshape(-1, 3), len(shape)
        marked = np.arange(count) < len(guides)
        mix = closest_guides(Strands(points, np.arange(count + 1) * len(shares), guide=marked))
        roots = np.einsum("sk,skc->sc", mix.weights, rest[:, 0][mix.guides])
        edges = np.diff(shape, axis=1, prepend=roots[:, None])
        widths = strand_widths(count, shares, groom.material.width)
        coloured = replace(guides, colours=point_colours(groom)).resampled_at(shares)
        colours = np.asarray(coloured.colours).reshape(rest.shape)
        return cls(guides, shares, rest, mix.guides, mix.weights, edges, widths, colours)


def split_guides(groom: Groom, most: int = MAX_GUIDES) -> tuple[Groom, Strands | None]:
    """Return a groom of the guides alone, and the other strands; None if there are none.

    If no strand is marked as a guide and there are more than `most`, evenly spaced ones are taken.
    """
    strands = groom.strands
    guide = guide_mask(strands)
    if strands.guide is None and len(strands) > most:
        guide = np.zeros(len(strands), bool)
        guide[np.linspace(0, len(strands) - 1, most).astype(int)] = True
    if guide.all() or not guide.any():
        return groom, None
    return groom.select(guide), strands.select(~guide)


def choose_shares(guides: Strands) -> Float64Array:
    """Return the fewest sample positions (m,) that keep the guides' shape within `TOLERANCE`."""
    some = guides.select(np.arange(0, len(guides), max(1, len(guides) // 100)))
    for count in COUNTS:
        for power in POWERS:
            shares = np.linspace(0, 1, count) ** power
            if _misfit(some, shares) < TOLERANCE:
                return shares
    return np.linspace(0, 1, MOST_POINTS)


def _misfit(strands: Strands, shares: Float64Array) -> float:
    """Return the RMS distance between strands and their polylines through `shares`."""
    fine = strands.resampled(FINE).points.reshape(-1, FINE, 3)
    coarse = _sampled(strands, shares)
    wanted = np.linspace(0, 1, FINE)
    after = np.clip(np.searchsorted(shares, wanted, side="right"), 1, len(shares) - 1)
    span = shares[after] - shares[after - 1]
    part = ((wanted - shares[after - 1]) / span)[:, None]
    chords = coarse[:, after - 1] * (1 - part) + coarse[:, after] * part
    return float(np.sqrt(((chords - fine) ** 2).sum(axis=2).mean()))


def _arrange_hair(
    groom: Groom, hairs: int, own: Strands | None, seed: int, shares: Float64Array
) -> Float32Array:
    """Return (S, m, 3) the guides, then other hair in tufts in random order."""
    guides, order = groom.strands, np.random.default_rng(seed)
    others = max(hairs - len(guides), 0)
    if own is not None:
        chosen = _shuffle_tufts(own.roots, order)[:others]
        made = _sampled(own.select(chosen), shares)
    elif others:
        made = _interpolate(groom, others, seed, shares)
        made = made[_shuffle_tufts(made[:, 0], order)]
    else:
        made = np.empty((0, len(shares), 3), np.float32)
    return np.concatenate([_sampled(guides, shares), made])


def _interpolate(groom: Groom, count: int, seed: int, shares: Float64Array) -> Float32Array:
    """Return (count, m, 3) hair between the guides."""
    guides, roots = groom.strands, roots_between(groom, count, seed).positions
    made = np.empty((count, len(shares), 3), np.float32)
    for number, some in enumerate(_blocks(count)):
        wanted = len(guides) + len(roots[some])
        block = densify(groom, wanted, seed + number, roots=roots[some])
        new = np.arange(len(guides), wanted)
        made[some] = _sampled(block.select(new), shares)
    return made


def _sampled(strands: Strands, shares: Float64Array) -> Float32Array:
    """Return points (S, m, 3) of strands at shares of their length."""
    return strands.resampled_at(shares).points.reshape(-1, len(shares), 3)


def _blocks(count: int) -> Iterator[slice]:
    for first in range(0, count, BLOCK):
        yield slice(first, min(first + BLOCK, count))


def _shuffle_tufts(roots: Float32Array, generator: np.random.Generator) -> Int64Array:
    """Return an order (N,) of strands: tufts of neighbours, the tufts in random order.

    Software renderers draw `TUFT` strands in lockstep; neighbours are occluded together.
    """
    low, high = roots.min(axis=0), roots.max(axis=0)
    cell = ((roots - low) / np.maximum(high - low, 1e-9) * ((1 << BITS) - 1)).astype(np.int64)
    code = np.zeros(len(roots), np.int64)  # Morton code: neighbours in space are near in order
    for bit in range(BITS):
        for axis in range(3):
            code |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    sorted_ = np.argsort(code, kind="stable")
    whole = len(roots) // TUFT * TUFT
    tufts = generator.permutation(sorted_[:whole].reshape(-1, TUFT)).ravel()
    return np.concatenate([tufts, sorted_[whole:]])
