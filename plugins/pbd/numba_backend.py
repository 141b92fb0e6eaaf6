"""The fast backend: packs rods for the kernels and runs them on all cores, float32."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation import quaternion
from hairkit.simulation.obstacles import Obstacles

from . import kernels
from .drawn_points import drawing
from .factor_layout import banded_factor
from .hair_grid import HairGrid
from .kernel_embedding import embed_points
from .kernel_hair_grid import draw_nodes, settle_cells, spread_nodes
from .kernel_wind import sample_gusts
from .linear_system import System
from .reference import Contact, Load, State, TorsoStep, obstacles_of, rest_state
from .resampling import Embedding
from .rods import Rods
from .simd import LANES

Array = npt.NDArray[Any]
AirWaves = tuple[Float64Array, Float64Array, Float64Array]
WORTH = 64 // LANES
"""Blocks that are worth another thread's while."""
FEW, GRIDS = 2000, 4
"""Up to FEW rods are splatted to one grid, more rods to GRIDS grids in parallel."""


class FastEngine:
    """Rods in blocks of lanes."""

    def __init__(self, rods: Rods, contact: Contact | None) -> None:
        self._rods = rods
        self._count = len(rods.points)
        self._unit = rods.mass.mean(axis=1)
        self._contact = contact
        held = quaternion.third_axis(rods.root_frame)
        self._root = kernels.pack_lanes(np.concatenate([rods.root_frame, held], axis=1)[:, None])
        self._packed: tuple[System, Float32Array, Float32Array, Float32Array] | None = None
        head, torso = obstacles_of(contact)
        self._grids = _grid(head), _grid(torso)
        self.torso_from_head = np.eye(4)
        self._mass = kernels.pack_lanes(rods.mass.astype(np.float32))
        self._mass[-1, :, (self._count - 1) % LANES + 1 :] = 0.0
        self._cells = np.zeros((1, 0, 4), np.float32)
        self._usual = np.zeros(0, np.float32)
        self._blown: Float32Array | None = None
        self._air_work = kernels.pack_lanes(np.zeros(rods.points.shape, np.float32))
        self._packed_embedding: tuple[Embedding, tuple[Array, ...]] | None = None
        self.state = rest_state(rods)

    @property
    def state(self) -> State:
        """The present state as float64; setting it moves the rods."""
        nodes = self._unpack_lanes(self._x)
        frames = quaternion.normalize(self._unpack_lanes(self._q))
        return State(nodes[..., :3], nodes[..., 3:6], frames, nodes[..., 7:10])

    @state.setter
    def state(self, value: State) -> None:
        slack = np.zeros_like(value.position[..., :1])
        parts = (value.position, value.velocity, slack, value.acceleration, slack)
        nodes = np.concatenate(parts, axis=-1)
        self._x = kernels.pack_lanes(nodes.astype(np.float32))
        self._q = kernels.pack_lanes(value.frames.astype(np.float32))

    def run(self, system: System, loads: Sequence[Load], iterations: int) -> None:
        """Do one substep for each load."""
        if self._packed is None or self._packed[0] is not system:
            self._packed = (system, *_constants(self._rods, system, self._contact, self._unit))
        _, node, element, metric = self._packed
        contact = self._contact
        settings = np.array([system.step, system.rates.damping, 0, 0, iterations, 0, 0], "f4")
        if contact is not None:
            settings[2:4] = contact.friction, contact.fastest
            settings[5:] = 1, contact.rounds
        parallel_for(
            kernels.run_substeps,
            len(self._x),
            self._x,
            self._q,
            self._root,
            node,
            element,
            metric,
            *_pack_motions(loads),
            loads[0].gravity.astype(np.float32),
            self._air(loads[0].air),
            self._force(loads[0].force),
            self._grids,
            settings,
            min_chunk=WORTH,
        )

    def apply_hair_grid(
        self, hair_grid: HairGrid, head_step: Float64Array, rates: tuple[float, float, float]
    ) -> None:
        """Apply hair-hair interaction."""
        size = int(np.prod(hair_grid.shape))
        if self._cells.shape[1] != size:
            grids = 1 if self._count < FEW else GRIDS
            self._cells = np.zeros((grids, size, 4), np.float32)
            self._usual = hair_grid.uncrowded_mass.astype(np.float32).reshape(-1)
        shift, origin = (
            (head_step - np.eye(4))[:3].astype(np.float32),
            hair_grid.origin.astype(np.float32),
        )
        parallel_for(
            spread_nodes,
            len(self._cells),
            self._x,
            self._mass,
            shift,
            origin,
            hair_grid.shape,
            np.float32(rates[2]),
            self._cells,
        )
        settle_cells(0, size, self._cells, self._usual)
        parallel_for(
            draw_nodes,
            len(self._x),
            self._x,
            shift,
            origin,
            hair_grid.shape,
            np.array(rates, np.float32),
            self._cells[0],
            min_chunk=4 * WORTH,
        )

    def set_gusts(self, waves: AirWaves | None, wind: Float64Array, head: Float64Array) -> None:
        """Evaluate gusts (see `wind.gust_waves`) for the next substeps; None: the mean wind."""
        self._blown = None
        if waves is None:
            return
        vectors, amplitudes, phases = waves
        phases = np.remainder((phases + vectors @ head[:3, 3]) / (2 * np.pi), 1.0)
        turns = np.column_stack([vectors @ head[:3, :3] / (2 * np.pi), phases])
        parallel_for(
            sample_gusts,
            len(self._x),
            self._x,
            turns.astype(np.float32),
            amplitudes.astype(np.float32),
            wind.astype(np.float32),
            self._air_work,
            min_chunk=4 * WORTH,
        )
        self._blown = self._air_work

    def air(self) -> Float64Array:
        """Return the air velocity (S, n, 3) at the nodes, world, of the last gusts."""
        return self._unpack_lanes(self._air_work)

    def rod(self, rod: int) -> tuple[Float64Array, Float64Array]:
        """Return places and velocities (n, 3) of one rod, head axes."""
        block, lane = divmod(rod, LANES)
        nodes = self._x[block, :, :, lane].astype(np.float64)
        return nodes[:, :3], nodes[:, 3:6]

    def points(self, embedding: Embedding, head: Float64Array) -> Float32Array:
        """Return the guides' points (P, 3) in the world."""
        if self._packed_embedding is None or self._packed_embedding[0] is not embedding:
            self._packed_embedding = (
                embedding,
                _pack_embedding(embedding, self._x.shape[1]),
            )
        out = np.empty((len(embedding.rod), 3), np.float32)
        parallel_for(
            embed_points,
            self._count,
            self._x,
            self._q,
            *self._packed_embedding[1],
            *drawing(embedding, self._contact),
            self.torso_from_head,
            head[:3].astype(np.float32),
            out,
            min_chunk=256,
        )
        return out

    def _unpack_lanes(self, values: Float32Array) -> Float64Array:
        spread = np.moveaxis(values, -1, 1).reshape(-1, *values.shape[1:-1])
        return spread[: self._count].astype(np.float64)

    def _air(self, air: Float64Array) -> Float32Array:
        if self._blown is not None:
            return self._blown
        if air.ndim == 1:
            return np.repeat(air.astype(np.float32)[None, None, :, None], LANES, axis=3)
        return kernels.pack_lanes(air.astype(np.float32))

    def _force(self, force: Float64Array | None) -> Float32Array:
        if force is None:
            return np.zeros((1, 1, 3, LANES), np.float32)
        return kernels.pack_lanes((force / self._unit[:, None, None]).astype(np.float32))


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
    packed = [kernels.pack_lanes(part.astype(np.float32)) for part in (node, element, metric)]
    return packed[0], packed[1], packed[2]


