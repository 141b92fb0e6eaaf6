"""The simulator: nodes along the guides, and what moves them in an `advance`."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.options import fill_options
from hairkit.parallel import parallel_for
from hairkit.simulation import Measures, Surroundings, quaternion, rigid_motion
from hairkit.simulation.embedding import FIRM, carry_points, embed_points, hand_goals, node_points
from hairkit.simulation.guide_simulator import FRAME, KERATIN, GuideSimulator
from hairkit.simulation.held_guides import held_lengths, pull_to_captured
from hairkit.simulation.lanes import LANES, Kind
from hairkit.simulation.obstacle_kernels import NO_FIELDS, WORTH
from hairkit.simulation.rigid_motion import inverse_motion, motion_steps
from hairkit.simulation.vectors import Floats
from hairkit.simulation.wind import air_velocity
from hairkit.types.groom import Groom

from .kernels import Hair, Steps, move
from .options import Options

CLEARANCE = 0.002
"""Metres that hair keeps off the bodies, where it was not nearer at rest."""
GRAB_SPEED = 5.0
"""m/s, of hands."""
REACH = 1.0
"""Metres from the head to the farthest hair."""


class PbdSimulator(GuideSimulator):
    """Simulated guides of a groom (see `hairkit.simulation.Simulator`)."""

    def __init__(
        self, groom: Groom, options: Options, kind: Kind = np.float32, contact: bool = True
    ) -> None:
        super().__init__(groom, contact)
        self._kind = kind
        self.retune(options)
        self._place(None)

    def retune(self, options: Options) -> None:
        """Change the options; hair stays where it is unless the number of nodes changes."""
        physics, before = self._groom.physics, getattr(self, "_hair", None)
        self._options = fill_options(
            options, stiffness=physics.stiffness, damping=physics.damping, friction=physics.friction
        )
        self._hair = self._at_rest()
        if before is not None and before.place.shape == self._hair.place.shape:
            self._hair = self._hair._replace(place=before.place, velocity=before.velocity)
        self._points = None

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Reset the guides to rest on a head at `head_from_rest` (4, 4), with zero velocity."""
        self._place(head_from_rest)
        self._hair = self._at_rest()

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Advance by `seconds` in substeps, in which the head moves evenly."""
        if not seconds > 0 or not len(self.strands):
            return
        options, start, end = self._options, self._head, surroundings.head_from_rest
        self._move_hands(surroundings, GRAB_SPEED * seconds)
        bust, torso = self._torso, rigid_motion.follow_head(self._torso, end, self._bodies.joint)
        frame = rigid_motion.interpolate_motion(start, end, min(1.0, FRAME / seconds))
        if rigid_motion.way_of_roots(start, frame, self._rest[:, 0]) == math.inf:
            start, bust = end, torso  # hair and torso go with a head that is elsewhere at once
            self._hair.slack[:] = 0
        count = max(1, math.ceil(options.substeps * seconds / FRAME - 1e-6))
        heads, changes = motion_steps(start, end, count)
        poses = inverse_motion(motion_steps(bust, torso, count)[0]) @ heads
        nearer = np.diff(poses, axis=0, prepend=[inverse_motion(bust) @ start])[:, :3]
        ways = REACH * np.linalg.norm(nearer[..., :3], axis=(1, 2))
        h, kind = seconds / count, self._kind
        steps = Steps(
            (changes - np.eye(4))[:, :3].astype(kind),
            (self._gravity(surroundings) @ heads[:, :3, :3]).astype(kind),
            poses,
            (ways + np.linalg.norm(nearer[..., 3], axis=1)).astype(kind),
            kind(h),
            kind(1 / (options.bend * h**2)),
            kind(options.drag),
            kind(1 - (1 - (options.damping or 0.0)) ** (h / FRAME)),
            kind(options.friction or 0.0),
            options.iterations,
        )
        hair, fields = self._under(surroundings, end), self._bodies.fields
        head, beside = fields._replace(torso=NO_FIELDS.torso), fields._replace(head=NO_FIELDS.head)
        parallel_for(move, len(hair.place), hair, steps, head, beside)
        self._head, self._torso, self._points = end, torso, None
        self._time += seconds

    def measure(self) -> Measures:
        """Return the stretch of nodes and points, and energies; potential energy is 0 at rest."""
        place, speed = self._strands_of(self._hair.place), self._strands_of(self._hair.velocity)
        near, fallen = self._strands_of(self._hair.near), place - self._rest
        length = np.linalg.norm(np.diff(place, axis=1), axis=-1)
        stretch = np.abs(length / near[:, :-1, 0] - 1).max(initial=0.0)
        chord = np.linalg.norm(place[:, 2:] - place[:, :-2], axis=-1) - near[:, :-2, 1]
        mass = (KERATIN * np.pi / 4 * self._groom.material.width**2) * near[:, :, 0].mean(axis=1)
        load = self._bears + self._head[:3, :3].T @ self._rest_gravity
        energy = 0.5 * self._options.bend * (chord**2).sum(axis=1)
        energy += (0.5 * self._pull * (fallen**2).sum(axis=-1) - (load * fallen).sum(-1)).sum(1)
        drawn, depth = self._measure_drawn()
        kinetic = 0.5 * (speed**2).sum(axis=(1, 2))
        return Measures(
            max(float(stretch), drawn), float(mass @ kinetic), float(mass @ energy), depth
        )

    def _at_rest(self) -> Hair:
        """Return the hair at rest; note where its nodes are, and what holds them there."""
        strands, options = self.strands, self._options
        nodes, weight = options.nodes, abs(self._groom.physics.gravity)
        rest = node_points(strands, nodes)
        near = np.zeros((*rest.shape[:2], 2))
        for apart in (1, 2):
            way = rest[:, apart:] - rest[:, :-apart]
            near[:, :-apart, apart - 1] = np.linalg.norm(way, axis=-1)
        held = held_lengths(self._groom) / near[:, :-1, 0].sum(axis=1)
        self._pull = pull_to_captured(
            rest, near[:, :-1, 0], options.stiffness or 0.0, options.borne * weight, held
        )
        self._on = embed_points(
            strands, rest, np.tile([1.0, 0.0, 0.0, 0.0], (len(rest), nodes - 1, 1))
        )
        self._rest, still = rest, np.zeros_like(rest)
        self._bears = options.borne * _borne(rest, self._rest_gravity)
        clear = np.minimum(self._bodies.at(rest)[0], CLEARANCE)
        parts = (near, clear, rest, still, 0 * clear, self._bears, rest, self._pull)
        return Hair(*map(self._lanes_of, parts))

    def _under(self, around: Surroundings, head: Float64Array) -> Hair:
        """Return the hair in the air and in the hands, which pull at the nearest nodes."""
        wind, drag, rest = around.wind, self._options.drag, self._rest
        air = air_velocity(rest, self._time, wind, around.turbulence, axes=head) @ head[:3, :3]
        goal, pull, back = rest.copy(), self._pull.copy(), inverse_motion(head)
        *held, places = hand_goals(self._on, rest, self._hands.places, back)
        goal[tuple(held)], pull[tuple(held)] = places, FIRM
        steady = self._lanes_of(drag * air + self._bears)
        goals, pulls = self._lanes_of(goal), self._lanes_of(pull)
        return self._hair._replace(steady=steady, goal=goals, pull=pulls)

    def _carry(self) -> Float64Array:
        """Return where the nodes carry the guides' points (P, 3), head axes."""
        nodes, points = self._strands_of(self._hair.place), np.empty((len(self._on.rod), 3))
        turns = quaternion.shortest_arc(_ways(self._rest), _ways(nodes))
        parallel_for(
            carry_points, len(points), self._on, nodes[:, None], turns[:, None], points,
            min_chunk=WORTH,
        )  # fmt: skip
        return points

    def _lanes_of(self, values: Float64Array) -> Floats:
        """Return values (S, n, ...) as (B, n, ..., LANES), filled up with the last strand."""
        blocks = -(-len(values) // LANES)
        which = np.minimum(np.arange(blocks * LANES), len(values) - 1)
        parts = values[which].reshape(blocks, LANES, *values.shape[1:])
        return np.ascontiguousarray(np.moveaxis(parts, 1, -1), self._kind)

    def _strands_of(self, lanes: Floats) -> Float64Array:
        """Return values (B, n, parts, LANES) as (S, n, parts)."""
        parts = np.moveaxis(lanes, -1, 1).reshape(-1, *lanes.shape[1:-1])
        return parts[: len(self.strands)].astype(np.float64)


def _ways(nodes: Float64Array) -> Float64Array:
    """Return the directions (S, n - 1, 3) of segments."""
    return quaternion.normalize(np.diff(nodes, axis=1))


def _borne(rest: Float64Array, gravity: Float64Array) -> Float64Array:
    """Return accelerations (S, n, 3) against that part of gravity which segments cannot bear.

    Segments bear what changes their lengths: the projection of gravity on these directions.
    """
    way, left = _ways(rest)[:, 1:], np.zeros_like(rest)
    turn = (way[:, 1:] * way[:, :-1]).sum(axis=-1)
    k = np.arange(way.shape[1])
    matrix = np.zeros((len(rest), len(k), len(k)))
    matrix[:, k, k] = np.where(k > 0, 2.0, 1.0)  # only the outer end of the first is free
    matrix[:, k[1:], k[:-1]] = matrix[:, k[:-1], k[1:]] = -turn
    load = np.where(k > 0, 0.0, way @ gravity)
    force = np.linalg.solve(matrix, load[..., None]) * way
    left[:, 2:] = force - gravity
    left[:, 2:-1] -= force[:, 1:]
    return left
