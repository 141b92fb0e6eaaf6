"""Inverse statics: the unloaded shape for which gravity bends the rod into the captured one.

At rest K l (q - q0) is the generalised force of gravity, so q0 follows at once. The rest is stable
only if K l minus the slope of that force is positive definite; thin hair that stands up is not, and
gets stiffer by the factor that makes it so (after Derouet-Jourdan, Bertails-Descoubes and Thollot,
"Stable inverse dynamic curves", 2010).
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled, compiled_with, parallel_for

from .element_kernels import advance_frame, node, times, turns
from .rods import NODES, SHARES, WEIGHTS, Rods

MARGIN = 0.6
"""A rest is soft when gravity takes off more than this share of the stiffness in some direction."""
_DIFFERENCE = 1e-5


def rest_as_captured(rods: Rods, gravity: Float64Array) -> Rods:
    """Return the rods with a natural shape, and stiffness where needed, to rest as captured."""
    load = gravity_forces(rods, rods.captured, gravity)
    rods = stiffen(rods, gravity)
    natural = rods.captured - load / (rods.lengths[:, None] * rods.stiffness)
    return rods._replace(natural=natural)


def stiffen(rods: Rods, gravity: Float64Array) -> Rods:
    """Return the rods, those stiffer whose captured shape gravity would topple."""
    slope = gravity_slopes(rods, gravity)
    factor = np.ones(len(rods.lengths))
    for strand in range(len(rods.offsets) - 1):
        own = slice(rods.offsets[strand], rods.offsets[strand + 1])
        size = 3 * (own.stop - own.start)
        one = slope[own, :, : size // 3].reshape(size, size)
        soft = (one + one.T) / 2
        scale = 1 / np.sqrt((rods.lengths[own, None] * rods.stiffness[own]).ravel())
        soft = scale[:, None] * soft * scale
        if not _below(soft, MARGIN):
            worst = eigh(soft, eigvals_only=True, subset_by_index=(size - 1, size - 1))[0]
            factor[own] = worst / MARGIN
    return rods._replace(stiffness=rods.stiffness * factor[:, None])


def gravity_forces(rods: Rods, q: Float64Array, gravity: Float64Array) -> Float64Array:
    """Return (E, 3) the generalised forces of gravity on rods at rest on the head, joule metres."""
    result = np.zeros_like(q)
    parallel_for(_forces_of_all, len(rods.roots), rods, q, gravity, result)
    return result


def gravity_slopes(rods: Rods, gravity: Float64Array) -> Float64Array:
    """Return (E, 3, N, 3) how the captured shape's forces change with the strand's coordinates.

    N is the largest number of elements; the rest is 0. By central differences.
    """
    most = int(np.diff(rods.offsets).max(initial=0))
    result = np.zeros((len(rods.lengths), 3, most, 3))
    parallel_for(_slopes_of_all, len(rods.roots), rods, rods.captured, gravity, result)
    return result


def _below(matrix: Float64Array, bound: float) -> bool:
    """Return whether all eigenvalues of a symmetric matrix are below a bound."""
    try:
        np.linalg.cholesky(bound * np.eye(len(matrix)) - matrix)
    except np.linalg.LinAlgError:
        return False
    return True


@compiled
def _forces_of_all(
    begin: int, stop: int, rods: Rods, q: Float64Array, gravity: Float64Array, result: Float64Array
) -> None:
    for strand in range(begin, stop):
        first, last = rods.offsets[strand], rods.offsets[strand + 1]
        _forces(rods, strand, q[first:last], gravity, result[first:last])


@compiled_with(allocates=True)
def _slopes_of_all(
    begin: int, stop: int, rods: Rods, q: Float64Array, gravity: Float64Array, result: Float64Array
) -> None:
    for strand in range(begin, stop):
        first, last = rods.offsets[strand], rods.offsets[strand + 1]
        count = last - first
        moved = q[first:last].copy()
        ahead, back = np.zeros((count, 3)), np.zeros((count, 3))
        for e in range(count):
            step = _DIFFERENCE / rods.lengths[first + e]
            for j in range(3):
                kept = moved[e, j]
                moved[e, j] = kept + step
                _forces(rods, strand, moved, gravity, ahead)
                moved[e, j] = kept - step
                _forces(rods, strand, moved, gravity, back)
                moved[e, j] = kept
                for k in range(count):
                    for i in range(3):
                        result[first + k, i, e, j] = (ahead[k, i] - back[k, i]) / (2 * step)


@compiled_with(allocates=True, inside=True)
def _forces(
    rods: Rods, strand: int, q: Float64Array, gravity: Float64Array, result: Float64Array
) -> None:
    """Write J' m g of one strand: what hangs on an element's end pulls by weight and moment."""
    first, count = rods.offsets[strand], len(q)
    frames, ends = np.empty((count + 1, 3, 3)), np.empty((count + 1, 3))
    frames[0], ends[0] = rods.frames[strand], rods.roots[strand]
    for k in range(count):
        advance_frame(q[k], rods.lengths[first + k], frames[k], ends[k], frames[k + 1], ends[k + 1])
    local, slope, arm = np.empty(3), np.empty((3, 3)), np.empty(3)
    turn, mean = np.empty((3, 3)), np.empty((3, 3))
    hung, moment, pull = 0.0, np.zeros(3), np.empty(3)
    for k in range(count - 1, -1, -1):
        length, mass = rods.lengths[first + k], rods.density[first + k] * rods.lengths[first + k]
        node(q[k], length, local, slope)
        turns(q[k], length, turn, mean)
        _in_frame(frames[k], gravity, pull)
        _in_frame(frames[k], moment, arm)
        for j in range(3):
            result[k, j] = 0.0
            for i in range(3):
                result[k, j] += hung * slope[i, j] * pull[i] + mean[i, j] * arm[i]
        first_moment = np.zeros(3)
        for g in range(NODES):
            node(q[k], length * SHARES[g], local, slope)
            times(frames[k], local, arm)
            for i in range(3):
                first_moment[i] += mass * WEIGHTS[g] * arm[i]
                for j in range(3):
                    result[k, j] += mass * WEIGHTS[g] * slope[i, j] * pull[i]
        for i in range(3):
            first_moment[i] += hung * (ends[k + 1, i] - ends[k, i])
        moment[0] += first_moment[1] * gravity[2] - first_moment[2] * gravity[1]
        moment[1] += first_moment[2] * gravity[0] - first_moment[0] * gravity[2]
        moment[2] += first_moment[0] * gravity[1] - first_moment[1] * gravity[0]
        hung += mass


@compiled_with(inside=True)
def _in_frame(frame: Float64Array, vector: Float64Array, result: Float64Array) -> None:
    for j in range(3):
        result[j] = frame[0, j] * vector[0] + frame[1, j] * vector[1] + frame[2, j] * vector[2]
