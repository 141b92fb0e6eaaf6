"""How far away the hair in one photo is: a network's guess, learnt from grooms.

One photo tells nothing of its rays' third dimension but by what hair is like. A U-Net sees, in an
upright view of the head, hair, skin and clothes, the strands' directions and the depth of the
fitted head, and answers with the depths of the first and the last hair. `training/hair_depth` in
the repository trained it on views of procedural grooms of random styles and heads, and on those of
path-traced captures.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.imaging.unet import run_network, shipped_weights
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap

GRID, WINDOW, ABOVE = 128, 0.64, 0.22
"""Cells along an edge of the network's window; its edge, and how much of it lies above the head's
middle, metres."""
CHANNELS, LAYERS = 9, 2
"""Features, and depths, of a cell."""
MIRRORED = (4, 7)
"""Features that change their sign in a mirrored photo: the strands' slope, and the place across."""
HEAD_SCALE, DEPTH_SCALE = 0.1, 0.1
"""Metres of depth that are 1 to the network."""
FINE = 4
"""Pixels of the answer along an edge of a cell."""
NEARER = 0.02
"""How far before the depth that the network tells hair begins, metres: it learnt from a twentieth
of a head's strands. Of five fronts this has the best visible F at 4 mm/40, 48.0."""


@dataclass(frozen=True, eq=False)
class HairDepth:
    """Where hair begins and ends along the rays of an upright view of the head."""

    camera: Camera
    """That of the photo, upright, its window about the head's middle."""
    seen: BoolArray
    """(H, W) where the photo shows hair."""
    first: Float32Array
    """(H, W) depth of the first hair, metres; of nothing where none is seen."""
    last: Float32Array
    """(H, W) depth of the last hair behind it."""

    def within(self, points: npt.ArrayLike) -> tuple[BoolArray, Float64Array]:
        """Return where points (N, 3) lie behind hair that is seen, and how deep in it, metres.

        The second (N,) is the way to the nearer of both ends, negative outside.
        """
        pixels = np.nan_to_num(self.camera.project(points), nan=-1)
        x, y = np.moveaxis(np.floor(pixels).astype(int), -1, 0)
        inside = (x >= 0) & (y >= 0) & (x < self.camera.width) & (y < self.camera.height)
        at, depth = (np.where(inside, y, 0), np.where(inside, x, 0)), self.camera.depth(points)
        deep = np.minimum(depth - self.first[at], self.last[at] - depth)
        return inside & self.seen[at], np.asarray(deep, np.float64)


def head_middle(head: Head) -> Float64Array:
    """Return the middle (3,) of the cranium: of the box about the scalp."""
    scalp = head.vertices[head.scalp > 0.5].astype(np.float64)
    return np.asarray((scalp.min(axis=0) + scalp.max(axis=0)) / 2)


def guess_hair_depth(
    head: Head, camera: Camera, mask: Mask, orientation: OrientationMap
) -> HairDepth:
    """Return the depths of the hair that a photo shows.

    The pictures of the mask and of the orientation map have the camera's size.
    """
    middle = head_middle(head)
    upright = upright_camera(camera, middle)
    at = float(upright.depth(middle))
    x, y = np.meshgrid(np.arange(GRID) + 0.5, np.arange(GRID) + 0.5)
    beside = camera.pixels_per_metre * WINDOW / GRID
    size = [max(round(n / max(beside, 1.0)), 1) for n in (camera.width, camera.height)]
    small = camera.resized(*size)
    places = small.project(upright.unproject(np.stack([x, y], axis=-1), np.full(x.shape, at)))
    hair = mask.hair.astype(np.float32)
    trust = hair * orientation.confidence
    planes = [
        hair, (mask.person & ~mask.hair).astype(np.float32), np.ones_like(hair), trust,
        trust * np.cos(2 * orientation.angle), trust * np.sin(2 * orientation.angle),
    ]  # fmt: skip
    where = (places - 0.5).astype(np.float32)
    seen, person, valid, sure, even, odd = (
        cv2.remap(
            cv2.resize(plane, size, interpolation=cv2.INTER_AREA), where[..., 0], where[..., 1],
            cv2.INTER_LINEAR,
        )
        for plane in planes
    )  # fmt: skip
    turned = upright.rotation @ camera.rotation.T
    flow = (even + 1j * odd) / np.maximum(sure, 1e-6) * np.exp(2j * np.arctan2(*turned[1::-1, 0]))
    shown, depth = seen > 0.5, head_depth(head, upright) - at
    bare = ~np.isfinite(depth)
    features = [
        shown, person > 0.5, valid > 0.5, flow.real * shown, flow.imag * shown,
        np.where(bare, 0, depth / HEAD_SCALE), ~bare, 2 * x / GRID - 1, 2 * y / GRID - 1,
    ]  # fmt: skip
    values = np.stack(features).astype(np.float32)
    mirrored = values[..., ::-1].copy()
    mirrored[list(MIRRORED)] *= -1
    first, second = (
        run_network(each, shipped_weights("field", "hair_depth.npz")) for each in (values, mirrored)
    )
    scores = (first + second[..., ::-1]) / 2
    fine = (FINE * GRID, FINE * GRID)
    nearest, last = (cv2.resize(at + DEPTH_SCALE * layer, fine) for layer in scores)
    return HairDepth(upright.resized(*fine), cv2.resize(seen, fine) > 0.5, nearest - NEARER, last)


def upright_camera(camera: Camera, middle: Float64Array) -> Camera:
    """Return the camera at the same place that looks at the head's middle, the head upright."""
    flat = camera.model == "orthographic"
    back = -camera.forward if flat else camera.position - middle
    distance = float(np.linalg.norm(back))
    return Camera.on_turn(
        float(np.degrees(np.arctan2(back[0], back[2]))),
        elevation_deg=float(np.degrees(np.arcsin(back[1] / distance))),
        distance=distance, target=middle, focal=GRID / WINDOW * (1 if flat else distance),
        width=GRID, height=GRID, centre=(GRID / 2, GRID * ABOVE / WINDOW), model=camera.model,
    )  # fmt: skip
