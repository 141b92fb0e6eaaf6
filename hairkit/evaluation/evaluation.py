"""All figures of one groom against one truth."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from hairkit.arrays import BoolArray, Float64Array
from hairkit.evaluation.align import Alignment, CameraError, align, alignment_points, camera_errors
from hairkit.evaluation.images import (
    DrawnDirections,
    OrientationError,
    direction_share,
    hair_silhouette,
    judge_drawn_directions,
    mask_iou,
    orientation_error,
)
from hairkit.evaluation.likeness import MEASURES, likeness
from hairkit.evaluation.prediction import Prediction
from hairkit.evaluation.scores import (
    Hits,
    Samples,
    Score,
    StrandScores,
    occupancy_score,
    sample_hits,
    sample_strands,
    scores_of_hits,
)
from hairkit.evaluation.strand_statistics import (
    HeadMeasures,
    LengthMeasures,
    head_measures,
    length_measures,
    strand_consistency,
)
from hairkit.evaluation.truth import Truth
from hairkit.grooming.densify import densify
from hairkit.parallel import one_blas_thread
from hairkit.types.groom import Groom
from hairkit.types.mask import HAIR, PERSON
from hairkit.types.strands import Strands

DENSE_STRANDS = 10_000
"""Hair is densified to this many strands for its silhouette."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Data for the pictures of a report; not part of the figures."""

    precision: Hits
    recall: Hits
    samples: Samples
    """Of every predicted strand, in the truth's frame."""
    directions: tuple[DrawnDirections, ...]
    silhouettes: tuple[BoolArray, ...]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Figures of a groom, brought into the truth's frame, against the truth."""

    strands: int
    """Strands of the groom."""
    similarity: Alignment
    cameras: tuple[CameraError, ...]
    scores: StrandScores
    occupancy: Score
    """Of the voxels that strands run through."""
    lengths: LengthMeasures
    true_head: HeadMeasures
    own_head: HeadMeasures
    """Against the head that was fitted to the photos."""
    direction_views: tuple[float, ...]
    """Share of visible drawn samples with the right direction, by view."""
    direction_share: float
    """The same over all views together."""
    silhouette_views: tuple[float, ...]
    """Intersection over union of the densified hair with the true hair mask, by view."""
    dense_strands: int
    """Strands that the silhouettes were drawn with."""
    orientation_views: tuple[OrientationError, ...] | None
    """Of the 2D orientation maps; None when they were not given."""
    mask_views: tuple[float, ...] | None
    """Intersection over union of the hair masks; None when they were not given."""
    likeness_views: Float64Array | None
    """(V, 6) `MEASURES` of drawn hair over those of photos; None without photos or OpenGL."""
    consistency: float | None
    """Share of a true strand that one predicted strand follows; None when not asked for."""
    evidence: Evidence

    @property
    def azimuth_error_deg(self) -> float:
        """Mean absolute azimuth error of the views."""
        return float(np.mean([abs(camera.azimuth_deg) for camera in self.cameras]))

    @property
    def silhouette(self) -> float:
        """Mean silhouette overlap of the views."""
        return float(np.mean(self.silhouette_views))

    @property
    def orientation_deg(self) -> float | None:
        """Mean 2D orientation error of the views, None when unknown."""
        if self.orientation_views is None:
            return None
        return float(np.mean([view.mean_deg for view in self.orientation_views]))

    @property
    def mask_iou(self) -> float | None:
        """Mean mask overlap of the views, None when unknown."""
        return None if self.mask_views is None else float(np.mean(self.mask_views))

    @property
    def likeness(self) -> dict[str, float] | None:
        """Mean over the views of each measure of the drawn hair over the photo's, if known."""
        if self.likeness_views is None:
            return None
        return dict(zip(MEASURES, self.likeness_views.mean(axis=0).tolist(), strict=True))

    def to_json(self) -> dict[str, Any]:
        """Return every figure as plain numbers, lists and dictionaries."""
        figures = {
            field.name: _plain(getattr(self, field.name))
            for field in dataclasses.fields(self)
            if field.name != "evidence"
        }
        means = ("azimuth_error_deg", "silhouette", "orientation_deg", "mask_iou", "likeness")
        return figures | {name: getattr(self, name) for name in means}


