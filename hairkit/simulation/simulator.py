"""What every simulator of guides can do, whatever its method."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, frozen_array
from hairkit.types.strands import Strands


@dataclass(frozen=True)
class Grab:
    """A point of a strand that the user holds."""

    point: int
    """Its number in the strands' points."""
    target: tuple[float, float, float]
    """Where it is pulled to, world, metres."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What acts on the hair during one `advance`: the state at its end; motion is interpolated."""

    head_from_rest: Float64Array = field(default_factory=lambda: np.eye(4))
    """(4, 4) rigid motion of the head since rest, in the world."""
    wind: Float64Array = field(default_factory=lambda: np.zeros(3))
    """(3,) velocity of the air, metres per second, world."""
    turbulence: float = 0.0
    """How far gusts go beyond the mean wind, as a share of it."""
    gravity: Float64Array | None = None
    """(3,) metres per second squared, world; None takes the groom's, along -Y."""
    grabs: tuple[Grab, ...] = ()

    def __post_init__(self) -> None:
        motion = frozen_array(self.head_from_rest, np.float64, (4, 4), "head_from_rest")
        object.__setattr__(self, "head_from_rest", motion)
        object.__setattr__(self, "wind", frozen_array(self.wind, np.float64, (3,), "wind"))
        if self.gravity is not None:
            gravity = frozen_array(self.gravity, np.float64, (3,), "gravity")
            object.__setattr__(self, "gravity", gravity)


@dataclass(frozen=True)
class Measures:
    """Read-outs of a simulator's present state."""

    stretch: float
    """Largest relative change of a segment's length, 0.01 for 1 %."""
    kinetic_energy: float
    """Joules, all guides."""
    potential_energy: float
    """Joules of gravity and elastic energy; 0 is the rest state."""


@runtime_checkable
class Simulator(Protocol):
    """Simulated guides; `advance` is the only thing that moves them.

    A simulator is made at rest: the captured shape, which stays still under gravity.
    """

    @property
    def strands(self) -> Strands:
        """The guides at rest, head frame."""
        ...

    @property
    def options(self) -> Any:
        """The plugin's options in force: those that were None are resolved by the groom."""
        ...

    @property
    def time(self) -> float:
        """Seconds since the start or the last reset."""
        ...

    @property
    def points(self) -> Float32Array:
        """(P, 3) present positions in the world, metres, in the order of `strands`."""
        ...

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Go on by `seconds`, in as many substeps as the method needs."""
        ...

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Put the guides at rest on a head at `head_from_rest` (4, 4), without velocity."""
        ...

    def retune(self, options: Any) -> None:
        """Take other values of the plugin's options from now on; positions stay."""
        ...

    def measure(self) -> Measures:
        """Return the present read-outs."""
        ...
