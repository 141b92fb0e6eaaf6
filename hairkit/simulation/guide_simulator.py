"""What simulators of a groom's guides share: the guides, head and torso, and the points drawn."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, frozen_array, read_only
from hairkit.errors import InputError
from hairkit.grooming.guide_weights import guide_mask
from hairkit.parallel import parallel_for
from hairkit.simulation.obstacle_kernels import Drawn, Points, draw_points
from hairkit.simulation.obstacles import NO_BODIES, Bodies, groom_bodies
from hairkit.simulation.rigid_motion import inverse_motion, transform_points
from hairkit.simulation.simulator import Surroundings, check_grabs
from hairkit.simulation.vectors import Floats
from hairkit.simulation.wind import air_velocity
from hairkit.simulation.wind_shadow import passing_wind
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

FRAME = 1 / 60
"""Seconds that the option `substeps` of simulators divides."""
KERATIN = 1300.0
"""Density of hair, kg/m^3."""
DRAWN, ROUNDING = 0.001, 1e-5
"""Metres off the obstacles that drawn points keep, where they were not nearer at rest, and by which
that is less than what grids say."""
SMALLEST = 2e-5
"""Metres between points of which float32 has digits enough for a stretch of 1 %."""
WORTH = 256
"""Strands that are worth another thread's while."""


class GuideSimulator(ABC):
    """Guides on a head and a torso; a subclass moves them (see `Simulator`)."""

    _options: Any
    _time: float
    _head: Float64Array
    """(4, 4) motion since rest, world."""
    _torso: Float64Array
    """(4, 4) motion since rest, world."""
    _hands: dict[int, Float64Array]
    """Where the hand of each held point is, (3,) metres, world."""
    _points: Float32Array | None
    """Those last asked for; None after a motion."""
    _shadow: tuple[Floats, Float64Array]
    """What hair and head take of the wind: `wind_losses`, and where their first cell is."""

    def __init__(self, groom: Groom, contact: bool = True) -> None:
        if not len(groom.strands):
            raise InputError("the groom holds no strands, so there is nothing to simulate")
        self._bodies: Bodies = groom_bodies(groom) if contact else NO_BODIES
        self._groom = groom.select(guide_mask(groom.strands))
        self._drawn = drawn_at_rest(self._groom.strands, self._bodies)
        self._rest_gravity = np.array([0.0, -groom.physics.gravity, 0.0])

    @property
    def strands(self) -> Strands:
        """The guides at rest, head frame."""
        return self._groom.strands

    @property
    def options(self) -> Any:
        """The options in force; None is replaced by the groom's value."""
        return self._options

    @property
    def time(self) -> float:
        """Seconds since the start or the last reset."""
        return self._time

    @property
    def points(self) -> Float32Array:
        """(P, 3) present positions in the world, metres, in the order of `strands`."""
        if self._points is None:
            own = self._draw()
            world = transform_points(self._head.astype(own.dtype), own)
            self._points = read_only(world.astype(np.float32))
        return self._points

    @abstractmethod
    def _carry(self) -> Points:
        """Return where the method's own curves carry the guides' points (P, 3), head axes."""

    def _place(self, head_from_rest: npt.ArrayLike | None) -> None:
        """Set time to 0, head and torso at a motion (4, 4) since rest; None: at rest; let go."""
        head = np.eye(4) if head_from_rest is None else head_from_rest
        self._head = self._torso = frozen_array(head, np.float64, (4, 4), "head_from_rest")
        self._time, self._points, self._hands = 0.0, None, {}

    def _move_hands(self, around: Surroundings, most: float) -> None:
        """Move hands by up to `most` metres to the targets of grabs; a new one is at its point."""
        check_grabs(around.grabs, len(self.strands.points))
        before, self._hands = self._hands, {}
        for grab in around.grabs:
            start = before.get(grab.point)
            start = self.points[grab.point].astype(np.float64) if start is None else start
            way = np.asarray(grab.target, np.float64) - start
            size = max(float(np.linalg.norm(way)), 1e-12)
            self._hands[grab.point] = start + min(1.0, most / size) * way

    def _gravity(self, around: Surroundings) -> Float64Array:
        """Return gravity (3,), world."""
        return self._rest_gravity if around.gravity is None else around.gravity

    def _air_at(
        self,
        rest: Points,
        now: Points,
        around: Surroundings,
        head: Float64Array,
        drag: float,
        seed: int = 0,
    ) -> Float64Array:
        """Return the air's velocity (S, n, 3), world: what passes hair and head, and all gusts.

        Gusts are those where the head carries `rest` (S, n, 3); `now` (S n or more, 3) are the
        places where the wind passes, head axes. The wind is not 0.
        """
        wind = np.asarray(around.wind, np.float64)
        air = air_velocity(rest, self._time, wind, around.turbulence, seed, head)
        places, own = now[: air.size // 3], wind @ head[:3, :3]
        passing = passing_wind(*self._shadow, places, own, drag).reshape(*air.shape[:2], 1)
        return air - (1 - passing) * wind

    def _torso_from_head(self) -> Float64Array:
        """Return the motion (4, 4) from the head axes to the torso's."""
        return inverse_motion(self._torso) @ self._head

    def _draw(self) -> Points:
        """Return the guides' points (P, 3), head axes, each out of the obstacles.

        Brows, lashes and beard are stiff.
        """
        points, stiff = self._carry(), self.strands.planted[self.strands.strand_of_point]
        keep_out(self._drawn, self._bodies, self._torso_from_head(), points)
        points[stiff] = self.strands.points[stiff]
        return points

    def _measure_drawn(self) -> tuple[float, float]:
        """Return the largest stretch between drawn points, and how much deeper one is than at rest.

        In head axes, since float32 is coarse far away.
        """
        points, length = self._draw().astype(np.float64), self._drawn.length
        now = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
        long = length > SMALLEST
        stretch = float(np.abs(now[long] / length[long] - 1).max(initial=0.0))
        depth = self._bodies.deepest(points, self._torso_from_head(), self._drawn.deepest)
        return stretch, depth


def drawn_at_rest(strands: Strands, bodies: Bodies) -> Drawn:
    """Return lengths and depths that the points of strands keep when they are drawn."""
    points = strands.points.astype(np.float64)
    length = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    length[strands.offsets[:-1]] = 0.0
    # points between nodes outside the head may still cut through it
    deepest = np.minimum(bodies.at(strands.points)[0], DRAWN) - ROUNDING
    return Drawn(strands.offsets, length, deepest)


def keep_out(drawn: Drawn, bodies: Bodies, torso_from_head: Float64Array, points: Points) -> None:
    """Move points (P, 3), head axes, in their place: out of the bodies, as far apart as at rest."""
    count = len(drawn.starts) - 1
    parallel_for(draw_points, count, drawn, bodies.fields, torso_from_head, points, min_chunk=WORTH)
