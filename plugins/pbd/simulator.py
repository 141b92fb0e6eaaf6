"""The simulator: builds rods from a groom's guides and advances them in substeps."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array
from hairkit.grooming.guide_weights import guide_mask
from hairkit.grooming.prepare_export import select_strands
from hairkit.rendering.context import on_graphics_card
from hairkit.simulation import Grab, Measures, Surroundings, check_grabs
from hairkit.simulation.hair_grid import HairGrid, make_hair_grid
from hairkit.simulation.obstacles import Bodies, groom_bodies
from hairkit.simulation.rigid_motion import (
    follow_head,
    interpolate_motion,
    inverse_motion,
    motion_steps,
)
from hairkit.simulation.ties import held_lengths
from hairkit.simulation.wind import air_velocity
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

from .backend import Engine, FastEngine, PreciseEngine
from .embedding import embed_points
from .grab import Hands
from .linear_system import Rates, System, assemble
from .resampling import finer_steps, max_stiffness, node_points, overhang
from .rods import Rods, balance_load, clamp_roots, make_rods
from .state import Contact, Load, TorsoStep, elastic_energy, rest_state

if TYPE_CHECKING:
    from . import Options

FRAME = 1 / 60
"""Seconds of `substeps` substeps; wind and the hair grid are updated at this interval."""
HAIR_DENSITY = 1300.0
"""Density of keratin, kg/m^3."""
SINGLE_HAIR = 1.2e-3
"""m^4/s^2: EI over mass per length of a hair of 80 micrometres, 4 GPa."""
HELD = 4e4
"""1/s^2: squared frequency, of 32 Hz, at which hair before its tie is pulled to the head."""
FIRMEST = 6e3
"""Largest bending stiffness, as EI / (rho A) h^2 / l^4 of segments of length l in substeps of h:
more has tones above 50 Hz, and float32 loses the lengths. Hair cut short is stiffer than that."""
REACH = 0.04
"""Length from the root over which hair is pulled to its captured shape, metres: there skin and the
hair around hold it."""
STANDING = 2.5
"""Squared frequency, in g / L, of the pull that bears hair which stands or lies out, since other
hair is beneath it: a column that carries its own weight buckles by pi^2 / 4 of it at most. Hair
that hangs needs none."""
UPRIGHT = 6.4
"""Moment by its own weight times length over sqrt(EI GJ) at which a level strand turns aside (it
buckles at w L^3 = 12.85 sqrt(EI GJ)). A guide stands for the hair around it, which together bears
what lies out: it is at least so stiff that it stays."""
SMALLEST = 2e-5
"""Metres between points of which float32 has digits enough for a stretch of 1 %."""
APART = 4
"""Nodes between those at which gusts are evaluated: shorter than half a gust is long."""
_KEPT_SYSTEMS = 4


class PbdSimulator:
    """Simulated guides of a groom (see `hairkit.simulation.Simulator`)."""

    def __init__(self, groom: Groom, options: Options) -> None:
        guides = select_strands(groom, guide_mask(groom.strands))
        self._groom = guides
        self._bodies: Bodies = groom_bodies(groom)
        self._points: Float32Array | None = None
        self._head: Float64Array = np.eye(4)
        self._torso: Float64Array = np.eye(4)
        self._hands = Hands()
        self._rest_energy: float | None = None
        self._tune(options)
        self.reset()

    @property
    def strands(self) -> Strands:
        """The guides at rest, head frame."""
        return self._groom.strands

    @property
    def options(self) -> Options:
        """The options in force; None is replaced by the groom's value."""
        return self._options

    @property
    def time(self) -> float:
        """Seconds since the start or the last reset."""
        return self._time

    @property
    def rods(self) -> Rods:
        """The rods of the guides, at rest."""
        return self._rods

    @property
    def points(self) -> Float32Array:
        """(P, 3) present positions in the world, metres, in the order of `strands`."""
        if self._points is None:
            self._points = self._engine.points(self._embedding, self._head)
            self._points.setflags(write=False)
        return self._points

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Advance by `seconds`, in pieces of at most `FRAME`, each in substeps."""
        if not seconds > 0:
            return
        start, end = self._head, surroundings.head_from_rest
        pieces = max(1, math.ceil(seconds / FRAME - 1e-6))
        for piece in range(pieces):
            self._piece(
                seconds / pieces,
                surroundings,
                interpolate_motion(start, end, piece / pieces),
                interpolate_motion(start, end, (piece + 1) / pieces),
            )
        self._head = end
        self._points = None

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Reset the guides to rest on a head at `head_from_rest` (4, 4), with zero velocity."""
        self._head = np.eye(4) if head_from_rest is None else np.asarray(head_from_rest, np.float64)
        self._torso, self._engine.torso_from_head = self._head, np.eye(4)
        self._engine.state = rest_state(self._rods)
        self._hold((), 0.0)
        self._time = 0.0
        self._points = None

    def retune(self, options: Options) -> None:
        """Change the options; positions and velocities stay."""
        before, nodes = self._engine.state, self._rods.nodes
        self._tune(options)
        if self._rods.nodes == nodes:
            self._engine.state = before
        self._points = None

    def measure(self) -> Measures:
        """Return the stretch of rods and points, and energies; potential energy is 0 at rest."""
        rods, shape = self._rods, self._rates.shape
        if self._rest_energy is None:
            self._rest_energy = elastic_energy(rods, rest_state(rods), shape)
        down = self._head[:3, :3].T @ self._gravity(None)
        state = self._engine.state
        kinetic = 0.5 * float((rods.mass[..., None] * state.velocity**2).sum())
        fallen = ((state.position - rods.points) * down).sum(axis=-1)
        weight = -float((rods.mass * fallen).sum())
        length = np.linalg.norm(np.diff(state.position, axis=1), axis=-1)
        stretch = float(np.abs(length / rods.length - 1).max())
        energy = weight + elastic_energy(rods, state, shape) - self._rest_energy
        # in head axes, since float32 is coarse far away
        points = self._engine.points(self._embedding, np.eye(4)).astype(np.float64)
        depth = self._bodies.deepest(points, self._engine.torso_from_head, self._deepest)
        return Measures(max(stretch, self._drawn_stretch(points)), kinetic, energy, depth)

    def _drawn_stretch(self, points: Float64Array) -> float:
        """Return the largest stretch between points."""
        now = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
        long = self._embedding.length > SMALLEST
        return float(np.abs(now[long] / self._embedding.length[long] - 1).max(initial=0.0))

    def _tune(self, options: Options) -> None:
        """Set the options; rebuild only what the changed ones affect."""
        resolved = options.resolved(self._groom.physics)
        before: Options | None = getattr(self, "_options", None)
        new = before is None or before.nodes != resolved.nodes
        stiff = before is None or _stiffness(before) != _stiffness(resolved)
        if new:
            self._place_nodes(resolved.nodes)
        if new or stiff:
            self._stiffen(resolved)
        if new:
            self._embedding = embed_points(self._groom.strands, self._nodes, self._rods.frames)
            self._hair_grid: HairGrid = make_hair_grid(self._nodes, self._rods.mass)
        self._options = resolved
        self._rates = self._rates_of(resolved)
        self._systems: dict[float, System] = {}
        self._rest_energy = None
        self._contact = _contact(resolved, self._bodies, self._near, self._deepest)
        self._engine = self._make_engine(self._contact)
        self._engine.torso_from_head = inverse_motion(self._torso) @ self._head

    def _make_engine(self, contact: Contact) -> Engine:
        """Return the backend of the options."""
        name = self._options.backend
        if name == "compute" or (name == "auto" and on_graphics_card()):
            from .gl_backend import ComputeEngine

            return ComputeEngine(self._rods, contact)
        return (PreciseEngine if name == "reference" else FastEngine)(self._rods, contact)

    def _place_nodes(self, nodes: int) -> None:
        """Place nodes along the guides; measure the captured distance to the obstacles."""
        strands, width = self._groom.strands, self._groom.strands.widths
        self._nodes = node_points(strands, nodes)
        self._width = np.full(len(strands), self._groom.material.width)
        if width is not None:
            mean = np.add.reduceat(width, strands.offsets[:-1]) / strands.counts
            self._width = np.maximum(mean, 1e-6)
        near = self._bodies.at(self._nodes)[0]
        self._near: Float64Array = near
        length = np.maximum(strands.lengths(), 1e-9)
        self._held: Float64Array = held_lengths(self._groom) / length
        # embedded points between nodes outside the head may still cut through it
        self._deepest = np.minimum(self._bodies.at(strands.points)[0], 0.001) - 1e-5

    def _stiffen(self, options: Options) -> None:
        """Make the rods, whose natural shape balances gravity at the captured shape."""
        self._segment = float(np.median(np.linalg.norm(np.diff(self._nodes, axis=1), axis=-1)))
        density = HAIR_DENSITY * np.pi / 4 * self._width[:, None] ** 2
        most = max_stiffness(self._nodes, FRAME / options.substeps)[:, None]
        length = np.linalg.norm(np.diff(self._nodes, axis=1), axis=-1).min(axis=1, keepdims=True)
        most = np.minimum(most, FIRMEST * length**4 / (FRAME / options.substeps) ** 2)
        weight = abs(self._groom.physics.gravity) * overhang(self._nodes)[:, None]
        borne = weight / (UPRIGHT * np.sqrt(options.twist))
        firm = np.maximum(SINGLE_HAIR * 10.0 ** (options.bend or 0.0), borne)
        bending = density * np.minimum(firm, most)
        rods = make_rods(self._nodes, density, bending, bending * options.twist)
        down = np.array([0.0, -self._groom.physics.gravity, 0.0])
        weight = rods.mass[..., None] * down
        self._rods = balance_load(clamp_roots(rods, weight), weight)

    def _rates_of(self, options: Options) -> Rates:
        """Convert options to rates; drag goes as area over mass, which is 1 / width."""
        rods, width = self._rods, self._width
        drag = options.drag * width.mean() / width
        arc = np.pad(np.cumsum(rods.length, axis=1), ((0, 0), (1, 0)))
        total = arc[:, -1:]
        pull = options.pull() * np.maximum(1 - arc / REACH, 0.0) ** 2
        falls = (rods.points[:, :1, 1] - rods.points[:, -1:, 1]) / total
        weight = abs(self._groom.physics.gravity)
        pull += STANDING * np.clip(1 - falls, 0.0, 1.0) * weight / total
        pull = np.where(arc / total < self._held[:, None], HELD, pull)
        damping = -math.log(1 - (options.damping or 0.0)) / FRAME
        return Rates(np.repeat(drag[:, None], rods.nodes, axis=1), damping, pull)

    def _system(self, step: float) -> System:
        key = round(step, 9)
        if key not in self._systems:
            if len(self._systems) >= _KEPT_SYSTEMS:
                self._systems.pop(next(iter(self._systems)))
            shape = self._hands.pull(self._embedding, self._rates.shape)
            self._systems[key] = assemble(self._rods, replace(self._rates, shape=shape), step)
        return self._systems[key]

    def _piece(
        self, seconds: float, around: Surroundings, start: Float64Array, end: Float64Array
    ) -> None:
        """Advance by up to `FRAME`: update wind and hair grid once, then do substeps."""
        finer = finer_steps(start, end, self._rods.points[:, 0], self._segment)
        if finer == 0:
            start, finer = end, 1  # hair and torso go with a head that is elsewhere at once
            self._move_torso([(end, np.eye(4))])
            self._engine.state = self._engine.state  # known distances to the torso are void
        count = max(1, math.ceil(self._options.substeps * seconds / FRAME - 1e-6)) * finer
        step = seconds / count
        self._hold(around.grabs, self._options.grab_speed * seconds)
        gravity, air = self._gravity(around), self._air(around, start)
        force = self._hands.force(self._rods, self._embedding, inverse_motion(end))
        if self._options.cohesion > 0 or self._options.pressure > 0:
            rates = (self._options.cohesion, self._options.pressure, seconds)
            self._engine.apply_hair_grid(self._hair_grid, inverse_motion(end) @ start, rates)
        heads = motion_steps(start, end, count)
        loads = [
            Load(head_step, after[:3, :3].T, gravity, air, force, torso)
            for (after, head_step), torso in zip(heads, self._move_torso(heads), strict=True)
        ]
        self._engine.run(self._system(step), loads)
        self._time += seconds

    def _move_torso(self, heads: list[tuple[Float64Array, Float64Array]]) -> list[TorsoStep | None]:
        """Let the torso follow the head's `motion_steps`; return its own."""
        if self._bodies.torso is None:
            return [None] * len(heads)
        before, end = self._torso, heads[-1][0]
        self._torso = follow_head(before, end, self._bodies.joint)
        steps: list[TorsoStep | None] = []
        for (head, _), (torso, change) in zip(
            heads, motion_steps(before, self._torso, len(heads)), strict=True
        ):
            from_head = inverse_motion(torso) @ head
            steps.append(TorsoStep(from_head, inverse_motion(from_head) @ change @ from_head))
        self._engine.torso_from_head = inverse_motion(self._torso) @ end
        return steps

    def _hold(self, grabs: tuple[Grab, ...], most: float) -> None:
        """Move the hands by up to `most` metres; other held points are another system."""
        check_grabs(grabs, len(self.strands.points))
        before = self._hands.held
        self._hands.move(grabs, lambda: self.points, most)
        if self._hands.held != before:
            self._systems.clear()

    def _gravity(self, around: Surroundings | None) -> Float64Array:
        if around is None or around.gravity is None:
            return np.array([0.0, -self._groom.physics.gravity, 0.0])
        return around.gravity

    def _air(self, around: Surroundings, head: Float64Array) -> Float64Array:
        """Return the air velocity at the nodes, world; gusts are those where the head carries them.

        They are evaluated at every `APART`-th node and interpolated between.
        """
        wind = np.asarray(around.wind, np.float64)
        if around.turbulence == 0.0 or not wind.any():
            return wind
        nodes = self._rods.nodes
        some = np.unique(np.append(np.arange(0, nodes, APART), nodes - 1))
        share = np.stack([np.interp(np.arange(nodes), some, row) for row in np.eye(len(some))], 1)
        places, seed = self._rods.points[:, some].astype(np.float32), self._options.seed
        air = air_velocity(places, self._time, wind, around.turbulence, seed, head)
        result: Float64Array = share @ air
        return result


def _stiffness(options: Options) -> tuple[object, ...]:
    return options.bend, options.twist, options.substeps


def _contact(
    options: Options, bodies: Bodies, near: Float64Array, deepest: Float64Array
) -> Contact:
    """Return the contact parameters; hair captured nearer (S, n) keeps its own distance."""
    clearance, friction = np.minimum(options.clearance, near), options.friction or 0.0
    return Contact(bodies, clearance, friction, options.depenetration, deepest, options.rounds)
