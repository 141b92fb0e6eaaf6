"""The simulator: builds rods from a groom's guides and advances them in substeps."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import Surroundings
from hairkit.simulation.guide_simulator import FRAME
from hairkit.simulation.held_guides import borne_masses
from hairkit.simulation.node_simulator import NodeSimulator
from hairkit.simulation.rigid_motion import inverse_motion
from hairkit.simulation.substeps import Course, StepArrays
from hairkit.simulation.vectors import Floats

from .backend import Engine
from .block import Contact, acting, state_of
from .limits import max_stiffness, overhang
from .linear_system import Rates, System, assemble
from .options import Options
from .rods import TINY, Rods, State, balance_load, clamp_roots, elastic_energy, make_rods

SINGLE_HAIR = 1.2e-3
"""m^4/s^2: EI over mass per length of a hair of 80 micrometres, 4 GPa."""
UPRIGHT = 6.4
"""Moment by its own weight times length over sqrt(EI GJ) at which a level strand turns aside (it
buckles at w L^3 = 12.85 sqrt(EI GJ)). A guide stands for the hair around it, which together bears
what lies out: it is at least so stiff that it stays."""
KEPT_SYSTEMS = 4
"""Substeps of other lengths, and points held, whose matrices are kept."""


class RodSimulator(NodeSimulator):
    """Simulated guides of a groom (see `hairkit.simulation.Simulator`)."""

    rods: Rods
    """Of the guides, at rest."""
    _options: Options

    @property
    def _state(self) -> State:
        return self._engine.state

    @_state.setter
    def _state(self, value: State) -> None:
        self._engine.state = value

    def _now(self) -> tuple[Floats, Floats, Floats]:
        """Return nodes, velocities and frames, in blocks."""
        now = state_of(self._engine.rows)
        return now.position, now.velocity, now.frames

    def _elastic(self, place: Float64Array) -> float:
        """Return the energy of bending, twist, the pull to the captured shape, and the support."""
        frames = self._engine.state.frames
        moved = place - self._nodes
        raised = float((self._borne[..., None] * moved @ self._rest_gravity).sum())
        bound = -0.5 * float((self._bonds() * moved).sum())
        energy = elastic_energy(self.rods, place, frames, self._pull) - self._rest_energy
        return energy + raised + bound

    def _build(self, near: Float64Array) -> None:
        """Make the rods and their engine."""
        options = self._options
        self.rods = rods = self._stiffen(options)
        self._pull = self._pull_to_rest()
        self._rest_energy = elastic_energy(rods, rods.points, rods.frames, self._pull)
        self._system = lru_cache(KEPT_SYSTEMS)(self._assemble)
        friction = options.friction or 0.0
        contact = Contact(self._bodies, near, friction, options.depenetration, options.rounds)
        exact = options.backend == "reference"
        self._engine = Engine(rods, contact, np.float64 if exact else np.float32)
        self._beside = self._now()[0][:, :, self._some]
        self._beside_mass = self._engine.mass[:, :, self._some]

    def _stiffen(self, options: Options) -> Rods:
        """Return the rods, whose natural shape balances what weight nothing else bears."""
        density = self._density
        most = max_stiffness(self._nodes, FRAME / options.substeps)[:, None]
        weight = abs(self._groom.physics.gravity) * overhang(self._nodes)[:, None]
        borne = weight / (UPRIGHT * np.sqrt(options.twist))
        firm = np.maximum(SINGLE_HAIR * 10.0 ** (options.bend or 0.0), borne)
        bending = density * np.minimum(firm, most)
        rods = make_rods(self._nodes, density, bending, bending * options.twist)
        self._borne = borne_masses(self._nodes, rods.length, rods.mass, self._held)
        load, borne = (m[..., None] * self._rest_gravity for m in (rods.mass, self._borne))
        return balance_load(clamp_roots(rods, load), load - borne)

    def _assemble(self, step: float, held: tuple[int, ...]) -> System:
        """Return the system of substeps in which some points are held."""
        shape = self._pull_with_hands(held)
        return assemble(self.rods, Rates(self._drag, self._damping, shape), step)

    def _substeps(
        self, steps: StepArrays, seconds: float, around: Surroundings, head: Course
    ) -> None:
        """Update wind and hair grid once, then do the substeps."""
        options, engine, (start, end) = self._options, self._engine, head
        if options.cohesion > 0 or options.pressure > 0:
            rates = (options.cohesion, options.pressure, seconds * len(steps.turn))
            now, change = state_of(engine.rows), inverse_motion(end) @ start
            self._hair_grid.mix(now.position, now.velocity, engine.mass, change, rates)
        held = tuple(self._hands)
        system = self._system(round(seconds, 12), held)
        force = self._support(steps, seconds * len(steps.turn), head) + self._bonds()
        if held:
            force += self.rods.mass[..., None] * self._drawn_by_hands(end)
        engine.run(system, steps, acting(self.rods, self._air(around, start), force))

    def _support(self, steps: StepArrays, seconds: float, head: Course) -> Float64Array:
        """Return the force (S, n, 3) of what bears hair, N, head axes: it pushes and never pulls.

        Hair is pressed on it by gravity less the root's acceleration, along gravity at rest.
        """
        (start, end), (_, velocity, _) = head, self._now_by_strands()
        before = velocity[:, 0] @ start[:3, :3].T @ end[:3, :3]
        drift, rest = steps.drift[-1], self._rest_gravity
        after = self._nodes[:, 0] @ drift[:, :3].T + drift[:, 3]
        pressed = (steps.air[-1, :, 3] - (after - before) / seconds) @ rest
        share = np.maximum(pressed / max(rest @ rest, TINY), 0.0)
        return np.asarray(-(self._borne * share[:, None])[..., None] * rest)

    def _bonds(self) -> Float64Array:
        """Return the force (S, n, 3) that keeps hair beside what it was beside at rest, N, head
        axes: springs to the mean way of what was within a cell of the hair grid.

        Chang, Jin and Yu ("A practical model for hair mutual interactions", 2002) join guides so.
        """
        moved = self._now()[0][:, :, self._some] - self._beside
        mean, nodes = moved.copy(), (self._beside_mass, np.eye(4))
        self._hair_grid.mix(self._beside, mean, *nodes, (np.inf, 0.0, 1.0))
        apart = (mean - moved).reshape(-1, *moved.shape[2:])[: len(self._nodes)]
        pull = self._options.adhesion * self.rods.mass[..., None]
        return np.asarray(pull * (self._share @ apart), np.float64)
