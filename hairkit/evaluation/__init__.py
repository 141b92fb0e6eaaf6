"""Scores of a groom against a capture's ground truth (docs/evaluation.md).

Everything that compares with true strands, masks, directions or cameras, and the report. Nothing
here is used by a reconstruction.

* `align`: the similarity that aligns a prediction with the truth; camera errors
* `likeness`: brightness, colour, contrast and coherence of the drawn hair over the photos'
* `depth_map`: first visible surfaces of strands and head
* `error_maps`: pictures of the report: right and wrong strands in each view
* `evaluation`: all figures of one groom against one truth
* `images`: drawn direction, silhouette overlap, 2D orientation error, mask overlap
* `neighbour_search`: exact search for a neighbour within a distance and an angle
* `prediction`: what a reconstruction left in its folder
* `report`: `evaluation.json` and `report.html`
* `scorecard`: the figures by name, with what a good value is
* `scores`: precision, recall and F of strands
* `strand_statistics`: lengths, roots, hair inside the head, broken strands
* `truth`: the truth folder of a capture
"""

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