@one_blas_thread()
def evaluate(
    prediction: Prediction,
    truth: Truth,
    *,
    consistency: bool = False,
    dense_strands: int = DENSE_STRANDS,
) -> Evaluation:
    """Score a prediction against the truth by the protocol of docs/evaluation.md.

    Parameters
    ----------
    prediction : Prediction
        A groom with its own cameras, in its own frame.
    truth : Truth
        Of the same capture; both must have the same views.
    consistency : bool
        Measure strand consistency too, which takes some seconds.
    dense_strands : int
        Hair is densified to this many strands for its silhouette.

    Raises
    ------
    InputError
        When views do not pair up or no strand is long enough to score.
    """
    prediction = prediction.in_order_of(truth)
    groom = prediction.groom  # brows, lashes and beard are no hair of the head
    alone = groom.select(~groom.strands.planted)
    prediction = dataclasses.replace(prediction, groom=alone)
    groom, similarity, cameras = _align(prediction, truth)
    samples = sample_strands(groom.strands, name="predicted")
    precision, recall = sample_hits(samples, truth.samples, surfaces=truth.surfaces, visible=True)
    directions = _directions(samples, truth)
    silhouettes, dense = _silhouettes(groom, truth, dense_strands)
    return Evaluation(
        strands=len(groom.strands),
        similarity=similarity,
        cameras=cameras,
        scores=scores_of_hits(precision, recall),
        occupancy=occupancy_score(samples, truth.samples),
        lengths=length_measures(groom.strands, truth.strands),
        true_head=head_measures(groom.strands, samples, truth.head),
        own_head=head_measures(groom.strands, samples, groom.head),
        direction_views=tuple(direction_share([view]) for view in directions),
        direction_share=direction_share(directions),
        silhouette_views=tuple(
            mask_iou(drawn, truth.hair_mask(view) == HAIR) for view, drawn in enumerate(silhouettes)
        ),
        dense_strands=dense,
        orientation_views=_orientation(prediction, truth),
        mask_views=_masks(prediction, truth),
        likeness_views=_likeness(prediction, truth, dense_strands),
        consistency=strand_consistency(groom.strands, truth.strands) if consistency else None,
        evidence=Evidence(precision, recall, samples, directions, silhouettes),
    )


def _align(
    prediction: Prediction, truth: Truth
) -> tuple[Groom, Alignment, tuple[CameraError, ...]]:
    groom = prediction.groom
    points = alignment_points(groom.strands, groom.head.vertices)
    similarity = align(prediction.cameras, truth.cameras, points)
    errors = camera_errors(truth.names, prediction.cameras, truth.cameras, similarity, points)
    head = dataclasses.replace(
        groom.head, vertices=similarity.apply(groom.head.vertices).astype(np.float32)
    )
    strands = similarity.moved_strands(groom.strands)
    return dataclasses.replace(groom, strands=strands, head=head), similarity, errors


def _directions(samples: Samples, truth: Truth) -> tuple[DrawnDirections, ...]:
    return tuple(
        judge_drawn_directions(camera, samples, truth.head, truth.orientation(view))
        for view, camera in enumerate(truth.cameras)
    )


def _silhouettes(groom: Groom, truth: Truth, count: int) -> tuple[tuple[BoolArray, ...], int]:
    """Draw the densified hair into every view."""
    dense: Strands = densify(groom, count)
    samples = sample_strands(dense, shortest=0.0, name="densified")
    drawn = tuple(
        hair_silhouette(camera, samples, truth.head, clothes=truth.hair_mask(view) == PERSON)
        for view, camera in enumerate(truth.cameras)
    )
    return drawn, len(dense)


def _orientation(prediction: Prediction, truth: Truth) -> tuple[OrientationError, ...] | None:
    if prediction.orientations is None:
        return None
    return tuple(
        orientation_error(found, truth.orientation(view), truth.hair_mask(view) == HAIR)
        for view, found in enumerate(prediction.orientations)
    )


def _masks(prediction: Prediction, truth: Truth) -> tuple[float, ...] | None:
    if prediction.masks is None:
        return None
    return tuple(
        mask_iou(found.hair, truth.hair_mask(view) == HAIR)
        for view, found in enumerate(prediction.masks)
    )


def _likeness(prediction: Prediction, truth: Truth, count: int) -> Float64Array | None:
    photos = truth.photos()
    if photos is None:
        return None
    hair = [truth.hair_mask(view) == HAIR for view in range(len(photos))]
    return likeness(prediction.groom, prediction.cameras, photos, hair, count)


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        plain = {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
        kind = type(value)
        derived = [name for name in vars(kind) if isinstance(vars(kind)[name], property)]
        return plain | {name: getattr(value, name) for name in derived}
    return value
