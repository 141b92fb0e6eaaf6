"""Chains of bones through the hair, and the weights of the cards' vertices on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int64Array
from hairkit.types.groom import Groom

from .build import CardSet, Level
from .locks import COURSE, sort_into_locks

SPACING = 0.05
"""Metres from joint to joint, about."""
FEWEST, MOST = 3, 8
"""Joints of a chain; the last is its tip, which turns nothing."""
SAME = 1e-4
"""Metres between courses below which a card is its chain's own."""
NEAR = 2
"""Chains that move a card: its own and the next."""


@dataclass(frozen=True, eq=False)
class Chains:
    """Bones of C chains, in one list of B joints, each chain from root to tip."""

    places: Float64Array
    """(B, 3) metres."""
    parent: Int64Array
    """(B,) the joint above; -1 for the first of a chain, which hangs on the head."""
    first: Int64Array
    """(C + 1,) where each chain begins."""
    course: Float64Array
    """(C, 8, 3) its middle line."""


def find_chains(groom: Groom, cards: CardSet, count: int) -> Chains:
    """Return about `count` chains along the middles of the hair's largest locks."""
    lock = sort_into_locks(cards.courses, [min(count, len(groom.strands))])[0]
    order = np.argsort(lock, kind="stable")
    first = np.searchsorted(lock[order], np.arange(lock.max() + 1))
    size = np.bincount(lock)[:, None]
    middle = (np.add.reduceat(cards.courses[order].astype(np.float64), first) / size).reshape(
        -1, COURSE, 3
    )
    steps = np.linalg.norm(np.diff(middle, axis=1), axis=2)
    length = np.median(groom.strands.lengths())
    every = [
        _joints(line, int(np.clip(round(part / SPACING), FEWEST - 1, MOST - 1)) + 1)
        for line, part in zip(middle, np.maximum(steps.sum(axis=1), 0.5 * length), strict=True)
    ]
    counts = [len(joints) for joints in every]
    begin = np.concatenate([[0], np.cumsum(counts)])
    parent = np.arange(begin[-1]) - 1
    parent[begin[:-1]] = -1
    return Chains(np.concatenate(every), parent, begin, middle)


def _joints(line: Float64Array, count: int) -> Float64Array:
    """Return `count` places (J, 3) at equal steps along a line (8, 3)."""
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    wanted = np.linspace(0, arc[-1], count)
    return np.stack([np.interp(wanted, arc, line[:, axis]) for axis in range(3)], axis=1)


def weigh(level: Level, chains: Chains) -> tuple[Int64Array, Float32Array]:
    """Return joints (V, 4) and weights (V, 4), each row with sum 1, of a level's vertices.

    A card follows the two chains whose courses are nearest to its own; along them, two joints each.
    A joint turns what lies below it, so that the hair at the root stays on the head.
    """
    centre = level.cards.centre
    count, stations = centre.shape[:2]
    pick = np.rint(np.linspace(0, stations - 1, COURSE)).astype(np.int64)
    apart = np.linalg.norm(centre[:, None, pick] - chains.course[None], axis=3).mean(axis=2)
    near = np.argsort(apart, axis=1, kind="stable")[:, : min(NEAR, len(chains.course))]
    distance = np.take_along_axis(apart, near, axis=1)
    share = 1 / np.maximum(distance, SAME) ** 2
    share /= share.sum(axis=1, keepdims=True)
    joints = np.zeros((count, stations, 2 * NEAR), np.int64)
    weights = np.zeros((count, stations, 2 * NEAR))
    along = np.linspace(0, 1, stations)[None]
    for each in range(near.shape[1]):
        begin = chains.first[near[:, each]][:, None]
        bones = (chains.first[near[:, each] + 1] - chains.first[near[:, each]] - 1)[:, None]
        # half a bone later, so that the bend is smooth about each joint
        place = np.clip(along * bones - 0.5, 0, bones - 1)
        low = np.minimum(place.astype(np.int64), np.maximum(bones - 2, 0))
        part = place - low
        joints[..., 2 * each], joints[..., 2 * each + 1] = begin + low, begin + low + 1
        weights[..., 2 * each] = share[:, each, None] * (1 - part)
        weights[..., 2 * each + 1] = share[:, each, None] * part
    # both edges of a station alike; glTF wants joint 0 where a weight is 0
    named = np.repeat(np.where(weights > 0, joints, 0), 2, axis=1).reshape(-1, 2 * NEAR)
    shared = np.repeat(weights, 2, axis=1).reshape(-1, 2 * NEAR).astype(np.float32)
    return named, shared / shared.sum(axis=1, keepdims=True)
