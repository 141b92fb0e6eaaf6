"""Scores of a groom against a capture's truth (docs/evaluation.md)."""

from __future__ import annotations

from hairkit.evaluate.evaluation import Evaluation, evaluate
from hairkit.evaluate.images import mask_iou, orientation_error
from hairkit.evaluate.prediction import Prediction, read_prediction
from hairkit.evaluate.scores import Score, StrandScores, strand_scores
from hairkit.evaluate.truth import Truth, read_truth

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
