"""Cameras refined from the nominal turn by landmarks and by the mutual consistency of the silhouettes.

Unknown are the turn's shared place, tilt, magnification and perspective, and six numbers a view (`hairkit.pose.Turn`).
Gauss-Newton with soft-L1 weights on four kinds of rows: landmarks, marginalised over the unknown shape of the head (a
Gaussian process around the given head's landmarks); midline landmarks that lie on the outline of profile views; the
viewing rays of silhouette contour points, each of which must touch all other silhouettes somewhere (silhouette
coherence: Hernandez, Schmitt and Cipolla, "Silhouette coherence for camera calibration under circular motion", 2007);
and a prior that keeps to the nominal turn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit import Capture, Head, Mask, Scene, hookimpl
from hairkit.coherence import Outlines, coherence
from hairkit.errors import InputError
from hairkit.options import option
from hairkit.pose import LOG_MAGNIFICATION, MIN_PERSPECTIVE, PERSPECTIVE, SHARED, Turn
from hairkit.mask import HAIR
from hairkit.stored import Float64Array, Int64Array

JAW = 17
"""The first landmarks trace the jaw, which detectors place less surely."""
MIDLINE = (27, 28, 29, 30, 33, 51, 57, 8)
"""Nose, lips and chin: on the outline of a view from the side."""
USUAL_FOCAL_EQUIVALENT = 42.0
"""Focal length of head portraits, mm for a 36 x 24 mm frame, when nothing else is known."""
USUAL_DISTANCE = 0.7
WIDEST, HAIR_THICKNESS = 0.6, 0.012
"""Without landmarks: depth below the crown over the width there, and how far hair stands off the head, metres."""
REFERENCE_HEIGHT = 1080
SETTLED = 1e-4
"""Stop when no angle (radians) or length (metres) moves more than this."""
AFFINE_SPREAD, SMOOTH_SPREAD, SMOOTH_LENGTH = 0.004, 0.004, 0.04
PLACE_SPREAD, LOOSE_SPREAD = 0.004, 0.0015
"""How heads differ, metres: stretch (per 0.1 m), smooth bends and their reach, place of the face, single points."""


@dataclass(frozen=True)
class Options:
    """Settings of the refinement; the spreads are of the prior."""

    azimuth: float = option(3.0, low=0.01, high=30, doc="Spread off the nominal turn.", unit="deg")
    elevation: float = option(2.0, low=0.01, high=30, doc="Spread of elevations.", unit="deg")
    roll: float = option(1.5, low=0.01, high=30, doc="Spread of camera rolls.", unit="deg")
    distance: float = option(0.04, low=0.001, high=0.5, doc="Relative spread of distances.")
    shift: float = option(0.008, low=0.0001, high=0.2, doc="Spread of the aim.", unit="m")
    landmark_px: float = option(
        1.5, low=0.1, high=50, doc="Noise of landmarks, pictures 1080 high.", unit="px"
    )
    silhouette_px: float = option(
        3.0, low=0.1, high=50, doc="Noise of outlines, pictures 1080 high.", unit="px"
    )
    contour_points: int = option(140, low=20, high=1000, doc="Contour points used in each view.")
    iterations: int = option(15, low=1, high=100, doc="Most rounds of Gauss-Newton.")


@hookimpl
def estimate_scene(
    capture: Capture, masks: tuple[Mask, ...], head: Head, options: Options
) -> Scene:
    """Solve for all cameras; the head keeps its shape and gives the world its frame and scale."""
    problem = _Problem(capture, Outlines.of(masks, options.contour_points), masks, head, options)
    vector = problem.start()
    offset = np.zeros((68, 3))
    for _ in range(options.iterations):
        moved, offset = problem.step(vector, offset)
        change, vector = np.abs(moved - vector).max(), moved
        if change < SETTLED:
            break
    names = tuple(view.name for view in capture.views)
    cameras = problem.turn.cameras(vector)
    return Scene(names, cameras, head, problem.residual_px(vector, offset))


@dataclass(frozen=True, eq=False)
class _Sight:
    """Landmarks seen in the views, one row each, with how far to trust them."""

    view: Int64Array
    point: Int64Array
    pixel: Float64Array
    noise: Float64Array
    """(N,) standard deviation in pixels."""

    @classmethod
    def of(cls, capture: Capture, masks: tuple[Mask, ...], noise: float) -> _Sight:
        """Collect the landmarks; those of the jaw, or under hair, are only guesses of the detector."""
        rows = []
        for index, (view, mask) in enumerate(zip(capture.views, masks, strict=True)):
            if view.landmarks is None:
                continue
            for point, (x, y) in enumerate(view.landmarks):
                inside = 0 <= x < view.width and 0 <= y < view.height
                covered = inside and mask.labels[int(y), int(x)] == HAIR
                trust = (2.0 if point < JAW else 1.0) * (3.0 if covered else 1.0)
                rows.append((index, point, x, y, noise * trust))
        table = np.array(rows, np.float64).reshape(-1, 5)
        return cls(
            table[:, 0].astype(np.int64), table[:, 1].astype(np.int64), table[:, 2:4], table[:, 4]
        )


class _Problem:
    """The least-squares problem: rows of residuals and their slopes at a vector of the turn."""

    def __init__(
        self,
        capture: Capture,
        outlines: Outlines,
        masks: tuple[Mask, ...],
        head: Head,
        options: Options,
    ) -> None:
        self.turn = _turn(capture)
        self.outlines = outlines
        self.head = head
        self.pixel = capture.views[0].height / REFERENCE_HEIGHT
        self.sight = _Sight.of(capture, masks, options.landmark_px * self.pixel)
        self.noise = options.silhouette_px * self.pixel
        self.knows_landmarks = head.landmark_vertices is not None and len(self.sight.view) >= 6
        self.landmarks, self.covariance = np.zeros((68, 3)), np.zeros((204, 204))
        if head.landmark_vertices is not None:
            self.landmarks = head.vertices[head.landmark_vertices].astype(np.float64)
            self.covariance = _shape_covariance(self.landmarks)
        self.centre = self.turn.sizes / 2.0
        self.prior_mean, self.prior_spread = self._prior(capture, options)

    def _prior(self, capture: Capture, options: Options) -> tuple[Float64Array, Float64Array]:
        mean = np.zeros(self.turn.size)
        spread = np.empty(self.turn.size)
        spread[:SHARED] = [0.15, 0.05, 0.05, 0.1, 0.2, 0.1, 0.5, 0.6]
        mean[PERSPECTIVE] = 1 / USUAL_DISTANCE
        angles = np.radians([options.azimuth, options.elevation, options.roll])
        spread[SHARED:] = np.tile(
            [*angles, options.distance, options.shift, options.shift], len(capture.views)
        )
        return mean, spread

    def start(self) -> Float64Array:
        """Return the nominal turn with the shared place and magnification that suit landmarks or masks."""
        vector = self.prior_mean.copy()
        vector[[LOG_MAGNIFICATION, 3, 4, 5]] = (
            self._place_by_landmarks(vector)
            if self.knows_landmarks
            else self._place_by_masks(vector)
        )
        self.prior_mean = vector.copy()
        return vector

    def _place_by_landmarks(self, vector: Float64Array) -> Float64Array:
        """Return log magnification and the turn's centre: exact for cameras far away, so linear."""
        rotation, _, _ = self.turn.unpack(vector)
        sight = self.sight
        axes = rotation[sight.view, :2]
        seen = sight.pixel - self.centre[sight.view]
        weight = np.repeat(1 / sight.noise, 2)
        left = np.concatenate([seen.reshape(-1, 1), axes.reshape(-1, 3)], axis=1)
        right = np.einsum("nij,nj->ni", axes, self.landmarks[sight.point]).ravel()
        solution = np.linalg.lstsq(left * weight[:, None], right * weight, rcond=None)[0]
        if not solution[0] > 0:
            raise InputError(
                "the landmarks do not fit a head seen from the views' azimuths; check their order"
            )
        return np.array([-np.log(solution[0]), *solution[1:]])

    def _place_by_masks(self, vector: Float64Array) -> Float64Array:
        """Return log magnification and the turn's centre from the silhouettes' tops and widths.

        A silhouette is as wide as the head, with a little hair, where it lies `WIDEST` of its width below its top.
        """
        rotation, _, _ = self.turn.unpack(vector)
        top, middle, width = self.outlines.crowns(WIDEST)
        scalp = self.head.vertices[self.head.scalp > 0.5]
        breadth = np.ptp(scalp[:, [0, 2]], axis=0).mean() + 2 * HAIR_THICKNESS
        magnification = float(np.median(width)) / breadth
        crown = np.array(
            [
                0.0,
                self.head.vertices[:, 1].max() + HAIR_THICKNESS,
                (scalp[:, 2].max() + scalp[:, 2].min()) / 2,
            ]
        )
        seen = (np.stack([middle, top], axis=1) - self.centre) / magnification
        axes = rotation[:, :2].reshape(-1, 3)
        place = np.linalg.lstsq(axes, axes @ crown - seen.ravel(), rcond=None)[0]
        return np.array([np.log(magnification), *place])

    def step(self, vector: Float64Array, offset: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Return the vector and the landmarks' offsets (68, 3) after one round of Gauss-Newton."""
        tangents = self.turn.tangents(vector)
        normal = np.diag(self.prior_spread**-2)
        right = (self.prior_mean - vector) / self.prior_spread**2
        rows, residual = self._silhouette_rows(vector, tangents)
        normal += rows.T @ rows
        right += rows.T @ residual
        if not self.knows_landmarks:
            return vector + np.linalg.solve(normal, right), offset
        rows, residual, gain = self._landmark_rows(vector, offset, tangents)
        normal += rows.T @ rows
        right += rows.T @ residual
        move = np.linalg.solve(normal, right)
        if vector[PERSPECTIVE] + move[PERSPECTIVE] < MIN_PERSPECTIVE:
            move = _solve_held(normal, right, PERSPECTIVE, MIN_PERSPECTIVE - vector[PERSPECTIVE])
        return vector + move, (gain @ (residual - rows @ move)).reshape(68, 3)

    def _silhouette_rows(
        self, vector: Float64Array, tangents: Float64Array
    ) -> tuple[Float64Array, Float64Array]:
        """Return rows that bring contour rays into the silhouettes they miss."""
        rotation, translation, focal = self.turn.unpack(vector)
        middle = 1 / max(float(vector[PERSPECTIVE]), MIN_PERSPECTIVE)
        value, slope = coherence(self.outlines, rotation, translation, focal, self.centre, middle)
        missed = np.nonzero(value < 0)[0]
        residual = -value[missed] / self.noise
        weight = np.sqrt(_robust(residual)) / self.noise
        rows = np.einsum("nvk,vkp->np", slope[missed], tangents) * weight[:, None]
        return rows, residual * weight * self.noise

    def _landmark_rows(
        self, vector: Float64Array, offset: Float64Array, tangents: Float64Array
    ) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Return whitened rows, residuals, and the gain that turns residuals into landmark offsets.

        The offsets are a Gaussian process; they are marginalised, so the covariance of the residuals is the noise plus
        the shape's covariance seen by the cameras.
        """
        sight = self.sight
        pixels, by_camera, by_point = self._project(vector, self.landmarks + offset)
        residual = sight.pixel - pixels
        weight = _robust(np.linalg.norm(residual, axis=1) / sight.noise)
        count = len(sight.view)
        shape = np.zeros((count, 2, 68, 3))
        shape[np.arange(count), :, sight.point] = by_point
        shape = shape.reshape(2 * count, 204)
        seen = shape @ self.covariance
        covariance = seen @ shape.T
        covariance[np.diag_indices(2 * count)] += np.repeat(sight.noise**2 / weight, 2)
        root = np.linalg.cholesky(covariance)
        rows = np.einsum("nik,nkp->nip", by_camera, tangents[sight.view]).reshape(2 * count, -1)
        total = residual.ravel() + shape @ offset.ravel()
        white = np.linalg.solve(root, np.column_stack([rows, total, seen]))
        split = rows.shape[1]
        return white[:, :split], white[:, split], white[:, split + 1 :].T

    def _project(
        self, vector: Float64Array, points: Float64Array
    ) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Return pixels (N, 2) and their slopes by camera motion (N, 2, 7) and by the point (N, 2, 3)."""
        view = self.sight.view
        rotation, translation, focal = self.turn.unpack(vector)
        local = np.einsum("nij,nj->ni", rotation[view], points[self.sight.point])
        local += translation[view]
        x, y, z = local.T
        f = focal[view]
        zero = np.zeros_like(x)
        by_local = np.stack(
            [
                np.stack([f / z, zero, -f * x / z**2], axis=1),
                np.stack([zero, f / z, -f * y / z**2], axis=1),
            ],
            axis=1,
        )
        spin = np.cross(local[:, None, :], by_local)
        zoom = np.stack([f * x / z, f * y / z], axis=1)
        by_camera = np.concatenate([spin, by_local, zoom[:, :, None]], axis=2)
        pixels = zoom + self.centre[view]
        return pixels, by_camera, by_local @ rotation[view]

    def residual_px(self, vector: Float64Array, offset: Float64Array) -> float:
        """Return the root mean square misfit of landmarks and missed contour rays, pixels."""
        rotation, translation, focal = self.turn.unpack(vector)
        middle = 1 / max(float(vector[PERSPECTIVE]), MIN_PERSPECTIVE)
        value, _ = coherence(self.outlines, rotation, translation, focal, self.centre, middle)
        misfit = value[value < 0]
        if self.knows_landmarks:
            pixels, _, _ = self._project(vector, self.landmarks + offset)
            misfit = np.append(misfit, np.linalg.norm(self.sight.pixel - pixels, axis=1))
        return float(np.sqrt(np.mean(misfit**2))) if len(misfit) else 0.0


def _solve_held(
    normal: Float64Array, right: Float64Array, index: int, value: float
) -> Float64Array:
    """Return the solution of the normal equations whose number `index` is held at `value`."""
    free = np.delete(np.arange(len(right)), index)
    result = np.full(len(right), value)
    result[free] = np.linalg.solve(
        normal[np.ix_(free, free)], right[free] - normal[free, index] * value
    )
    return result


def _robust(scaled: Float64Array) -> Float64Array:
    """Return the weights of soft-L1 for residuals over their noise, with the bend at 2."""
    weights: Float64Array = 1 / np.sqrt(1 + (scaled / 2) ** 2)
    return weights


def _shape_covariance(points: Float64Array) -> Float64Array:
    """Return (204, 204): how landmarks of other heads differ from these, metres squared."""
    squared = ((points[:, None] - points[None]) ** 2).sum(2)
    kernel = AFFINE_SPREAD**2 * (points @ points.T) / 0.1**2
    kernel += SMOOTH_SPREAD**2 * np.exp(-squared / (2 * SMOOTH_LENGTH**2))
    kernel += PLACE_SPREAD**2 + LOOSE_SPREAD**2 * np.eye(len(points))
    covariance: Float64Array = np.kron(kernel, np.eye(3))
    return covariance


def _turn(capture: Capture) -> Turn:
    sizes = np.array([(view.width, view.height) for view in capture.views])
    diagonal = np.hypot(*sizes.T)
    known = [view.focal_px for view in capture.views]
    ratios = diagonal / diagonal[0]
    if all(focal is not None for focal in known):
        ratios = np.array(known, np.float64) / float(known[0] or 1)
    azimuths = np.radians([view.azimuth_deg for view in capture.views])
    return Turn(azimuths, sizes, ratios)
