"""The cameras of a turn as a least-squares problem: landmarks, silhouettes and a prior.

Unknown are the turn's shared place, tilt, magnification and perspective, and six numbers a view
(`hairkit.cameras.turntable.Turn`). Levenberg-Marquardt (`hairkit.cameras.camera_search`) with
soft-L1 weights on

* landmarks, marginalised over the unknown shape of the head (`hairkit.cameras.landmark_equations`),
  the face's midline on the outline of views from the side, and the rim of the cranium on the
  outline where no hair covers it (`hairkit.head_model.cranium`);
* silhouette coherence (`hairkit.cameras.silhouette_coherence`; Hernandez, Schmitt and Cipolla
  2007): the viewing ray of every contour point touches all other silhouettes;
* a prior that keeps to the nominal turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.cameras.camera_search import Evidence, Fit, Search
from hairkit.cameras.landmark_equations import (
    CameraArrays,
    LandmarkFit,
    Sights,
    shape_precision,
    soft_l1_cost,
    soft_l1_weight,
)
from hairkit.cameras.outlines import Outlines
from hairkit.cameras.silhouette_coherence import coherence
from hairkit.cameras.turntable import LOG_MAGNIFICATION, MIN_PERSPECTIVE, PERSPECTIVE, Turn
from hairkit.errors import InputError
from hairkit.head_model.cranium import Cranium
from hairkit.imaging.masked_filters import picture_scale
from hairkit.imaging.person_outline import MIDDLE
from hairkit.options import option
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.head import LANDMARKS, Head
from hairkit.types.mask import Mask

USUAL_DISTANCE = 0.7
"""Distance of head portraits, metres."""
SHARED_SPREAD = (0.05, 0.01, 0.01, 0.1, 0.2, 0.1, 0.5, 0.5)
"""Prior of what views share: tilt of the head in the turn (radians), the turn's centre (metres),
log of the magnification, 1 / distance."""
SHARED_SPREAD_BY_MASKS = (0.05, 0.01, 0.01, 0.01, 0.01, 0.01, 0.05, 0.5)
"""The same where no landmark ties the turn to the head: silhouettes fit any place and size."""
HAIR_THICKNESS = 0.012
"""Without landmarks: how far hair stands off the head, metres."""
SOFT = 0.3
"""A contour ray counts as missing gradually, over this many times the outline's noise."""
SOFT_MIN = 0.3
"""Softness of the minimum over silhouettes, times the outline's noise."""
NOISE_OF_ALL = 2.0
"""Times the noise up to which all contour points count; with so many times more, one of as many."""
NEAR = 6.0
"""Rays that stay farther inside than this many times the noise tell nothing."""
FROM_THE_SIDE = 0.35
"""Views this near (radians) to 90 degrees show the face's midline on the outline."""
SILHOUETTE_PX, PROFILE_PX = 3.0, 3.0
"""Noise of outlines, and of the profile's, in pixels of pictures 1080 high."""
FOCAL_SPREAD = 0.03
"""Of the logarithm of a known focal length: lenses breathe and cameras crop."""
ABOVE, LOOSE_ABOVE = np.radians(35), 4.0
"""Elevation (radians) from which a view is one from above, and how much wider the spreads of its
azimuth and elevation are: such photos belong to no turn, and show no face."""
LEVEL = np.radians(8)
"""Spread of the elevation of a whole turn, radians: cameras are held lower or higher than heads."""
NEAREST = 0.2
"""Metres from a camera to the head's middle at least: nearer ones would lie in the head."""
PLACE_ROUNDS = 4
"""Rounds of the first place and depths: the magnification settles to 0.1 %."""
ALL_RAYS_OF = 8
"""Turns of more views than this share the contour points that so many views would have: time grows
with the number of views, not with its square."""
MIN_SIGHTS = 6
"""Fewer landmarks than this place no head."""


