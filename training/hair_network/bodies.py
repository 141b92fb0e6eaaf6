"""A body for a rendered bust: hair of another length over back, clothes and arms; hats and hands.

Renders end at the chest, and long hair ends at the edge of the picture. Photographs from behind
show hair that ends on a shirt, between bare shoulders and arms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.random import Generator

from hairkit.arrays import BoolArray, Float64Array, UInt8Array
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

from .colours import Array, noise
from .renders import EDGE, Render

CHIN = 1.35
"""Widths of the head from its top to the chin."""


@dataclass(frozen=True)
class _Frame:
    """Where the head is: its middle column, its top row and its width, pixels."""

    middle: float
    top: float
    width: float

    def at(self, x: float, y: float) -> Float64Array:
        """Return a place in pixels from one in widths of the head, right of its middle and down."""
        return np.array([self.middle + x * self.width, self.top + y * self.width])


def dress(rng: Generator, render: Render) -> tuple[Render, BoolArray]:
    """Return the render with a body on a larger canvas, and where skin is bare besides the head."""
    if not render.head.any():
        return render, np.zeros_like(render.head)
    render = _enlarge(rng, render)
    rows, columns = np.nonzero(render.head)
    top = float(rows.min())
    skull = columns[rows < top + 0.5 * np.ptp(rows)]
    left, right = np.percentile(skull, (1, 99))
    frame = _Frame((left + right) / 2, top, max(right - left, 8.0))
    labels = _cut(rng, render.labels, frame)
    torso, arms, bare = _body(rng, labels.shape, frame)
    behind = (torso | arms) & (labels == BACKGROUND)
    front, covered = _in_front(rng, labels, frame)
    bare = (bare & behind) | front
    cloth = ((labels == PERSON) & ~render.head) | (behind & ~bare) | covered
    image = _paint(rng, render, labels, cloth, bare)
    labels[behind | front | covered] = PERSON
    head = render.head & ~covered
    return replace(render, image=image, labels=labels, head=head), bare


def _enlarge(rng: Generator, render: Render) -> Render:
    """Return the render with room below and beside it; hair that reached its edge goes on there."""
    height, width = render.labels.shape
    below, beside = int(height * rng.uniform(0, 1.0)), int(width * rng.uniform(0, 0.5))
    edges = (0, below, beside, beside)
    image = cv2.copyMakeBorder(render.image, *edges, cv2.BORDER_REFLECT)
    labels = cv2.copyMakeBorder(render.labels, *edges, cv2.BORDER_CONSTANT, value=BACKGROUND)
    labels[height:] = np.where(labels[height - 1] == HAIR, HAIR, BACKGROUND)
    head = cv2.copyMakeBorder(render.head.astype(np.uint8), *edges, cv2.BORDER_CONSTANT)
    scale = min(EDGE / max(labels.shape), 1)
    size = (round(labels.shape[1] * scale), round(labels.shape[0] * scale))
    near = cv2.INTER_NEAREST
    points = render.landmarks
    return replace(
        render,
        image=np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8),
        labels=np.asarray(cv2.resize(labels, size, interpolation=near), np.uint8),
        head=np.asarray(cv2.resize(head, size, interpolation=near)) > 0,
        landmarks=None if points is None else (points + np.array([beside, 0])) * scale,
    )


def _cut(rng: Generator, labels: UInt8Array, frame: _Frame) -> UInt8Array:
    """Return labels whose hair ends at another height, evenly, in locks or in thin tips."""
    labels, shape = labels.copy(), labels.shape
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    reached = (np.max(rows[labels == HAIR], initial=0) - frame.top) / frame.width
    if reached < CHIN or (reached < 3 and rng.random() < 0.35):
        return labels
    across = (columns - frame.middle) / frame.width
    end = rng.uniform(0.9, max(min(reached, 4.5), 1.2)) + rng.uniform(-0.4, 0.3) * across**2
    locks = noise(
        rng, shape, frame.width * rng.uniform(0.8, 4), frame.width * rng.uniform(0.02, 0.2)
    )
    end = end + rng.uniform(0.02, 0.35) * locks
    labels[(labels == HAIR) & ((rows - frame.top) / frame.width > end)] = BACKGROUND
    return labels


def _body(
    rng: Generator, shape: tuple[int, int], frame: _Frame
) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Return (H, W) torso, arms, and what is bare of both."""
    shoulder, reach = CHIN + rng.uniform(0.25, 0.6), rng.uniform(0.75, 1.5)
    waist, neck, slope = (
        reach * rng.uniform(0.65, 0.95),
        rng.uniform(0.3, 0.45),
        rng.uniform(0.1, 0.4),
    )
    half = [(neck, shoulder - 0.5), (neck, shoulder - 0.15), (reach * 0.6, shoulder)]
    half += [(reach, shoulder + slope), (waist, shoulder + 2.5), (waist * 1.1, 9)]
    outline = [frame.at(x, y) for x, y in half] + [frame.at(-x, y) for x, y in half[::-1]]
    torso = _polygon(shape, np.array(outline))
    arms, bare = np.zeros_like(torso), np.zeros_like(torso)
    sleeve = rng.choice((0.0, rng.uniform(0.2, 1.0), 2.0), p=(0.25, 0.35, 0.4))
    for side in (-1, 1):
        out = reach + rng.uniform(-0.1, 0.5)
        elbow = np.array([side * out, shoulder + slope + rng.uniform(1.0, 1.7)])
        start = np.array([side * (reach - 0.18), shoulder + slope + 0.15])
        hand = elbow + np.array([side * rng.uniform(-1.2, 0.3), rng.uniform(-0.3, 1.5)])
        thick = rng.uniform(0.32, 0.5)
        arm = _limb(shape, frame, (start, elbow, hand), thick)
        arms |= arm
        if sleeve < 1:
            split = start + sleeve * (elbow - start)
            bare |= _limb(shape, frame, (split, elbow, hand), thick)
    if rng.random() < 0.45:  # a neckline, or the bare back
        rows, columns = np.mgrid[: shape[0], : shape[1]]
        depth, wide = rng.uniform(0.2, 1.1), rng.uniform(0.4, 1.0) * reach
        x, y = (columns - frame.middle) / frame.width, (rows - frame.top) / frame.width
        bare |= torso & ((x / wide) ** 2 + ((y - shoulder + 0.1) / depth) ** 2 < 1)
    return torso, arms, bare


