"""Smooth horizontal sections: how well all outlines agree with one smooth shape at every height.

A viewing ray that grazes the subject is a tangent of its horizontal section at the height where it touches. The tangents
of a section obey its support function `h(angle)`, and sections of people are smooth: `h` is a short Fourier series with
random coefficients. Silhouettes that contradict every such series say that their cameras are wrong: unlike coherence,
which forgives whatever lies inside, this uses both sides of an outline at all heights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit.stored import BoolArray, Float32Array, Float64Array

HARMONICS = 6
SPREADS = np.array([0.1, 0.03, 0.03, 0.006, 0.004, 0.002, 0.001])
"""Usual size of the harmonics of a support function, metres."""
OVERTONES = np.array([0.0, 0.0, 0.0, 0.15, 0.2, 0.05, 0.08])
"""What harmonics 3 and higher add for each metre of the second: flat sections have corners."""
STEEP = 1.2
"""Outlines that run more columns than this for each row are no tangents of a horizontal section."""
ABSENT = 1e3
"""Noise given to tangents that are not seen, metres."""


@dataclass(frozen=True, eq=False)
class Profiles:
    """First and last column of every silhouette at every row, in picture pixels."""

    columns: Float64Array
    """(V, 2, H) NaN where the silhouette is cut by the picture, missing, or too flat."""
    scale: float
    """Rows of the table per picture pixel."""

    @classmethod
    def of(cls, fields: Float32Array, scale: float, edge: int = 4) -> Profiles:
        """Read the outline off signed distance fields (V, H, W) of `scale` rows per pixel."""
        columns = np.stack([_row_ends(field, edge) for field in fields])
        slope = np.gradient(columns, axis=2)
        columns[~(np.abs(slope) < STEEP)] = np.nan
        columns[:, :, :edge] = np.nan
        columns[:, :, -edge:] = np.nan
        return cls(columns / scale, scale)

    def at(self, rows: Float64Array) -> Float64Array:
        """Return columns (V, 2, K) at picture rows (V, 2, K); NaN where there is no outline."""
        place = rows * self.scale - 0.5
        low = np.floor(np.nan_to_num(place, nan=-9)).astype(np.int64)
        inside = (low >= 0) & (low < self.columns.shape[2] - 1)
        low = np.where(inside, low, 0)
        share = place - low
        first = np.take_along_axis(self.columns, low, axis=2)
        second = np.take_along_axis(self.columns, low + 1, axis=2)
        return np.where(inside, first * (1 - share) + second * share, np.nan)


def _row_ends(field: Float32Array, edge: int) -> Float64Array:
    """Return (2, H) field columns where the silhouette begins and ends, to a part of a pixel."""
    inside = field > 0
    width = field.shape[1]
    ends = np.full((2, len(field)), np.nan)
    rows = np.nonzero(inside.any(1))[0]
    first = inside[rows].argmax(1)
    last = width - 1 - inside[rows, ::-1].argmax(1)
    for side, column, step in ((0, first, -1), (1, last, 1)):
        kept = (column >= edge) & (column < width - edge)
        row, at = rows[kept], column[kept]
        here, beyond = field[row, at], field[row, at + step]
        ends[side, row] = at + 0.5 + step * here / np.maximum(here - beyond, 1e-6)
    return ends


@dataclass(frozen=True, eq=False)
class Sections:
    """The support functions of the sections: Fourier coefficients, and the rows they touch."""

    heights: Float64Array
    """(K,) heights in the head frame, metres."""
    coefficients: Float64Array
    """(K, 2 * HARMONICS + 1): constant, cosines, sines; metres."""
    rows: Float64Array
    """(V, 2, K) picture rows of the tangents."""

    @classmethod
    def start(
        cls, heights: Float64Array, rotation: Float64Array, translation: Float64Array,
        focal: Float64Array, centre: Float64Array,
    ) -> Sections:  # fmt: skip
        """Return round sections about the head's axis."""
        points = np.stack([0 * heights, heights, 0 * heights], axis=1)
        local = np.einsum("vij,kj->vki", rotation, points) + translation[:, None]
        rows = focal[:, None] * local[..., 1] / local[..., 2] + centre[:, 1:]
        coefficients = np.zeros((len(heights), 2 * HARMONICS + 1))
        coefficients[:, 0] = 0.1
        return cls(heights, coefficients, np.repeat(rows[:, None], 2, axis=1))


def section_rows(
    profiles: Profiles,
    sections: Sections,
    rotation: Float64Array,
    translation: Float64Array,
    focal: Float64Array,
    centre: Float64Array,
    noise: float,
) -> tuple[Float64Array, Float64Array, Sections]:
    """Return whitened residuals (K, 2 V), their slopes by the cameras (K, 2 V, V, 7), and better sections.

    `noise` is the outline's, metres. Slopes are by each camera's small motion, as in `hairkit.pose.Turn.tangents`.
    """
    rows, angle, offset = _tangents(
        profiles, sections, sections.rows, rotation, translation, focal, centre
    )
    seen = np.isfinite(offset)
    count, _, levels = offset.shape
    slopes = np.zeros((7, count, 2, levels))
    derivative = _series(sections.coefficients, np.nan_to_num(angle), 1)
    for axis in range(7):
        step = 1e-4
        moved = _moved_cameras(rotation, translation, focal, axis, step)
        _, angle_moved, offset_moved = _tangents(profiles, sections, rows, *moved, centre)
        turned = (angle_moved - angle + np.pi) % (2 * np.pi) - np.pi
        slopes[axis] = (offset_moved - offset - derivative * turned) / step
    seen &= np.isfinite(slopes).all(0)
    residual, white, coefficients = _whitened(
        sections, np.where(seen, angle, 0.0), np.where(seen, offset, 0.0), seen, noise
    )
    table = np.zeros((levels, count, 2, count, 7))
    for view in range(count):
        table[:, view, :, view] = np.where(seen[view], slopes[:, view], 0.0).transpose(2, 1, 0)
    by_camera = np.einsum("kab,kbvc->kavc", white, table.reshape(levels, 2 * count, count, 7))
    kept_rows = np.where(np.isfinite(rows), rows, sections.rows)
    return residual, by_camera, Sections(sections.heights, coefficients, kept_rows)


