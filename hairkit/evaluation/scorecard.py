"""The figures a reconstruction is judged by, one line each, with what is wanted of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hairkit.evaluation.evaluation import Evaluation

Band = tuple[float, float]
"""Least and greatest value wanted."""
_MOST = float("inf")


@dataclass(frozen=True)
class Figure:
    """One number with the band it must lie in and the band aimed at."""

    name: str
    value: float | None
    """None when it could not be measured."""
    unit: str
    must: Band | None = None
    aim: Band | None = None
    digits: int = 1

    @property
    def verdict(self) -> str:
        """`aim`, `must`, `missed`, or nothing where nothing is wanted or known."""
        if self.value is None or self.must is None:
            return ""
        if self.aim is not None and self.aim[0] <= self.value <= self.aim[1]:
            return "aim"
        return "must" if self.must[0] <= self.value <= self.must[1] else "missed"

    def text(self) -> str:
        """Return the value with its unit."""
        return "-" if self.value is None else f"{self.value:.{self.digits}f}{self.unit}"


def band_text(band: Band | None, digits: int) -> str:
    """Return a band as people write it: at least, at most, or from to."""
    if band is None:
        return ""
    low, high = band
    if high == _MOST:
        return f">= {low:.{digits}f}"
    return f"<= {high:.{digits}f}" if low <= 0 else f"{low:.{digits}f} to {high:.{digits}f}"


def figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    """Return the figures of one evaluation, the ones that are judged first."""
    return (*_strand_figures(evaluation), *_view_figures(evaluation), *_head_figures(evaluation))


def mean_figures(several: Sequence[Sequence[Figure]]) -> tuple[Figure, ...]:
    """Return the mean of each figure over evaluations whose figures come in the same order."""
    means = []
    for column in zip(*several, strict=True):
        known = [figure.value for figure in column if figure.value is not None]
        first = column[0]
        mean = float(np.mean(known)) if known else None
        means.append(Figure(first.name, mean, first.unit, first.must, first.aim, first.digits))
    return tuple(means)


def _strand_figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    fine, middle, coarse = (100 * score.f for score in evaluation.scores.all)
    signed = [100 * score.f for score in evaluation.scores.all_signed]
    outer = evaluation.scores.outer
    behind = max(fine - signed[0], middle - signed[1], coarse - signed[2])
    lengths = evaluation.lengths
    return (
        Figure("F 4 mm/40, all", coarse, "", (65, _MOST), (84, _MOST)),
        Figure("F 3 mm/30, all", middle, ""),
        Figure("F 2 mm/20, all", fine, "", (32, _MOST), (52, _MOST)),
        Figure("F 4 mm/40, outer", None if outer is None else 100 * outer[2].f, ""),
        Figure(
            "F 3 mm/30, outer",
            None if outer is None else 100 * outer[1].f,
            "",
            (50, _MOST),
            (72, _MOST),
        ),
        Figure("F 2 mm/20, outer", None if outer is None else 100 * outer[0].f, ""),
        Figure("signed F behind sign-free F", behind, "", (-_MOST, 4), (-_MOST, 1)),
        Figure("mean length / true", lengths.mean_ratio, "", (0.75, 1.3), (0.95, 1.05), 2),
        Figure(
            "strands under half their neighbours",
            100 * lengths.broken_share,
            " %",
            (0, 10),
            (0, 2),
        ),
        Figure("strands", evaluation.strands, "", digits=0),
    )


def _view_figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    cameras = evaluation.cameras
    share = 100 * evaluation.direction_share
    rotation = float(np.mean([camera.rotation_deg for camera in cameras]))
    apart = 1000 * float(np.mean([camera.position_m for camera in cameras]))
    return (
        Figure("drawn direction within 20 deg", share, " %", (65, _MOST), (85, _MOST)),
        Figure("silhouette IoU", evaluation.silhouette, "", (0.75, _MOST), (0.88, _MOST), 3),
        Figure("2D orientation error", evaluation.orientation_deg, " deg", (0, 13), (0, 8)),
        Figure("hair mask IoU", evaluation.mask_iou, "", (0.82, _MOST), (0.92, _MOST), 3),
        Figure("camera azimuth error", evaluation.azimuth_error_deg, " deg", (0, 1.5), (0, 0.5), 2),
        Figure("camera rotation error", rotation, " deg", digits=2),
        Figure("camera position error", apart, " mm"),
        Figure("reprojection", evaluation.similarity.residual_px, " px"),
    )


def _head_figures(evaluation: Evaluation) -> tuple[Figure, ...]:
    own, true = evaluation.own_head, evaluation.true_head
    return (
        Figure("points inside own head", own.points_inside, "", (0, 0), digits=0),
        Figure("samples inside own head", own.samples_inside, "", (0, 0), digits=0),
        Figure("points inside true head", true.points_inside, "", digits=0),
        Figure("roots off own head", own.root_distance_mean_mm, " mm", digits=2),
        Figure("roots off true head", true.root_distance_mean_mm, " mm", digits=2),
    )
