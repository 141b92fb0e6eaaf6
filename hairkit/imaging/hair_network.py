"""A small convolutional network that tells hair from the rest of a person and the background.

A U-Net (`hairkit.imaging.unet`) on the features of `hairkit.imaging.hair_features`. It was
trained on 12,917 pictures made of renders alone, of path-traced heads and of `hairkit synth`,
whose hair, skin, clothes and surroundings were recoloured and warped at random, with painted
bodies, plaits, beards, glasses and bald crowns; `training/hair_network` in the repository does
that.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.imaging.hair_features import hair_features
from hairkit.imaging.unet import run_network, shipped_weights
from hairkit.types.capture import View
from hairkit.types.person import Person

MIRRORED = (5, 9)
"""Features that change their sign in a mirrored photo: the strands' slope and the coordinate across
the face."""
_REMEMBERED = 36
"""Answers that are remembered: those of the largest capture; each takes 0.2 MB."""
_ANSWERS: dict[bytes, Float32Array] = {}
"""Answers by the digest of what was asked, the oldest first."""
NEARER = np.array([[0.1, 0.0], [0.9, 0.9]])
"""Corners of the part of a crop that the network sees once more, shares of its width and height. On
210 photographs with small heads the mean IoU rises by 0.006; of photos that are not cropped it
rises by 0.003, of renders that are not it falls by 0.001."""
LEAST_ODDS = np.float32(0.01)
"""Least probability of a class by the person's network: it may be wrong."""
_LIKELY_FACE = 0.8
"""Least presence of a face whose landmarks are used."""


def find_hair(view: View) -> Float32Array:
    """Return `hair_probability` of a view, from the person and the face found in it.

    Of a photo that is cropped to the head it is the mean of the answers to the crop and to its
    upper middle: how large the head is in it is uncertain. Answers are remembered, since several
    steps and every stroke ask for the same one.
    """
    person, landmarks = view.person, likely_landmarks(view)
    if person is not None and person.alpha.shape != view.image.shape[:2]:
        person = None
    seen = () if person is None else (person.alpha, person.hair)
    key = _digest((view.image, landmarks, np.array(bool(view.cropped)), *seen))
    answer = _ANSWERS.get(key)
    if answer is None:
        look = _look_twice if view.cropped else hair_probability
        answer = look(view.image, person, landmarks)
        answer.flags.writeable = False
        for oldest in list(_ANSWERS)[: max(len(_ANSWERS) + 1 - _REMEMBERED, 0)]:
            _ANSWERS.pop(oldest, None)
        _ANSWERS[key] = answer
    return answer


def silhouette(view: View) -> UInt8Array:
    """Return the probability (H, W) of the person in a view in which somebody looked, of 255.

    Where no face shows, hair may be all that shows: then what may be hair is the person's, too.
    """
    assert view.person is not None
    if likely_landmarks(view) is not None:
        return view.person.alpha
    hair = cv2.resize(find_hair(view)[..., 0], (view.width, view.height))
    return np.maximum(view.person.alpha, (255 * hair).astype(np.uint8))


def _look_twice(
    image: UInt8Array, person: Person | None, landmarks: Float64Array | None
) -> Float32Array:
    answer = hair_probability(image, person, landmarks)
    cells, pixels = np.array(answer.shape[1::-1]), np.array(image.shape[1::-1])
    (left, top), (right, bottom) = nearer = np.rint(NEARER * cells).astype(int)
    first, last = np.rint(nearer * pixels / cells).astype(int)
    part = np.s_[first[1] : last[1], first[0] : last[0]]
    again = hair_probability(
        image[part],
        None if person is None else person.part(part),
        None if landmarks is None else landmarks - first,
    )
    size = (int(right - left), int(bottom - top))
    mean = answer[top:bottom, left:right]
    mean += cv2.resize(again, size, interpolation=cv2.INTER_AREA)
    mean /= 2
    return answer


def _digest(parts: Sequence[npt.NDArray[Any] | None]) -> bytes:
    state = hashlib.sha256()
    for part in parts:
        state.update(repr(None if part is None else (part.shape, part.dtype.str)).encode())
        state.update(b"" if part is None else np.ascontiguousarray(part).data)
    return state.digest()


def mark_face(view: View, size: tuple[int, int]) -> Float32Array:
    """Return (height, width) 1 in the convex hull of a view's landmarks, jaw to brows, else 0."""
    canvas = np.zeros((size[1], size[0]), np.uint8)
    landmarks = likely_landmarks(view)
    if landmarks is not None:
        points = landmarks * size / (view.width, view.height)
        cv2.fillConvexPoly(canvas, cv2.convexHull(np.rint(points - 0.5).astype(np.int32)), 1)
    return canvas.astype(np.float32)


def likely_landmarks(view: View) -> Float64Array | None:
    """Return the landmarks that were given, or those of a face that is likely there."""
    if view.landmarks is not None:
        return view.landmarks
    if view.face is not None and view.face.presence > _LIKELY_FACE:
        return view.face.landmarks
    return None


def hair_probability(
    image: UInt8Array, person: Person | None, landmarks: Float64Array | None
) -> Float32Array:
    """Return (h, w, 3) the probabilities of hair, of the rest of the person and of the background.

    The longer side of the result has `hairkit.imaging.hair_features.GRID` cells. It is the mean of
    the network's answers to the photo and to its mirror image, times what the person's network says
    of the same classes (a product of experts, Hinton 2002): one learnt from renders, the other from
    photographs, so they are wrong in different places.

    Parameters
    ----------
    image : (H, W, 3)
        RGB.
    person : Person, optional
        Of the pixels of `image`.
    landmarks : (68, 2), optional
        iBUG points in pixels of `image`.
    """
    alpha = None if person is None else person.alpha.astype(np.float32) / np.float32(255)
    features = hair_features(image, alpha, landmarks)
    columns, rows = features.size
    mirrored = np.zeros_like(features.values)
    mirrored[:, :rows, :columns] = features.values[:, :rows, :columns][..., ::-1]
    mirrored[list(MIRRORED)] *= -1
    weights = shipped_weights("imaging", "hair_network.npz")
    first = _softmax(run_network(features.values, weights))[:, :rows, :columns]
    second = _softmax(run_network(mirrored, weights))[:, :rows, :columns][..., ::-1]
    mean = np.moveaxis(np.asarray((first + second) / 2, np.float32), 0, -1)
    if person is None or not person.hair.size:
        return mean
    classes = [person.hair, cv2.subtract(person.alpha, person.hair), 255 - person.alpha]
    cells = [
        cv2.resize(np.asarray(one, np.float32), features.size, interpolation=cv2.INTER_AREA)
        for one in classes
    ]
    odds = mean * (np.stack(cells, axis=-1) / np.float32(255)).clip(LEAST_ODDS, None)
    return np.asarray(odds / odds.sum(axis=-1, keepdims=True), np.float32)


def _softmax(scores: Float32Array) -> Float32Array:
    odds = np.exp(scores - scores.max(axis=0))
    return np.asarray(odds / odds.sum(axis=0), np.float32)
