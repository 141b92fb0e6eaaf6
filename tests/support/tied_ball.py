"""A ball with hair that is tied behind it: hull, masks and exact orientation maps."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from hairkit.arrays import BoolArray, Float64Array
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.types.mask import HAIR, PERSON, Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.volume import Hull, OrientationField, VoxelGrid, outer_products

BALL = 0.1
HEAD = ball_head(rings=24)
TIE = np.array([0.0, 0.5, -0.866])
"""Direction of the tie from the ball's centre."""
THICK, RING, WIDE = 0.012, 0.01, 0.02
"""Metres of hair on the scalp; radius of the tail at the tie and at its widest."""
LENGTH = 0.2
"""Of the tail behind the ball, metres; it leaves along `TIE` and turns down."""
CELL = 0.004
"""Edge of a voxel, metres."""
GRID = VoxelGrid.around([-0.16, -0.2, -0.26], [0.16, 0.16, 0.16], CELL)


def tail_course() -> tuple[Float64Array, Float64Array]:
    """Return the tail's centres (M, 3) and radii (M,) from the skin to its end."""
    points, heading = [BALL * TIE], TIE.copy()
    for _ in range(int((THICK + LENGTH) / 0.002)):
        heading = heading + 0.002 / 0.05 * np.array([0.0, -1.0, 0.0])
        heading /= np.linalg.norm(heading)
        points.append(points[-1] + 0.002 * heading)
    way = 0.002 * np.arange(len(points))
    swell = np.interp(way, [0, 0.03, 0.1, 0.15, way[-1]], [RING, RING, WIDE, WIDE, 0.5 * WIDE])
    return np.array(points), swell


@functools.cache
def tied_hull(curtain: bool = False) -> Hull:
    """Return hair tight on the ball with a tail; with `curtain` it hangs loose all around."""
    centres = GRID.centres().astype(np.float64)
    distance = np.linalg.norm(centres, axis=-1) - BALL
    hair = (distance > 0) & (distance < THICK) & (centres[..., 1] > -0.03)
    if curtain:
        around = np.hypot(centres[..., 0], centres[..., 2])
        ring = (around > BALL) & (around < BALL + THICK) & (centres[..., 2] < 0.03)
        hair |= ring & (centres[..., 1] < 0) & (centres[..., 1] > -0.18)
    else:
        hair |= _tube(centres) & (distance > 0)
    return Hull(GRID, hair, hair, distance.astype(np.float32))


def _tube(centres: Float64Array) -> BoolArray:
    inside = np.zeros(centres.shape[:3], bool)
    for centre, radius in zip(*tail_course(), strict=True):
        low, high = ((centre + side * radius - centres[0, 0, 0]) / CELL for side in (-1, 1))
        box = tuple(slice(max(int(a), 0), int(b) + 2) for a, b in zip(low, high, strict=True))
        inside[box] |= np.linalg.norm(centres[box] - centre, axis=-1) < radius
    return inside


def cameras() -> tuple[Camera, ...]:
    """Return the turn, with pixels finer than the directions vary."""
    return tuple(
        Camera.on_turn(45.0 * i, distance=0.7, focal=300.0, width=180, height=200) for i in range(8)
    )


def way_to(place: Float64Array, points: Float64Array) -> Float64Array:
    """Return unit tangents (N, 3) of the ball at points (N, 3) towards a direction (3,)."""
    outward = points / np.linalg.norm(points, axis=1, keepdims=True)
    way = place - (outward @ place)[:, None] * outward
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    return np.asarray(way)


def seen(camera: Camera, place: Float64Array = TIE) -> tuple[Mask, OrientationMap]:
    """Return a view full of hair that runs over the ball to a direction (3,), with its tail."""
    mask, found = drawn(camera, lambda points: way_to(place, points))
    angle = found.angle.copy()
    course, radii = tail_course()
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    here, depth = camera.project(course), camera.depth(course)
    behind = camera.depth(np.zeros((1, 3)))[0]
    for k in np.argsort(-depth[:-1]):
        if np.hypot(*(here[k] - camera.centre)) > BALL * camera.focal / behind or depth[k] < behind:
            step = here[k + 1] - here[k]
            disc = np.hypot(x - here[k, 0], y - here[k, 1]) < radii[k] * camera.focal / depth[k]
            angle[disc] = wrap_angle(np.arctan2(step[1:], step[:1]))
    return mask, OrientationMap(angle, found.confidence)


def drawn(
    camera: Camera, comb: Callable[[Float64Array], Float64Array], bare: float = -np.inf
) -> tuple[Mask, OrientationMap]:
    """Return a picture of hair that runs along tangents (N, 3) of the ball at points (N, 3).

    Below the height `bare`, metres, the ball is skin.
    """
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = np.stack([x - camera.centre[0], y - camera.centre[1]], axis=-1) / camera.focal
    rays = np.concatenate([rays, np.ones((*x.shape, 1))], axis=-1).reshape(-1, 3) @ camera.rotation
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    eye = camera.position
    along = -(rays @ eye)
    root = along**2 - (eye @ eye - (BALL + THICK) ** 2)
    points = eye + (along - np.sqrt(np.maximum(root, 0)))[:, None] * rays
    step = camera.project(points + 1e-3 * comb(points)) - camera.project(points)
    angle = wrap_angle(np.arctan2(step[:, 1], step[:, 0])).reshape(x.shape)
    skin = (points[:, 1] < bare).reshape(x.shape) & (root > 0).reshape(x.shape)
    sure = ((root > 0).reshape(x.shape) & ~skin).astype(np.float32)
    return Mask(np.where(skin, PERSON, HAIR).astype(np.uint8), True), OrientationMap(angle, sure)


def tied_field() -> OrientationField:
    """Return the field of hair that runs over the ball to the tie."""
    centres = GRID.centres().reshape(-1, 3).astype(np.float64)
    tensor = outer_products(way_to(TIE, centres)).reshape(*GRID.shape, 6).astype(np.float32)
    sure = np.ones(GRID.shape, np.float32)
    return OrientationField(GRID, tensor, sure, -centres[:, 1].reshape(GRID.shape).astype("f4"))
