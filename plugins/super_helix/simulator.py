"""The simulator of the contract: guides as super-helices on a moving head."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.options import fill_options
from hairkit.parallel import parallel_for
from hairkit.simulation import Measures, Surroundings
from hairkit.simulation.guide_simulator import FRAME, KERATIN, GuideSimulator
from hairkit.simulation.hair_grid import SPACING, make_hair_grid
from hairkit.simulation.held_guides import held_lengths
from hairkit.simulation.rigid_motion import follow_head, interpolate_motion
from hairkit.simulation.wind_shadow import wind_losses
from hairkit.types.groom import Groom

from .binding import bind_rods, carry_points
from .linear_time_step import place_points, step_strands
from .options import Options
from .rods import NODES, Rods
from .state import Body, Loads, Motion, Step
from .statics import rest_as_captured

SKIN = 0.0015
"""Hair is kept this far off the head, metres, where it was not nearer at rest."""
PUSH_RATE, GRAB_RATE = 600.0, 150.0
"""Rates, per second, at which contact and a user's hand act on a point's or a strand's mass."""
GRAB_SPEED = 5.0
"""Highest speed of a user's hand, m/s: faster ones would whip the strand."""
POISSON = 0.38
"""Poisson's ratio of hair."""
HELD = 100.0
"""Times the stiffness of hair that hair before its tie has: it is stretched over the head."""
MIDDLE = 0.6
"""`bend_stiffness` of a groom at which the stiffness is that of the options."""


