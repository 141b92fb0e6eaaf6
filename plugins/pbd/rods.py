"""Discrete Cosserat rods: the model, its rest state, and inverse statics.

A rod has n nodes and n - 1 segments; each segment carries a frame (a quaternion) whose third axis
is its direction (Kugelstadt and Schoemer 2016; parallel transport in time after Bergou et al.
2010). Element i joins segments i - 1 and i; element 0 joins the root frame, which the head holds at
half a segment's distance, to segment 0. With unit directions d, natural turns c and twists t, the
energy is

    sum_i bend_i / 2 |(d_i - d_{i-1}) - c_i|^2 + twist_i / 2 (t_i - rest_i)^2,

bend = EI / l and twist = GJ / l in N m: quadratic in the node positions, since segments keep their
length, so that one banded matrix serves all three coordinates at all times.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.simulation import quaternion

SHARPEST = 0.3
"""Lower bound of 1 + cosine of a turn, which limits the twist coupling beyond 134 degrees."""
TINY = 1e-30
"""Added to what divides."""
_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Rods:
    """S rods of n nodes each, at rest; metres, kilograms, newtons, head frame."""

    points: Float64Array
    """(S, n, 3) nodes at rest."""
    mass: Float64Array
    """(S, n) mass of the nodes."""
    bars: Float64Array
    """(S, n - 1) mass of the segments, which are rigid bars; 0 where the mass is beads at the
    nodes."""
    length: Float64Array
    """(S, n - 1) length of the segments."""
    bend: Float64Array
    """(S, n - 1) bending stiffness of the elements, EI / l; element 0 at 0 is a hinge."""
    twist: Float64Array
    """(S, n - 1) torsional stiffness of the elements, GJ / l."""
    root_frame: Float64Array
    """(S, 4) frame that the head holds."""
    frames: Float64Array
    """(S, n - 1, 4) frames of the segments at rest."""
    curvature: Float64Array
    """(S, n - 1, 3) natural turn c of each element, in its midpoint frame."""
    natural_twist: Float64Array
    """(S, n - 1) natural twist of each element, radians."""

    @property
    def nodes(self) -> int:
        """Nodes of every rod."""
        return int(self.points.shape[1])

    def inertia(self) -> Float64Array:
        """Return (S, n, n) the mass matrix: a rigid bar has thirds and sixths of its mass."""
        at = np.arange(self.nodes)
        matrix = np.zeros((len(self.mass), self.nodes, self.nodes))
        matrix[:, at, at] = self.mass
        for ends in ((at[:-1], at[1:]), (at[1:], at[:-1])):
            matrix[:, ends[0], ends[0]] -= self.bars / 6
            matrix[:, ends[0], ends[1]] += self.bars / 6
        return matrix

    def before(self, frames: Float64Array) -> Float64Array:
        """Return (S, n - 1, 4) the frame before each element: the root's, then the segments'."""
        return np.concatenate([self.root_frame[:, None], frames[:, :-1]], axis=1)


def make_rods(
    points: npt.ArrayLike,
    density: npt.ArrayLike,
    bending: npt.ArrayLike,
    torsion: npt.ArrayLike | None = None,
    *,
    root_direction: npt.ArrayLike | None = None,
    straight: bool = False,
) -> Rods:
    """Return unloaded rods with nodes at `points`.

    Parameters
    ----------
    points
        (S, n, 3) metres, root first.
    density
        Mass per length, kg/m: a number or (S, n - 1) of the segments.
    bending, torsion
        EI and GJ, N m^2: numbers or (S, n - 1) of the elements; GJ is EI / 1.3 where None (a round
        fibre of Poisson's ratio 0.3).
    root_direction
        (3,) or (S, 3) direction that the root holds; None: that of the first segment.
    straight
        True: the natural shape is straight; False: it is `points`.
    """
    nodes = np.array(points, np.float64)
    edge = np.diff(nodes, axis=1)
    length = np.linalg.norm(edge, axis=-1)
    if nodes.ndim != 3 or nodes.shape[1] < 3 or not (length > 0).all():
        raise InputError(
            f"rods need (S, n, 3) points, n >= 3, no two neighbours equal; got {nodes.shape}"
        )
    segments = np.broadcast_to(np.asarray(density, np.float64), length.shape) * length
    mass = np.zeros(nodes.shape[:2])
    mass[:, :-1] += segments / 2
    mass[:, 1:] += segments / 2
    # an element's length: from middle to middle, the first from the root to its middle
    span = length / 2
    span[:, 1:] += length[:, :-1] / 2
    ei = np.broadcast_to(np.asarray(bending, np.float64), length.shape)
    gj = ei / 1.3 if torsion is None else np.broadcast_to(torsion, length.shape)
    direction = edge / length[..., None]
    held = direction[:, 0] if root_direction is None else np.asarray(root_direction, np.float64)
    frames = parallel_frames(
        np.broadcast_to(quaternion.normalize(held), direction[:, 0].shape), direction
    )
    rods = Rods(
        nodes, mass, segments, length, ei / span, gj / span, frames[:, 0], frames[:, 1:],
        np.zeros_like(nodes[:, 1:]), np.zeros_like(length),
    )  # fmt: skip
    return rods if straight else _with_moments(rods, np.zeros_like(direction), 0 * length)


def parallel_frames(held: Float64Array, direction: Float64Array) -> Float64Array:
    """Return twist-free frames (S, n, 4) of the root and the segments (Bishop 1975)."""
    first = np.broadcast_to([0.0, 0.0, 1.0], held.shape)
    frames = [quaternion.shortest_arc(first, held)]
    before = held
    for j in range(direction.shape[1]):
        turn = quaternion.shortest_arc(before, direction[:, j])
        frames.append(quaternion.normalize(quaternion.product(turn, frames[-1])))
        before = direction[:, j]
    return np.stack(frames, axis=1)


def clamp_roots(rods: Rods, force: Float64Array) -> Rods:
    """Return rods whose first elements are as stiff as a clamp is under the load (S, n, 3).

    A clamped beam of bending stiffness B under a tension T leaves the clamp's direction over the
    length sqrt(B / T), which is not longer than a segment of hair. Its small turns beyond elements
    of B / l fall as r^j with r + 1 / r - 2 = T l^2 / B; they sum up to that length where the first
    element has (1 + 1 / sqrt(r)) B / l, which is 2 B / l without tension.
    """
    pull = (force[:, 1:].sum(axis=1) * quaternion.third_axis(rods.frames[:, 0])).sum(axis=-1)
    soft = np.maximum(0.5 * rods.bend[:, 0] * rods.length[:, 0], TINY)
    ratio = np.sqrt(np.maximum(pull, 0.0) / soft) * rods.length[:, 0]
    bend = rods.bend.copy()
    bend[:, 0] *= 0.5 * (1 + np.exp(np.arcsinh(0.5 * ratio)))
    return replace(rods, bend=bend)


def balance_load(rods: Rods, force: npt.ArrayLike) -> Rods:
    """Return rods in equilibrium at their present shape under node forces (S, n, 3), newtons.

    Inverse statics: from the tip to the root, each element's moment balances the load beyond it;
    the natural shape gives this moment at the present shape. Tension carries the load along the
    rod, so that moments are perpendicular to it.
    """
    weight = np.broadcast_to(np.asarray(force, np.float64), rods.points.shape)
    beyond = np.cumsum(weight[:, ::-1], axis=1)[:, ::-1][:, 1:]
    load = rods.length[..., None] * beyond
    before = rods.before(rods.frames)
    direction = quaternion.third_axis(rods.frames)
    turn = direction - quaternion.third_axis(before)
    middle = quaternion.third_axis(before) + direction
    along = (direction * middle).sum(axis=-1, keepdims=True)
    along = np.where(along > 1e-9, along, np.inf)  # a fold straight back has no middle
    binormal = half_binormal(before, rods.frames)
    moment, torque = np.zeros_like(direction), np.zeros_like(rods.length)
    for _ in range(_ROUNDS * rods.nodes):
        first, second = split_torque(before, rods.frames, np.cross(turn, moment))
        turning = second + next_element(first)
        twisting = torque[..., None] * binormal
        total = load + np.cross(turning, direction) - twisting - next_element(twisting)
        new = total
        for j in range(direction.shape[1] - 1, -1, -1):
            if j + 1 < direction.shape[1]:
                new[:, j] += new[:, j + 1]
            pull = (new[:, j] * middle[:, j]).sum(axis=-1, keepdims=True) / along[:, j]
            new[:, j] -= pull * direction[:, j]
        torsion = np.cumsum((direction * turning).sum(axis=-1)[:, ::-1], axis=1)[:, ::-1]
        change = np.abs(new - moment).max(initial=0.0) + np.abs(torsion - torque).max(initial=0.0)
        moment, torque = new, torsion
        if change <= 1e-15 * np.abs(moment).max(initial=0.0):
            break
    return _with_moments(rods, moment, torque)


def _with_moments(rods: Rods, moment: Float64Array, torque: Float64Array) -> Rods:
    """Return rods whose elements have these moments at the present shape."""
    direction = quaternion.third_axis(rods.frames)
    before = rods.before(rods.frames)
    turn = direction - quaternion.third_axis(before)
    soft = np.where(rods.bend > 0, rods.bend, np.inf)[..., None]
    natural = turn - moment / soft
    middle = midpoint_frame(before, rods.frames)
    twisting = np.where(rods.twist > 0, rods.twist, np.inf)
    return replace(
        rods,
        curvature=quaternion.rotate(quaternion.inverse(middle), natural),
        natural_twist=twist_between(before, rods.frames) - torque / twisting,
    )


def transport_frames(frames: Float64Array, direction: Float64Array) -> Float64Array:
    """Return frames parallel-transported in time to new directions."""
    turn = quaternion.shortest_arc(quaternion.third_axis(frames), direction)
    return quaternion.normalize(quaternion.product(turn, frames))


def elements(
    rods: Rods, frames: Float64Array, way: Float64Array
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return the elements' turns and natural turns (S, n - 1, 3), and torques (S, n - 1).

    The turns are those between the segments `way` (S, n - 1, 3), over their lengths.
    """
    before, held = rods.before(frames), quaternion.third_axis(rods.root_frame)[:, None]
    turn = way - np.concatenate([held, way[:, :-1]], axis=1)
    natural = quaternion.rotate(midpoint_frame(before, frames), rods.curvature)
    return turn, natural, rods.twist * (twist_between(before, frames) - rods.natural_twist)


def midpoint_frame(before: Float64Array, after: Float64Array) -> Float64Array:
    """Return the midpoint frames of neighbours."""
    sign = np.where((before * after).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return quaternion.normalize(before + sign * after)


def twist_between(before: Float64Array, after: Float64Array) -> Float64Array:
    """Return the twist about their direction between neighbouring frames, radians."""
    step = quaternion.product(quaternion.inverse(before), after)
    sign = np.where(step[..., 0] < 0, -1.0, 1.0)
    result: Float64Array = 2.0 * np.arctan2(sign * step[..., 3], sign * step[..., 0])
    return result


def half_binormal(before: Float64Array, after: Float64Array) -> Float64Array:
    """Return a x b / (1 + a.b) of directions a, b: the gradient of twist with respect to either."""
    first, second = quaternion.third_axis(before), quaternion.third_axis(after)
    cosine = (first * second).sum(axis=-1, keepdims=True)
    result: Float64Array = np.cross(first, second) / np.maximum(1.0 + cosine, SHARPEST)
    return result


def split_torque(
    before: Float64Array, after: Float64Array, torque: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Split a torque on the midpoint frames into torques on the frames before and after.

    The midpoint frame rotates by half the sum of both rotations, plus the tangent of a quarter of
    the angle between them times their difference.
    """
    step = quaternion.product(after, quaternion.inverse(before))
    sign = np.where(step[..., :1] < 0, -1.0, 1.0)
    quarter = sign * step[..., 1:] / (1.0 + sign * step[..., :1])
    aside = np.cross(quarter, torque)
    return 0.5 * (torque - aside), 0.5 * (torque + aside)


def next_element(values: Float64Array) -> Float64Array:
    """Return the values of the next element, 0 beyond the tip."""
    return np.concatenate([values[:, 1:], np.zeros_like(values[:, :1])], axis=1)
