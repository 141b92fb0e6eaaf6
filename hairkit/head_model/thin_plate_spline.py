"""Thin-plate splines in two and three dimensions (Duchon 1977, Bookstein 1989).

f(x) = sum_i a_i phi(|x - x_i|) + b + c . x, the function of least bending that goes through given
values, or near them: lambda, one number a point, is the square of the miss that bending costs. phi
is r^2 log r in two dimensions and r in three, the biharmonic's fundamental solutions; the side
conditions sum a = 0 and sum a x = 0 leave affine maps unbent. Solved by SciPy's `RBFInterpolator`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, freeze
from hairkit.errors import InputError

KERNELS = {2: "thin_plate_spline", 3: "linear"}
"""SciPy's names of r^2 log r and of r, by the dimension of space."""


@dataclass(frozen=True, eq=False)
class ThinPlateSpline:
    """A smooth map that takes places to values; call it with points (M, D) to get (M, K).

    >>> corners = [[0, 0], [1, 0], [0, 1], [1, 1]]
    >>> spline = ThinPlateSpline(corners, [[0, 0], [2, 0], [0, 1], [2, 1]])
    >>> spline([[0.5, 0.5]]).round(6).tolist()
    [[1.0, 0.5]]
    """

    places: Float64Array
    """(N, D) points, D 2 or 3, more than D of them and not all in one line or plane."""
    values: Float64Array
    """(N, K) values at the places."""
    smoothing: npt.ArrayLike = 0.0
    """lambda, one for all points or (N,): 0 goes through the values, infinity is affine."""

    def __post_init__(self) -> None:
        places = freeze(self, "places", np.float64, (None, None), "spline places")
        count, dimension = places.shape
        if dimension not in KERNELS:
            raise InputError(f"a thin-plate spline in {dimension} dimensions, expected 2 or 3")
        if np.linalg.matrix_rank(places - places.mean(axis=0), tol=1e-9) < dimension:
            flat = "line" if dimension == 2 else "plane"
            raise InputError(f"the {count} places of a thin-plate spline lie in one {flat}")
        freeze(self, "values", np.float64, (count, None), "spline values")
        smoothing = np.broadcast_to(np.asarray(self.smoothing, np.float64), (count,))
        if not (np.isfinite(smoothing) & (smoothing >= 0)).all():
            raise InputError("a thin-plate spline's smoothing is below 0 or not finite")
        if not (smoothing > 0).all() and len(np.unique(places[smoothing == 0], axis=0)) < len(
            places[smoothing == 0]
        ):
            raise InputError("a thin-plate spline has the same place twice without smoothing")
        object.__setattr__(self, "smoothing", smoothing)

    @cached_property
    def _solved(self) -> Any:
        from scipy.interpolate import RBFInterpolator  # loads half of SciPy

        kernel = KERNELS[self.places.shape[1]]
        return RBFInterpolator(
            self.places, self.values, smoothing=self.smoothing, kernel=kernel, degree=1
        )

    def __call__(self, points: npt.ArrayLike) -> Float64Array:
        """Return (M, K) the map at points (M, D)."""
        return np.asarray(self._solved(np.asarray(points, np.float64)))
