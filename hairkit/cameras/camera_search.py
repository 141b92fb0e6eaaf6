"""The search for the cameras of least cost: Levenberg-Marquardt, from coarse outlines to fine ones.

How carefully the turn was taken is found with the cameras: the prior's precision is the mean of its
posterior, a gamma distribution, given the deviations found and their covariance (expectation
maximisation; MacKay, "Bayesian interpolation", 1992): a careful turn is held to even steps. The
search starts again from turns whose steps are long on one side and short on the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.cameras.landmark_equations import LandmarkEquations
from hairkit.cameras.turntable import ELEVATION, MIN_PERSPECTIVE, PER_VIEW, PERSPECTIVE, SHARED

SETTLED, SETTLED_COARSELY, WORSE = 1e-3, 1e-2, 1e-9
"""Stop when the cost falls by less than the first share, the second while outlines are coarse; a
step that costs more by the third share is taken back."""
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e3
"""Of Levenberg-Marquardt, times the diagonal of the normal equations."""
COARSE_TO_FINE = (8.0, 4.0, 2.0)
"""Times the noise of outlines in the rounds before the last: over four careless turns their cost
falls by up to 109 against a start with the last noise, over careful ones by up to 58."""
CARE_FREEDOM = 4.0
"""Degrees of freedom of the prior of the precision, whose mean is 1; a turn of eight has 48
deviations."""
UNEVEN, SIDES = np.radians(18), 8
"""Amplitude of the wave once around that is added to the azimuths of further starts, and how many
phases it has."""
UNEVEN_ROUNDS = 6
"""Rounds by which these starts are compared, with the last noise of `COARSE_TO_FINE`."""
FAR, LOW = 4.0, np.radians(-10)
"""The search also starts from so many times the usual distance at this elevation: without, people
photographed from metres away, by a camera at the chest, ended at a wrong height of the camera."""
FARTHER, FARTHER_NOISE, MOST_FARTHER = 1.2, (4.0, 2.0), 6
"""Factor by which all distances are tried anew, times the noise of outlines in these rounds, and
most steps one way. A search ends near the distance from which it starts: of 20 turns without EXIF
the focal length was 0.7 to 1.2 of the true one, and with steps 0.9 to 1.2."""
STRAY = np.radians(20)
"""Elevation off the others' from which a view is a stray: bobs look alike from behind and above."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A solution."""

    vector: Float64Array
    """Numbers of the turn."""
    offset: Float64Array
    """(68, 3) landmarks off the given head's, metres."""
    flat: bool
    """True for orthographic cameras: the perspective is held."""
    prior_mean: Float64Array
    """The vector of the nominal turn, from which the solution started."""
    precision: float = 1.0
    """Of the views' deviations from the nominal turn, over that of a usual turn."""
    cost: float = np.inf


@dataclass(frozen=True, eq=False)
class Evidence:
    """What pictures say at one vector, linearised."""

    cost: float
    normal: Float64Array
    right: Float64Array
    landmarks: LandmarkEquations | None