def _pack_motions(loads: Sequence[Load]) -> tuple[Float32Array, Float32Array]:
    """Pack rides and turns as `kernels.run_substeps` takes them."""
    head_steps, turns = np.zeros((len(loads), 3, 20)), np.zeros((len(loads), 3, 4))
    for k, load in enumerate(loads):
        head_steps[k, :, :4] = load.head_step[:3]
        head_steps[k, :, 4:8] = load.head_step[:3] - np.eye(
            3, 4
        )  # in float64: small motions keep their digits
        head_steps[k, 0, 8:12] = quaternion.from_matrix(load.head_step[:3, :3])
        torso = load.torso or TorsoStep(np.eye(4), load.head_step)
        head_steps[k, :, 12:16] = torso.from_head[:3]
        head_steps[k, :, 16:] = torso.step[:3] - np.eye(3, 4)
        turns[k, :, :3] = load.turn
    return head_steps.astype(np.float32), turns.astype(np.float32)


def _pack_embedding(embedding: Embedding, nodes: int) -> tuple[Array, ...]:
    """Return segment, weights (P, 6) of four nodes and two frames, and offset."""
    t, last = embedding.share, nodes - 2
    one, two = t * t * (3 - 2 * t), t * (1 - t)
    start, end = two * (1 - t), -two * t  # of the slopes, per segment
    first, final = embedding.segment == 0, embedding.segment == last
    weight = np.stack(
        [
            np.where(first, 0.0, -0.5 * start),
            1 - one - np.where(first, start, 0.0) - np.where(final, end, 0.5 * end),
            one + np.where(first, start, 0.5 * start) + np.where(final, end, 0.0),
            np.where(final, 0.0, 0.5 * end),
            np.where(t < 0.5, 0.5 - t, 0.0),
            np.where(t < 0.5, 0.0, t - 0.5),
        ],
        axis=1,
    )
    return (
        embedding.segment.astype(np.int32),
        weight.astype(np.float32),
        embedding.offset.astype(np.float32),
    )


def _grid(body: Obstacles | None) -> tuple[Float32Array, Float32Array]:
    if body is None:
        return np.zeros((0, 0, 0), np.float32), np.ones(5, np.float32)
    grid = body.grid
    first = grid.origin + 0.5 * grid.spacing
    # least distance outside the grid, metres
    place = np.array([*first, 1.0 / grid.spacing, 0.02], np.float32)
    return body.distance.copy(), place
