"""The person in a photo, by MediaPipe's network for selfies; person and hair by the user's own.

The network sees the photo in a square and its mirror image; the mean of both is the answer. It may
give one map (the person, or the hair), two (background, the rest) or those of MediaPipe's
`selfie_multiclass` (background, hair and four more). Option `model` names a file in the place of
the installed network for the person, `hair_model` one for the stage `segment`.

It needs `selfie_segmentation`: `hairkit models install`. Without a network it gives no answer.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hairkit import Mask, View, hookimpl
from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.errors import ModelError
from hairkit.nets.model_folder import find_model
from hairkit.nets.net_process import NetProcess, shared_nets
from hairkit.nets.tflite_header import read_input_shape
from hairkit.options import option
from hairkit.types.mask import BACKGROUND, HAIR, PERSON
from hairkit.types.person import Person

MODELS = ("selfie_segmentation",)
_SUM_TOLERANCE = 1e-2
"""Channels that are probabilities add up to one within this."""
_LIKELY = 0.5
"""Probability from which a pixel has a label."""


@dataclass(frozen=True)
class Options:
    """Settings of the networks for persons and hair."""

    model: Path | None = option(
        None, doc="A .tflite file in the place of the installed selfie_segmentation."
    )
    hair_model: Path | None = option(
        None, doc="A .tflite file that finds hair: a hair segmenter, or selfie_multiclass."
    )


@hookimpl
def segment_person(view: View, options: Options) -> Person | None:
    """Return the probability of the person in every pixel, None without a network."""
    path = options.model or find_model(*MODELS)
    if path is None:
        return None
    maps = find_classes(view.image, path, shared_nets())
    return Person(_levels(maps[0] if len(maps) == 1 else 1 - maps[0]))


@hookimpl
def segment(view: View, options: Options) -> Mask | None:
    """Return hair by `hair_model`, None without it; the person by its other classes or the view."""
    if options.hair_model is None:
        return None
    maps = find_classes(view.image, options.hair_model, shared_nets())
    hair = maps[min(1, len(maps) - 1)]
    person = _person(view, maps)
    labels = np.full(hair.shape, BACKGROUND, np.uint8)
    if person is not None:
        labels[person] = PERSON
    labels[hair >= _LIKELY] = HAIR
    return Mask(labels, person_known=person is not None, alpha=_levels(hair))


def find_classes(image: UInt8Array, model: Path, nets: NetProcess) -> Float32Array:
    """Return the probability of each class of a network (C, H, W) in a photo (H, W, 3), RGB.

    Raises `FormatError` for a file of another format, `ModelError` for a network of other inputs
    or outputs.
    """
    shape = read_input_shape(model)
    if len(shape) != 4 or shape[3] != 3:
        raise ModelError(f"{model}: wants {shape}, expected a network of colour pictures")
    small = cv2.resize(image, (shape[2], shape[1]), interpolation=cv2.INTER_AREA)
    batch = np.stack([small, small[:, ::-1]]) / np.float32(255)
    scores = nets.run(model, np.asarray(batch, np.float32))[0]
    if scores.ndim != 4:
        raise ModelError(f"{model}: gives {scores.shape}, expected one map or more of the photo")
    plain, mirrored = _probability(scores)
    height, width = image.shape[:2]
    large = [
        cv2.resize(one, (width, height), interpolation=cv2.INTER_CUBIC)
        for one in (plain + mirrored[..., ::-1]) / 2
    ]
    return np.asarray(np.stack(large).clip(0, 1), np.float32)


def _person(view: View, maps: Float32Array) -> BoolArray | None:
    """Return where the person is: by classes beside hair, else as was found in the view."""
    if len(maps) > 2:
        return np.asarray(maps[0] < _LIKELY)
    if view.person is None:
        return None
    return np.asarray(view.person.alpha >= 255 * _LIKELY)


def _levels(probability: Float32Array) -> UInt8Array:
    return np.asarray((255 * probability).round(), np.uint8)


def _probability(scores: Float32Array) -> Float32Array:
    """Return probabilities (N, C, H, W) for what a network gives: these, or logits."""
    if scores.shape[1] == 1:
        bounded = scores.min() >= 0 and scores.max() <= 1
        return scores if bounded else np.asarray(1 / (1 + np.exp(-scores)), np.float32)
    if scores.min() < 0 or np.abs(scores.sum(axis=1) - 1).max() > _SUM_TOLERANCE:
        scores = np.exp(scores - scores.max(axis=1, keepdims=True))
        scores /= scores.sum(axis=1, keepdims=True)
    return scores
