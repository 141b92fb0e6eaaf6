"""Landmarks as evidence about cameras when the head's exact shape is not known.

The landmarks of a person differ from a given head's by offsets that are smooth over the face: a
Gaussian process. They are marginalised in closed form (the Schur complement of bundle adjustment:
Triggs et al., "Bundle adjustment - a modern synthesis", 2000, with the process's covariance as
prior), so that only the cameras remain unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.head_model.cranium import Cranium
from hairkit.types.capture import Capture, View
from hairkit.types.face import OBLIQUE_YAW_DEG, STEEP_YAW_DEG
from hairkit.types.head import JAW_LANDMARKS, LANDMARKS
from hairkit.types.mask import HAIR, Mask

JAW_NOISE, COVERED_NOISE = 2.0, 3.0
"""Times the noise of given landmarks of the jaw, and of those under hair: detectors guess them."""
FACES = 4
"""Views that show the face in a turn of eight, at most."""
UNLIKE_DEG = 8.0
"""Difference up to which an oblique face's yaw is that of the turn."""
STEEP = 1.0
"""Growth of the noise of a steep face's landmarks for each degree of its yaw. A mesh hardly turns
farther: faces seen from 52, 58, 65 and 70 degrees have yaws of 47, 50, 51 and 52, some seen from 62
of 44. Their landmarks are off by 5 to 12 mm, all of a face one way, so that many tell no more than
one."""
MIDLINE = np.array([27, 28, 29, 30, 33, 51, 57, 8])
"""Nose, lips and chin: they lie on the outline of a view from the side."""
SHOWN = 0.25
"""Least share of them without hair near: where less shows, the face is on the other side."""
AFFINE_SPREAD, SMOOTH_SPREAD, SMOOTH_LENGTH = 0.004, 0.004, 0.04
PLACE_SPREAD, LOOSE_SPREAD = 0.004, 0.0015
"""Variation between heads, metres: stretch over `AFFINE_LENGTH`, smooth deformation and its
correlation length, position of the face, single points."""
AFFINE_LENGTH = 0.1
SIZE_SPREAD = 0.012
"""Relative standard deviation of the size of a face about the template's, which alone gives photos
their scale. The circumference of heads is 568 +- 15 mm for men and 546 +- 15 mm for women (Gordon
et al., "1988 anthropometric survey of U.S. Army personnel", 1989), 3.3 % in all; deformations as
above let it vary by 3.6 %. Cameras pull it, too, all one way: with 0.02 the scale of captures is
0.93 to 0.99, with 0.012 it is 0.95 to 1.00."""


def steepness(views: Sequence[View]) -> Float64Array:
    """Return by how many degrees (V,) faces are turned too far, 0 for the rest.

    By their yaws, or those of oblique faces beyond them, as the turn has it.
    """
    faces = [(v.azimuth_deg, v.face.yaw_deg) if v.face else (0.0, 0.0) for v in views]
    azimuth, yaw = np.reshape(faces, (-1, 2)).T
    beyond = 180 - np.abs((azimuth - yaw) % 360 - 180) - UNLIKE_DEG
    beyond = np.where(np.abs(yaw) > OBLIQUE_YAW_DEG, beyond, 0.0)
    return np.asarray(np.maximum(np.abs(yaw) - STEEP_YAW_DEG, beyond).clip(0), np.float64)


