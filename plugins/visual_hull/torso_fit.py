"""The torso that photos show below a head, found by the outlines of the clothes.

Where a body turns away from a view, its picture lies on the silhouette's edge. Where that edge is
clothes or skin, the body ends right there; where it is hair, the body ends at least the hair's
thickness further in. A few numbers are fitted to all views by robust least squares, with a weak
pull to an adult's torso.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.cameras.depth_raster import head_depth, mesh_depth
from hairkit.head_model.torso import Torso
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import HAIR, PERSON, Mask

FIELD_HEIGHT = 240
"""Rows of the pictures in which outlines are looked up."""
THICKNESS = 0.010
"""Metres of hair between the body and an outline that is hair, on a head of an adult's size."""
SOFT = 0.010
"""Metres beyond which a misfit counts less than squared."""
HEIGHTS = np.array([32, 20, 10, 0, -12, -25, -38, -55, -75, -105, -140, -200, -270, -340]) * 1e-3
"""Of the sections whose outlines are compared, metres above the root joint."""
AROUND = 48
"""Points of a section."""
USUAL = {
    "breadth": 0.2,
    "depth": 0.2,
    "drop": 0.03,
    "slope": 0.3,
    "forward": 0.03,
    "lean": 0.2,
    "sideways": 0.02,
    "roll": 0.1,
    "yaw": 0.15,
}
"""Variation between people: standard deviations of log ratios, of metres and of radians."""
RATIOS = ("breadth", "depth", "slope")
PULL = 0.002
"""Metres of misfit of every outline point that weigh as much as one standard deviation."""
SMALLEST_WIDTH = 8
"""Least columns of the pictures in which outlines are looked up."""
OUTLINE_SMOOTHING = 1.0
"""Gaussian over masks and misfits, pixels of those pictures."""
FAR = 1e4
"""Distance to an outline where a picture has none, pixels."""
DIFFERENCE, TOLERANCE, MOST_STEPS = 1e-3, 1e-4, 40
"""Of the solver: step of derivatives in standard deviations, relative change at which it stops,
evaluations."""
FEWEST_VIEWS, LEAST_CLOTHES = 3, 0.01
"""Views that must show clothes below the head, all of fewer, and on which share of their pixels."""
COVERED, STRAY = 0.75, 0.1
"""Share of the clothes that the torso must cover, and of the torso that may lie on background."""


def fit_torso(head: Head, cameras: Sequence[Camera], masks: Sequence[Mask]) -> Torso | None:
    """Return the torso that fits the masks of all views, or None where they show none.

    None comes where fewer than `FEWEST_VIEWS` views show clothes below the head (cropped photos,
    masks that know hair alone), and where what they show is not shaped like a torso.

    Parameters
    ----------
    head
        Fitted to the photos; its joints place the torso.
    cameras, masks
        One a view, in the same order.
    """
    from scipy.optimize import least_squares  # slow to load

    known = [(c, m) for c, m in zip(cameras, masks, strict=True) if m.person_known]
    usual = Torso.under(head)
    views = [view for view in (_View.of(head, usual, *pair) for pair in known) if view is not None]
    if len(views) < min(FEWEST_VIEWS, len(masks)):
        return None
    solved = least_squares(
        lambda numbers: _misfits(usual, numbers[None], views)[0],
        np.zeros(len(USUAL)),
        lambda numbers: _derivatives(usual, numbers, views),
        loss="soft_l1",
        f_scale=SOFT,
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        max_nfev=MOST_STEPS,
    )
    found = _torso(usual, solved.x)
    return found if _agrees(found, views) else None


@dataclass(frozen=True, eq=False)
class _View:
    """A small picture of one view."""

    camera: Camera
    misfit: Float32Array
    """(H, W) metres by which an outline of the body at a pixel is wrong."""
    clothes: BoolArray
    """(H, W) the person below the head, neither hair nor head."""
    bare: BoolArray
    """(H, W) neither person nor hair."""

    @classmethod
    def of(cls, head: Head, usual: Torso, camera: Camera, mask: Mask) -> _View | None:
        """Return the view, or None where it shows no clothes."""
        height, width = mask.labels.shape
        size = (max(round(width * FIELD_HEIGHT / height), SMALLEST_WIDTH), FIELD_HEIGHT)
        camera = camera.resized(*size)
        hair, person = (_share(mask, label, size) for label in (HAIR, PERSON))
        clothes = (person > 0.5) & ~np.isfinite(head_depth(head, camera))
        below = camera.project(usual.joint)[1]
        clothes[: min(max(int(np.nan_to_num(below)), 0), FIELD_HEIGHT)] = False
        if clothes.mean() < LEAST_CLOTHES:
            return None
        away = float(camera.depth(usual.joint)) if camera.model == "perspective" else 1.0
        pixels_per_metre = camera.focal / away
        thickness = THICKNESS * usual.scale * pixels_per_metre
        misfit = _misfit_field(hair, person, thickness) / np.float32(pixels_per_metre)
        return cls(camera, misfit, clothes, hair + person < 0.5)


def _share(mask: Mask, label: int, size: tuple[int, int]) -> Float32Array:
    wanted = (mask.labels == label).astype(np.float32)
    return np.asarray(cv2.resize(wanted, size, interpolation=cv2.INTER_AREA), np.float32)


