"""Scores of a groom against a capture's truth (docs/evaluation.md)."""

from __future__ import annotations

from hairkit.evaluate.scores import Score, StrandScores, strand_hits, strand_scores
from hairkit.evaluate.truth import Truth, read_truth

__all__ = ["Score", "StrandScores", "Truth", "read_truth", "strand_hits", "strand_scores"]
