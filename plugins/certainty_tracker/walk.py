"""Compiled walk of strands through the field: one step and the state after it at a time.

A step is certain when it lies in the hair and turns by less than a limit (thesis 6.1). After some
uncertain steps in a row the strand ends, and those are cut off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.field.sampling_kernels import gradient_at, make_unit, principal_direction, sample_at
from hairkit.parallel import compiled

ROOT_STEPS, ROOT_INERTIA = 4, 0.7
"""Steps from the root, where few views see hair and the field is weak, and their least inertia."""
ACROSS = 0.2
"""Cosine of strand and field below which the growth decides the sign: 78 degrees and more."""
SKIN_LEVEL = 0.6
"""Smoothed occupancy of the hull along which strands slide; its border has 0.5."""
UNKNOWN = -1.0
"""Cosine returned where the field is unknown."""


class Volumes(NamedTuple):
    """Volumes on one grid; scalars have a last axis of one."""

    origin: Float64Array
    """(3,) lowest corner of the grid, metres, head frame."""
    spacing: float
    """Edge of a cell, metres."""
    tensors: Float32Array
    """(X, Y, Z, 6) of the orientation field, in the order xx yy zz xy xz yz."""
    growth: Float32Array
    """(X, Y, Z, 1) potential that rises from root to tip."""
    inside: BoolArray
    """(X, Y, Z) cells where hair may be."""
    skin: Float32Array
    """(X, Y, Z, 1) smoothed occupancy of the hull, 0 to 1."""
    head_distance: Float32Array
    """(X, Y, Z, 1) signed distance to the head, metres, inside < 0."""


class Rules(NamedTuple):
    """The options in the units of the walk."""

    step: float
    """Metres."""
    min_cosine: float
    """Of a turn in one step, below which the step is uncertain."""
    max_score: int
    """Uncertain steps in a row that end a strand."""
    blind_steps: int
    """Steps from the root that are never uncertain."""
    inertia: float
    """Share of the previous direction in the next one."""
    slide_sine: float
    """Of the angle to the hull's surface, below which a strand slides along it; 0 for never."""
    slide_length: float
    """Metres from the root on which strands may slide."""
    clearance: float
    """Distance kept from the head, metres."""


@compiled
def track_strands(
    first: int,
    last: int,
    volumes: Volumes,
    rules: Rules,
    starts: Float64Array,
    directions: Float64Array,
    points: Float32Array,
    counts: Int64Array,
) -> None:
    """Write strands `first` to `last` into points (N, M, 3), and their numbers of points (N,).

    `starts` and `directions` are (N, 3) roots and unit first directions.
    """
    for s in range(first, last):
        counts[s] = track_strand(volumes, rules, starts[s], directions[s], points[s])


@compiled
def track_strand(
    volumes: Volumes,
    rules: Rules,
    start: Float64Array,
    direction: Float64Array,
    points: Float32Array,
) -> int:
    """Write one strand into points (M, 3); return its number of points up to the last certain."""
    p, d, found = start.copy(), direction.copy(), np.empty(3)
    points[0] = p
    points[1] = p + rules.step * d
    count, score = 1, rules.max_score
    for i in range(1, len(points)):
        if not in_grid(volumes, p):
            break
        blind = i <= rules.blind_steps
        cosine = field_direction(volumes, rules.step, p, d, found)
        certain = blind or (cosine >= rules.min_cosine and in_hair(volumes, p))
        if cosine >= rules.min_cosine or (blind and cosine > UNKNOWN):
            keep = rules.inertia if i > ROOT_STEPS else max(rules.inertia, ROOT_INERTIA)
            for axis in range(3):
                d[axis] = keep * d[axis] + (1 - keep) * found[axis]
        if rules.slide_sine > 0 and i * rules.step < rules.slide_length:
            bend_along_hull(volumes, rules.slide_sine, p, d)
        if not make_unit(d):
            break
        for axis in range(3):
            p[axis] += rules.step * d[axis]
        if not push_out_of_head(volumes, rules.clearance, p, d):
            break
        points[i] = p
        if certain:
            score = rules.max_score
            count = i + 1
        else:
            score -= 1
            if score <= 0:
                break
    return max(count, 2)