@dataclass(frozen=True)
class TurnOptions:
    """Noise of the evidence, and the spreads of the prior; plugins inherit them."""

    azimuth: float = option(3.0, low=0.01, high=30, doc="Spread off the nominal turn.", unit="deg")
    elevation: float = option(2.0, low=0.01, high=30, doc="Spread of elevations.", unit="deg")
    roll: float = option(1.5, low=0.01, high=30, doc="Spread of camera rolls.", unit="deg")
    distance: float = option(0.04, low=0.001, high=0.5, doc="Relative spread of distances.")
    shift: float = option(0.008, low=0.0001, high=0.2, doc="Spread of the aim.", unit="m")
    landmark_px: float = option(
        1.5, low=0.1, high=50, doc="Noise of landmarks, pictures 1080 high.", unit="px"
    )
    contour_points: int = option(
        100, low=20, high=1000, doc="Contour points of a view; fewer each beyond eight views."
    )


class Silhouettes(NamedTuple):
    """What masks show of the outline."""

    outlines: Outlines
    cranium: Cranium | None
    """None where it would tell nothing: no landmarks on the head, or masks of hair alone."""

    @classmethod
    def of(cls, masks: tuple[Mask, ...], head: Head, options: TurnOptions) -> Silhouettes:
        """Return the silhouettes of all views."""
        share = min(1.0, ALL_RAYS_OF / len(masks))
        outlines = Outlines.of(masks, max(1, round(options.contour_points * share)))
        if head.landmark_vertices is None or not outlines.whole:
            return cls(outlines, None)
        return cls(outlines, Cranium.of(head, masks, outlines.scale))

    def arranged(self, order: Int64Array) -> Silhouettes:
        """Return them with the views in another order."""
        cranium = None if self.cranium is None else self.cranium.arranged(order)
        return Silhouettes(self.outlines.arranged(order), cranium)


