"""Kernels of contact: penetration, Coulomb friction, then the lengths of what has moved."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.simulation.obstacle_kernels import distance_at

from .kernel_elastic import solve_tridiagonal
from .kernel_math import (
    HALF,
    ONE,
    ZERO,
    Vector,
    dot,
    inlined,
    larger,
    minus,
    moved,
    one,
    plus,
    put,
    put_one,
    rows_of,
    smaller,
    stage,
    three,
    times,
)
from .reference import SOFTEST as SOFTEST64
from .simd import LANES, root

FAR = 1.0
"""Metres up to which distances are exact: bounds would be looked up again sooner."""
FURTHER = np.float32(1.05)
"""Safety factor on the distance that a node has moved since its last lookup."""
SOFTEST, STILL = np.float32(SOFTEST64), np.float32(1e-12)
HEAD = ((ONE, ZERO, ZERO, ZERO), (ZERO, ONE, ZERO, ZERO), (ZERO, ZERO, ONE, ZERO))


@stage
def resolve_contacts(x: Any, rod: Any, step: Any, fields: Any, settings: Any) -> None:
    """Push nodes out of the obstacles, with friction, and restore the lengths."""
    touching, h, with_torso = False, settings.seconds, fields.torso.distance.shape[0] > 0
    drift, pose, beside = rows_of(step.drift), rows_of(step.torso), rows_of(step.torso_drift)
    for j in range(1, len(x)):
        node, clear = x[j], rod[j].clear
        put(node.normal, (ZERO, ZERO, ZERO))
        put_one(node.depth, ZERO)
        put_one(node.grip, ZERO)
        place = three(node.place)
        way = times(h, minus(three(node.speed), times(HALF * h, three(node.gain))))
        by = minus(way, times(h, moved(drift, place)))
        near = approach(node, node.slack, by, fields.head, HEAD, drift, clear)
        if with_torso:
            by = minus(way, times(h, moved(beside, place)))
            near |= approach(node, node.aside, by, fields.torso, pose, beside, clear)
        if near:
            push_out(node, settings)
            touching = True
    restore_lengths(x, rod, settings)
    # without contact, one more iteration is enough
    for _ in range(settings.rounds if touching else min(settings.rounds, 1)):
        if touching:
            apply_friction(x, h)
        restore_lengths(x, rod, settings)


@inlined
def approach(
    node: Any, slack: Any, way: Vector, field: Any, pose: Any, drift: Any, clear: Any
) -> bool:
    """Look up a body for nodes whose slack is used up on their way; return if one touches it.

    `pose` brings head axes to the body's; `drift` is the velocity of a point that rides on it.
    """
    put_one(slack, one(slack) - FURTHER * root(dot(way, way)))
    found = False
    for w in range(LANES):
        if slack[w] < ZERO:
            at = (node.place[0, w], node.place[1, w], node.place[2, w])
            x, y, z = moved(pose, at)
            distance, a, b, c = distance_at(field, x, y, z, FAR)
            slack[w] = distance - clear[w]
            if -slack[w] > node.depth[w]:
                found, node.depth[w] = True, -slack[w]
                surface, n = node.surface, node.normal
                surface[0, w], surface[1, w], surface[2, w] = moved(drift, at)
                n[0, w] = pose[0][0] * a + pose[1][0] * b + pose[2][0] * c
                n[1, w] = pose[0][1] * a + pose[1][1] * b + pose[2][1] * c
                n[2, w] = pose[0][2] * a + pose[1][2] * b + pose[2][2] * c
    return found


@inlined
def push_out(node: Any, settings: Any) -> None:
    """Push nodes out of the obstacles, with friction; nothing happens where normals are 0."""
    h, normal = settings.seconds, three(node.normal)
    relative = minus(three(node.speed), three(node.surface))
    across = dot(relative, normal)
    inward = larger(ZERO - across, ZERO)
    # depth of this substep is removed at once, older depth at a limited speed
    depth = smaller(one(node.depth), h * (inward + settings.fastest))
    slide = minus(relative, times(across, normal))
    brake, grip = braked(slide, settings.friction * inward)
    put_one(node.grip, grip)
    put(node.speed, plus(three(node.speed), minus(times(inward, normal), brake)))
    out = minus(times(depth, normal), times(HALF * h, brake))
    put(node.place, plus(three(node.place), out))


@inlined
def braked(slide: Vector, grip: Any) -> tuple[Vector, Any]:
    """Return what friction takes of a speed along the obstacle, and what is left of the grip."""
    size = root(dot(slide, slide)) + STILL
    slowed = smaller(larger(grip, ZERO), size)
    return times(slowed / size, slide), grip - slowed


@stage
def apply_friction(x: Any, h: Any) -> None:
    """Let nodes that touch rub once more, by what the strands' own tension adds to their grip."""
    for j in range(1, len(x)):
        speed, normal = three(x[j].speed), three(x[j].normal)
        relative = minus(speed, three(x[j].surface))
        along = minus(relative, times(dot(relative, normal), normal))
        brake, grip = braked(along, one(x[j].grip))
        put_one(x[j].grip, grip)
        put(x[j].speed, minus(speed, brake))
        put(x[j].place, minus(three(x[j].place), times(HALF * h, brake)))


@stage
def restore_lengths(x: Any, rod: Any, settings: Any) -> None:
    """Restore the lengths; a touching node moves only along the obstacle, and is pressed on it."""
    place, normal, ease = three(x[0].place), times(ZERO, three(x[1].normal)), one(rod[0].ease)
    end = still = normal
    for j in range(1, len(x)):
        here, own, wall = three(x[j].place), one(rod[j].ease), three(x[j].normal)
        edge = minus(here, place)
        square = dot(edge, edge)
        size = ONE / root(square)
        way = times(size, edge)
        put_one(x[j].beside, ZERO - dot(end, way))
        start, end = _mobility(ease, way, normal), _mobility(own, way, wall)
        put_one(x[j].pivot, dot(way, plus(start, end)) + SOFTEST * (ease + own))
        put_one(x[j].value, square * size - one(rod[j].length))
        put(x[j].way, way)
        place, normal, ease = here, wall, own
    solve_tridiagonal(x)
    over, after = ONE / settings.seconds, still
    for j in range(len(x) - 1, 0, -1):
        own = times(one(x[j].value), three(x[j].way))
        pull, normal, ease = minus(after, own), three(x[j].normal), one(rod[j].ease)
        away, after = dot(pull, normal), own
        change = times(ease, minus(pull, times(away, normal)))
        put(x[j].place, plus(three(x[j].place), change))
        put(x[j].speed, plus(three(x[j].speed), times(over, change)))
        put_one(x[j].grip, one(x[j].grip) - settings.friction * over * ease * away)


@inlined
def _mobility(ease: Any, way: Vector, normal: Vector) -> Vector:
    """Return the displacement of an end node by a unit pull of its segment."""
    return times(ease, minus(way, times(dot(way, normal), normal)))
