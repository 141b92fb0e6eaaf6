"""The protocol of simulators of guides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, freeze
from hairkit.errors import InputError
from hairkit.types.strands import Strands


@dataclass(frozen=True)
class Grab:
    """A point of a strand that is pulled to a target."""

    point: int
    """Index in `Strands.points`."""
    target: tuple[float, float, float]
    """World, metres."""


def check_grabs(grabs: Sequence[Grab], points: int) -> None:
    """Raise `InputError` where a grab names none of that many points."""
    for grab in grabs:
        if not 0 <= grab.point < points:
            raise InputError(f"grab of point {grab.point}, expected 0 to {points - 1}")


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Head motion and forces of one `advance`, at its end; the head motion is interpolated."""

    head_from_rest: Float64Array = field(default_factory=lambda: np.eye(4))
    """(4, 4) rigid motion of the head since rest, in the world."""
    wind: Float64Array = field(default_factory=lambda: np.zeros(3))
    """(3,) velocity of the air, metres per second, world."""
    turbulence: float = 0.0
    """RMS speed of gusts over the mean wind speed."""
    gravity: Float64Array | None = None
    """(3,) metres per second squared, world; None: the groom's, along -Y."""
    grabs: tuple[Grab, ...] = ()
    """Points that are pulled during the step; empty: none."""

    def __post_init__(self) -> None:
        freeze(self, "head_from_rest", np.float64, (4, 4), "head_from_rest")
        freeze(self, "wind", np.float64, (3,), "wind")
        freeze(self, "gravity", np.float64, (3,), "gravity")


@dataclass(frozen=True)
class Measures:
    """Measurements of a simulator's present state."""

    stretch: float
    """Largest relative change of a segment's length since rest, 0.01 for 1 %."""
    kinetic_energy: float
    """Joules, all guides."""
    potential_energy: float
    """Gravitational and elastic energy, joules, relative to the rest state."""
    depth: float = 0.0
    """Metres that a drawn point lies deeper in the head or the torso than at rest, at most."""


@runtime_checkable
class Simulator(Protocol):
    """Simulated guides of one groom; only `advance`, `reset` and `retune` change the state.

    `make_simulator(groom, options)` returns one at rest: time 0, the head at `np.eye(4)`, and the
    guides in their captured shape, which is an equilibrium under gravity. Points are finite after
    each `advance`, or a later call raises `HairkitError`.
    """

    @property
    def strands(self) -> Strands:
        """The guides at rest, head frame, metres; the same object for the simulator's life."""
        ...

    @property
    def options(self) -> Any:
        """The options in force, with None replaced by the groom's value; None without options."""
        ...

    @property
    def time(self) -> float:
        """Simulated seconds since the start or the last reset."""
        ...

    @property
    def points(self) -> Float32Array:
        """(P, 3) float32 positions, world, metres, in the order of `strands.points`.

        The array stays valid: later steps write to another one.
        """
        ...

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Advance by `seconds`, in as many substeps as the method needs.

        `seconds` of 0 or less changes nothing. Raises `InputError` if a grab names no point of
        `strands`, and `HairkitError` if the method cannot go on.
        """
        ...

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Reset time to 0 and the guides to rest, with zero velocity.

        `head_from_rest` (4, 4) is the rigid motion of the head, world; None: the identity.
        """
        ...

    def retune(self, options: Any) -> None:
        """Change the options; positions stay unless the number of nodes changes.

        `options` is an instance of the plugin's options class.
        """
        ...

    def measure(self) -> Measures:
        """Return stretch and energies of the present state; the state does not change."""
        ...