@dataclass(frozen=True, eq=False)
class TurnFit:
    """All evidence about the cameras of a turn, and the prior."""

    turn: Turn
    outlines: Outlines
    head: Head
    landmarks: LandmarkFit | None
    noise: float
    """Of outlines, pixels."""
    prior: Float64Array
    """(P, P) inverse covariance; elevations share a level."""
    focal: float | None
    """Focal length of the first view in pixels, where all views tell theirs."""

    @classmethod
    def of(
        cls,
        capture: Capture,
        masks: tuple[Mask, ...],
        head: Head,
        options: TurnOptions,
        silhouettes: Silhouettes | None = None,
    ) -> TurnFit:
        """Return the problem; `silhouettes` are those of the masks where they are known."""
        pixels = np.array([picture_scale(view.height) for view in capture.views])
        pixel = float(pixels.mean())
        outlines, cranium = silhouettes or Silhouettes.of(masks, head, options)
        turn = _aimed(Turn.of(capture), capture, outlines.heads)
        angles = np.radians([options.azimuth, options.elevation, options.roll])
        each = [*angles, options.distance, options.shift, options.shift]
        sights = Sights.of(capture, masks, options.landmark_px * pixels)
        landmarks = None
        if head.landmark_vertices is not None and len(sights) >= MIN_SIGHTS:
            places = head.vertices[head.landmark_vertices].astype(np.float64)
            side = np.nonzero(np.abs(np.cos(turn.azimuths)) < np.sin(FROM_THE_SIDE))[0]
            fields, scale = outlines.fields, outlines.scale
            if not outlines.whole:
                side = side[:0]
            landmarks = LandmarkFit(
                places, shape_precision(places), sights, fields, scale, side, PROFILE_PX * pixel
            )
        shared = SHARED_SPREAD if landmarks is not None else SHARED_SPREAD_BY_MASKS
        own = np.tile(each, (len(capture.views), 1))
        above = turn.elevations > ABOVE
        own[above, :2] *= LOOSE_ABOVE
        covariance = np.diag(np.concatenate([shared, own.ravel()]) ** 2)
        own[:, 0], own[:, 1], own[:, 2:] = 0, LEVEL * ~above, 0
        level = np.append(np.zeros(len(shared)), own)
        covariance += np.outer(level, level)
        noise = SILHOUETTE_PX * pixel
        focals = [view.focal_px for view in capture.views]
        focal = None if None in focals else focals[0]
        problem = cls(turn, outlines, head, landmarks, noise, np.linalg.inv(covariance), focal)
        if landmarks is None or cranium is None:
            return problem
        start = problem.cameras(problem.start(flat=False).vector)
        return replace(problem, landmarks=landmarks.with_cranium(cranium, start))

    def with_sights(self, more: Sights) -> TurnFit:
        """Return the problem with more landmarks seen."""
        assert self.landmarks is not None
        landmarks = replace(self.landmarks, sights=self.landmarks.sights.joined(more))
        return replace(self, landmarks=landmarks)

    def search(self, iterations: int) -> Search:
        """Return the search for the cameras."""
        return Search(self.evidence, self.prior, iterations, self.focal is None)

    def start(self, flat: bool) -> Fit:
        """Return the nominal turn, its place and magnification as landmarks or masks suggest."""
        vector = np.zeros(self.turn.size)
        vector[PERSPECTIVE] = 1 / USUAL_DISTANCE
        magnification, place = (
            self._place_by_landmarks(self.landmarks, flat)
            if self.landmarks is not None
            else self._place_by_masks()
        )
        vector[LOG_MAGNIFICATION], vector[3:6] = np.log(magnification), place
        if self.focal is not None:
            vector[PERSPECTIVE] = max(magnification / self.focal, MIN_PERSPECTIVE)
        if flat:
            vector[PERSPECTIVE] = MIN_PERSPECTIVE
        points = LANDMARKS if self.landmarks is None else len(self.landmarks.landmarks)
        return Fit(vector, np.zeros((points, 3)), flat, vector)

    def from_cameras(self, cameras: Sequence[Camera]) -> Fit:
        """Return the solution of known cameras, whose prior is still the nominal turn."""
        start = self.start(cameras[0].model == "orthographic")
        return replace(start, vector=self.turn.vector_of(cameras))

    def cameras(self, vector: Float64Array) -> CameraArrays:
        """Return the cameras as arrays."""
        return (*self.turn.unpack(vector), self.turn.centres)

    def _place_by_landmarks(self, landmarks: LandmarkFit, flat: bool) -> tuple[float, Float64Array]:
        """Return magnification and the turn's centre.

        The solution is linear for orthographic cameras. Pixels times depth over the usual distance
        are those of such cameras; depths follow from the place found before.
        """
        sights = landmarks.sights
        axes = self.turn.axes[sights.view]
        seen = sights.pixel - self.turn.aims[sights.view]
        points = landmarks.landmarks[sights.point]
        weight = np.repeat(1 / sights.noise, 2)
        right = np.einsum("nij,nj->ni", axes[:, :2], points).ravel()
        nearness = np.ones(len(points))
        for _ in range(1 if flat else PLACE_ROUNDS):
            left = np.column_stack([(seen * nearness[:, None]).ravel(), axes[:, :2].reshape(-1, 3)])
            solution = np.linalg.lstsq(left * weight[:, None], right * weight, rcond=None)[0]
            depth = np.einsum("nj,nj->n", axes[:, 2], points - solution[1:])
            nearness = 1 + depth / USUAL_DISTANCE
        if not solution[0] > 0:
            raise InputError(
                "the landmarks do not fit a head seen from the views' azimuths; check their order"
            )
        return 1 / float(solution[0]), np.asarray(solution[1:], np.float64)

    def _place_by_masks(self) -> tuple[float, Float64Array]:
        """Return magnification and the turn's centre from the silhouettes' tops and widths.

        A silhouette is as wide as the head with a little hair.
        """
        top, middle, width = self.outlines.heads.T
        scalp = self.head.vertices[self.head.scalp > 0.5].astype(np.float64)
        breadth = np.ptp(scalp[:, [0, 2]], axis=0).mean() + 2 * HAIR_THICKNESS
        magnification = float(np.median(width)) / breadth
        depth = (scalp[:, 2].max() + scalp[:, 2].min()) / 2
        crown = np.array([0.0, scalp[:, 1].max() + HAIR_THICKNESS, depth])
        seen = (np.stack([middle, top], axis=1) - self.turn.aims) / magnification
        axes = self.turn.axes[:, :2].reshape(-1, 3)
        place = np.linalg.lstsq(axes, axes @ crown - seen.ravel(), rcond=None)[0]
        return magnification, place

    def evidence(self, fit: Fit, coarseness: float) -> Evidence:
        """Return the evidence at a solution, with the outlines' noise times a number."""
        vector = fit.vector
        cameras, tangents = self.cameras(vector), self.turn.tangents(vector)
        noise = coarseness * self.noise
        rows, residual, cost = self._coherence_rows(vector, cameras, tangents, noise)
        normal, right = rows.T @ rows, rows.T @ residual
        if cameras[1][:, 2].min() <= NEAREST:
            cost = np.inf
        if self.focal is not None and not fit.flat:
            row, off = self._focal_row(vector, self.focal)
            normal, right = normal + np.outer(row, row), right + row * off
            cost += off**2
        if self.landmarks is None:
            return Evidence(cost, normal, right, None)
        seen = self.landmarks.equations(fit.offset, cameras, tangents)
        return Evidence(cost + seen.cost, normal + seen.normal, right + seen.right, seen)

    def _focal_row(self, vector: Float64Array, focal: float) -> tuple[Float64Array, float]:
        """Return the row that keeps magnification over perspective near the known focal length."""
        perspective = float(vector[PERSPECTIVE])
        row = np.zeros(len(vector))
        row[LOG_MAGNIFICATION], row[PERSPECTIVE] = 1, -1 / perspective
        found = vector[LOG_MAGNIFICATION] - np.log(perspective)
        return row / FOCAL_SPREAD, float(np.log(focal) - found) / FOCAL_SPREAD

    def _coherence_rows(
        self, vector: Float64Array, cameras: CameraArrays, tangents: Float64Array, noise: float
    ) -> tuple[Float64Array, Float64Array, float]:
        """Return rows that bring contour rays into the silhouettes they miss, or nearly miss.

        Then their right sides, and the cost.
        """
        every = max(1, round(noise / self.noise / NOISE_OF_ALL))
        value, slope = self._coherence(vector, cameras, noise, every)
        near = np.nonzero(value < NEAR * noise)[0]
        soft = SOFT * noise
        missed = np.logaddexp(0, -value[near] / soft) * soft / noise
        share = 1 / (1 + np.exp(value[near] / soft))
        weight = np.sqrt(every * soft_l1_weight(missed))
        rows = np.tensordot(slope[near], tangents, 2)
        return (
            rows * (share * weight / noise)[:, None],
            missed * weight,
            every * soft_l1_cost(missed),
        )

    def _coherence(
        self, vector: Float64Array, cameras: CameraArrays, noise: float, every: int = 1
    ) -> tuple[Float64Array, Float64Array]:
        return coherence(self.outlines.thinned(every), *cameras, cameras[1][:, 2], SOFT_MIN * noise)

    def residual_px(self, fit: Fit) -> float:
        """Return the root mean square misfit of landmarks and missed contour rays, pixels.

        Landmarks with more than the median noise count less, as they do in the fit.
        """
        cameras = self.cameras(fit.vector)
        value, _ = self._coherence(fit.vector, cameras, self.noise)
        misfit = value[value < 0]
        weight = np.ones(len(misfit))
        if self.landmarks is not None:
            noise = self.landmarks.sights.noise
            misfit = np.append(misfit, self.landmarks.misfit(fit.offset, cameras))
            weight = np.append(weight, np.minimum(1, np.median(noise) / noise) ** 2)
        return float(np.sqrt(np.average(misfit**2, weights=weight))) if len(misfit) else 0.0


def _aimed(turn: Turn, capture: Capture, heads: Float64Array) -> Turn:
    """Return the turn with the cameras of cropped photos aimed at the middles of heads (V, 3)."""
    row, column, width = heads.T
    usual = np.nanmedian(width / turn.focal_ratios) * turn.focal_ratios
    middles = np.stack([column, row + MIDDLE * usual], axis=1)
    cropped = np.array([view.cropped is not None for view in capture.views])
    return replace(turn, aims=np.where((cropped & np.isfinite(row))[:, None], middles, turn.aims))