@dataclass(frozen=True, eq=False)
class Sights:
    """Landmarks seen in the views, one row each, with how far to trust them."""

    view: Int64Array
    """(N,) index of the view."""
    point: Int64Array
    """(N,) index of the landmark."""
    pixel: Float64Array
    """(N, 2)."""
    noise: Float64Array
    """(N,) standard deviation in pixels."""

    @classmethod
    def of(cls, capture: Capture, masks: tuple[Mask, ...], noise: Float64Array | float) -> Sights:
        """Return the landmarks of all views; `noise` (V,), or of all, where none is told, pixels.

        Detectors tell the noise of each; a face's own landmarks are in `view.landmarks`. They err
        alike on faces seen from near each other, so that more than `FACES` tell no more.
        """
        rows = []
        shown = sum(view.landmarks is not None for view in capture.views)
        usual = np.broadcast_to(noise, len(masks))
        crowded = np.sqrt(max(1.0, shown / FACES))
        less = 1 + STEEP * steepness(capture.views)
        for index, (view, mask) in enumerate(zip(capture.views, masks, strict=True)):
            if view.landmarks is None:
                continue
            own = np.where(np.arange(LANDMARKS) < JAW_LANDMARKS, JAW_NOISE, 1.0) * usual[index]
            if view.face is not None and view.face.noise_px.all():
                own = view.face.noise_px
            for point, (x, y) in enumerate(view.landmarks):
                inside = 0 <= x < view.width and 0 <= y < view.height
                covered = inside and mask.labels[int(y), int(x)] == HAIR
                trust = (COVERED_NOISE if covered else 1.0) * less[index]
                rows.append((index, point, x, y, own[point] * trust * crowded))
        return cls.of_rows(rows)

    @classmethod
    def of_rows(cls, rows: list[tuple[int, int, float, float, float]]) -> Sights:
        """Return sights from rows of view, landmark, x, y and noise."""
        table = np.array(rows, np.float64).reshape(-1, 5)
        whole = table[:, :2].astype(np.int64)
        return cls(whole[:, 0], whole[:, 1], table[:, 2:4], table[:, 4])

    def __len__(self) -> int:
        return len(self.view)

    def joined(self, other: Sights) -> Sights:
        """Return these sights and the others."""
        return Sights(
            np.concatenate([self.view, other.view]),
            np.concatenate([self.point, other.point]),
            np.concatenate([self.pixel, other.pixel]),
            np.concatenate([self.noise, other.noise]),
        )


