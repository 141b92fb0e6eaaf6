"""The helix arc through two points with given tangents.

Two tangents t0, t1 at points p0, p1 are joined by a helix arc only if <p1 - p0, t1 - t0> = 0: they
are *co-helical* (Derouet-Jourdan, Bertails-Descoubes and Thollot, "Floating tangents for
approximating spatial curves with G1 piecewise helices", 2013). With m along t0 + t1, e along
t1 - t0 and b = m x e, a helix's chord lies in the plane of m and b, and so does its axis. One
scalar equation turns the axis until the chord has its direction; the root is unique for turns below
one whole turn.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float64Array
from hairkit.helices.arc_length import dot, unit

COINCIDENT = 1e-12
"""Tangents closer than this, radians, count as equal: a straight arc if the chord is parallel."""
_STEPS = 64
_SMALL = 1e-9


def helix_through(
    p0: npt.ArrayLike, t0: npt.ArrayLike, p1: npt.ArrayLike, t1: npt.ArrayLike
) -> tuple[Float64Array, Float64Array]:
    """Return Darboux vectors (..., 3) and lengths (...) of the arcs through co-helical pairs.

    Parameters
    ----------
    p0, p1
        (..., 3) first and last points, metres.
    t0, t1
        (..., 3) unit tangents there. What the chord has along t1 - t0 is ignored: release the
        points first (`hairkit.helices.floating_tangents`).

    Returns
    -------
    darboux, length
        Radians per metre, in the frame of the points, and metres. Arcs turn less than once.
    """
    start, end = np.asarray(t0, np.float64), np.asarray(t1, np.float64)
    chord = np.asarray(p1, np.float64) - np.asarray(p0, np.float64)
    middle, across, half_cosine, half_sine = _basis(start, end, chord)
    along, aside = dot(chord, middle), dot(chord, across)
    beta = _axis_angle(half_cosine, half_sine, np.arctan2(np.abs(aside), along))
    side = np.where(aside < 0, -1.0, 1.0)
    axis = np.sin(beta)[..., None] * middle - (side * np.cos(beta))[..., None] * across
    half_turn, x, y = _chord(half_cosine, half_sine, np.sin(beta), np.cos(beta))
    length = np.hypot(along, aside) / np.hypot(x, y)
    rate = 2 * half_turn / np.where(length > 0, length, 1.0)
    bent = (half_sine > COINCIDENT) | (np.abs(aside) > COINCIDENT * np.abs(along))
    sign = _turning_sign(axis, start, end, half_turn, bent & (half_sine > COINCIDENT))
    darboux = np.where(bent, rate * sign, 0.0)[..., None] * axis
    return darboux, np.where(bent, length, np.hypot(along, aside))


def _basis(
    start: Float64Array, end: Float64Array, chord: Float64Array
) -> tuple[Float64Array, Float64Array, Float64Array, Float64Array]:
    """Return m, b and the cosine and sine of half the angle between the tangents."""
    total, change = start + end, end - start
    half_cosine = np.sqrt(dot(total, total)) / 2
    half_sine = np.sqrt(dot(change, change)) / 2
    scale = np.hypot(half_cosine, half_sine)
    middle = np.where(half_cosine[..., None] > COINCIDENT, total, chord)
    middle = unit(middle)
    # equal tangents have no e: any axis in the plane of tangent and chord will do
    free = chord - dot(chord, middle)[..., None] * middle
    across = np.where(half_sine[..., None] > COINCIDENT, np.cross(middle, change), free)
    return middle, unit(across), half_cosine / scale, half_sine / scale


def _chord(
    c: Float64Array, s: Float64Array, sine: Float64Array, cosine: Float64Array
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return half the turn, and the chord per length along m and aside of it.

    The axis stands at `sine` to m; its `cosine` is signed: negative for more than half a turn.
    """
    half_turn = np.arctan2(s, c * cosine)
    arc = s / np.where(half_turn > 0, half_turn, 1.0)
    arc = np.where(half_turn > 0, arc, c * cosine)
    return half_turn, c * sine**2 + arc * cosine, sine * (arc - c * cosine)


def _axis_angle(c: Float64Array, s: Float64Array, target: Float64Array) -> Float64Array:
    """Return beta in [0, pi] at which the chord stands at `target` to m; it grows with beta.

    Newton's method, kept between bounds; a pair is done after its first small step.
    """
    shape = np.broadcast_shapes(c.shape, target.shape)
    c, s, target = (np.broadcast_to(v, shape).ravel() for v in (c, s, target))
    result = np.clip(target, 0.0, np.pi)
    low, high = np.zeros_like(result), np.full_like(result, np.pi)
    left = np.arange(len(result))
    for _ in range(_STEPS):
        beta = result[left]
        miss, slope = _miss(c[left], s[left], beta, target[left])
        low[left] = np.where(miss < 0, beta, low[left])
        high[left] = np.where(miss < 0, high[left], beta)
        wanted = beta - miss / np.where(slope > 0, slope, np.inf)
        inside = (slope > 0) & (wanted >= low[left]) & (wanted <= high[left])
        result[left] = np.where(inside, wanted, (low[left] + high[left]) / 2)
        left = left[np.abs(result[left] - beta) > _SMALL]
        if not len(left):
            break
    return result.reshape(shape)


def _miss(
    c: Float64Array, s: Float64Array, beta: Float64Array, target: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Return the sine of the chord's angle beyond the target, times the chord, and its slope."""
    sine, cosine = np.sin(beta), np.cos(beta)
    half_turn, x, y = _chord(c, s, sine, cosine)
    h = np.where(half_turn > 0, half_turn, 1.0)
    turn_slope = s * c * sine / np.maximum(s**2 + (c * cosine) ** 2, 1e-300)
    arc, arc_slope = s / h, -s / h**2 * turn_slope
    x_slope = 2 * c * sine * cosine + arc_slope * cosine - arc * sine
    y_slope = cosine * (arc - c * cosine) + sine * (arc_slope + c * sine)
    goal_x, goal_y = np.cos(target), np.sin(target)
    return y * goal_x - x * goal_y, y_slope * goal_x - x_slope * goal_y


def _turning_sign(
    axis: Float64Array,
    start: Float64Array,
    end: Float64Array,
    half_turn: Float64Array,
    known: BoolArray,
) -> Float64Array:
    """Return +1 or -1: the sense about the axis that turns the first tangent into the last."""
    sense = dot(np.cross(start, end), axis) * np.where(half_turn < np.pi / 2, 1.0, -1.0)
    return np.where(known & (sense < 0), -1.0, 1.0)
