"""Brushes: strands combed, cut, curled, thinned and planted by strokes over them.

Comb, part, puff, smooth and curl change directions alone, so that lengths stay; cut, trim and
lengthen change lengths alone; `hairkit.grooming.density` adds and removes strands; roots stay in
all. As in other grooming tools a stroke acts in a ball about the brush, most in its middle.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.grooming.brushed_hair import Hair, Stroke, falloff, strokes_of
from hairkit.grooming.density import add, thin
from hairkit.options import unknown_name
from hairkit.types.edits import Edit, Edits
from hairkit.types.groom import Groom

SHORTEST = 0.002
"""Least length of what is left of a strand that is cut, metres."""
RISE = 0.03
"""Metres from the root after which a strand follows a parting or a puff wholly."""
OVER = 16.0
"""Reach of a parting by which hair that lies across it is laid over: wholly within 0.87 radii. With
2 or 4 a moved parting leaves strands across the face, halfway between both sides."""
GOLDEN = (np.sqrt(5) - 1) / 2
"""Turns between the curls of one strand and the next, which so begin anywhere."""
NEIGHBOURS = 8
"""Strands whose mean smoothing draws to."""
_log = logging.getLogger(__name__)


def comb(hair: Hair, strokes: list[Stroke]) -> None:
    """Pull hair along the way of the brush; `amount` is the share of its way."""
    for k in range(max(len(stroke.path) for stroke in strokes) - 1):
        shift = np.zeros_like(hair.points)
        for stroke in strokes:
            at, way = stroke.path[k], stroke.path[k + 1] - stroke.path[k]
            away = np.linalg.norm(hair.points - at, axis=2) / stroke.radius
            shift += stroke.amount * falloff(away)[..., None] * way
        hair.move(shift)


def part(hair: Hair, strokes: list[Stroke]) -> None:
    """Part hair along a line that is drawn on the scalp: what lies across it is laid over to its
    own side, and all goes aside by `amount` metres more."""
    roots = hair.points[:, 0]
    shift = np.zeros_like(hair.points)
    for stroke in strokes:
        weight, near = stroke.reach(roots)
        if len(stroke.path) > 1:
            line = np.gradient(stroke.path, axis=0)[near]
            side = np.cross(line, hair.outwards(roots))
            side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
            side *= np.sign(((roots - stroke.path[near]) * side).sum(axis=1))[:, None]
            aside = ((hair.points - roots[:, None]) * side[:, None]).sum(axis=2, keepdims=True)
            over = np.minimum(OVER * weight, 1)[:, None, None] * (np.abs(aside) - aside)
            more = _rise(hair) * (stroke.amount * weight)[:, None, None]
            shift += (over + more) * side[:, None]
    hair.move(shift)


def puff(hair: Hair, strokes: list[Stroke]) -> None:
    """Lift hair off the head by `amount` metres."""
    weight = sum(stroke.amount * stroke.reach(hair.points)[0] for stroke in strokes)
    out = hair.outwards(hair.points[:, 0])[:, None]
    hair.move(_rise(hair) * np.asarray(weight)[..., None] * out)


def smooth(hair: Hair, strokes: list[Stroke]) -> None:
    """Draw strands to the mean shape of those around them; `amount` is the share of the way."""
    others = hair.others(strokes[0].group)
    count = min(NEIGHBOURS, len(others.points))
    near = cKDTree(others.points[:, 0]).query(hair.points[:, 0], count)[1].reshape(-1, count)
    shape = others.points - others.points[:, :1]
    shape /= np.maximum(others.arcs[:, -1:, None], 1e-9)
    mean = shape[near].mean(axis=1) * hair.arcs[:, -1:, None] + hair.points[:, :1]
    weight = sum(stroke.amount * stroke.reach(hair.points)[0] for stroke in strokes)
    hair.move(np.clip(weight, 0, 1)[..., None] * (mean - hair.points))


def curl(hair: Hair, strokes: list[Stroke]) -> None:
    """Wind strands to helices of radius `amount` metres; a turn takes `pitch` of the axis."""
    weight = sum(stroke.amount * stroke.reach(hair.points)[0] for stroke in strokes)
    way = np.gradient(hair.points, axis=1)
    way /= np.maximum(np.linalg.norm(way, axis=2, keepdims=True), 1e-12)
    across = np.cross(way, hair.outwards(hair.points[:, 0])[:, None])
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-9)
    turn = 2 * np.pi / np.hypot(strokes[0].pitch, 2 * np.pi * strokes[0].amount)
    begin = 2 * np.pi * np.modf(GOLDEN * np.arange(len(hair.points)))[0]
    angle = turn * hair.arcs + begin[:, None]
    winding = np.cos(angle)[..., None] * across + np.sin(angle)[..., None] * np.cross(way, across)
    hair.move(_rise(hair) * np.asarray(weight)[..., None] * winding)


def cut(hair: Hair, strokes: list[Stroke]) -> None:
    """Cut strands where the brush first meets them; what is beyond falls away."""
    arcs = hair.arcs
    inside = np.any([stroke.reach(hair.points)[0] > 0 for stroke in strokes], axis=0)
    last = np.where(inside[:, 1:], arcs[:, :-1], np.inf).min(axis=1)  # outside of the ball
    hair.scale(np.clip(np.maximum(last, SHORTEST) / np.maximum(arcs[:, -1], 1e-12), 0, 1))


def trim(hair: Hair, strokes: list[Stroke]) -> None:
    """Cut strands that the brush touches to a length of `amount` metres."""
    length, most = hair.arcs[:, -1], max(strokes[0].amount, SHORTEST)
    shorter = np.minimum(most / np.maximum(length, 1e-12), 1.0)
    hair.scale(np.where(_touched(hair.points, strokes) > 0, shorter, 1.0))


def lengthen(hair: Hair, strokes: list[Stroke]) -> None:
    """Make strands that the brush touches longer by `amount` metres."""
    longer = strokes[0].amount * _touched(hair.points, strokes)
    hair.scale(1 + longer / np.maximum(hair.arcs[:, -1], 1e-12))


def dye(hair: Hair, strokes: list[Stroke]) -> None:
    """Give hair the colour of the stroke, in the mixture of light; `amount` is its share."""
    for stroke in strokes:
        share = np.clip(stroke.amount * stroke.reach(hair.points)[0], 0, 1)[..., None]
        hair.colours = (hair.colours + share * (stroke.colour - hair.colours)).astype(np.float32)
    hair.dyed = True


class Kind(NamedTuple):
    """A brush: a function that does a stroke and, where it is mirrored, the other one, both to the
    hair as it was before; its usual amount; and whether its path is drawn on the skin below it,
    since it acts about the roots."""

    apply: Callable[[Hair, list[Stroke]], None]
    amount: float
    on_skin: bool = False


BRUSHES = {
    "comb": Kind(comb, 1.0), "part": Kind(part, 0.03, True), "puff": Kind(puff, 0.01),
    "smooth": Kind(smooth, 0.5), "curl": Kind(curl, 0.006), "cut": Kind(cut, 0.0),
    "trim": Kind(trim, 0.03), "lengthen": Kind(lengthen, 0.02),
    "add": Kind(add, 1.0, True), "thin": Kind(thin, 0.5, True), "dye": Kind(dye, 1.0),
}  # fmt: skip
"""Brushes by name."""


def edit_groom(groom: Groom, edits: Edits, brushes: Mapping[str, Kind] = BRUSHES) -> Groom:
    """Return a groom after strokes; those that reach no hair are named in the log."""
    if not edits:
        return groom
    hair = Hair.of(groom)
    for number, edit in enumerate(edits.strokes, start=1):
        if not brush_hair(hair, edit, brushes):
            _log.warning("stroke %d (%s) reaches no hair; it is kept", number, edit.setting.brush)
    return hair.onto(groom)


def brush_hair(hair: Hair, edit: Edit, brushes: Mapping[str, Kind] = BRUSHES) -> bool:
    """Do a stroke on hair; return whether it reached any.

    Raises `InputError` for a brush that there is not.
    """
    setting = edit.setting
    if setting.brush not in brushes:
        raise InputError(unknown_name("brush", setting.brush, brushes))
    kind = brushes[setting.brush]
    strokes = strokes_of(edit, kind.amount)
    if kind.on_skin:
        strokes = [each._replace(path=hair.room.on_skin(each.path)) for each in strokes]
    near = np.any([stroke.near(hair.points).any(axis=1) for stroke in strokes], axis=0)
    index = np.flatnonzero(near & hair.in_group(setting.group))
    index = index[_touched(hair.points[index], strokes) > 0]
    some = hair.take(index)
    kind.apply(some, strokes)
    some.outside()
    hair.put(index, some)
    return len(some.points) > 0


def _touched(points: Float64Array, strokes: list[Stroke]) -> Float64Array:
    """Return how much (S,) strokes reach of strands (S, M, 3), at the most."""
    return np.asarray(np.max([each.reach(points)[0].max(axis=1) for each in strokes], axis=0))


def _rise(hair: Hair) -> Float64Array:
    """Return (S, M, 1) how much of a shift points take: none at the root."""
    return np.clip(hair.arcs / RISE, 0, 1)[..., None]
