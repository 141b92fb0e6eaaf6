"""The groom: everything an exporter or a simulator needs, and nothing else is passed to them."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from hairkit.errors import InputError
from hairkit.storage import Float32Array, Int32Array, Stored, frozen_array
from hairkit.types.head import Head
from hairkit.types.strands import Strands


def _grey() -> Float32Array:
    return np.array([0.16, 0.11, 0.08], np.float32)


@dataclass(frozen=True, eq=False)
class HairMaterial(Stored):
    """How the hair looks, as far as photos tell."""

    root_colour: Float32Array = field(default_factory=_grey)
    """(3,) linear RGB in [0, 1]."""
    tip_colour: Float32Array = field(default_factory=_grey)
    """(3,) linear RGB in [0, 1]."""
    width: float = 8e-5
    """Strand diameter, metres."""
    curl_radius: float = 0.0
    """Radius of the waves about the strand's axis, metres; 0 for straight hair."""
    curl_pitch: float = 0.0
    """Length of one turn along the axis, metres; 0 for straight hair."""

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "root_colour", frozen_array(self.root_colour, np.float32, (3,), "root_colour")
        )
        object.__setattr__(
            self, "tip_colour", frozen_array(self.tip_colour, np.float32, (3,), "tip_colour")
        )
        if not self.width > 0:
            raise InputError(f"hair width is {self.width}, expected metres above 0")


@dataclass(frozen=True, eq=False)
class HairPhysics(Stored):
    """What a simulator starts from; dimensionless unless a unit is stated."""

    stiffness: float = 0.45
    """How firmly strands keep the captured shape, 0 to 1."""
    bend_stiffness: float = 0.6
    damping: float = 0.05
    friction: float = 0.1
    gravity: float = 9.81
    """Metres per second squared, along -Y."""


@dataclass(frozen=True, eq=False)
class Groom(Stored):
    """Guides on a fitted head, bound at their roots, with look and physics."""

    strands: Strands
    head: Head
    root_triangle: Int32Array
    """(S,) face of the head that carries each root."""
    root_barycentric: Float32Array
    """(S, 3) weights of that face's corners."""
    material: HairMaterial = field(default_factory=HairMaterial)
    physics: HairPhysics = field(default_factory=HairPhysics)

    def __post_init__(self) -> None:
        count = len(self.strands)
        triangle = frozen_array(self.root_triangle, np.int32, (count,), "root_triangle")
        if count and (triangle.min() < 0 or triangle.max() >= len(self.head.faces)):
            raise InputError("root_triangle names faces that the head does not have")
        object.__setattr__(self, "root_triangle", triangle)
        barycentric = frozen_array(
            self.root_barycentric, np.float32, (count, 3), "root_barycentric"
        )
        object.__setattr__(self, "root_barycentric", barycentric)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the groom as hairkit's own file (see `hairkit.types.groom_file`), atomically."""
        from hairkit.types.groom_file import write_groom  # it builds on this module

        write_groom(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` and `reconstruct` wrote; raises `FormatError` for anything else."""
        from hairkit.types.groom_file import read_groom

        groom = read_groom(path)
        return cls(**{f.name: getattr(groom, f.name) for f in dataclasses.fields(cls)})