class SuperHelices(GuideSimulator):
    """Guides whose elements keep their length: two curvatures and a twist each."""

    def __init__(self, groom: Groom, options: Options) -> None:
        super().__init__(groom, options.contact)
        self._shape, self._binding = bind_rods(self.strands, options.elements)
        self.retune(options)
        self.reset()

    def retune(self, options: Options) -> None:
        """Take other options from now on; positions and the number of elements stay."""
        width, grip = self._groom.material.width * 1e6, self._groom.physics.friction
        options = self._options = fill_options(options, diameter=width, friction=grip)
        self._rods = rest_as_captured(self._with_material(options), self._rest_gravity)

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Put the guides at rest on a head at `head_from_rest` (4, 4), without velocity."""
        self._place(head_from_rest)
        head, self._before = self._head, 0.0
        shape = (len(self._rods.lengths), NODES)
        rest = np.empty((*shape, 3))
        parallel_for(
            place_points, len(self._rods.roots), self._rods, self._rods.captured, head, rest
        )
        q, still = self._rods.captured, np.zeros((*shape, 3))
        self._motion = Motion(q.copy(), q.copy(), rest, rest.copy(), still, still.copy())
        own = (rest - head[:3, 3]) @ head[:3, :3]
        self._gap = np.minimum(SKIN, self._bodies.at(own)[0])
        hair, strand = make_hair_grid(own, self._rods.masses), SPACING * self._rods.density.mean()
        self._shadow = wind_losses(hair, len(self.strands), strand, self._bodies), hair.origin
        self._hair_grid, self._at_rest = hair, own
        self._rest_energy = self._potential(own, q, self._rest_gravity)

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Go on by `seconds` in substeps; the head moves evenly from where it was."""
        if not seconds > 0:
            raise InputError(f"cannot advance by {seconds} s, expected seconds above 0")
        count = max(1, int(np.ceil(seconds / FRAME * self._options.substeps - 1e-6)))
        start, end = self._head, surroundings.head_from_rest
        air = self._air(surroundings)
        for substep in range(1, count + 1):
            head = interpolate_motion(start, end, substep / count)
            self._substep(seconds / count, head, surroundings, air)

    def measure(self) -> Measures:
        """Return the present read-outs."""
        speed = (self._motion.velocity**2).sum(-1)
        own = (self._motion.points - self._head[:3, 3]) @ self._head[:3, :3]
        gravity = self._rest_gravity @ self._head[:3, :3]
        stretch, depth = self._measure_drawn()
        return Measures(
            stretch,
            float(0.5 * (self._rods.masses * speed).sum()),
            self._potential(own, self._motion.q, gravity) - self._rest_energy,
            depth,
        )

    def _substep(
        self, seconds: float, head: Float64Array, around: Surroundings, air: Float64Array
    ) -> None:
        options = self._options
        two_step = options.second_order and abs(self._before - seconds) < 1e-9
        torso, fields = follow_head(self._torso, head, self._bodies.joint), self._bodies.fields
        step = Step(
            seconds,
            two_step,
            options.internal_friction,
            options.iterations,
            np.array(self._gravity(around), np.float64),
            np.array(head, np.float64),
            PUSH_RATE**2,
            float(options.friction or 0.0),
            (
                Body(np.array(head), np.array(self._head), fields.head),
                Body(np.array(torso), np.array(self._torso), fields.torso),
            ),
        )
        self._move_hands(around, GRAB_SPEED * seconds)
        self._mix(seconds)
        loads = self._loads(around, air)
        parallel_for(step_strands, len(self._rods.roots), self._rods, self._motion, loads, step)
        self._head, self._torso, self._before = step.head, torso, seconds
        self._points = None
        self._time += seconds

    def _air(self, around: Surroundings) -> Float64Array:
        """Return (E, NODES, 3) the air's velocity, taken at the middle of each element."""
        if not np.any(around.wind):
            return np.zeros_like(self._motion.points)
        now = (self._motion.points[:, NODES // 2] - self._head[:3, 3]) @ self._head[:3, :3]
        air = self._air_at(
            self._at_rest[:, NODES // 2, None], now, around, self._head, self._options.air_drag
        )
        return np.repeat(air, NODES, axis=1)

    def _mix(self, seconds: float) -> None:
        """Let hair take on the speed of that around it, and leave crowds; as in `rods`, draw it to
        where what was beside it at rest has gone."""
        options, motion, turn = self._options, self._motion, self._head[:3, :3]
        own, mass = (motion.points - self._head[:3, 3]) @ turn, self._rods.masses
        speed, moved = motion.velocity @ turn, own - self._at_rest
        mixed, mean = speed.copy(), moved.copy()
        rates = options.hair_friction, options.hair_push, seconds
        for place, changed, how in (own, mixed, rates), (self._at_rest, mean, (np.inf, 0.0, 1.0)):
            nodes = place.reshape(1, 1, -1, 3), changed.reshape(1, 1, -1, 3)
            self._hair_grid.mix(*nodes, mass.reshape(1, 1, -1), np.eye(4), how)
        change = (mixed - speed + options.adhesion * seconds * (mean - moved)) @ turn.T
        motion.velocity[:] += change
        motion.velocity_before[:] += change

    def _loads(self, around: Surroundings, air: Float64Array) -> Loads:
        motion, masses = self._motion, self._rods.masses
        drag, spring, anchor = (
            self._options.air_drag * masses,
            np.zeros(masses.shape),
            np.zeros_like(motion.points),
        )
        drawn = self.points if around.grabs else np.empty((0, 3))
        for point, place in self._hands.items():
            element = self._binding.element[point]
            node = int(np.argmin(np.linalg.norm(motion.points[element] - drawn[point], axis=1)))
            strand = np.searchsorted(self._rods.offsets, element, side="right") - 1
            own = slice(self._rods.offsets[strand], self._rods.offsets[strand + 1])
            spring[element, node] = GRAB_RATE**2 * masses[own].sum()
            lever = motion.points[element, node] - drawn[point]
            anchor[element, node] = place + lever
        return Loads(drag, np.ascontiguousarray(air), spring, anchor, self._gap)

    def _with_material(self, options: Options) -> Rods:
        """Return the captured rods with the stiffness and mass of hair."""
        width = 1e-6 * float(options.diameter or 0.0)
        second = np.pi * (width / 2) ** 4 / 4
        bend = options.young * 1e9 * second * options.stiffness
        bend *= self._groom.physics.bend_stiffness / MIDDLE
        one = np.array([bend / (1 + POISSON), bend, bend])
        shape = self._shape
        density = np.full(len(shape.lengths), KERATIN * np.pi * width**2 / 4)
        strand = np.repeat(np.arange(len(shape.roots)), np.diff(shape.offsets))
        way = np.append(0.0, np.cumsum(shape.lengths))
        held = way[1:] - way[shape.offsets[strand]] <= held_lengths(self._groom)[strand]
        stiffness = np.where(held, HELD, 1.0)[:, None] * one
        return shape._replace(stiffness=stiffness, density=density)

    def _carry(self) -> Float64Array:
        """Return where the elements carry the guides' points (P, 3), head axes."""
        total = len(self._binding.arc)
        points, frames = np.empty((total, 3)), np.empty((total, 3, 3))
        parallel_for(
            carry_points,
            len(self._rods.roots),
            self._rods,
            self._motion.q,
            self._binding,
            points,
            frames,
        )
        return points

    def _potential(self, points: Float64Array, q: Float64Array, gravity: Float64Array) -> float:
        rods = self._rods
        elastic = 0.5 * (rods.lengths[:, None] * rods.stiffness * (q - rods.natural) ** 2).sum()
        return float(elastic - (rods.masses[..., None] * points * gravity).sum())
