"""The head as a mixture of shapes, fitted to landmarks and outlines in all views.

A few shapes, weighted in standard deviations, move the head's vertices; a similarity places them.
Both are found together by least squares: landmarks are compared with their pixels in every view
that has them; rims of the head with the person's outline, where that is skin; and where it is hair,
the head has to stay inside. Misses are counted in metres at the head, with a loss that outliers do
not dominate, and every weight and the similarity pay for leaving 0, by their spread among people
(a maximum a posteriori estimate, as in Blanz and Vetter 1999).

The shapes are those of the default head (`hairkit.head_model.identity`), or the principal
components of a folder of OBJ heads with the topology of the head that is fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from hairkit import Camera, Capture, Head, Mask, Scene, hookimpl
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.cameras.outlines import Outlines
from hairkit.errors import InputError
from hairkit.head_model.identity import identity_modes
from hairkit.head_model.template import default_head
from hairkit.io.mesh_text import read_obj
from hairkit.options import option
from hairkit.types.head import JAW_LANDMARKS, LANDMARKS
from hairkit.types.mask import HAIR

ROUNDS = 3
"""Rounds, in each of which the rims of the head are found anew."""
LANDMARK_MISS, JAW_MISS = 0.0025, 0.006
"""Metres by which detectors miss landmarks, and those of the jaw."""
OUTLINE_MISS = 0.006
"""Metres by which outlines miss, cameras included."""
SCALP_DEPTH = 0.003
"""Metres under the hair's outline at which the scalp lies at least."""
RIM = 1.5
"""Pixels from the outline of the head, drawn alone, up to which a vertex is on its rim."""
RIM_STEP = 8
"""Every how manieth vertex may be a rim: neighbours say the same."""
ABOVE_NECK = 0.1
"""Share of the way from the neck's joint to the head's above which rims count: the chin."""
NEAR_RIM = 0.012
"""Metres from the outline within which a rim is taken to be seen there."""
HAIR_MARGIN = 8
"""Pixels of the field beside hair where the outline is not taken for skin's."""
OUTLINE_POINTS = 20
"""Points a silhouette that the outlines keep; only their distance fields are read here."""
TURN_SPREAD, SHIFT_SPREAD, SIZE_SPREAD = 0.008, 0.0012, 0.005
"""Spread of the similarity about that of the scene: radians, metres, logarithm."""
EVALUATIONS = 10
"""Steps of the solver in a round at most."""
LARGEST_WEIGHT = 3.5
"""Standard deviations that no shape exceeds."""
FEWEST_HEADS = 3
"""Heads in a folder of shapes at least."""


@dataclass(frozen=True)
class Options:
    """Settings of the fit."""

    shapes: Path | None = option(
        None, doc="Folder of OBJ heads of one topology; none: hairkit's shapes."
    )
    modes: int = option(30, low=1, high=200, doc="Shapes that are fitted at most.")
    prior: float = option(
        1.0, low=0.01, high=100, doc="How strongly weights are drawn to the average head."
    )
    outlines: bool = option(True, doc="Fit the person's outline too, not landmarks alone.")


class _Marks(NamedTuple):
    """The landmarks of one view."""

    camera: Camera
    pixels: Float64Array
    """(68, 2)."""


class _Rims(NamedTuple):
    """Vertices on the rim of the head in one view, and what the photo shows there."""

    camera: Camera
    vertices: Int64Array
    """(R,)."""
    skin: BoolArray
    """(R,) true where the outline is skin, false where it is hair."""
    field: Float32Array
    """(H, W) signed distance to the outline, pixels, inside above 0."""
    scale: float
    """Pixels of the field per pixel of the picture."""


@hookimpl
def fit_head(capture: Capture, masks: tuple[Mask, ...], scene: Scene, options: Options) -> Scene:
    """Return the scene with its head changed by shapes."""
    modes = _modes(scene.head, options)
    fit = _Fit(scene.head, modes, options.prior)
    marks = [
        _Marks(camera, view.landmarks)
        for view, camera in zip(capture.views, scene.cameras, strict=True)
        if view.landmarks is not None and scene.head.landmark_vertices is not None
    ]
    outlined = options.outlines and all(mask.person_known for mask in masks)
    fields = _label_outlines(masks) if outlined else []
    for _ in range(ROUNDS):
        shaped = fit.head()
        rims = [
            _find_rims(shaped, camera, field, hair, scale)
            for camera, (field, hair, scale) in zip(scene.cameras, fields, strict=False)
        ]
        fit.improve(marks, rims)
    return replace(scene, head=fit.head())