def _misfit_field(hair: Float32Array, person: Float32Array, thickness: float) -> Float32Array:
    """Return pixels (H, W) by which a body's outline misses the silhouette's, outside positive.

    Behind an outline of hair the body may end anywhere from `thickness` inwards.
    """
    hairs, whole = (
        cv2.GaussianBlur(part, (0, 0), OUTLINE_SMOOTHING) for part in (hair, hair + person)
    )
    within = whole > 0.5
    rim = within & (cv2.dilate((~within).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0)
    hairy = hairs > 0.5 * whole
    to_hair, to_body = _distance_to(rim & hairy), _distance_to(rim & ~hairy)
    if not rim.any():
        return np.zeros(hair.shape, np.float32)
    by_hair = to_hair < to_body
    inner = np.where(by_hair, np.maximum(thickness - to_hair, 0), -to_body)
    outer = np.minimum(to_hair, to_body) + np.where(by_hair, thickness, 0)
    field = np.where(within, inner, outer).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(field, (0, 0), OUTLINE_SMOOTHING), np.float32)


def _distance_to(pixels: BoolArray) -> Float32Array:
    """Return the distance (H, W) to the nearest of the pixels, very far where there is none."""
    if not pixels.any():
        return np.full(pixels.shape, FAR, np.float32)
    others = (~pixels).astype(np.uint8)
    return np.asarray(cv2.distanceTransform(others, cv2.DIST_L2, cv2.DIST_MASK_5), np.float32)


def _torso(usual: Torso, numbers: Float64Array) -> Torso:
    """Return the torso that differs from the usual one by so many standard deviations (9,)."""
    values: dict[str, Any] = {}
    for (name, deviation), number in zip(USUAL.items(), numbers, strict=True):
        change = float(deviation * number)
        values[name] = float(np.exp(change)) if name in RATIOS else change
    return replace(usual, **values)


def _derivatives(usual: Torso, numbers: Float64Array, views: Sequence[_View]) -> Float64Array:
    """Return (N, 9) how the misfits change with each of the numbers (9,), all found at once."""
    steps = np.concatenate([np.zeros((1, len(numbers))), DIFFERENCE * np.eye(len(numbers))])
    found = _misfits(usual, numbers + steps, views)
    return np.asarray((found[1:] - found[0]).T / DIFFERENCE)


def _misfits(usual: Torso, numbers: Float64Array, views: Sequence[_View]) -> Float64Array:
    """Return (T, N) metres by which the outlines of the torsos miss those of every view, then the
    pull to an adult, for T rows of numbers (T, 9)."""
    surface = np.stack([_torso(usual, row).surface(HEIGHTS, AROUND) for row in numbers])
    around = np.roll(surface, -1, axis=2) - np.roll(surface, 1, axis=2)
    normal = np.cross(np.gradient(surface, axis=1), around)
    surface, normal = surface.reshape(-1, AROUND, 3), normal.reshape(-1, AROUND, 3)
    level, squared = (np.einsum("rai,rai->ra", part, surface) for part in (normal, surface))
    ends = [
        _outline(surface, _facing(surface, normal, level, squared, view.camera)) for view in views
    ]
    found = [_look_up(view, *end) for view, end in zip(views, ends, strict=True)]
    either = np.stack(found).reshape(len(views), 2, len(numbers), len(HEIGHTS))
    parts = either.transpose(2, 0, 1, 3).reshape(len(numbers), -1)
    weight = PULL * np.sqrt(parts.shape[1])
    return np.concatenate([parts, weight * numbers], axis=1)


def _facing(
    surface: Float64Array,
    normal: Float64Array,
    level: Float64Array,
    squared: Float64Array,
    camera: Camera,
) -> Float64Array:
    """Return (R, A) products of normals and viewing directions at surface points (R, A, 3).

    `level` and `squared` (R, A) are the points' products with their normals and with themselves:
    what all views share.
    """
    if camera.model == "orthographic":
        return np.asarray(normal @ camera.forward)
    place = camera.position
    distance = np.sqrt(squared - 2 * surface @ place + place @ place)
    return np.asarray((level - normal @ place) / distance)


def _outline(surface: Float64Array, facing: Float64Array) -> tuple[Float64Array, BoolArray]:
    """Return points (2 R, 3) where the sections (R, A, 3) turn away, and which exist (2 R,).

    They lie where `facing` (R, A) changes its sign.
    """
    after = np.roll(facing, -1, axis=1)
    rows = np.arange(len(surface))
    points, there = [], []
    for turns in ((facing <= 0) & (after > 0), (facing > 0) & (after <= 0)):
        at = turns.argmax(axis=1)
        there.append(turns.any(axis=1))
        change = facing[rows, at] - after[rows, at]
        share = np.clip(facing[rows, at] / np.where(change == 0, 1, change), 0, 1)[:, None]
        following = surface[rows, (at + 1) % AROUND]
        points.append((1 - share) * surface[rows, at] + share * following)
    return np.concatenate(points), np.concatenate(there)


def _look_up(view: _View, points: Float64Array, there: BoolArray) -> Float64Array:
    """Return the misfits (N,) of outline points (N, 3), 0 beyond the picture's edge."""
    pixels = np.nan_to_num(view.camera.project(points), nan=-1.0)
    size = np.array([view.camera.width, view.camera.height])
    inside = there & (pixels > 0).all(axis=1) & (pixels < size).all(axis=1)
    values = map_coordinates(view.misfit, pixels[:, ::-1].T - 0.5, order=1, mode="nearest")
    return np.where(inside, values, 0.0)


def _agrees(torso: Torso, views: Sequence[_View]) -> bool:
    """Return whether the torso covers the clothes and little else."""
    vertices, faces = torso.mesh()
    clothes = covered = shown = stray = 0
    for view in views:
        body = np.isfinite(mesh_depth(vertices, faces, view.camera))
        clothes += int(view.clothes.sum())
        covered += int((view.clothes & body).sum())
        shown += int(body.sum())
        stray += int((view.bare & body).sum())
    return covered >= COVERED * clothes and stray <= STRAY * shown