@compiled
def field_direction(
    volumes: Volumes, step: float, p: Float64Array, d: Float64Array, found: Float64Array
) -> float:
    """Write the field's direction half a step on (midpoint rule) into found (3,), signed along d.

    Return its cosine with d: negative where the growth potential reversed it, `UNKNOWN` where the
    field is unknown.
    """
    tensor, middle = np.empty(6), np.empty(3)
    sample_at(volumes.origin, volumes.spacing, volumes.tensors, p, tensor)
    if not principal_direction(tensor, d, found):
        return UNKNOWN
    for axis in range(3):
        middle[axis] = p[axis] + 0.5 * step * found[axis]
    sample_at(volumes.origin, volumes.spacing, volumes.tensors, middle, tensor)
    if not principal_direction(tensor, found, found):
        return UNKNOWN
    cosine = float(found[0] * d[0] + found[1] * d[1] + found[2] * d[2])
    if cosine < 0:
        found[:] = -found
        cosine = -cosine
    if cosine < ACROSS:
        gradient_at(volumes.origin, volumes.spacing, volumes.growth, p, middle)
        if found[0] * middle[0] + found[1] * middle[1] + found[2] * middle[2] < 0:
            found[:] = -found
            cosine = -cosine
    return cosine


@compiled
def bend_along_hull(volumes: Volumes, slide_sine: float, p: Float64Array, d: Float64Array) -> None:
    """Bend d along the hull's surface if it leaves the hull within a cell at a small angle."""
    ahead, normal, inside = np.empty(3), np.empty(3), np.empty(1)
    for axis in range(3):
        ahead[axis] = p[axis] + volumes.spacing * d[axis]
    sample_at(volumes.origin, volumes.spacing, volumes.skin, ahead, inside)
    if inside[0] >= SKIN_LEVEL:
        return
    gradient_at(volumes.origin, volumes.spacing, volumes.skin, p, normal)
    sine = -(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2])
    if sine < slide_sine:
        pull = max(sine, 0.0) + SKIN_LEVEL - inside[0]
        for axis in range(3):
            d[axis] += pull * normal[axis]


@compiled
def push_out_of_head(volumes: Volumes, clearance: float, p: Float64Array, d: Float64Array) -> bool:
    """Move p to the clearance from the head and remove d's inward part; False if d vanishes."""
    distance, normal = np.empty(1), np.empty(3)
    sample_at(volumes.origin, volumes.spacing, volumes.head_distance, p, distance)
    if distance[0] >= clearance:
        return True
    gradient_at(volumes.origin, volumes.spacing, volumes.head_distance, p, normal)
    inward = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]
    for axis in range(3):
        p[axis] += (clearance - distance[0]) * normal[axis]
        if inward < 0:
            d[axis] -= inward * normal[axis]
    return bool(make_unit(d))


@compiled
def in_grid(volumes: Volumes, p: Float64Array) -> bool:
    """Return whether p (3,) lies in a cell of the grid."""
    for axis in range(3):
        cell = int(np.floor((p[axis] - volumes.origin[axis]) / volumes.spacing))
        if cell < 0 or cell >= volumes.inside.shape[axis]:
            return False
    return True


@compiled
def in_hair(volumes: Volumes, p: Float64Array) -> bool:
    """Return whether hair may be at p (3,), which lies in the grid."""
    x = int((p[0] - volumes.origin[0]) / volumes.spacing)
    y = int((p[1] - volumes.origin[1]) / volumes.spacing)
    z = int((p[2] - volumes.origin[2]) / volumes.spacing)
    return bool(volumes.inside[x, y, z])
