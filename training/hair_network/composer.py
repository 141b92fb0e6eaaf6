"""One training picture: a rendered head with another look, backdrop, light, shape and camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.random import Generator

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

from .bodies import dress
from .colours import Array, noise, random_box, texture, to_lab, to_rgb
from .looks import cover_hair, fade_hair, paint_cloth, paint_face, paint_hair, paint_skin, thin_hair
from .renders import Render

EDGE = 640
"""Pixels of the longer side of a training picture: those in which the features see texture."""

UNDRESSED = 0.35
"""Share of the pictures that keep the render's bust."""


@dataclass(frozen=True, eq=False)
class Composite:
    """A training picture."""

    image: UInt8Array
    """(H, W, 3) RGB."""
    labels: UInt8Array
    """(H, W) 255 hair, 128 the rest of the person, 0 background."""


def compose(renders: Sequence[Render], rng: Generator) -> Composite:
    """Return a picture of one of the renders, changed at random."""
    render = renders[int(rng.integers(len(renders)))]
    bare, plain = np.zeros_like(render.head), rng.random() < UNDRESSED
    if not plain:
        render, bare = dress(rng, render)
    labels = thin_hair(rng, render)
    bald = (labels == PERSON) & (render.labels == HAIR)
    skin = (labels == PERSON) & (render.labels == PERSON) & (render.head | bare)
    lab, hair = paint_hair(rng, to_lab(render.image), labels == HAIR)
    lab, skin_tone = paint_skin(rng, lab, skin, bald)
    lab, labels = fade_hair(rng, lab, labels, render.head, skin_tone)
    if render.landmarks is not None:
        lab = paint_face(rng, lab, labels == PERSON, render.landmarks, hair)
    cloth = (labels == PERSON) & (render.labels == PERSON) & ~skin
    if not plain or rng.random() < 0.75:
        lab = paint_cloth(rng, lab, cloth, skin_tone, hair)
    lab, labels = cover_hair(rng, lab, labels, skin_tone)
    if (
        not plain
        or rng.random() < 0.8
        or not np.array_equal(labels > 0, render.labels > 0)
        or bald.any()
    ):
        front = cv2.GaussianBlur((labels != BACKGROUND).astype(np.float32), (0, 0), 0.8)
        lab = lab * front[..., None] + _backdrop(rng, renders, labels.shape) * (
            1 - front[..., None]
        )
    picture = _light(rng, to_rgb(lab))
    if rng.random() < 0.55:
        picture, labels = _warp(rng, picture, labels, render.landmarks)
    picture, labels = place(rng, picture, labels)
    return Composite(_photograph(rng, picture), labels)


def place(rng: Generator, picture: Array, labels: UInt8Array) -> tuple[Array, UInt8Array]:
    """Return picture and labels turned, mirrored, and cropped around the hair or not at all."""
    height, width = labels.shape
    rows, columns = np.nonzero(labels == HAIR)
    low, high = np.zeros(2), np.array([width, height], np.float64)
    if rng.random() < 0.75 and len(rows):
        extent = max(np.ptp(rows), np.ptp(columns)) * np.exp(rng.uniform(*np.log((0.6, 3.2))))
        aspect = np.exp(rng.uniform(-0.45, 0.35) * np.array([0.5, -0.5]))
        middle = np.array([columns.mean(), rows.mean()])
        middle += rng.normal((0, 0.05), 0.14) * extent * aspect
        low = np.clip(middle - extent * aspect / 2, 0, high - 40)
        high = np.clip(middle + extent * aspect / 2, low + 40, high)
    scale = EDGE / (high - low).max()
    size = (int((high[0] - low[0]) * scale), int((high[1] - low[1]) * scale))
    turned = np.vstack(
        [cv2.getRotationMatrix2D((width / 2, height / 2), rng.normal(0, 10), 1), (0, 0, 1)]
    )
    matrix = np.array([[scale, 0, -low[0] * scale], [0, scale, -low[1] * scale]]) @ turned
    if rng.random() < 0.5:
        matrix[0] = (0, 0, size[0] - 1) - matrix[0]
    mode = cv2.BORDER_REFLECT
    placed = cv2.warpAffine(picture.astype(np.float32), matrix, size, borderMode=mode)
    found: Any = cv2.warpAffine(labels, matrix, size, flags=cv2.INTER_NEAREST, borderMode=mode)
    return placed, found


