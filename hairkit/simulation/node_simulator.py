"""What simulators share whose guides are chains of nodes: time, motion of head and torso, air."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, Int64Array
from hairkit.parallel import parallel_for
from hairkit.simulation.embedding import (
    FIRM,
    Embedding,
    carry_points,
    embed_points,
    hand_goals,
    held_nodes,
    node_points,
)
from hairkit.simulation.guide_simulator import FRAME, KERATIN, GuideSimulator
from hairkit.simulation.hair_grid import SPACING, make_hair_grid
from hairkit.simulation.held_guides import held_lengths, pull_to_captured
from hairkit.simulation.obstacle_kernels import WORTH, Points
from hairkit.simulation.rigid_motion import (
    finer_steps,
    follow_head,
    interpolate_motion,
    inverse_motion,
)
from hairkit.simulation.simulator import Measures, Surroundings
from hairkit.simulation.substeps import Course, StepArrays, make_steps
from hairkit.simulation.vectors import Floats
from hairkit.simulation.wind_shadow import wind_losses
from hairkit.types.groom import Groom
from hairkit.types.node_options import NodeOptions

APART = 4
"""Nodes between those at which the air, and what hair does beside hair, is evaluated: shorter than
half a gust is long."""


class NodeSimulator(GuideSimulator):
    """Guides of `nodes` nodes each, in head axes; a subclass does the substeps of a frame."""

    _options: NodeOptions
    _embedding: Embedding
    """Of the guides' own points in the nodes."""
    _nodes: Float64Array
    """(S, n, 3) nodes at rest, metres."""
    _length: Float64Array
    """(S, n - 1) lengths between them, metres."""
    _mass: Float64Array
    """(S, n) kilograms."""
    _pull: Float64Array
    """(S, n) squared frequency of the pull to rest, 1/s^2."""
    _some: Int64Array
    """Every `APART`th node and the last."""
    _share: Float64Array
    """(n, k) by which values at those nodes are interpolated."""
    _still: Any
    """The state at rest."""

    def __init__(self, groom: Groom, options: NodeOptions, contact: bool = True) -> None:
        super().__init__(groom, contact)
        self._place(None)
        self._place_nodes(options.nodes)
        self._tune(options)

    @property
    @abstractmethod
    def _state(self) -> Any:
        """A copy of the present state; setting it voids what is known of distances to bodies."""

    @_state.setter
    @abstractmethod
    def _state(self, value: Any) -> None: ...

    @abstractmethod
    def _build(self, near: Float64Array) -> None:
        """Make what moves the nodes, at rest, by the options; `near` (S, n) is its clearance."""

    @abstractmethod
    def _now(self) -> tuple[Floats, Floats, Floats]:
        """Return nodes and velocities (B, L, n, 3) and frames (B, L, n - 1, 4); last are void."""

    @abstractmethod
    def _elastic(self, place: Float64Array) -> float:
        """Return the energy of what holds nodes (S, n, 3) to their shape, joules, 0 at rest."""

    @abstractmethod
    def _substeps(
        self, steps: StepArrays, seconds: float, around: Surroundings, head: Course
    ) -> None:
        """Move the nodes in substeps of so many seconds, in which the head goes along `head`."""

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Advance by `seconds`, in pieces of at most `FRAME`, each in substeps."""
        if not seconds > 0:
            return
        start, end = self._head, surroundings.head_from_rest
        pieces = max(1, math.ceil(seconds / FRAME - 1e-6))
        heads = [interpolate_motion(start, end, piece / pieces) for piece in range(pieces + 1)]
        for course in pairwise(heads):
            self._piece(seconds / pieces, surroundings, course)
        self._head, self._points = end, None

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Reset the guides to rest on a head at `head_from_rest` (4, 4), with zero velocity."""
        self._place(head_from_rest)
        self._state = self._still

    def retune(self, options: NodeOptions) -> None:
        """Change the options; positions and velocities stay unless the number of nodes changes."""
        before, other = self._state, options.nodes != self._options.nodes
        if other:
            self._place_nodes(options.nodes)
        self._tune(options)
        if not other:
            self._state = before
        self._points = None

    def measure(self) -> Measures:
        """Return the stretch of nodes and points, and energies; potential energy is 0 at rest."""
        place, speed, _ = self._now_by_strands()
        kinetic = 0.5 * float((self._mass[..., None] * speed**2).sum())
        fallen = (place - self._nodes) @ (self._head[:3, :3].T @ self._rest_gravity)
        energy = self._elastic(place) - float((self._mass * fallen).sum())
        length = np.linalg.norm(np.diff(place, axis=1), axis=-1)
        stretch = float(np.abs(length / self._length - 1).max(initial=0.0))
        drawn, depth = self._measure_drawn()
        return Measures(max(stretch, drawn), kinetic, energy, depth)

    def _now_by_strands(self) -> Iterator[Float64Array]:
        """Yield nodes and velocities (S, n, 3) and frames (S, n - 1, 4)."""
        for part in self._now():
            yield part.reshape(-1, *part.shape[2:])[: len(self._nodes)].astype(np.float64)

    def _place_nodes(self, nodes: int) -> None:
        """Place nodes along the guides; measure the captured distance to the obstacles."""
        strands, width = self.strands, self.strands.widths
        some = self._some = np.unique(np.append(np.arange(0, nodes, APART), nodes - 1))
        shares = [np.interp(np.arange(nodes), some, row) for row in np.eye(len(some))]
        self._share = np.stack(shares, axis=1)
        self._nodes = node_points(strands, nodes)
        self._length = np.linalg.norm(np.diff(self._nodes, axis=1), axis=-1)
        self._segment = float(np.median(self._length))
        self._width = np.full(len(strands), self._groom.material.width)
        if width is not None:
            mean = np.add.reduceat(width, strands.offsets[:-1]) / strands.counts
            self._width = np.maximum(mean, 1e-6)
        self._density = KERATIN * np.pi / 4 * self._width[:, None] ** 2
        bars = np.pad(self._density * self._length, ((0, 0), (1, 1)))
        self._mass = 0.5 * (bars[:, 1:] + bars[:, :-1])
        self._near = self._bodies.at(self._nodes)[0]
        hair = self._hair_grid = make_hair_grid(self._nodes, self._mass)
        strand = SPACING * self._density.mean()
        self._shadow = wind_losses(hair, len(strands), strand, self._bodies), hair.origin
        self._held = held_lengths(self._groom) / np.maximum(strands.lengths(), 1e-9)

    def _tune(self, options: NodeOptions) -> None:
        """Set the options, and make what moves the nodes by them."""
        options = self._options = options.resolved(self._groom.physics)
        self._damping = -math.log(1 - (options.damping or 0.0)) / FRAME
        drag = options.drag * self._width.mean() / self._width
        self._drag = np.repeat(drag[:, None], options.nodes, axis=1)
        # hair captured nearer keeps its own distance
        self._build(np.minimum(options.clearance, self._near))
        self._still = self._state
        _, _, frames = self._now_by_strands()
        self._embedding = embed_points(self.strands, self._nodes, frames)

    def _piece(self, seconds: float, around: Surroundings, head: Course) -> None:
        """Advance by up to `FRAME`, in substeps, of which a fast head takes more."""
        options, (start, end) = self._options, head
        self._move_hands(around, options.grab_speed * seconds)
        torso = follow_head(self._torso, end, self._bodies.joint)
        finer = finer_steps(start, end, self._nodes[:, 0], self._segment, options.substeps)
        if finer == 0:
            start, finer = end, 1  # hair and torso go with a head that is elsewhere at once
            self._torso, self._state = torso, self._state
        count = max(1, math.ceil(options.substeps * seconds / FRAME - 1e-6)) * finer
        step, head = seconds / count, (start, end)
        steps = make_steps(head, (self._torso, torso), count, self._gravity(around), step)
        self._substeps(steps, step, around, head)
        self._torso = torso
        self._time += seconds

    def _pull_to_rest(self, share: float = 1.0) -> Float64Array:
        """Return the squared frequency (S, n) of the pull to rest; hair bears a share of itself."""
        firm, weight = self._options.stiffness or 0.0, share * abs(self._groom.physics.gravity)
        return pull_to_captured(self._nodes, self._length, firm, weight, self._held)

    def _pull_with_hands(self, held: tuple[int, ...]) -> Float64Array:
        """Return the squared frequency (S, n) of pulls to rest and to hands that hold points."""
        pull = self._pull.copy()
        np.add.at(pull, held_nodes(self._embedding, held), FIRM)
        return pull

    def _drawn_by_hands(self, head: Float64Array) -> Float64Array:
        """Return the acceleration (S, n, 3) that makes hands, not rest, the ends of their pulls."""
        drawn, back = np.zeros_like(self._nodes), inverse_motion(head)
        rod, node, goal = hand_goals(self._embedding, self._nodes, self._hands, back)
        np.add.at(drawn, (rod, node), FIRM * (goal - self._nodes[rod, node]))
        return drawn

    def _carry(self) -> Points:
        """Return where the nodes carry the guides' points (P, 3), head axes."""
        place, _, frames = self._now()
        on, count = self._embedding, len(self._embedding.rod)
        points = np.empty((count, 3), place.dtype)
        parallel_for(carry_points, count, on, place, frames, points, min_chunk=WORTH)
        return points

    def _air(self, around: Surroundings, head: Float64Array) -> Float64Array:
        """Return the air velocity at the nodes, world, interpolated from some of them."""
        if not np.any(around.wind):
            return np.zeros(3)
        places, now = self._nodes[:, self._some], self._now()[0][:, :, self._some].reshape(-1, 3)
        drag, seed = self._options.drag, self._options.seed
        air = self._air_at(places.astype(np.float32), now, around, head, drag, seed)
        return np.asarray(self._share @ air)