@dataclass(frozen=True, eq=False)
class Search:
    """A problem to be solved."""

    evidence: Callable[[Fit, float], Evidence]
    """The evidence at a solution, with the noise of outlines times a number."""
    prior: Float64Array
    """(P, P) inverse covariance of the prior."""
    iterations: int
    """Most rounds of Levenberg-Marquardt."""
    any_distance: bool = True
    """False where the perspective is known."""

    def find(self, start: Fit, azimuths: Float64Array) -> Fit:
        """Return the best solution; `azimuths` (views,) are the nominal ones, radians."""
        starts = [start]
        any_distance = self.any_distance and not start.flat
        if any_distance:
            starts.append(_farther(_even(start, LOW), FAR))
        fit = _best(self.settle(each, COARSE_TO_FINE) for each in starts)
        if any_distance:
            fit = self._from_distances(fit)
        return self._reconsidered(self.settle(self._from_uneven_turns(fit, azimuths)))

    def _reconsidered(self, fit: Fit) -> Fit:
        """Return the better of this solution and that from strays moved among the other views.

        Without strays it is that from an even turn of low cameras.
        """
        views = fit.vector[SHARED:].reshape(-1, PER_VIEW).copy()
        stray = np.abs(views[:, ELEVATION] - np.median(views[:, ELEVATION])) > STRAY
        if stray.any() and not stray.all():
            views[stray] = [0, *np.median(views[~stray, ELEVATION:], axis=0)]
            trial = replace(fit, vector=np.append(fit.vector[:SHARED], views))
        else:
            trial = _even(fit, LOW)
        trial = replace(trial, precision=1.0)
        return _best([fit, self.settle(trial, (*COARSE_TO_FINE, 1.0, 1.0))])

    def _from_distances(self, fit: Fit) -> Fit:
        """Return the best solution from greater distances on, or else from smaller ones."""
        first = fit
        for way in (FARTHER, 1 / FARTHER):
            for _ in range(MOST_FARTHER):
                trial = self.settle(_farther(fit, way), FARTHER_NOISE)
                if trial.cost >= fit.cost:
                    break
                fit = trial
            if fit is not first:
                break
        return fit

    def settle(self, fit: Fit, noises: Sequence[float] = (1.0, 1.0)) -> Fit:
        """Return the solution to which descents with these times the noise lead.

        After each the precision is what its deviations tell; then follows one more; see `descend`.
        """
        seen = None
        for noise, following in pairwise((*noises, noises[-1])):
            fit, seen = self.descend(fit, noise, self.iterations, seen)
            fit = self._with_care(fit, seen if noise == 1 else self.evidence(fit, 1.0))
            seen = seen if following == noise else None
        return self.descend(fit, noises[-1], self.iterations, seen)[0]

    def descend(
        self, fit: Fit, noise: float, iterations: int, seen: Evidence | None = None
    ) -> tuple[Fit, Evidence]:
        """Return the best place reached from a solution (Levenberg-Marquardt), and its evidence.

        `seen` is the evidence at the solution where it is known.
        """
        damping = FIRST_DAMPING
        least = SETTLED if noise <= 1 else SETTLED_COARSELY
        here = self.evidence(fit, noise) if seen is None else seen
        fit = replace(fit, cost=self.cost(fit, here))
        for _ in range(iterations):
            move = self._move(fit, here, damping)
            vector = fit.vector + move
            vector[PERSPECTIVE] = max(vector[PERSPECTIVE], MIN_PERSPECTIVE)
            offset = fit.offset if here.landmarks is None else here.landmarks.offsets(move)
            trial = replace(fit, vector=vector, offset=offset)
            there = self.evidence(trial, noise)
            trial = replace(trial, cost=self.cost(trial, there))
            if not trial.cost <= fit.cost * (1 + WORSE):  # or not finite
                damping *= 10
                if damping > MOST_DAMPING:
                    break
                continue
            settled = fit.cost - trial.cost < least * fit.cost
            fit, here, damping = trial, there, damping / 5
            if settled:
                break
        return fit, here

    def cost(self, fit: Fit, seen: Evidence) -> float:
        """Return the cost of a solution by the evidence there and by the prior."""
        off = fit.prior_mean - fit.vector
        numbers = len(fit.vector) - SHARED
        # of the precision of so many deviations, without that of the deviations
        care = CARE_FREEDOM * fit.precision
        care -= (numbers + CARE_FREEDOM) * float(np.log(fit.precision))
        return seen.cost + float(off @ self._prior(fit) @ off) + care

    def _move(self, fit: Fit, seen: Evidence, damping: float) -> Float64Array:
        """Return the damped step; the perspective of orthographic cameras stays."""
        prior = self._prior(fit)
        normal = seen.normal + prior
        right = seen.right + prior @ (fit.prior_mean - fit.vector)
        normal += damping * np.diag(np.diag(normal))
        free = np.arange(len(right))
        if fit.flat:
            free = np.delete(free, PERSPECTIVE)
        result = np.zeros(len(right))
        result[free] = np.linalg.solve(normal[np.ix_(free, free)], right[free])
        return result

    def _prior(self, fit: Fit) -> Float64Array:
        """Return the prior's inverse covariance; the views' with the precision of the solution."""
        prior = self.prior.copy()
        prior[SHARED:, SHARED:] *= fit.precision
        return prior

    def _with_care(self, fit: Fit, seen: Evidence) -> Fit:
        """Return the solution with the mean of the precision's posterior."""
        covariance = np.linalg.inv(seen.normal + self._prior(fit))[SHARED:, SHARED:]
        off = (fit.vector - fit.prior_mean)[SHARED:]
        squared = np.sum(self.prior[SHARED:, SHARED:] * (np.outer(off, off) + covariance))
        precision = (len(off) + CARE_FREEDOM) / (float(squared) + CARE_FREEDOM)
        return replace(fit, precision=precision)

    def _from_uneven_turns(self, fit: Fit, azimuths: Float64Array) -> Fit:
        """Return the best of the solutions to which turns lead that are slow on one side.

        Opposite views have mirrored outlines and hold each other where they are; such turns move
        them against each other.
        """
        trials = [fit]
        for phase in np.linspace(0, 2 * np.pi, SIDES, endpoint=False):
            vector = fit.vector.copy()
            vector[SHARED::PER_VIEW] += UNEVEN * np.cos(azimuths - phase)
            trial = replace(fit, vector=vector)
            trials.append(self.descend(trial, COARSE_TO_FINE[-1], UNEVEN_ROUNDS)[0])
        return _best(trials)


def _best(fits: Iterable[Fit]) -> Fit:
    return min(fits, key=lambda each: each.cost)


def _even(fit: Fit, elevation: float) -> Fit:
    """Return the solution with all views at one elevation, upright, at one distance."""
    vector = fit.vector.copy()
    vector[:3] = 0
    views = vector[SHARED:].reshape(-1, PER_VIEW)
    views[:, ELEVATION], views[:, ELEVATION + 1 :] = elevation, 0
    return replace(fit, vector=vector)


def _farther(fit: Fit, times: float) -> Fit:
    """Return the solution with all distances times a number."""
    vector = fit.vector.copy()
    vector[PERSPECTIVE] /= times
    return replace(fit, vector=vector)