@dataclass(frozen=True, eq=False)
class LandmarkEquations:
    """Normal equations of landmarks for P camera numbers, the head's shape marginalised."""

    normal: Float64Array
    """(P, P)."""
    right: Float64Array
    """(P,)."""
    cost: float
    _solved: Float64Array
    """(3 N, P + 1) how the offsets give way to the cameras' numbers, and those without a step."""

    def offsets(self, move: Float64Array) -> Float64Array:
        """Return the best offsets (N, 3) of the points after a step of the cameras, metres."""
        return (self._solved[:, -1] - self._solved[:, :-1] @ move).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class LandmarkFit:
    """The landmarks of a head, how those of people differ, and what is seen of them."""

    landmarks: Float64Array
    """(68 + K, 3) in the head frame; behind the 68 those of the cranium."""
    precision: Float64Array
    """(3 (68 + K), 3 (68 + K)) inverse covariance of the offsets."""
    sights: Sights
    fields: Float32Array
    """(V, H, W) signed distance to the silhouettes in pixels, see `Outlines`."""
    scale: float
    """Field pixels per pixel."""
    profiles: Int64Array
    """Views from the side, where the midline of the face lies on the outline."""
    profile_noise: float
    """Standard deviation of that, pixels."""
    cranium: Cranium | None = None
    """What outlines show of it; None where masks are of hair alone."""

    def with_cranium(self, cranium: Cranium, cameras: CameraArrays) -> LandmarkFit:
        """Return the fit with those points of a cranium that cameras see on a bare outline."""
        every = replace(self, landmarks=np.concatenate([self.landmarks, cranium.points]))
        view, point, share = cranium.rims(cameras)
        pixels, *_ = every.project(LANDMARKS + point, view, np.zeros((1, 3)), cameras)
        value, slope = _sample(self.fields, self.scale, view, pixels)
        share = share * cranium.bare(view, pixels - value[:, None] * slope)
        near = np.abs(value) < GATE * self.profile_noise
        shown = cranium.select(np.unique(point[near & (share > 0)]))
        points = np.concatenate([self.landmarks, shown.points])
        return replace(self, landmarks=points, precision=shape_precision(points), cranium=shown)

    def project(
        self, point: Int64Array, view: Int64Array, offset: Float64Array, cameras: CameraArrays
    ) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Return pixels (N, 2), slopes by camera motion (N, 2, 7) and by the point (N, 2, 3)."""
        rotation, translation, focal, centre = cameras
        place = (self.landmarks + offset)[point]
        local = np.einsum("nij,nj->ni", rotation[view], place) + translation[view]
        x, y, z = local.T
        f, zero = focal[view], np.zeros_like(x)
        zoom = np.stack([f * x / z, f * y / z], axis=1)
        by_local = np.stack([f / z, zero, -zoom[:, 0] / z, zero, f / z, -zoom[:, 1] / z], axis=1)
        by_local = by_local.reshape(-1, 2, 3)
        by_camera = np.concatenate(
            [np.cross(local[:, None, :], by_local), by_local, zoom[:, :, None]], axis=2
        )
        return zoom + centre[view], by_camera, by_local @ rotation[view]

    def misfit(self, offset: Float64Array, cameras: CameraArrays) -> Float64Array:
        """Return each sight's distance from where it should be (N,), pixels."""
        sights = self.sights
        pixels, _, _ = self.project(sights.point, sights.view, offset, cameras)
        return np.asarray(np.linalg.norm(sights.pixel - pixels, axis=1))

    def equations(
        self, offset: Float64Array, cameras: CameraArrays, tangents: Float64Array
    ) -> LandmarkEquations:
        """Return the cameras' normal equations, by `tangents` (V, 7, P) of cameras by unknowns."""
        sights = self.sights
        pixels, by_camera, by_point = self.project(sights.point, sights.view, offset, cameras)
        residual = (sights.pixel - pixels) / sights.noise[:, None]
        length = np.linalg.norm(residual, axis=1)
        weight = np.sqrt(soft_l1_weight(length)) / sights.noise
        rows = np.einsum("nik,nkp->nip", by_camera, tangents[sights.view])
        seen = (
            (rows * weight[:, None, None]).reshape(-1, rows.shape[2]),
            (by_point * weight[:, None, None]).reshape(-1, 3),
            (residual * (weight * sights.noise)[:, None]).ravel(),
            np.repeat(sights.point, 2),
        )
        *outline, outline_cost = self._outline_rows(offset, cameras, tangents)
        rows, by_shape, residual, point = (
            np.concatenate(pair) for pair in zip(seen, outline, strict=True)
        )
        found = self._marginalised(rows, by_shape, residual, point, offset)
        unlike = float(offset.ravel() @ self.precision @ offset.ravel())
        return replace(found, cost=soft_l1_cost(length) + outline_cost + unlike)

    def _outline_rows(
        self, offset: Float64Array, cameras: CameraArrays, tangents: Float64Array
    ) -> tuple[Float64Array, Float64Array, Float64Array, Int64Array, float]:
        """Return rows that bring the face's midline, in views from the side, and the cranium's rim
        on to the outline where that is bare: hair hides a face. Last comes the cost."""
        view = np.repeat(self.profiles, len(MIDLINE))
        point = np.tile(MIDLINE, len(self.profiles))
        share = np.ones(len(view))
        if self.cranium is not None:
            rim_view, rim_point, rim_share = self.cranium.rims(cameras)
            view, point = np.append(view, rim_view), np.append(point, LANDMARKS + rim_point)
            share = np.append(share, rim_share)
        pixels, by_camera, by_point = self.project(point, view, offset, cameras)
        value, slope = _sample(self.fields, self.scale, view, pixels)
        if self.cranium is not None:
            bare = self.cranium.bare(view, pixels - value[:, None] * slope)
            faces = bare[: len(MIDLINE) * len(self.profiles)].reshape(-1, len(MIDLINE))
            faces[:] = faces.mean(axis=1, keepdims=True) >= SHOWN
            share = share * bare
        residual = -value / self.profile_noise
        weight = np.sqrt(share * soft_l1_weight(residual)) / self.profile_noise
        weight = np.where(np.abs(residual) < GATE, weight, 0.0)
        along = np.einsum("ni,nik->nk", slope, by_camera)
        rows = np.einsum("nk,nkp->np", along, tangents[view]) * weight[:, None]
        by_shape = np.einsum("ni,nik->nk", slope, by_point) * weight[:, None]
        cost = soft_l1_cost(np.minimum(np.abs(residual), GATE), share)
        return rows, by_shape, -value * weight, point, cost

    def _marginalised(
        self,
        rows: Float64Array,
        by_shape: Float64Array,
        residual: Float64Array,
        point: Int64Array,
        offset: Float64Array,
    ) -> LandmarkEquations:
        """Eliminate the offsets: the Schur complement of their block."""
        residual = residual + (by_shape * offset[point]).sum(1)
        columns = 3 * point[:, None] + np.arange(3)
        ends = np.arange(0, columns.size + 1, 3)
        size = self.landmarks.size
        by_offset = csr_matrix((by_shape.ravel(), columns.ravel(), ends), (len(rows), size))
        flat, pull = by_offset.T @ rows, by_offset.T @ residual
        shape = self.precision + (by_offset.T @ by_offset).toarray()
        solved = np.linalg.solve(shape, np.column_stack([flat, pull]))
        normal = rows.T @ rows - flat.T @ solved[:, :-1]
        right = rows.T @ residual - flat.T @ solved[:, -1]
        cost = float(residual @ residual - pull @ solved[:, -1])
        return LandmarkEquations((normal + normal.T) / 2, right, cost, solved)


