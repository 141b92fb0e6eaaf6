"""Strands as super-helices: rods of elements with constant material curvatures and twist."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array, Int64Array

NODES = 3
"""Gauss points of an element, at which its mass sits."""
SHARES, WEIGHTS = (
    0.5 * (v + shift)
    for v, shift in zip(np.polynomial.legendre.leggauss(NODES), (1, 0), strict=True)
)


class Rods(NamedTuple):
    """The constants of the rods, packed like strands: strand s has elements offsets[s:s + 2]."""

    offsets: Int64Array
    """(S + 1,) ascending, first 0."""
    roots: Float64Array
    """(S, 3) clamped ends at rest, head frame, metres."""
    frames: Float64Array
    """(S, 3, 3) columns: tangent and two normals at the clamped ends at rest."""
    lengths: Float64Array
    """(E,) metres."""
    captured: Float64Array
    """(E, 3) twist and two curvatures of the captured shape, radians per metre."""
    natural: Float64Array
    """(E, 3) those of the rod without load."""
    stiffness: Float64Array
    """(E, 3) of twist and both bendings, newton square metres."""
    density: Float64Array
    """(E,) kilograms per metre."""

    @property
    def masses(self) -> Float64Array:
        """(E, NODES) kilograms of the Gauss points."""
        return (self.density * self.lengths)[:, None] * WEIGHTS

    def one(self, strand: int) -> Rods:
        """Return a single strand."""
        own = slice(self.offsets[strand], self.offsets[strand + 1])
        return Rods(
            np.array([0, own.stop - own.start]),
            self.roots[strand : strand + 1],
            self.frames[strand : strand + 1],
            *(getattr(self, name)[own] for name in self._fields[3:]),
        )
