"""The figures of an evaluation, one line each, with what a good value is in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hairkit.evaluation.evaluation import Evaluation
from hairkit.evaluation.likeness import MEASURES
from hairkit.evaluation.scores import Score

_F_MEANING = "higher is better, 100 is best: points of either side that have a match on the other"

_OCCUPANCY_MEANING = "higher is better, 100 is best: voxels with hair, whatever its direction"


@dataclass(frozen=True)
class Figure:
    """One measured number."""

    name: str
    value: float | None
    """None when it could not be measured."""
    unit: str
    digits: int = 1
    meaning: str = ""
    """Description of a good value."""

    def text(self) -> str:
        """Return the value with its unit."""
        return "-" if self.value is None else f"{self.value:.{self.digits}f}{self.unit}"


def figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    """Return the figures of one evaluation, the most telling ones first."""
    return (*_strand_figures(evaluation), *_view_figures(evaluation), *_head_figures(evaluation))


def _strand_figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    scores, lengths = evaluation.scores, evaluation.lengths
    behind = max(
        100 * (free.f - signed.f)
        for free, signed in zip(scores.all, scores.all_signed, strict=True)
    )
    outer: Sequence[Score | None] = scores.outer or (None, None, None)
    return (
        *_f_figures(scores.all, "all"),
        *_f_figures(outer, "outer"),
        Figure("occupancy F 3 mm, all", 100 * evaluation.occupancy.f, "", 1, _OCCUPANCY_MEANING),
        Figure("signed F behind sign-free F", behind, "", 1, "0 is best: no strand runs backwards"),
        Figure("mean length / true", lengths.mean_ratio, "", 2, "1 is best"),
        Figure(
            "strands under half their neighbours",
            100 * lengths.broken_share,
            " %",
            1,
            "lower is better: share of broken strands",
        ),
        Figure("strands", evaluation.strands, "", 0, "compare only with equal numbers"),
    )


def _f_figures(scores: Sequence[Score | None], samples: str) -> list[Figure]:
    """Return F of the coarse, middle and fine threshold in per cent."""
    names = ("F 2 mm/20", "F 3 mm/30", "F 4 mm/40")
    return [
        Figure(f"{name}, {samples}", None if score is None else 100 * score.f, "", 1, _F_MEANING)
        for name, score in reversed(list(zip(names, scores, strict=True)))
    ]


def _view_figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    cameras = evaluation.cameras
    share = 100 * evaluation.direction_share
    rotation = float(np.mean([camera.rotation_deg for camera in cameras]))
    apart = 1000 * float(np.mean([camera.position_m for camera in cameras]))
    lower, overlap = "lower is better", "higher is better, 1 is best"
    orientation, azimuth = evaluation.orientation_deg, evaluation.azimuth_error_deg
    scale, alike = 1 / evaluation.similarity.scale, evaluation.likeness or {}
    return (
        Figure("drawn direction within 20 deg", share, " %", 1, "higher is better, 100 is best"),
        Figure("silhouette IoU", evaluation.silhouette, "", 3, overlap),
        Figure("2D orientation error", orientation, " deg", 1, f"{lower}, guessing gives 45"),
        Figure("hair mask IoU", evaluation.mask_iou, "", 3, overlap),
        *(
            Figure(f"{name} / photo", alike.get(name), "", 2, "1 is best: of the drawn hair")
            for name in MEASURES
        ),
        Figure("metric scale / true", scale, "", 3, "1 is best: scores are of the groom so scaled"),
        Figure("camera azimuth error", azimuth, " deg", 2, lower),
        Figure("camera rotation error", rotation, " deg", 2, lower),
        Figure("camera position error", apart, " mm", 1, lower),
        Figure("reprojection", evaluation.similarity.residual_px, " px", 1, lower),
    )


def _head_figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    own, true = evaluation.own_head, evaluation.true_head
    none = "0 is best: no hair inside the head"
    return (
        Figure("points inside own head", own.points_inside, "", 0, none),
        Figure("samples inside own head", own.samples_inside, "", 0, none),
        Figure("points inside true head", true.points_inside, "", 0, "lower is better"),
        Figure("roots off own head", own.root_distance_mean_mm, " mm", 2, "0 is best"),
        Figure("roots off true head", true.root_distance_mean_mm, " mm", 2, "lower is better"),
    )