CameraArrays = tuple[Float64Array, Float64Array, Float64Array, Float64Array]
"""Rotations (V, 3, 3), translations (V, 3), focal lengths (V,) and principal points (V, 2)."""
GATE = 8.0
"""Outlines farther off than this many spreads are of something else."""
SOFT_L1_BEND = 2.0
"""Residual, in standard deviations, where the loss turns from squared to linear."""
OUTSIDE = 1e6
"""Signed distance outside of the picture, pixels."""


def shape_precision(landmarks: Float64Array) -> Float64Array:
    """Return (3 N, 3 N), 1 / m^2: the inverse covariance of people's heads at these points.

    The first 68 are the landmarks, whose size has a prior of its own.
    """
    squared = ((landmarks[:, None] - landmarks[None]) ** 2).sum(2)
    kernel = AFFINE_SPREAD**2 * (landmarks @ landmarks.T) / AFFINE_LENGTH**2
    kernel += SMOOTH_SPREAD**2 * np.exp(-squared / (2 * SMOOTH_LENGTH**2))
    kernel += PLACE_SPREAD**2 + LOOSE_SPREAD**2 * np.eye(len(landmarks))
    precision: Float64Array = np.kron(np.linalg.inv(kernel), np.eye(3))
    centred = np.zeros_like(landmarks)
    centred[:LANDMARKS] = landmarks[:LANDMARKS] - landmarks[:LANDMARKS].mean(axis=0)
    growth = (centred / (centred**2).sum()).ravel()  # growth @ offsets: how much larger they are
    variance = np.einsum("ic,ij,jc->", growth.reshape(-1, 3), kernel, growth.reshape(-1, 3))
    tighter = max(0.0, SIZE_SPREAD**-2 - float(variance) ** -1)
    return precision + tighter * np.outer(growth, growth)


def soft_l1_weight(scaled: Float64Array) -> Float64Array:
    """Return the weights of soft-L1 for residuals over their noise."""
    return np.asarray(1 / np.sqrt(1 + (scaled / SOFT_L1_BEND) ** 2))


def soft_l1_cost(scaled: Float64Array, share: Float64Array | float = 1.0) -> float:
    """Return the soft-L1 cost of residuals over their noise: their squared sum where small.

    Each counts for its `share`.
    """
    bent = np.sqrt(1 + (scaled / SOFT_L1_BEND) ** 2) - 1
    return float(2 * SOFT_L1_BEND**2 * (share * bent).sum())


def _sample(
    fields: Float32Array, scale: float, view: Int64Array, pixels: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Return signed distances (N,) and their slopes by the pixel (N, 2).

    `OUTSIDE`, without slope, off the picture.
    """
    height, width = fields.shape[1:]
    place = pixels * scale - 0.5
    below = place < np.array([width - 1, height - 1])
    inside: BoolArray = np.asarray(((place >= 0) & below).all(1))
    place = np.where(inside[:, None], place, 0.0)
    j, i = place.astype(np.int64).T
    x, y = (place - np.stack([j, i], axis=1)).T
    a, b = fields[view, i, j], fields[view, i, j + 1]
    c, d = fields[view, i + 1, j], fields[view, i + 1, j + 1]
    value = (a * (1 - x) + b * x) * (1 - y) + (c * (1 - x) + d * x) * y
    slope = np.stack([(b - a) * (1 - y) + (d - c) * y, (c - a) * (1 - x) + (d - b) * x], axis=1)
    return np.where(inside, value, OUTSIDE), slope * scale * inside[:, None]