def _modes(head: Head, options: Options) -> Float64Array:
    """Return (K, V, 3) moves by one deviation of each shape, in the size of the head."""
    if options.shapes is not None:
        return _folder_modes(options.shapes, head)[: options.modes]
    model = default_head()
    if not np.array_equal(head.faces, model.faces):
        raise InputError(
            "blendshapes: the shapes are of the default head; give blendshapes.shapes, a folder of"
            " OBJ heads with the topology of yours"
        )
    size = _spread(head.vertices) / _spread(model.vertices)
    return size * identity_modes()[: options.modes].astype(np.float64)


def _folder_modes(folder: Path, head: Head) -> Float64Array:
    """Return the principal components (K, V, 3) of the heads in a folder, largest first.

    Each is placed on the fitted head by the similarity of least squares first.
    """
    files = sorted(folder.glob("*.obj"))
    if len(files) < FEWEST_HEADS:
        raise InputError(f"{folder}: {len(files)} .obj heads, expected {FEWEST_HEADS} or more")
    from hairkit.cameras.similarity import fit_similarity

    shapes = []
    for file in files:
        vertices = read_obj(file).vertices
        if len(vertices) != len(head.vertices):
            raise InputError(
                f"{file}: {len(vertices)} vertices, the head that is fitted has"
                f" {len(head.vertices)}; all need one topology"
            )
        shapes.append(fit_similarity(vertices, head.vertices).apply(vertices))
    centred = np.stack(shapes) - np.mean(shapes, axis=0)
    _, sizes, axes = np.linalg.svd(centred.reshape(len(files), -1), full_matrices=False)
    deviations = sizes[: len(files) - 1] / np.sqrt(len(files) - 1)
    components: Float64Array = (deviations[:, None] * axes[: len(files) - 1]).reshape(
        -1, len(head.vertices), 3
    )
    return components


def _spread(vertices: Float32Array) -> float:
    return float(np.linalg.norm(vertices - vertices.mean(axis=0)))


class _Part(NamedTuple):
    """Some vertices of the head."""

    vertices: Float64Array
    """(N, 3) on the head that is fitted."""
    modes: Float64Array
    """(K, N, 3)."""

    def place(self, values: Float64Array) -> Float64Array:
        """Return their places (N, 3)."""
        return _similar(self.vertices + np.tensordot(values[7:], self.modes, axes=1), values)


class _Fit:
    """Weights of the shapes and the similarity, while they are found."""

    def __init__(self, head: Head, modes: Float64Array, prior: float) -> None:
        self._head, self._modes, self._prior = head, modes, prior
        self._vertices = head.vertices.astype(np.float64)
        self._values = np.zeros(7 + len(modes))
        spreads = [SIZE_SPREAD, *[TURN_SPREAD] * 3, *[SHIFT_SPREAD] * 3]
        self._spread = np.concatenate([spreads, np.full(len(modes), 1 / np.sqrt(prior))])

    def head(self) -> Head:
        """Return the head as it is now."""
        moved = _Part(self._vertices, self._modes).place(self._values)
        whole = self._head.carried(lambda points: _similar(points, self._values).astype(np.float32))
        return replace(whole, vertices=moved.astype(np.float32))

    def improve(self, marks: Sequence[_Marks], rims: Sequence[_Rims]) -> None:
        """Find the values of least cost, with the rims as they are."""
        from scipy.optimize import least_squares

        index = self._head.landmark_vertices
        marked = None if index is None else self._part(index.astype(np.int64))
        parts = [self._part(rim.vertices) for rim in rims]
        limit = np.concatenate([np.full(7, np.inf), np.full(len(self._modes), LARGEST_WEIGHT)])
        found = least_squares(
            lambda values: self._misses(values, marks, marked, rims, parts),
            self._values,
            bounds=(-limit, limit),
            x_scale=self._spread,
            max_nfev=EVALUATIONS,
        )
        self._values = found.x

    def _misses(
        self,
        values: Float64Array,
        marks: Sequence[_Marks],
        marked: _Part | None,
        rims: Sequence[_Rims],
        parts: Sequence[_Part],
    ) -> Float64Array:
        """Return all misses, each in shares of its spread."""
        misses = [values / self._spread]
        if marked is not None:
            points = marked.place(values)
            jaw = np.arange(LANDMARKS) < JAW_LANDMARKS
            sigma = np.where(jaw, JAW_MISS, LANDMARK_MISS)[:, None]
            for mark in marks:
                off = mark.camera.project(points) - mark.pixels
                off *= _metres(mark.camera, points)[:, None] / sigma
                misses.append(_soften(off.ravel()))
        for rim, part in zip(rims, parts, strict=True):
            points = part.place(values)
            pixels = np.nan_to_num(rim.camera.project(points), nan=-1.0) * rim.scale - 0.5
            inside = ndimage.map_coordinates(
                rim.field, pixels.T[::-1], order=1, mode="nearest"
            ) * _metres(rim.camera, points)
            hidden = np.minimum(inside - SCALP_DEPTH, 0)  # hair covers the head, never the reverse
            misses.append(_soften(np.where(rim.skin, inside, hidden) / OUTLINE_MISS))
        return np.concatenate(misses)

    def _part(self, vertices: Int64Array) -> _Part:
        """Return some vertices of the head with their modes."""
        return _Part(self._vertices[vertices], self._modes[:, vertices])