def _backdrop(rng: Generator, renders: Sequence[Render], shape: tuple[int, ...]) -> Array:
    """Return (H, W, 3) a pattern, a wall, a room of several patterns, or another render."""
    size, chance = (shape[0], shape[1]), rng.random()
    if chance < 0.25:
        lab = texture(rng, size)
    elif chance < 0.5:
        wall = np.array([rng.uniform(2, 95), *rng.normal(0, 8, 2)])
        if chance < 0.4:
            wall = rng.uniform((88, -2, -2), (100, 2, 3))
        lab = wall + noise(rng, size, size[0] / 2)[..., None] * (rng.uniform(0, 6), 0.5, 0.5)
    elif chance < 0.8:
        lab = texture(rng, size)
        for _ in range(rng.integers(2, 8)):
            box = random_box(rng, size, 0.7)
            lab[box] = texture(rng, size)[box]
    else:
        other = renders[int(rng.integers(len(renders)))].image
        other = np.roll(other, rng.integers(other.shape[1]), axis=1)
        lab = to_lab(cv2.resize(other, size[::-1])) * (rng.uniform(0.5, 1.3), 1, 1)
        if rng.random() < 0.7:
            lab = cv2.GaussianBlur(lab, (0, 0), rng.uniform(8, 30))
    if rng.random() < 0.4:
        lab = cv2.GaussianBlur(lab, (0, 0), rng.uniform(1, 10))
    return np.asarray(lab, np.float32)


def _light(rng: Generator, picture: Array) -> Array:
    """Return the picture with another gamma, brighter at one side, and in light of a colour."""
    slope = 1 + rng.uniform(0, 0.3) * noise(rng, picture.shape[:2], *picture.shape[:2])
    tint = rng.uniform(0.75, 1.3) * rng.normal(1, 0.06, 3)
    return np.asarray(picture ** rng.uniform(0.75, 1.35) * np.maximum(slope, 0)[..., None] * tint)


def _warp(
    rng: Generator, picture: Array, labels: UInt8Array, landmarks: Float64Array | None
) -> tuple[Array, UInt8Array]:
    """Return picture and labels bent smoothly, except near the face."""
    height, width = labels.shape
    scale = rng.uniform(25, 140)
    bend = scale * rng.uniform(0.04, 0.22)
    shift = np.stack([bend * noise(rng, (height, width), scale) for _ in range(2)])
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    if landmarks is not None:
        x, y = landmarks[27:].mean(axis=0)
        unit = np.hypot(*(landmarks[36:48].mean(axis=0) - landmarks[48:].mean(axis=0)))
        shift *= 1 - np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * unit) ** 2)
    to = (columns + shift[0]).astype(np.float32), (rows + shift[1]).astype(np.float32)
    mode = cv2.BORDER_REFLECT
    bent = cv2.remap(picture.astype(np.float32), *to, cv2.INTER_LINEAR, borderMode=mode)
    return bent, np.asarray(cv2.remap(labels, *to, cv2.INTER_NEAREST, borderMode=mode), np.uint8)


def _photograph(rng: Generator, picture: Array) -> UInt8Array:
    """Return the picture (0 to 1) out of focus, with noise, and compressed as JPEG."""
    if rng.random() < 0.4:
        picture = cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.4, 2.2))
    grey = rng.standard_normal((*picture.shape[:2], 1)) * abs(rng.normal(0, 0.02))
    coloured = rng.standard_normal(picture.shape) * abs(rng.normal(0, 0.012))
    levels = np.clip((picture + grey + coloured) * 255, 0, 255).astype(np.uint8)
    quality = [cv2.IMWRITE_JPEG_QUALITY, int(rng.uniform(35, 95))]
    file = cv2.imencode(".jpg", np.ascontiguousarray(levels[..., ::-1]), quality)[1]
    decoded: Any = cv2.imdecode(file, cv2.IMREAD_COLOR)
    return np.ascontiguousarray(decoded[..., ::-1])
