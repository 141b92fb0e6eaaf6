"""Stretch and elastic energy of rods."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

from .reference import State, transport_frames
from .rods import Rods, midpoint_frame, twist_between


def largest_stretch(rods: Rods, state: State) -> float:
    """Return the largest relative change of a segment's length."""
    length = np.linalg.norm(np.diff(state.position, axis=1), axis=-1)
    return float(np.abs(length / rods.length - 1).max())


def elastic_energy(rods: Rods, state: State, shape: Float64Array | None = None) -> float:
    """Return the energy of bending, twist and the pull to the captured shape, joules.

    `shape` (S, n): squared frequencies of that pull, 1/s^2.
    """
    edge = np.diff(state.position, axis=1)
    frames = transport_frames(state.frames, quaternion.normalize(edge))
    before = rods.before(frames)
    reach = edge / rods.length[..., None]
    held = quaternion.third_axis(rods.root_frame)[:, None]
    turn = reach - np.concatenate([held, reach[:, :-1]], axis=1)
    off = turn - quaternion.rotate(midpoint_frame(before, frames), rods.curvature)
    energy = 0.5 * float((rods.bend[..., None] * off**2).sum())
    twist = twist_between(before, frames) - rods.natural_twist
    energy += 0.5 * float((rods.twist * twist**2).sum())
    if shape is not None:
        moved = ((state.position - rods.points) ** 2).sum(axis=-1)
        energy += 0.5 * float((rods.mass * shape * moved).sum())
    return energy