def _soften(misses: Float64Array) -> Float64Array:
    """Return misses whose squares grow only linearly when they are large (Charbonnier's loss)."""
    return np.asarray(np.sign(misses) * np.sqrt(2 * (np.sqrt(1 + misses**2) - 1)))


def _similar(points: Float64Array | Float32Array, values: Float64Array) -> Float64Array:
    """Return points moved by the similarity of the first seven values."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(values[1:4]).as_matrix()
    return np.asarray(np.exp(values[0]) * points.astype(np.float64) @ turn.T + values[4:7])


def _metres(camera: Camera, points: Float64Array) -> Float64Array:
    """Return (N,) metres at points that a pixel is wide."""
    if camera.model == "orthographic":
        return np.full(len(points), 1 / camera.focal)
    return np.maximum(camera.depth(points), 0) / camera.focal


def _label_outlines(masks: Sequence[Mask]) -> list[tuple[Float32Array, BoolArray, float]]:
    """Return, for each view, the signed distance to the outline, where it is hair, and scale."""
    outlines = Outlines.of(masks, count=OUTLINE_POINTS)
    found = []
    for field, mask in zip(outlines.fields, masks, strict=True):
        height, width = field.shape
        rows = ((np.arange(height) + 0.5) * mask.labels.shape[0] / height).astype(np.int64)
        columns = ((np.arange(width) + 0.5) * mask.labels.shape[1] / width).astype(np.int64)
        labels = mask.labels[np.ix_(rows, columns)]
        edge = (field > 0) & ~ndimage.binary_erosion(field > 0)
        nearest = ndimage.distance_transform_edt(~edge, return_distances=False, return_indices=True)
        hairy = ndimage.binary_dilation(labels == HAIR, iterations=HAIR_MARGIN)
        found.append((field, np.asarray(hairy)[tuple(nearest)], outlines.scale))
    return found


def _find_rims(
    head: Head, camera: Camera, field: Float32Array, hair: BoolArray, scale: float
) -> _Rims:
    """Return the vertices above the neck that are on the rim of the head, near the outline."""
    vertices = head.vertices.astype(np.float64)
    height, width = field.shape
    drawn = np.isfinite(head_depth(head, camera.resized(width, height)))
    inside = ndimage.distance_transform_edt(drawn)
    pixels = np.nan_to_num(camera.project(vertices), nan=-1.0) * scale - 0.5
    column, row = np.rint(pixels).astype(np.int64).T
    within = (row >= 0) & (column >= 0) & (row < height) & (column < width)
    within &= vertices[:, 1] > (1 - ABOVE_NECK) * head.joints[1, 1] + ABOVE_NECK * head.joints[2, 1]
    index = np.flatnonzero(within)
    index = index[inside[row[index], column[index]] <= RIM][::RIM_STEP]
    row, column = row[index], column[index]
    away = field[row, column] * _metres(camera, vertices[index])
    skin = ~hair[row, column]
    near = (np.abs(away) < NEAR_RIM) | (~skin & (away < 0))
    return _Rims(camera, index[near], skin[near], field, scale)
