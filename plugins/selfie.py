"""The person in a photo and the hair, by MediaPipe's two networks for selfies or the user's own.

A network sees the photo in a square and its mirror image; the mean of both is the answer.
`selfie_segmentation` tells the person from the background, from all sides. `selfie_multiclass` also
tells hair from skin and clothes, but may take a head from behind for background. The person is the
mean of both; the second one's share of hair in a person holds for it.

Both are installed by `hairkit models install`; one alone will do. Option `model` names a file in
their place. Without a network there is no answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hairkit import View, hookimpl
from hairkit.arrays import Float32Array, UInt8Array
from hairkit.errors import ModelError
from hairkit.nets.model_folder import find_model
from hairkit.nets.net_process import NetProcess, shared_nets
from hairkit.options import option
from hairkit.types.person import Person

MODELS = ("selfie_segmentation", "selfie_multiclass")
_SUM_TOLERANCE = 1e-2
"""Channels that are probabilities add up to one within this."""
_DOUBT = np.float32(0.05)
"""Probability of a person that is half hair, added to the second network's: where it sees next to
nobody its share of hair says nothing."""


@dataclass(frozen=True)
class Options:
    """Settings of the networks for persons."""

    model: Path | None = option(
        None,
        doc="A .tflite file in the place of the installed networks. It gives one map (the person), "
        "two (background, the rest) or more, as selfie_multiclass: the second is hair.",
    )


@hookimpl
def segment_person(view: View, options: Options) -> Person | None:
    """Return the probabilities of the person and, by a network that tells it, of the hair.

    None without a network.
    """
    paths = [options.model] if options.model else [find_model(name) for name in MODELS]
    answers = [find_classes(view.image, path, shared_nets()) for path in paths if path is not None]
    if not answers:
        return None
    persons = [maps[..., 0] if maps.shape[-1] == 1 else 1 - maps[..., 0] for maps in answers]
    cells, size = persons[-1].shape[::-1], (view.width, view.height)
    person = np.asarray(np.mean([cv2.resize(one, cells) for one in persons], axis=0), np.float32)
    if answers[-1].shape[-1] < 3:
        return Person(_levels(person, size))
    share = (answers[-1][..., 1] + _DOUBT / 2) / (persons[-1] + _DOUBT)
    return Person(_levels(person, size), _levels(person * share, size))


def find_classes(image: UInt8Array, model: Path, nets: NetProcess) -> Float32Array:
    """Return the probability (h, w, C) of a network's classes in the cells of a photo (H, W, 3).

    Raises `ModelError` for a file that is no network, and for one of other inputs or outputs.
    """
    shape = nets.input_shape(model)
    if len(shape) != 4 or shape[3] != 3:
        raise ModelError(f"{model}: wants {shape}, expected a network of colour pictures")
    small = cv2.resize(image, (shape[2], shape[1]), interpolation=cv2.INTER_AREA)
    batch = np.stack([small, small[:, ::-1]]) / np.float32(255)
    scores = nets.run(model, np.asarray(batch, np.float32))[0]
    if scores.ndim != 4:
        raise ModelError(f"{model}: gives {scores.shape}, expected one map or more of the photo")
    plain, mirrored = _probability(scores)
    return np.asarray((plain + mirrored[:, ::-1]) / 2, np.float32)


def _levels(cells: Float32Array, size: tuple[int, int]) -> UInt8Array:
    """Return the probability of all pixels (H, W), 0 to 255, from that of cells (h, w)."""
    large = cv2.resize(255 * cells, size, interpolation=cv2.INTER_CUBIC)
    return np.asarray(np.rint(large.clip(0, 255)), np.uint8)


def _probability(scores: Float32Array) -> Float32Array:
    """Return probabilities (N, H, W, C) for what a network gives: these, or logits."""
    if scores.shape[-1] == 1:
        bounded = scores.min() >= 0 and scores.max() <= 1
        return scores if bounded else np.asarray(1 / (1 + np.exp(-scores)), np.float32)
    if scores.min() < 0 or np.abs(scores.sum(axis=-1) - 1).max() > _SUM_TOLERANCE:
        scores = np.exp(scores - scores.max(axis=-1, keepdims=True))
        scores /= scores.sum(axis=-1, keepdims=True)
    return scores
