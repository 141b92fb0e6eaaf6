"""Discrete Cosserat rods: the model, its state and energy, and inverse statics.

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

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

TINY = 1e-30
"""Least divisor."""


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

    def before(self, frames: Float64Array) -> Float64Array:
        """Return (S, n - 1, 4) the frame before each element: the root's, then the segments'."""
        return np.concatenate([self.root_frame[:, None], frames[:, :-1]], axis=1)


@dataclass(frozen=True, eq=False)
class State:
    """Positions, velocities and frames of rods.

    In the axes of the moving head: its surface, the roots and the captured shape are then constant,
    and float32 keeps its precision wherever the head is.
    """

    position: Float64Array
    """(S, n, 3) metres."""
    velocity: Float64Array
    """(S, n, 3) m/s in the world."""
    frames: Float64Array
    """(S, n - 1, 4) of the segments."""
    acceleration: Float64Array
    """(S, n, 3) of the last substep before contact, m/s^2 in the world; 0 in equilibrium."""


def make_rods(
    points: Float64Array, density: Float64Array, bending: Float64Array, torsion: Float64Array
) -> Rods:
    """Return naturally straight rods with nodes at `points`, whose roots hold their directions.

    Parameters
    ----------
    points
        (S, n, 3) metres, root first, no two neighbours equal.
    density
        (S, 1) mass per length, kg/m.
    bending, torsion
        (S, 1) EI and GJ, N m^2.
    """
    edge = np.diff(points, axis=1)
    length = np.linalg.norm(edge, axis=-1)
    segments = density * length
    mass = np.zeros(points.shape[:2])
    mass[:, :-1] += segments / 2
    mass[:, 1:] += segments / 2
    # an element's length: from middle to middle, the first from the root to its middle
    span = length / 2
    span[:, 1:] += length[:, :-1] / 2
    frames = parallel_frames(edge / length[..., None])
    straight, untwisted = np.zeros_like(edge), np.zeros_like(length)
    return Rods(
        points, mass, segments, length, bending / span, torsion / span, frames[:, 0], frames,
        straight, untwisted,
    )  # fmt: skip


def parallel_frames(direction: Float64Array) -> Float64Array:
    """Return twist-free frames (S, n - 1, 4) of segments (Bishop 1975)."""
    frames = [transport_frames(np.array([1.0, 0.0, 0.0, 0.0]), direction[:, 0])]
    for j in range(1, direction.shape[1]):
        frames.append(transport_frames(frames[-1], direction[:, j]))
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


def balance_load(rods: Rods, force: Float64Array) -> Rods:
    """Return rods in equilibrium at their present shape under node forces (S, n, 3), newtons.

    Inverse statics: each element holds the torque G about it of all forces beyond; tension carries
    the rest. Turning what is beyond by a small angle w changes the element's energy by w times

        b x m - P (b - a) x m + t (a + b) / (1 + a b),

    with the directions a, b before and after it, its bending moment m, its torque t, and the part P
    w of the turn that its midpoint frame takes. That is G where, with c and M the length and the
    direction of (a + b) / 2,

        m = G x M + G (a x b) (b - a) / 4 c^2 (1 + c),  t = c G M.

    The natural turn and twist differ from the present ones by what gives these moments.
    """
    beyond = np.cumsum(force[:, ::-1], axis=1)[:, ::-1][:, 1:]
    after = quaternion.third_axis(rods.frames)
    torques = np.cross(after * rods.length[..., None], beyond)
    torque = np.cumsum(torques[:, ::-1], axis=1)[:, ::-1]
    frames = rods.before(rods.frames)
    before = quaternion.third_axis(frames)
    turn, middle = after - before, (after + before) / 2
    half_cosine = np.maximum(np.linalg.norm(middle, axis=-1, keepdims=True), TINY)
    aside = (torque * np.cross(before, after)).sum(axis=-1, keepdims=True)
    moment = np.cross(torque, middle) / half_cosine
    moment += aside / (4 * half_cosine**2 * (1 + half_cosine)) * turn
    natural = turn - moment / np.maximum(rods.bend, TINY)[..., None]
    twisting = (torque * middle).sum(axis=-1) / np.maximum(rods.twist, TINY)
    back = quaternion.inverse(midpoint_frame(frames, rods.frames))
    return replace(
        rods,
        curvature=quaternion.rotate(back, natural),
        natural_twist=twist_between(frames, rods.frames) - twisting,
    )


def rest_state(rods: Rods) -> State:
    """Return the captured state with zero velocity."""
    still = np.zeros_like(rods.points)
    return State(rods.points.copy(), still, rods.frames.copy(), still.copy())


def transport_frames(frames: Float64Array, direction: Float64Array) -> Float64Array:
    """Return frames (..., 4) turned by the shortest arcs that bring third axes to directions."""
    turn = quaternion.shortest_arc(quaternion.third_axis(frames), direction)
    return quaternion.normalize(quaternion.product(turn, frames))


def midpoint_frame(before: Float64Array, after: Float64Array) -> Float64Array:
    """Return the midpoint frames of neighbours."""
    sign = np.where((before * after).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return quaternion.normalize(before + sign * after)


def twist_between(before: Float64Array, after: Float64Array) -> Float64Array:
    """Return the twist about their direction between neighbouring frames, radians."""
    step = quaternion.product(quaternion.inverse(before), after)
    sign = np.where(step[..., 0] < 0, -1.0, 1.0)
    return 2.0 * np.arctan2(sign * step[..., 3], sign * step[..., 0])


def elastic_energy(
    rods: Rods, position: Float64Array, frames: Float64Array, pull: Float64Array
) -> float:
    """Return the energy of bending, twist and the pull to the captured shape, joules.

    `position` (S, n, 3) and `frames` (S, n - 1, 4), which may have other directions; `pull` (S, n)
    has the squared frequencies of that pull, 1/s^2.
    """
    edge = np.diff(position, axis=1)
    frames = transport_frames(frames, quaternion.normalize(edge))
    before = rods.before(frames)
    held = quaternion.third_axis(rods.root_frame)[:, None]
    turn = np.diff(edge / rods.length[..., None], axis=1, prepend=held)
    natural = quaternion.rotate(midpoint_frame(before, frames), rods.curvature)
    bent = ((turn - natural) ** 2).sum(axis=-1)
    twisted = twist_between(before, frames) - rods.natural_twist
    moved = ((position - rods.points) ** 2).sum(axis=-1)
    energy = (rods.bend * bent).sum() + (rods.twist * twisted**2).sum()
    return 0.5 * float(energy + (rods.mass * pull * moved).sum())
