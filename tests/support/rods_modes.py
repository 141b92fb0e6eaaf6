"""Rods of the plugin linearised about an equilibrium: small motions, compliance and stability.

The forces are those of the twin, segments keep their lengths, torsion is in balance
(the last segment's frame is held in `ClampedRods`). A virtual displacement of the free nodes is
a combination of `free` columns; those that change no length are left over.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from hairkit_plugins.rods.rods import Rods, State, transport_frames
from rods_bench import balanced
from rods_reference import elastic_force
from scipy.linalg import eigh, null_space

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

_STEP = 1e-6
"""Share of a segment by which nodes are moved for the forces' slope."""


@dataclass(frozen=True, eq=False)
class Small:
    """Small motions about an equilibrium in q free coordinates."""

    basis: Float64Array
    """(3 n, q) displacements of the nodes."""
    stiffness: Float64Array
    """(q, q) N/m."""
    tension: Float64Array
    """(n - 1,) newtons."""
    residual: float
    """Largest force that nothing balances, newtons."""

    def lowest(self) -> float:
        """Return the least stiffness, N/m; below 0 the equilibrium is unstable."""
        return float(np.linalg.eigvalsh(self.stiffness)[0])

    def squares(self, inertia: Float64Array) -> Float64Array:
        """Return the squared angular frequencies, rising, of a mass matrix (n, n) of nodes."""
        heavy = self.basis.T @ np.kron(inertia, np.eye(3)) @ self.basis
        result: Float64Array = eigh(self.stiffness, heavy, eigvals_only=True)
        return result

    def yielding(self, force: Float64Array) -> Float64Array:
        """Return the displacement (n, 3) under a small further force (n, 3)."""
        moved = np.linalg.solve(self.stiffness, self.basis.T @ force.ravel())
        result: Float64Array = (self.basis @ moved).reshape(force.shape)
        return result


def linearised(
    rods: Rods,
    state: State,
    force: Float64Array | None = None,
    free: Float64Array | None = None,
) -> Small:
    """Return the small motions of one rod about a state.

    Parameters
    ----------
    rods, state
        S = 1; torsion is balanced here.
    force
        (n, 3) dead loads, newtons.
    free
        (3 n, f) displacements that the supports let; all nodes but the root where None.
    """
    nodes, position = rods.nodes, state.position
    if free is None:
        free = np.eye(3 * nodes)[:, 3:]
    load = np.zeros((nodes, 3)) if force is None else force
    reach = float(rods.length.mean()) * _STEP
    shifts = reach * np.concatenate([np.eye(3 * nodes), -np.eye(3 * nodes)])
    moved = position + np.concatenate([0 * shifts[:1], shifts]).reshape(-1, nodes, 3)
    forces = balanced_force(rods, state.frames, moved).reshape(len(moved), -1)
    slope = (forces[1 : 3 * nodes + 1] - forces[3 * nodes + 1 :]).T / (2 * reach)
    edge = np.diff(position[0], axis=0)
    way = quaternion.normalize(edge)
    lengthening = np.zeros((nodes - 1, nodes, 3))
    pick = np.arange(nodes - 1)
    lengthening[pick, pick], lengthening[pick, pick + 1] = -way, way
    lengthening = lengthening.reshape(nodes - 1, -1)
    pushed = free.T @ (forces[0] + load.ravel())
    tension = np.linalg.lstsq(free.T @ lengthening.T, pushed, rcond=None)[0]
    residual = np.abs(pushed - free.T @ lengthening.T @ tension).max()
    aside = np.eye(3) - way[:, :, None] * way[:, None]
    taut = np.einsum("j,jab->jab", tension / rods.length[0], aside)
    difference = (np.eye(nodes, k=1) - np.eye(nodes))[:-1]
    stiffness = np.einsum("ji,jab,jk->iakb", difference, taut, difference).reshape(slope.shape)
    basis = free @ null_space(lengthening @ free)
    reduced = basis.T @ (stiffness - slope) @ basis
    return Small(basis, (reduced + reduced.T) / 2, tension, float(residual))


def balanced_force(rods: Rods, frames: Float64Array, position: Float64Array) -> Float64Array:
    """Return the elastic forces (S, n, 3) of one rod at other places (S, n, 3) of its nodes."""
    many = copies(rods, len(position))
    edge = np.diff(position, axis=1)
    carried = transport_frames(np.repeat(frames, len(position), axis=0), quaternion.normalize(edge))
    return elastic_force(many, edge, balanced(many, carried))


def copies(rods: Rods, count: int) -> Rods:
    """Return one rod `count` times."""
    return _picked(rods, [0] * count)


def one_of(rods: Rods, index: int) -> Rods:
    """Return one of several rods."""
    return _picked(rods, [index])


def _picked(rods: Rods, pick: list[int]) -> Rods:
    return replace(rods, **{name: array[pick] for name, array in vars(rods).items()})
