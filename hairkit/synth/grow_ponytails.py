"""Tied hair: strands that run over the scalp to a tie and hang from it as a tail."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array, across, unit_vectors
from hairkit.synth.bust import Obstacle
from hairkit.types.head import Head, Roots
from hairkit.types.strands import Strands

TIE_ELEVATIONS, TIE_AZIMUTH = (-5.0, 50.0), 8.0
"""Degrees above the horizon, seen from the scalp's centre, between which a tie lies behind the
head; its largest deviation to a side."""
TIE_GAP, TIE_RADIUS = 0.014, 0.007
"""Metres from the skin to the ring's centre, and of the ring."""
STEP = 0.004
"""Metres of a step."""
TURN_IN = 0.03
"""Metres from the ring at which strands leave the scalp for it."""
TIGHTNESS = 0.009
"""Metres of hair on the scalp at the tie, thinner towards the hairline."""
THINNEST = 0.1
"""Least thickness on the scalp, share of `TIGHTNESS`."""
MIXING = 0.3
"""Standard deviation in radians by which strands change their places around the ring."""
TAIL_SPREAD, TAIL_BEND = 0.28, 0.055
"""Standard deviation of directions behind the ring, of a unit vector; metres over which gravity
turns the tail down."""
TAIL_LENGTHS = 0.12
"""Standard deviation of the tail's length, share of it."""
TAIL_BOUNDS = (0.5, 1.4)
"""Shortest and longest tail over its mean."""
FRINGE_SHARE, FRINGE_DEPTH = 0.5, 0.02
"""Share of the strands that stay loose among those whose roots lie less than this far behind the
foremost, metres."""
MOST_STEPS = 120
"""Of a strand on the scalp."""
_DOWN = np.array([0.0, -1.0, 0.0])


def choose_fringe(roots: Roots, generator: np.random.Generator) -> BoolArray:
    """Return (N,) whether each strand hangs loose over the forehead."""
    front = roots.positions[:, 2] > roots.positions[:, 2].max() - FRINGE_DEPTH
    return np.asarray(front & (generator.random(len(roots)) < FRINGE_SHARE))


def place_tie(head: Head, generator: np.random.Generator) -> tuple[Float64Array, Float64Array]:
    """Return the centre (3,) of a tie behind the head and its axis (3,), off the skin."""
    scalp = head.vertices[head.scalp > 0.5].astype(np.float64)
    elevation = np.radians(generator.uniform(*TIE_ELEVATIONS))
    azimuth = np.radians(180 + generator.uniform(-TIE_AZIMUTH, TIE_AZIMUTH))
    flat = np.cos(elevation)
    axis = np.array([np.sin(azimuth) * flat, np.sin(elevation), np.cos(azimuth) * flat])
    middle = 0.5 * (scalp.min(axis=0) + scalp.max(axis=0))
    skin = scalp[np.argmax((scalp - middle) @ axis)]
    return skin + TIE_GAP * axis, axis


def grow_tied(
    tail: float, points: int, head: Head, roots: Roots, obstacle: Obstacle,
    generator: np.random.Generator,
) -> Float32Array:  # fmt: skip
    """Return strands (N, points, 3) through a tie, `tail` metres long behind it in the mean."""
    centre, axis = place_tie(head, generator)
    first = np.cross(axis, [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    ways, last = _to_tie(centre, roots, obstacle)
    come = ways[np.arange(len(roots)), last] - centre
    angle = np.arctan2(come @ second, come @ first) + MIXING * generator.standard_normal(len(roots))
    radius = np.sqrt(generator.random(len(roots)))
    side = radius[:, None] * (np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second)
    lengths = tail * np.clip(1 + TAIL_LENGTHS * generator.standard_normal(len(roots)), *TAIL_BOUNDS)
    hanging = _hang(centre + TIE_RADIUS * side, axis + TAIL_SPREAD * side, lengths, obstacle)
    strands = [
        np.concatenate([way[: end + 1], behind])
        for way, end, behind in zip(ways, last, hanging, strict=True)
    ]
    even = Strands.from_list(strands).resampled(points).points
    return even.reshape(len(roots), points, 3)


def _to_tie(
    centre: Float64Array, roots: Roots, obstacle: Obstacle
) -> tuple[Float64Array, Int64Array]:
    """Return ways (N, M, 3) over the scalp to near the ring, and the last point of each (N,)."""
    at = roots.positions.astype(np.float64)
    ways = np.repeat(at[:, None], MOST_STEPS + 1, axis=1)
    last = np.zeros(len(at), np.int64)
    whole = np.linalg.norm(at - centre, axis=1)
    for step in range(1, MOST_STEPS + 1):
        left = np.linalg.norm(at - centre, axis=1)
        going = left > TURN_IN
        if not going.any():
            break
        distance, outward = (v[going].astype(np.float64) for v in obstacle.at(at.astype("f4")))
        way = unit_vectors(across(outward, centre - at[going]))
        layer = TIGHTNESS * np.clip(1 - left[going] / whole[going], THINNEST, 1)[:, None]
        at[going] += STEP * way + np.clip(layer - distance, -STEP / 2, STEP / 2) * outward
        ways[going, step] = at[going]
        last[going] = step
    return ways, last


def _hang(
    starts: Float64Array, directions: Float64Array, lengths: Float64Array, obstacle: Obstacle
) -> Float64Array:
    """Return strands (N, M, 3) from the ring on, turned down by gravity, kept out of bodies."""
    steps = int(np.ceil(lengths.max() / STEP))
    step = (lengths / steps)[:, None]
    paths = np.repeat(starts[:, None], steps + 1, axis=1)
    heading = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    for k in range(1, steps + 1):
        heading = heading + step / TAIL_BEND * _DOWN
        heading /= np.linalg.norm(heading, axis=1, keepdims=True)
        ahead = paths[:, k - 1] + step * heading
        distance, outward = obstacle.at(ahead.astype(np.float32))
        paths[:, k] = ahead + np.clip(STEP / 2 - distance, 0, step) * outward
        heading = paths[:, k] - paths[:, k - 1]
        heading /= np.maximum(np.linalg.norm(heading, axis=1, keepdims=True), 1e-9)
    return paths
