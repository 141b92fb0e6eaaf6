"""Scores of a groom against a capture's truth (docs/evaluation.md)."""

from __future__ import annotations

from hairkit.evaluation.evaluation import Evaluation, evaluate
from hairkit.evaluation.images import mask_iou, orientation_error
from hairkit.evaluation.prediction import Prediction, read_prediction
from hairkit.evaluation.scores import Score, StrandScores, strand_scores
from hairkit.evaluation.truth import Truth, read_truth

__all__ = [
    "Evaluation",
    "Prediction",
    "Score",
    "StrandScores",
    "Truth",
    "evaluate",
    "mask_iou",
    "orientation_error",
    "read_prediction",
    "read_truth",
    "strand_scores",
]
