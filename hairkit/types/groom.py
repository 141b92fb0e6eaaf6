"""The groom: everything an exporter or a simulator needs, and nothing else is passed to them."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields, replace
from typing import Self

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int32Array, UInt8Array, check_reach, freeze
from hairkit.errors import DataError, FormatError
from hairkit.storage import Stored, from_arrays, read_npz, to_arrays, write_npz
from hairkit.types.carried import Carried
from hairkit.types.head import Head
from hairkit.types.preview import Previewed, draw_turn
from hairkit.types.strands import Strands
from hairkit.types.tie import Tie

_VERSION, _NEWEST = "hairkit_groom", 1
_STRANDS = "strands."
_AT_TOP = ("points", "offsets", "widths", "root_uv", "group", "guide", "colours")


_BROWN = (0.16, 0.11, 0.08)
"""Linear RGB of hair whose photos give no colour."""


def _default_colour() -> Float32Array:
    return np.array(_BROWN, np.float32)


@dataclass(frozen=True, eq=False)
class HairMaterial(Stored):
    """Appearance of the hair, as measured in the photos."""

    root_colour: Float32Array = field(default_factory=_default_colour)
    """(3,) linear RGB in [0, 1]."""
    tip_colour: Float32Array = field(default_factory=_default_colour)
    """(3,) linear RGB in [0, 1]."""
    width: float = 8e-5
    """Strand diameter, metres."""
    curl_radius: float = 0.0
    """Radius of the waves about the strand's axis, metres; 0 for straight hair."""
    curl_pitch: float = 0.0
    """Length of one turn along the axis, metres; 0 for straight hair."""

    def __post_init__(self) -> None:
        freeze(self, "root_colour", np.float32, (3,), "root_colour")
        freeze(self, "tip_colour", np.float32, (3,), "tip_colour")
        if not 0 < self.width < np.inf:
            raise DataError(f"hair width is {self.width}, expected metres above 0")
        for name in ("curl_radius", "curl_pitch"):
            if not np.isfinite(getattr(self, name)):
                raise DataError(f"{name} is {getattr(self, name)}, expected metres")


@dataclass(frozen=True, eq=False)
class HairPhysics(Stored):
    """Default physics of a groom; dimensionless unless a unit is stated."""

    stiffness: float = 0.45
    """Strength with which strands keep the captured shape, 0 to 1."""
    bend_stiffness: float = 0.6
    damping: float = 0.05
    friction: float = 0.1
    gravity: float = 9.81
    """Metres per second squared, along -Y."""

    def __post_init__(self) -> None:
        for each in fields(self):
            if not np.isfinite(getattr(self, each.name)):
                raise DataError(f"{each.name} is {getattr(self, each.name)}, expected a number")


@dataclass(frozen=True, eq=False)
class Groom(Previewed, Stored):
    """Guides on a fitted head, bound at their roots, with look and physics."""

    strands: Strands
    head: Head
    root_triangle: Int32Array
    """(S,) face of the head that carries each root."""
    root_barycentric: Float32Array
    """(S, 3) weights of that face's corners."""
    material: HairMaterial = field(default_factory=HairMaterial)
    physics: HairPhysics = field(default_factory=HairPhysics)
    ties: tuple[Tie, ...] = ()
    """Rings that hold strands; the strands of tie k have the group k + 1."""
    carried: Carried | None = None
    """What the file that the groom was read from held beyond it; None where nothing is known."""

    def __post_init__(self) -> None:
        count = len(self.strands)
        triangle = freeze(self, "root_triangle", np.int32, (count,), "root_triangle")
        if count and (triangle.min() < 0 or triangle.max() >= len(self.head.faces)):
            raise DataError("root_triangle names faces that the head does not have")
        freeze(self, "root_barycentric", np.float32, (count, 3), "root_barycentric")

    def __repr__(self) -> str:
        strands = repr(self.strands).removeprefix("Strands(").removesuffix(")")
        return f"Groom({strands}, head of {len(self.head.vertices)} vertices)"

    @property
    def root_density(self) -> Float32Array:
        """(S,) density of the hair about each root, of that of full hair, 0 to 1."""
        return self.head.density_at(self.root_triangle, self.root_barycentric)

    def select(self, keep: npt.ArrayLike) -> Groom:
        """Return the groom with the strands that a mask (S,) or an index array picks."""
        index = np.asarray(keep)
        if index.dtype == bool and index.all():
            return self
        return replace(
            self,
            strands=self.strands.select(index),
            root_triangle=self.root_triangle[index],
            root_barycentric=self.root_barycentric[index],
        )

    def preview(self) -> UInt8Array | None:
        """Return the guides on their head: front, left and back, (H, W, 3) uint8 RGB."""
        return draw_turn(self.head, self.strands)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the groom as hairkit's own file, atomically; equal grooms give equal files.

        `points` (P, 3) and `offsets` (S + 1,) stand at the top of the npz, with `widths`,
        `root_uv`, `group`, `guide`, `root_triangle` and `root_barycentric`; the rest is named
        `head.vertices`, `material.width` and so on.
        """
        arrays = {name.removeprefix(_STRANDS): array for name, array in to_arrays(self).items()}
        write_npz(path, arrays | {_VERSION: np.asarray(_NEWEST)})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` and `reconstruct` wrote; raises `FormatError` for anything else."""
        arrays = read_npz(path)
        version = arrays.pop(_VERSION, None)
        if version is None or not {"points", "offsets"} <= set(arrays):
            raise FormatError(f"{path}: not a groom of hairkit; expected what `reconstruct` wrote")
        if version.shape != () or version != _NEWEST:
            raise FormatError(f"{path}: a groom of version {version}, this hairkit reads {_NEWEST}")
        named = {_STRANDS + name if name in _AT_TOP else name: arrays[name] for name in arrays}
        groom = from_arrays(cls, named, str(path))
        groom.check_reach(path)
        return groom

    def check_reach(self, source: object) -> None:
        """Raise `FormatError` naming the file where a length is beyond `MAX_REACH`."""
        strands, capsules = self.strands, self.head.capsules
        check_reach(strands.points, source, "points")
        if strands.widths is not None:
            check_reach(strands.widths, source, "widths")
        check_reach(self.head.vertices, source, "the head's vertices")
        check_reach(self.head.joints, source, "the head's joints")
        for tie in self.ties:
            check_reach(tie.centre, source, "the centre of a tie")
        for lengths in (capsules.first, capsules.second, capsules.radius):
            check_reach(lengths, source, "the head's capsules")