def _in_front(rng: Generator, labels: UInt8Array, frame: _Frame) -> tuple[BoolArray, BoolArray]:
    """Return (H, W) a hand in front of the hair, and a hat, hood, scarf or collar; or nothing."""
    shape, chance = labels.shape, rng.random()
    skin, cloth = np.zeros(shape, np.bool_), np.zeros(shape, np.bool_)
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    x, y = (columns - frame.middle) / frame.width, (rows - frame.top) / frame.width
    if chance < 0.12:
        side = rng.choice((-1, 1))
        hand = np.array([side * rng.uniform(0, 0.7), rng.uniform(0, 2.2)])
        elbow = np.array([side * rng.uniform(1, 1.8), rng.uniform(0.3, 2.6)])
        shoulder = np.array([side * rng.uniform(0.9, 1.4), rng.uniform(2, 2.6)])
        skin = _limb(shape, frame, (hand, elbow, shoulder), rng.uniform(0.25, 0.42))
    elif chance < 0.18:  # a hat or cap down to the brows, or a band above them
        low, wide = rng.uniform(0.2, 0.55), rng.uniform(0.5, 0.75)
        tilt = rng.uniform(-0.3, 0.3) * x
        cloth = ((x / wide) ** 2 + ((y - low) / (low + rng.uniform(0, 0.35))) ** 2 < 1) & (
            y + tilt < low
        )
        if rng.random() < 0.4:
            cloth |= (np.abs(x) < wide * rng.uniform(1, 1.8)) & (np.abs(y + tilt - low) < 0.06)
    elif chance < 0.23:  # a hood: a ring around the face
        ring = (x / rng.uniform(0.65, 0.95)) ** 2 + ((y - 0.65) / rng.uniform(0.8, 1.1)) ** 2
        inner = ((x + rng.uniform(-0.3, 0.3)) / 0.52) ** 2 + (
            (y - 0.8) / rng.uniform(0.6, 0.9)
        ) ** 2
        cloth = (ring < 1) & (inner > 1)
    elif chance < 0.38:  # a scarf or collar in front of the hair, or beside the neck behind it
        low, high = rng.uniform(1.35, 1.7), rng.uniform(0.12, 0.4)
        cloth = (x / rng.uniform(0.5, 1.1)) ** 2 + ((y - low) / high) ** 2 < 1
        if rng.random() < 0.5:
            cloth &= labels != HAIR
    return skin, cloth


def _paint(
    rng: Generator, render: Render, labels: UInt8Array, cloth: BoolArray, bare: BoolArray
) -> UInt8Array:
    """Return the picture with plain shaded colours for clothes and skin that were not rendered."""
    image, shape = render.image.astype(np.float32), labels.shape
    skin = (render.labels == PERSON) & render.head
    shade = 1 + 0.06 * noise(rng, shape, shape[0] / 6) + 0.04 * noise(rng, shape, shape[0] / 20)
    for region, known in ((bare, skin), (cloth, cloth & (render.labels == PERSON))):
        colour = rng.uniform((150, 100, 80), (230, 190, 170))
        if np.count_nonzero(known) > 50:
            colour = np.median(render.image[known], axis=0)
        inside = cv2.distanceTransform(region.astype(np.uint8), cv2.DIST_L2, 3)
        rim = np.minimum(inside / (0.03 * shape[0]), 1)
        new = region & ~(known & (render.labels == PERSON))
        image[new] = ((shade * (0.7 + 0.3 * rim))[..., None] * colour)[new]
    return np.asarray(np.clip(image, 0, 255), np.uint8)


def _limb(
    shape: tuple[int, int], frame: _Frame, joints: tuple[Array, ...], thick: float
) -> BoolArray:
    canvas = np.zeros(shape, np.uint8)
    points = np.rint([frame.at(*joint) for joint in joints]).astype(np.int32)
    cv2.polylines(canvas, [points], False, 1, max(int(thick * frame.width), 1))
    return canvas > 0


def _polygon(shape: tuple[int, int], points: Float64Array) -> BoolArray:
    canvas = np.zeros(shape, np.uint8)
    cv2.fillPoly(canvas, [np.rint(points).astype(np.int32)], 1)
    return canvas > 0
