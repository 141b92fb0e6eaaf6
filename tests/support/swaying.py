"""A trivial simulator for the viewer's tests: hair goes with the head and leans with the wind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hairkit import hookimpl
from hairkit.options import option
from hairkit.simulation.simulator import Measures


@dataclass(frozen=True)
class Options:
    """What the viewer shows as sliders."""

    lean: float = option(0.01, low=0.0, high=0.1, doc="Metres a tip leans in 1 m/s.", unit="m")
    turns: int = option(3, low=1, high=9, doc="A whole number.")
    mode: str = option("soft", choices=("soft", "hard"), doc="A choice.")
    stiff: bool = option(False, doc="A switch.")


class Swaying:
    """Points lean with the wind by their distance from the root; held points are in the hand."""

    def __init__(self, groom: Any, options: Options) -> None:
        self.strands = groom.strands
        self.options = options
        self.time = 0.0
        self.points = groom.strands.points
        arc = groom.strands.arc_lengths()
        self._share = (arc / arc.max())[:, None]

    def advance(self, seconds: float, surroundings: Any) -> None:
        """Take the place that head and wind ask for, at once."""
        self.time += seconds
        matrix = surroundings.head_from_rest
        points = self.strands.points @ matrix[:3, :3].T + matrix[:3, 3]
        points = points + self.options.lean * self._share * surroundings.wind
        for grab in surroundings.grabs:
            points[grab.point] = grab.target
        self.points = points.astype(np.float32)

    def reset(self, head_from_rest: Any = None) -> None:
        """Go back to rest."""
        self.time = 0.0
        matrix = np.eye(4) if head_from_rest is None else np.asarray(head_from_rest)
        self.points = (self.strands.points @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)

    def retune(self, options: Any) -> None:
        """Take other options."""
        self.options = options

    def measure(self) -> Measures:
        """Return that all is calm."""
        return Measures(0.0, 0.0, 0.0)


@hookimpl
def make_simulator(groom: Any, options: Options) -> Swaying:
    """Return the simulator."""
    return Swaying(groom, options)
