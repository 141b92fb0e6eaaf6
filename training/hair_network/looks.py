"""Another look for a rendered head: hair, baldness, skin, beard, brows, glasses, clothes.

Pictures are (H, W, 3) in Lab; a function returns the changed picture.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.random import Generator

from hairkit.arrays import BoolArray, Float64Array, UInt8Array
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

from .colours import Array, hair_colour, noise, recolour, skin_colour, texture, turn
from .renders import Render

PLAITED = 0.2
"""Share of the pictures whose hair lies in locks of many directions: braids, buns, curls."""


def thin_hair(rng: Generator, render: Render) -> UInt8Array:
    """Return the labels of an empty picture, of a head bald in part or wholly, or as rendered."""
    chance = rng.random()
    if chance < 0.04:
        return np.full_like(render.labels, BACKGROUND)
    labels = render.labels.copy()
    if chance > 0.2 or not render.head.any():
        return labels
    rows, columns = np.nonzero(render.head)
    left, right = np.percentile(columns, (1, 99))
    width, height = right - left, min((right - left) * 1.25, np.ptp(rows))
    lost = labels == HAIR
    if rng.random() < 0.75:
        centre = rng.uniform(left, right), rows.min() + height * rng.uniform(-0.05, 0.2)
        axes = width * rng.uniform(0.2, 0.5), height * rng.uniform(0.12, 0.4)
        patch = ellipse(labels.shape, centre, axes, rng.uniform(-30, 30)).astype(np.float32)
        wavy = cv2.GaussianBlur(patch, (0, 0), 6) + 0.08 * noise(rng, patch.shape, 12)
        lost &= wavy > 0.5
    labels[lost] = np.where(render.head[lost], PERSON, BACKGROUND)
    return labels


def paint_hair(rng: Generator, lab: Array, hair: BoolArray) -> tuple[Array, Array]:
    """Return the picture with hair of another colour, streaks and locks, and that colour."""
    shape = hair.shape
    colour = lab[hair].mean(axis=0) if hair.any() else hair_colour(rng)
    if rng.random() < 0.75:
        colour = hair_colour(rng)
        lab = recolour(lab, hair, colour, rng.uniform(0.6, 1.6))
    change = np.zeros(lab.shape, np.float32)
    if rng.random() < 0.35:  # the tips, or streaks along the strands
        height = np.linspace(0, 1, shape[0], dtype=np.float32)[:, None]
        share = (height - rng.uniform(0.3, 0.7)) / rng.uniform(0.1, 0.4) + np.zeros(shape)
        if rng.random() < 0.5:
            scales = shape[0] * rng.uniform(0.2, 0.6), shape[1] * rng.uniform(0.008, 0.05)
            share = 0.5 + rng.uniform(0.5, 2) * (noise(rng, shape, *scales) - rng.uniform(0, 1))
        tint = (hair_colour(rng) - colour) * (0.8, 1, 1) * rng.uniform(0.4, 1)
        change = np.clip(share, 0, 1)[..., None] * tint
    lab = np.where(hair[..., None], lab + change, lab)
    if rng.random() < 0.6:  # light and shade of locks, braids and curls
        locks = np.zeros(shape)
        for scale in (rng.uniform(4, 9), rng.uniform(9, 20), rng.uniform(20, 50)):
            lock = noise(rng, shape, scale * rng.uniform(1, 4), scale)
            locks += rng.uniform(0, 1) * (turn(rng, lock) if rng.random() < 0.6 else lock)
        shade = lab[..., 0] * np.exp(rng.uniform(0.05, 0.45) * locks) + rng.uniform(0, 4) * locks
        lab[..., 0] = np.where(hair, np.clip(shade, 1, 99), lab[..., 0])
    if rng.random() < PLAITED:
        lab = np.where(hair[..., None], _plaits(rng, lab, hair), lab)
    if rng.random() < 0.25:
        lab[..., 0] = np.where(hair, lab[..., 0] * _ropes(rng, shape), lab[..., 0])
    return lab, colour


def _plaits(rng: Generator, lab: Array, hair: BoolArray) -> Array:
    """Return a picture of locks of this hair, each with strands of a direction of its own."""
    depth = cv2.distanceTransform(hair.astype(np.uint8), cv2.DIST_L2, 3)
    row, column = np.unravel_index(depth.argmax(), depth.shape)
    half = int(depth.max() * 0.7)
    if half < 8:
        return lab
    sample = lab[row - half : row + half, column - half : column + half].astype(np.float32)
    rows, columns = np.mgrid[: hair.shape[0], : hair.shape[1]].astype(np.float32)
    count = int(rng.integers(12, 90))
    seeds = rng.uniform(0, 1, (count, 2)) * hair.shape
    angles, stretch = rng.uniform(0, np.pi, count), rng.uniform(1.2, 3.5)
    first, second = np.full((2, *hair.shape), np.inf, np.float32)
    to = np.zeros((2, *hair.shape), np.float32)
    for (y, x), angle in zip(seeds, angles, strict=True):
        along = np.cos(angle) * (columns - x) + np.sin(angle) * (rows - y)
        across = np.cos(angle) * (rows - y) - np.sin(angle) * (columns - x)
        away = np.hypot(along / stretch, across)
        nearer = away < first
        second = np.minimum(second, np.where(nearer, first, away))
        first = np.where(nearer, away, first)
        to = np.where(nearer, np.stack([across, along]) + half, to).astype(np.float32)
    locks = cv2.remap(sample, to[0], to[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    round_ones = np.clip((second - first) / (0.25 * (second + first)), 0, 1)
    deep = rng.uniform(0.2, 0.8)
    locks[..., 0] *= (1 - deep + deep * round_ones**0.7) * rng.uniform(0.9, 1.3)
    return np.asarray(locks)


def _ropes(rng: Generator, shape: tuple[int, int]) -> Array:
    """Return (H, W) factors of the lightness: braids or dreadlocks, round and dark between."""
    height, width = shape
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    thick = rng.uniform(5, 22)
    bend = rng.uniform(0.3, 2.5) * noise(rng, shape, rng.uniform(40, 200), rng.uniform(30, 120))
    lean = rng.uniform(-0.6, 0.6) * (rows - height / 2) * np.sign(columns - width / 2)
    phase = np.pi * ((columns + lean * rng.random()) / thick + bend)
    round_ones = np.abs(np.sin(phase)) ** rng.uniform(0.4, 1.2)
    twist = np.abs(np.sin(np.pi * rows / (thick * rng.uniform(0.8, 2)) + phase))
    deep = rng.uniform(0.3, 0.9)
    return np.asarray((1 - deep + deep * round_ones) * (1 - rng.uniform(0, 0.4) * twist) * 1.2)


def paint_skin(rng: Generator, lab: Array, skin: BoolArray, bald: BoolArray) -> tuple[Array, Array]:
    """Return the picture with skin of another colour, also where hair was, and that colour."""
    colour = skin_colour(rng)
    if rng.random() < 0.75:
        lab = recolour(lab, skin, colour, rng.uniform(0.7, 1.4))
    if not bald.any():
        return lab, colour
    height, width = bald.shape
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    row, column = np.array(np.nonzero(bald)).mean(axis=1)
    x, y = columns - column, rows - row
    shade = 4 * noise(rng, bald.shape, height / 3, width / 3)
    shade += rng.uniform(-40, 40) * y / height + rng.uniform(-56, 56) * x / width
    spot = np.hypot(x - rng.uniform(-60, 60), y - rng.uniform(-30, 30)) / rng.uniform(20, 60)
    shade = np.clip(shade, -18, 18) + rng.uniform(0, 14) * np.exp(-np.square(spot))
    shade += noise(rng, bald.shape, 2) * rng.uniform(0, 1.5)
    bare = np.dstack([shade, 0 * shade, 0 * shade])
    bare += lab[skin].mean(axis=0) if skin.any() else colour
    soft = cv2.GaussianBlur(bald.astype(np.float32), (0, 0), rng.uniform(0.6, 4)) * (bald | skin)
    return lab + (bare - lab) * soft[..., None], colour


def fade_hair(
    rng: Generator, lab: Array, labels: UInt8Array, head: BoolArray, skin: Array
) -> tuple[Array, UInt8Array]:
    """Return picture and labels of a short cut that fades to stubble on its way down."""
    hair = labels == HAIR
    if rng.random() > 0.25 or not (hair & head).any() or (hair & ~head).sum() > 0.35 * hair.sum():
        return lab, labels
    rows, columns = np.nonzero(head)
    left, right = np.percentile(columns[rows < rows.min() + 0.5 * np.ptp(rows)], (1, 99))
    width = right - left
    down, across = np.mgrid[: hair.shape[0], : hair.shape[1]]
    place = (down - rows.min()) / width + rng.uniform(-0.35, 0.35) * (across - left) / width
    place = place + 0.04 * noise(rng, hair.shape, width * 0.15)
    share = np.clip((rng.uniform(0.35, 1.1) - place) / rng.uniform(0.05, 0.45) + 0.5, 0, 1)
    stubble = rng.uniform(0, 0.35)
    mixed = np.maximum(share, stubble) + 0.06 * noise(rng, hair.shape, 1.5)
    bare = skin + 3 * noise(rng, hair.shape, width * 0.3)[..., None] * (1, 0, 0)
    faded = bare + (lab - bare) * np.clip(mixed, 0, 1)[..., None]
    kept = np.where(hair & head & (share < 0.3), np.uint8(PERSON), labels)
    return np.where((hair & head)[..., None], faded, lab), kept.astype(np.uint8)


def paint_face(
    rng: Generator, lab: Array, person: BoolArray, points: Float64Array, hair: Array
) -> Array:
    """Return the picture with beard, brows and glasses, as may be; never hair in the labels."""
    shape = person.shape
    unit = float(np.hypot(*(points[36:48].mean(axis=0) - points[48:].mean(axis=0))))
    if rng.random() < 0.45:
        first = rng.integers(1, 6)
        jaw = points[first : 17 - first]
        longer = (1.02, rng.uniform(1.0, 1.35))
        outline = np.vstack(
            [jaw.mean(axis=0) + (jaw - jaw.mean(axis=0)) * longer, points[[31, 35]]]
        )
        area = _hull(shape, outline)
        if rng.random() < 0.8:
            area &= ~_hull(shape, points[48:60])
        share = cv2.GaussianBlur(area.astype(np.float32), (0, 0), unit * 0.05) * person
        share *= np.clip(rng.uniform(0.3, 1.2) + 0.3 * noise(rng, shape, unit * 0.2), 0, 1)
        strands = noise(rng, shape, unit * rng.uniform(0.04, 0.15), rng.uniform(1.2, 2))
        beard = hair + rng.uniform((-10, -2, -2), (6, 2, 2))
        beard = beard + (strands * rng.uniform(3, 12))[..., None] * (1, 0.1, 0.1)
        lab = lab + (beard - lab) * share[..., None]
    canvas = np.zeros(shape, np.uint8)
    if rng.random() < 0.6:
        width = max(int(unit * rng.uniform(0.03, 0.14)), 1)
        for brow in (points[17:22], points[22:27]):
            cv2.polylines(canvas, [np.rint(brow).astype(np.int32)], False, 1, width)
        share = cv2.GaussianBlur(canvas.astype(np.float32), (0, 0), 1) * person
        lab = lab + (hair - lab) * (share * rng.uniform(0.4, 1))[..., None]
    if rng.random() < 0.35:
        frame = _glasses(rng, shape, points, unit) & person
        lab = np.where(frame[..., None], (rng.uniform(3, 60), *rng.normal(0, 8, 2)), lab)
    return lab


def paint_cloth(rng: Generator, lab: Array, cloth: BoolArray, skin: Array, hair: Array) -> Array:
    """Return the picture with other clothes: patterned, of the skin's or hair's colour, black."""
    if not cloth.any():
        return lab
    other, chance, shape = texture(rng, cloth.shape), rng.random(), cloth.shape
    if chance < 0.2:
        other = skin + noise(rng, shape, 30)[..., None] * (3, 1, 1)
    elif chance < 0.35:
        other = np.zeros(lab.shape) + rng.uniform((3, -3, -4), (18, 3, 4))
    elif chance < 0.5:
        other = other + hair - other.mean(axis=(0, 1))
    if rng.random() < 0.5:
        folds = turn(rng, noise(rng, shape, rng.uniform(30, 120), rng.uniform(6, 25)))
        other = other + (rng.uniform(2, 10) * folds)[..., None] * (1, 0.1, 0.1)
    shade = rng.uniform(0, 1.5) * (lab[..., :1] - lab[..., 0][cloth].mean())
    return np.where(cloth[..., None], other + shade * (1, 0, 0), lab)


def cover_hair(
    rng: Generator, lab: Array, labels: UInt8Array, skin: Array
) -> tuple[Array, UInt8Array]:
    """Return picture and labels with a hand or a band in front of the hair, now and then."""
    rows, columns = np.nonzero(labels == HAIR)
    if rng.random() > 0.15 or not len(rows):
        return lab, labels
    place = rng.integers(len(rows))
    axes = rng.uniform(8, 70), rng.uniform(5, 22)
    patch = ellipse(labels.shape, (columns[place], rows[place]), axes, rng.uniform(0, 180))
    patch &= labels != BACKGROUND
    dyed = np.array([rng.uniform(5, 95), *rng.normal(0, 25, 2)])
    colour = skin if rng.random() < 0.6 else dyed
    colour = colour + noise(rng, labels.shape, 12)[..., None] * (3, 1, 1)
    covered = np.where(patch, np.uint8(PERSON), labels)
    return np.where(patch[..., None], colour, lab), covered


def ellipse(
    shape: tuple[int, ...], centre: tuple[float, float], axes: tuple[float, float], angle: float
) -> BoolArray:
    """Return (H, W) a filled ellipse; centre and half axes in pixels, angle in degrees."""
    canvas = np.zeros(shape[:2], np.uint8)
    whole = [(int(pair[0]), int(pair[1])) for pair in (centre, axes)]
    cv2.ellipse(canvas, whole[0], whole[1], angle, 0, 360, 1, -1)
    return canvas > 0


def _glasses(
    rng: Generator, shape: tuple[int, ...], points: Float64Array, unit: float
) -> BoolArray:
    canvas = np.zeros(shape, np.uint8)
    width, round_ones = max(int(unit * rng.uniform(0.02, 0.09)), 1), rng.random() < 0.5
    for eye, temple in ((points[36:42], points[0]), (points[42:48], points[16])):
        centre = eye.mean(axis=0)
        half = np.array([np.ptp(eye[:, 0]) * rng.uniform(0.75, 0.95) + 2, unit * 0.3])
        low, middle, high, side = (
            [int(v) for v in np.rint(p)] for p in (centre - half, centre, centre + half, temple)
        )
        if round_ones:
            cv2.ellipse(canvas, middle, (int(half[0]), int(half[1])), 0, 0, 360, 1, width)
        else:
            cv2.rectangle(canvas, low, high, 1, width)
        cv2.line(canvas, middle, side, 1, width)
    return canvas > 0


def _hull(shape: tuple[int, ...], points: Float64Array) -> BoolArray:
    canvas = np.zeros(shape, np.uint8)
    cv2.fillConvexPoly(canvas, cv2.convexHull(np.rint(points).astype(np.int32)), 1)
    return canvas > 0
