"""The fast backend: packs rods for the kernels and runs them on all cores, float32."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hairkit.simulate import rotation
from hairkit.stored import Float32Array, Float64Array

from . import kernels
from .crowd import Crowd
from .guides import Riders
from .kernel_math import LANES
from .kernel_ride import ride_points, rub_nodes
from .kernel_touch import uncover
from .packing import banded_factor
from .reference import Contact, Load, State, at_rest
from .rods import Rods
from .system import System


class FastEngine:
    """Rods in blocks of lanes."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        kernels.tell_of_compiling()
        self._rods = rods
        self._count = len(rods.points)
        self._unit = rods.mass.mean(axis=1)
        self._contact = contact
        held = rotation.third_axis(rods.root_frame)
        self._root = kernels.padded(np.concatenate([rods.root_frame, held], axis=1))
        self._packed: tuple[System, Float32Array, Float32Array, Float32Array] | None = None
        self._grid = _grid(contact)
        deepest = None if contact is None else contact.deepest
        self._deepest = None if deepest is None else deepest.astype(np.float32)
        self.state = at_rest(rods)

    @property
    def state(self) -> State:
        """The present state as float64; setting it moves the rods."""
        nodes = self._unpacked(self._x)
        return State(nodes[..., :3], nodes[..., 3:6], rotation.unit(self._unpacked(self._q)))

    @state.setter
    def state(self, value: State) -> None:
        slack = np.zeros_like(value.position[..., :1])
        nodes = np.concatenate([value.position, value.velocity, slack], axis=-1)
        self._x = kernels.padded(nodes.astype(np.float32))
        self._q = kernels.padded(value.frames.astype(np.float32))

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        if self._packed is None or self._packed[0] is not system:
            self._packed = (system, *_constants(self._rods, system, self._contact, self._unit))
        _, node, element, metric = self._packed
        contact = self._contact
        touching = (contact.friction, contact.fastest) if contact is not None else (0.0, 0.0)
        settings = np.array(
            [system.step, system.rates.damping, *touching, iterations, contact is not None],
            np.float32,
        )
        kernels.run_substeps(
            self._x, self._q, self._root, node, element, metric,
            _rides(loads), np.stack([load.turn for load in loads]).astype(np.float32),
            loads[0].gravity.astype(np.float32), self._air(loads[0].air),
            self._force(loads[0].force), self._grid, settings,
        )  # fmt: skip

    def rub(self, crowd: Crowd, ride: Float64Array, rates: tuple[float, float, float]) -> None:
        """Let hair act on hair."""
        rub_nodes(
            self._x, self._mass_of_nodes(), self._count, ride.astype(np.float32),
            crowd.origin.astype(np.float32), crowd.shape, crowd.usual.astype(np.float32),
            np.array(rates, np.float32),
        )  # fmt: skip

    def rod(self, rod: int) -> tuple[Float64Array, Float64Array]:
        """Return places and velocities (n, 3) of one rod, head axes."""
        block, lane = divmod(rod, LANES)
        nodes = self._x[block, :, :, lane].astype(np.float64)
        return nodes[:, :3], nodes[:, 3:6]

    def points(self, riders: Riders, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        motion = head[:3].astype(np.float32)
        found = np.asarray(
            ride_points(self._x, self._q, riders.identity, *riders.packed(), motion, self._count)
        )
        if self._deepest is not None and not riders.identity:
            uncover(found, self._deepest, motion, self._grid)
        return found

    def _unpacked(self, values: Float32Array) -> Float64Array:
        spread = np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:-1])
        return spread[: self._count].astype(np.float64)

    def _mass_of_nodes(self) -> Float32Array:
        if not hasattr(self, "_mass"):
            self._mass = kernels.padded(self._rods.mass.astype(np.float32))
        return self._mass

    def _air(self, air: Float64Array) -> Float32Array:
        if air.ndim == 1:
            return np.repeat(air.astype(np.float32)[None, None, :, None], LANES, axis=3)
        return kernels.padded(air.astype(np.float32))

    def _force(self, force: Float64Array | None) -> Float32Array:
        if force is None:
            return np.zeros((1, 1, 3, LANES), np.float32)
        return kernels.padded((force / self._unit[:, None, None]).astype(np.float32))


def _constants(
    rods: Rods, system: System, contact: Contact | None, unit: Float64Array
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Pack what nodes, elements and lengths need, masses as shares of the rod's mean."""
    count, nodes = rods.mass.shape
    node = np.zeros((count, nodes, kernels.NODE))
    node[..., kernels.REST : kernels.REST + 3] = rods.points
    node[..., kernels.MASS] = rods.mass / unit[:, None]
    node[..., kernels.DRAG] = system.rates.drag
    node[..., kernels.SHAPE] = system.rates.shape
    node[..., kernels.CLEAR] = -1.0 if contact is None else contact.clearance
    node[:, 1:, kernels.EASE] = 1.0 / node[:, 1:, kernels.MASS]
    element = np.zeros((count, nodes - 1, kernels.ELEMENT))
    element[..., kernels.LENGTH], element[..., kernels.OVER] = rods.length, 1.0 / rods.length
    element[..., kernels.BEND] = rods.bend / unit[:, None]
    element[..., kernels.TWIST] = rods.twist / unit[:, None]
    element[..., kernels.CURVE : kernels.CURVE + 3] = rods.curvature
    element[..., kernels.NATURAL] = rods.natural_twist
    element[..., kernels.FIRST :] = banded_factor(system.banded / unit[:, None, None])
    row, column = np.tril_indices(nodes - 1)
    metric = system.metric[:, row, column] * unit[:, None]
    packed = [kernels.padded(part.astype(np.float32)) for part in (node, element, metric)]
    return packed[0], packed[1], packed[2]


def _rides(loads: Sequence[Load]) -> Float32Array:
    rides = np.zeros((len(loads), 3, 8))
    for k, load in enumerate(loads):
        rides[k, :, :4] = load.ride[:3]
        rides[k, 0, 4:] = rotation.from_matrix(load.ride[:3, :3])
    return rides.astype(np.float32)


def _grid(contact: Contact | None) -> tuple[Float32Array, Float32Array]:
    if contact is None:
        return np.zeros((2, 2, 2), np.float32), np.ones(5, np.float32)
    grid = contact.obstacles.grid
    first = grid.origin + 0.5 * grid.spacing
    # outside the grid nothing is nearer than its room; a node looks again after that way
    place = np.array([*first, 1.0 / grid.spacing, 0.02], np.float32)
    return contact.obstacles.distance.copy(), place
