"""The person in a photo, by MediaPipe's network for selfies or by a network of the user's.

The network sees the photo in a square and its mirror image; the mean of both is the answer. Option
`model` names another file: one that gives the person alone (one channel), background and person
(two), or MediaPipe's `selfie_multiclass` (six, of which the first is the background).

It needs `selfie_segmentation`: `hairkit models install`. Without a network it gives no answer.
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
from hairkit.nets.tflite_header import read_input_shape
from hairkit.options import option
from hairkit.types.person import Person

MODELS = ("selfie_segmentation",)
_SUM_TOLERANCE = 1e-2
"""Channels that are probabilities add up to one within this."""


@dataclass(frozen=True)
class Options:
    """Settings of the person's network."""

    model: Path | None = option(
        None, doc="A .tflite file in the place of the installed selfie_segmentation."
    )


@hookimpl
def segment_person(view: View, options: Options) -> Person | None:
    """Return the probability of the person in every pixel, None without a network."""
    path = options.model or find_model(*MODELS)
    if path is None:
        return None
    return Person(find_person(view.image, path, shared_nets()))


def find_person(image: UInt8Array, model: Path, nets: NetProcess) -> UInt8Array:
    """Return the probability of the person (H, W), 0..255, in a photo (H, W, 3), RGB."""
    shape = read_input_shape(model)
    if len(shape) != 4 or shape[3] != 3:
        raise ModelError(f"{model}: wants {shape}, expected a network of colour pictures")
    small = cv2.resize(image, (shape[2], shape[1]), interpolation=cv2.INTER_AREA)
    batch = np.stack([small, small[:, ::-1]]) / np.float32(255)
    scores = nets.run(model, np.asarray(batch, np.float32))[0]
    if scores.ndim != 4:
        raise ModelError(f"{model}: gives {scores.shape}, expected one map or more of the photo")
    plain, mirrored = _probability(scores)
    person = (plain + mirrored[:, ::-1]) / 2
    height, width = image.shape[:2]
    large = cv2.resize(person, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.asarray((255 * large).round().clip(0, 255), np.uint8)


def _probability(scores: Float32Array) -> Float32Array:
    """Return the person's probability (N, H, W) from a network's channels (N, C, H, W)."""
    if scores.shape[1] == 1:
        bounded = scores.min() >= 0 and scores.max() <= 1
        raw = scores[:, 0]
        return raw if bounded else np.asarray(1 / (1 + np.exp(-raw)), np.float32)
    if scores.min() < 0 or np.abs(scores.sum(axis=1) - 1).max() > _SUM_TOLERANCE:
        scores = np.exp(scores - scores.max(axis=1, keepdims=True))
        scores /= scores.sum(axis=1, keepdims=True)
    return np.asarray(1 - scores[:, 0], np.float32)
