"""The simulator: builds rods from a groom's guides and advances them in substeps."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation import Measures, Surroundings
from hairkit.simulation.embedding import (
    FIRM,
    carry_points,
    embed_points,
    hand_goals,
    held_nodes,
    node_points,
)
from hairkit.simulation.guide_simulator import FRAME, KERATIN, GuideSimulator
from hairkit.simulation.hair_grid import make_hair_grid
from hairkit.simulation.held_guides import held_lengths, pull_to_captured
from hairkit.simulation.obstacle_kernels import WORTH
from hairkit.simulation.rigid_motion import follow_head, interpolate_motion, inverse_motion
from hairkit.simulation.wind import air_velocity
from hairkit.types.groom import Groom

from .backend import Engine, FastEngine
from .block import Contact, acting, make_steps, state_of
from .limits import finer_steps, max_stiffness, overhang
from .linear_system import Rates, System, assemble
from .options import Options
from .rods import Rods, balance_load, clamp_roots, elastic_energy, make_rods, rest_state

SINGLE_HAIR = 1.2e-3
"""m^4/s^2: EI over mass per length of a hair of 80 micrometres, 4 GPa."""
UPRIGHT = 6.4
"""Moment by its own weight times length over sqrt(EI GJ) at which a level strand turns aside (it
buckles at w L^3 = 12.85 sqrt(EI GJ)). A guide stands for the hair around it, which together bears
what lies out: it is at least so stiff that it stays."""
APART = 4
"""Nodes between those at which gusts are evaluated: shorter than half a gust is long."""
KEPT_SYSTEMS = 4
"""Substeps of other lengths, and points held, whose matrices are kept."""


class RodSimulator(GuideSimulator):
    """Simulated guides of a groom (see `hairkit.simulation.Simulator`)."""

    rods: Rods
    """Of the guides, at rest."""
    _options: Options

    def __init__(self, groom: Groom, options: Options) -> None:
        super().__init__(groom)
        self._place(None)
        self._place_nodes(options.nodes)
        self._tune(options)

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Advance by `seconds`, in pieces of at most `FRAME`, each in substeps."""
        if not seconds > 0:
            return
        start, end = self._head, surroundings.head_from_rest
        pieces = max(1, math.ceil(seconds / FRAME - 1e-6))
        heads = [interpolate_motion(start, end, piece / pieces) for piece in range(pieces + 1)]
        for before, after in pairwise(heads):
            self._piece(seconds / pieces, surroundings, before, after)
        self._head = end
        self._points = None

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Reset the guides to rest on a head at `head_from_rest` (4, 4), with zero velocity."""
        self._place(head_from_rest)
        self._engine.state = rest_state(self.rods)

    def retune(self, options: Options) -> None:
        """Change the options; positions and velocities stay unless the number of nodes changes."""
        before = self._engine.state
        if options.nodes != self.rods.nodes:
            self._place_nodes(options.nodes)
        self._tune(options)
        if options.nodes == before.position.shape[1]:
            self._engine.state = before
        self._points = None

    def measure(self) -> Measures:
        """Return the stretch of rods and points, and energies; potential energy is 0 at rest."""
        rods, state = self.rods, self._engine.state
        down = self._head[:3, :3].T @ self._rest_gravity
        kinetic = 0.5 * float((rods.mass[..., None] * state.velocity**2).sum())
        fallen = ((state.position - rods.points) * down).sum(axis=-1)
        elastic = elastic_energy(rods, state.position, state.frames, self._rates.shape)
        energy = elastic - self._rest_energy - float((rods.mass * fallen).sum())
        length = np.linalg.norm(np.diff(state.position, axis=1), axis=-1)
        stretch = float(np.abs(length / rods.length - 1).max())
        drawn_stretch, depth = self._measure_drawn()
        return Measures(max(stretch, drawn_stretch), kinetic, energy, depth)

    def _carry(self) -> Any:
        """Return where the rods carry the guides' points (P, 3), head axes."""
        on, now = self._embedding, state_of(self._engine.rows)
        points = np.empty((len(on.rod), 3), now.position.dtype)
        parallel_for(
            carry_points, len(points), on, now.position, now.frames, points, min_chunk=WORTH
        )
        return points

    def _place_nodes(self, nodes: int) -> None:
        """Place nodes along the guides; measure the captured distance to the obstacles."""
        strands, width = self.strands, self.strands.widths
        self._nodes = node_points(strands, nodes)
        self._segment = float(np.median(np.linalg.norm(np.diff(self._nodes, axis=1), axis=-1)))
        self._width = np.full(len(strands), self._groom.material.width)
        if width is not None:
            mean = np.add.reduceat(width, strands.offsets[:-1]) / strands.counts
            self._width = np.maximum(mean, 1e-6)
        self._near = self._bodies.at(self._nodes)[0]
        self._held = held_lengths(self._groom) / np.maximum(strands.lengths(), 1e-9)

    def _tune(self, options: Options) -> None:
        """Set the options, and make what moves the nodes by them."""
        self._options = options.resolved(self._groom.physics)
        self.rods = self._stiffen(self._options)
        self._embedding = embed_points(self.strands, self._nodes, self.rods.frames)
        self._hair_grid = make_hair_grid(self._nodes, self.rods.mass)
        self._rates = self._rates_of(self._options)
        rods = self.rods
        self._rest_energy = elastic_energy(rods, rods.points, rods.frames, self._rates.shape)
        self._system = lru_cache(KEPT_SYSTEMS)(self._assemble)
        # hair captured nearer keeps its own distance
        near, friction = np.minimum(options.clearance, self._near), self._options.friction or 0.0
        contact = Contact(self._bodies, near, friction, options.depenetration, options.rounds)
        self._engine = self._make_engine(contact)

    def _make_engine(self, contact: Contact) -> Engine:
        """Return the backend of the options."""
        name = self._options.backend
        if name == "compute":
            from .gl_backend import ComputeEngine

            return ComputeEngine(self.rods, contact)
        return FastEngine(self.rods, contact, np.float64 if name == "reference" else np.float32)

    def _stiffen(self, options: Options) -> Rods:
        """Return the rods, whose natural shape balances gravity at the captured shape."""
        density = KERATIN * np.pi / 4 * self._width[:, None] ** 2
        most = max_stiffness(self._nodes, FRAME / options.substeps)[:, None]
        weight = abs(self._groom.physics.gravity) * overhang(self._nodes)[:, None]
        borne = weight / (UPRIGHT * np.sqrt(options.twist))
        firm = np.maximum(SINGLE_HAIR * 10.0 ** (options.bend or 0.0), borne)
        bending = density * np.minimum(firm, most)
        rods = make_rods(self._nodes, density, bending, bending * options.twist)
        load = rods.mass[..., None] * self._rest_gravity
        return balance_load(clamp_roots(rods, load), load)

    def _rates_of(self, options: Options) -> Rates:
        """Convert options to rates; drag goes as area over mass, which is 1 / width."""
        rods, width = self.rods, self._width
        drag = options.drag * width.mean() / width
        pull = pull_to_captured(
            rods.points,
            rods.length,
            options.stiffness or 0.0,
            abs(self._groom.physics.gravity),
            self._held,
        )
        damping = -math.log(1 - (options.damping or 0.0)) / FRAME
        return Rates(np.repeat(drag[:, None], rods.nodes, axis=1), damping, pull)

    def _assemble(self, step: float, held: tuple[int, ...]) -> System:
        """Return the system of substeps in which some points are held."""
        shape = self._rates.shape.copy()
        np.add.at(shape, held_nodes(self._embedding, held), FIRM)
        return assemble(self.rods, replace(self._rates, shape=shape), step)

    def _piece(
        self, seconds: float, around: Surroundings, start: Float64Array, end: Float64Array
    ) -> None:
        """Advance by up to `FRAME`: update wind and hair grid once, then do substeps."""
        options, engine, back = self._options, self._engine, inverse_motion(end)
        self._move_hands(around, options.grab_speed * seconds)
        finer = finer_steps(start, end, self.rods.points[:, 0], self._segment)
        torso = follow_head(self._torso, end, self._bodies.joint)
        if finer == 0:
            start, finer = end, 1  # hair and torso go with a head that is elsewhere at once
            self._torso = torso
            engine.state = engine.state  # known distances to the torso are void
        count = max(1, math.ceil(options.substeps * seconds / FRAME - 1e-6)) * finer
        if options.cohesion > 0 or options.pressure > 0:
            rates = (options.cohesion, options.pressure, seconds)
            now = state_of(engine.rows)
            self._hair_grid.mix(now.position, now.velocity, engine.mass, back @ start, rates)
        head, bust = (start, end), (self._torso, torso)
        steps = make_steps(head, bust, count, self._gravity(around), seconds / count)
        force = self._pull_of_hands(back)
        system = self._system(round(seconds / count, 12), tuple(self._hands.places))
        engine.run(system, steps, acting(self.rods, self._air(around, start), force))
        self._torso = torso
        self._time += seconds

    def _pull_of_hands(self, back: Float64Array) -> Float64Array | None:
        """Return the force (S, n, 3) that makes hands, not rest, the ends of pulls, newtons."""
        if not self._hands.places:
            return None
        rods, places = self.rods, self._hands.places
        rod, node, goal = hand_goals(self._embedding, rods.points, places, back)
        force = np.zeros_like(rods.points)
        pull = FIRM * rods.mass[rod, node, None] * (goal - rods.points[rod, node])
        np.add.at(force, (rod, node), pull)
        return force

    def _air(self, around: Surroundings, head: Float64Array) -> Float64Array:
        """Return the air velocity at the nodes, world; gusts are those where the head carries them.

        They are evaluated at every `APART`-th node and interpolated between.
        """
        wind = np.asarray(around.wind, np.float64)
        if around.turbulence == 0.0 or not wind.any():
            return wind
        nodes = self.rods.nodes
        some = np.unique(np.append(np.arange(0, nodes, APART), nodes - 1))
        share = np.stack([np.interp(np.arange(nodes), some, row) for row in np.eye(len(some))], 1)
        places, seed = self.rods.points[:, some].astype(np.float32), self._options.seed
        air = air_velocity(places, self._time, wind, around.turbulence, seed, head)
        result: Float64Array = share @ air
        return result
