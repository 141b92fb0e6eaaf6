"""The simulator: what holds captured hair in place, and what moves it."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.parallel import parallel_for
from hairkit.simulation import Surroundings, quaternion
from hairkit.simulation.embedding import directions
from hairkit.simulation.lanes import Kind, Records, fill_lanes, pack_lanes
from hairkit.simulation.node_simulator import NodeSimulator
from hairkit.simulation.substeps import Course, Settings, StepArrays, Steps
from hairkit.simulation.vectors import Floats
from hairkit.types.groom import Groom

from .kernels import NODE, move
from .options import Options


class PbdSimulator(NodeSimulator):
    """Simulated guides of a groom (see `hairkit.simulation.Simulator`)."""

    _options: Options

    def __init__(
        self, groom: Groom, options: Options, kind: Kind = np.float32, contact: bool = True
    ) -> None:
        self._kind = kind
        super().__init__(groom, options, contact)

    @property
    def _state(self) -> Records:
        return self._hair.copy()

    @_state.setter
    def _state(self, value: Records) -> None:
        for name, known in ("place", 1), ("speed", 1), ("room", 0), ("aside", 0):
            self._hair[name] = known * value[name]

    def _build(self, near: Float64Array) -> None:
        """Make the hair at rest, and what bears its weight there."""
        rest, options = self._nodes, self._options
        self._pull = self._pull_to_rest(options.borne)
        self._bears = options.borne * borne(rest, self._rest_gravity)
        reach = [np.linalg.norm(rest[:, far:] - rest[:, :-far], axis=-1) for far in (1, 2)]
        self._reach = np.stack([np.pad(reach[k], ((0, 0), (0, k + 1))) for k in (0, 1)], -1)
        self._hair = np.zeros((len(pack_lanes(rest, self._kind)), options.nodes), NODE[self._kind])
        fill_lanes(
            self._hair, place=rest, rest=rest, reach=self._reach, clear=near, drag=self._drag
        )

    def _now(self) -> tuple[Floats, Floats, Floats]:
        """Return nodes, velocities, and frames that turn as the segments do, in blocks."""
        place, speed, rest = (np.moveaxis(self._hair[n], -1, 1) for n in ("place", "speed", "rest"))
        return place, speed, quaternion.shortest_arc(directions(rest), directions(place))

    def _elastic(self, place: Float64Array) -> float:
        """Return the energy of springs, of the pull to rest, and of what bears the weight there."""
        fallen, chord = place - self._nodes, np.linalg.norm(place[:, 2:] - place[:, :-2], axis=-1)
        energy = 0.5 * self._pull * (fallen**2).sum(axis=-1) - (self._bears * fallen).sum(axis=-1)
        energy[:, 2:] += 0.5 * self._options.bend * (chord - self._reach[:, :-2, 1]) ** 2
        return float((self._mass * energy).sum())

    def _substeps(
        self, steps: StepArrays, seconds: float, around: Surroundings, head: Course
    ) -> None:
        """Let air and hands act, and do the substeps."""
        options, kind, end = self._options, self._kind, head[1]
        blown = self._drag[..., None] * (self._air(around, end) @ end[:3, :3])
        steady = self._bears + blown + self._drawn_by_hands(end)
        fill_lanes(self._hair, pull=self._pull_with_hands(tuple(self._hands)), steady=steady)
        friction, fastest = kind(options.friction or 0.0), kind(options.depenetration)
        run = Settings(kind(seconds), kind(self._damping), friction, fastest, options.iterations)
        arrays, soft = (part.astype(kind) for part in steps), kind(1 / (options.bend * seconds**2))
        blocks, fields = len(self._hair), self._bodies.fields
        parallel_for(move, blocks, self._hair, Steps(*arrays), fields, run, soft)


def borne(rest: Float64Array, gravity: Float64Array) -> Float64Array:
    """Return accelerations (S, n, 3) against that part of gravity which segments cannot bear.

    Segments bear what changes their lengths: the projection of gravity on these directions.
    """
    way = directions(rest)[:, 1:]
    change = np.eye(way.shape[1]) - np.eye(way.shape[1], k=-1)  # of segments by their free ends
    gram = change @ change.T * (way @ way.swapaxes(1, 2))
    load = change.sum(axis=1) * (way @ gravity)
    force = np.linalg.solve(gram, load[..., None]) * way
    return np.pad(change.T @ force - gravity, ((0, 0), (2, 0), (0, 0)))