def _moved_cameras(
    rotation: Float64Array, translation: Float64Array, focal: Float64Array, axis: int, step: float
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return all cameras after the small motion `step` along one of the seven axes."""
    if axis == 6:
        return rotation, translation, focal * np.exp(step)
    if axis >= 3:
        return rotation, translation + step * np.eye(3)[axis - 3], focal
    cosine, sine = np.cos(step), np.sin(step)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn = np.eye(3)
    turn[i, i] = turn[j, j] = cosine
    turn[i, j], turn[j, i] = -sine, sine
    return turn @ rotation, translation @ turn.T, focal


def _tangents(
    profiles: Profiles,
    sections: Sections,
    rows: Float64Array,
    rotation: Float64Array,
    translation: Float64Array,
    focal: Float64Array,
    centre: Float64Array,
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return rows, normal angles and offsets (V, 2, K) of the rays that touch the sections at their heights."""
    origin = -np.einsum("vji,vj->vi", rotation, translation)[:, None, None]
    side = np.array([-1.0, 1.0])[None, :, None]
    for _ in range(3):
        columns = profiles.at(rows)
        pixel = np.stack([columns, rows], axis=-1) - centre[:, None, None]
        ray = np.concatenate([pixel / focal[:, None, None, None], np.ones((*rows.shape, 1))], -1)
        ray = np.einsum("vji,vskj->vski", rotation, ray)
        along = ray[..., [0, 2]]
        length = np.linalg.norm(along, axis=-1)
        along = along / length[..., None]
        normal = side[..., None] * np.stack([-along[..., 1], along[..., 0]], axis=-1)
        angle = np.arctan2(normal[..., 0], normal[..., 1])
        start = origin[..., [0, 2]]
        offset = (normal * start).sum(-1)
        tangent = np.stack([normal[..., 1], -normal[..., 0]], axis=-1)
        reach = _series(sections.coefficients, np.nan_to_num(angle), 1)
        way = reach * (tangent * along).sum(-1) - (start * along).sum(-1)
        height = origin[..., 1] + ray[..., 1] / length * way
        rows = rows + (height - sections.heights) * focal[:, None, None] / np.maximum(way, 0.05)
    return rows, angle, offset


def _series(coefficients: Float64Array, angle: Float64Array, order: int) -> Float64Array:
    """Return the Fourier series (order 0) or its derivative (order 1) of section k at angles (..., K)."""
    basis = _basis(angle, order)
    result: Float64Array = np.einsum("...kc,kc->...k", basis, coefficients)
    return result


def _basis(angle: Float64Array, order: int) -> Float64Array:
    wave = np.arange(1, HARMONICS + 1)
    phase = angle[..., None] * wave
    if order:
        return np.concatenate(
            [np.zeros((*angle.shape, 1)), -wave * np.sin(phase), wave * np.cos(phase)], axis=-1
        )
    return np.concatenate([np.ones((*angle.shape, 1)), np.cos(phase), np.sin(phase)], axis=-1)


def _whitened(
    sections: Sections, angle: Float64Array, offset: Float64Array, seen: BoolArray, noise: float
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return whitened residuals (K, 2 V), the whitening (K, 2 V, 2 V), and the posterior coefficients."""
    levels = len(sections.heights)
    basis = _basis(angle, 0).reshape(-1, levels, 2 * HARMONICS + 1).transpose(1, 0, 2)
    data = offset.reshape(-1, levels).T
    known = seen.reshape(-1, levels).T
    second = np.hypot(sections.coefficients[:, 2], sections.coefficients[:, HARMONICS + 2])
    spread = SPREADS + OVERTONES * second[:, None]
    variance = np.concatenate([spread, spread[:, 1:]], axis=1) ** 2
    seen_shape = basis * variance[:, None, :]
    covariance = seen_shape @ basis.transpose(0, 2, 1)
    diagonal = np.arange(data.shape[1])
    covariance[:, diagonal, diagonal] += np.where(known, noise, ABSENT) ** 2
    root = np.linalg.cholesky(covariance)
    white = np.linalg.inv(root)
    mean = np.zeros(2 * HARMONICS + 1)
    mean[0] = 0.1
    centred = np.where(known, data - basis @ mean, 0.0)
    residual = np.einsum("kab,kb->ka", white, centred)
    posterior = mean + np.einsum("kac,kba,kb->kc", seen_shape, white, residual)
    return residual, white, posterior
