"""The photographed hairline: where on the head the photos show that hair grows.

Every view votes on the vertices that it sees: bare where there is no hair in the photo, covered
elsewhere. Hair also covers skin that it only hangs over, so covered vertices keep their hair unless
other views see them bare. Vertices that no view sees take the votes of the nearest that are seen:
level views do not show the top of a head, but what grows around it. Bare strips as narrow as a
parting are closed: hair grows up to the line from which it is combed.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float64Array
from hairkit.cameras.depth_raster import HEAD_TOLERANCE, depth_behind, head_depth
from hairkit.types.camera import Camera
from hairkit.types.hairline import Hairline
from hairkit.types.mask import Mask
from hairkit.types.scene import Scene

RASTER_HEIGHT = 540
"""Height in pixels at which masks and head are compared: about a millimetre a pixel."""
LEAST_FACING = 0.12
"""Cosine of the angle to the viewing direction below which a vertex is seen too obliquely."""
POSE_BLUR = 0.003
"""Metres: misfit of cameras and head over which masks are blurred before they vote."""
SKIN_BLUR = 0.005
"""Metres over which the votes of neighbouring vertices are averaged."""
NEIGHBOURS = 24
"""Vertices averaged; the template's are 3 mm apart."""
UNSEEN_REACH = 0.015
"""Metres to which votes carry where photos leave more than half of the head unseen: hair is cut
short, not bald, behind a bare neck."""
PRIOR = 0.05
"""Weight of the belief that hair grows, in views that see a vertex straight on."""
FULL, BARE = 0.25, 0.5
"""Share of the votes against hair up to which hair is full, and from which nothing grows: on three
captures with a bald crown drawn into their masks these leave 0.27 to 0.41 of the hair there and
keep 0.97 to 0.99 of the rest; (0.35, 0.65) leave 0.37 to 0.5, (0.2, 0.4) keep 0.96 to 0.98."""
PARTING = 0.01
"""Half the width in metres of bare strips that are closed."""


def measure_hairline(scene: Scene, masks: Sequence[Mask]) -> Hairline:
    """Return the density of hair at every vertex of the scene's head; 1 where no view sees it."""
    head = scene.head
    vertices, normals = head.vertices.astype(np.float64), head.normals()
    against, weight = np.zeros(len(vertices)), np.zeros(len(vertices))
    for camera, mask in zip(scene.cameras, masks, strict=True):
        small = camera.resized(round(RASTER_HEIGHT * camera.width / camera.height), RASTER_HEIGHT)
        sees = _facing(small, scene, vertices, normals)
        against += sees * (1 - _hair_at(small, mask, vertices))
        weight += sees
    against = _average(vertices, against, weight, UNSEEN_REACH if scene.one_sided else np.inf)
    density = np.clip((BARE - against) / (BARE - FULL), 0, 1)
    return Hairline(_close(vertices, density).astype(np.float32))


def _facing(
    camera: Camera, scene: Scene, vertices: Float64Array, normals: Float64Array
) -> Float64Array:
    """Return (V,) the cosine under which a camera sees each vertex, 0 where it does not."""
    facing = -(normals * camera.view_direction(vertices)).sum(axis=1)
    behind = depth_behind(camera, head_depth(scene.head, camera), scene.head.vertices)
    return np.where((facing > LEAST_FACING) & (behind < HEAD_TOLERANCE), facing, 0.0)


def _hair_at(camera: Camera, mask: Mask, vertices: Float64Array) -> Float64Array:
    """Return (V,) the share of hair about each vertex in the picture."""
    hair = cv2.resize(
        mask.hair.astype(np.float32), (camera.width, camera.height), interpolation=cv2.INTER_AREA
    )
    blurred = cv2.GaussianBlur(hair, (0, 0), max(POSE_BLUR * camera.pixels_per_metre, 1e-3))
    u, v = np.nan_to_num(camera.project(vertices)).T
    column = np.clip(u, 0, camera.width - 1).astype(np.int64)
    row = np.clip(v, 0, camera.height - 1).astype(np.int64)
    return np.asarray(blurred[row, column].astype(np.float64))


def _average(
    vertices: Float64Array, against: Float64Array, weight: Float64Array, reach: float
) -> Float64Array:
    """Return (V,) the share of votes against hair, averaged over the nearest vertices seen.

    Votes fade with the distance of the nearest, over `reach` metres.
    """
    seen = np.flatnonzero(weight > 0)
    if not len(seen):
        return np.zeros(len(vertices))
    count = min(NEIGHBOURS, len(seen))
    distance, near = cKDTree(vertices[seen]).query(vertices, k=count)
    distance, near = distance.reshape(-1, count), seen[near.reshape(-1, count)]
    close = np.exp((distance[:, :1] ** 2 - distance**2) / (2 * SKIN_BLUR**2))
    close *= np.exp(-((distance[:, :1] / reach) ** 2))
    total = (close * weight[near]).sum(axis=1) + PRIOR
    return np.asarray((close * against[near]).sum(axis=1) / total)


def _close(vertices: Float64Array, density: Float64Array) -> Float64Array:
    """Return the morphological closing of a density (V,) with balls of `PARTING` on the head."""
    first, second = cKDTree(vertices).query_pairs(PARTING, output_type="ndarray").T
    for sign in (1.0, -1.0):
        extreme = sign * density
        np.maximum.at(extreme, first, sign * density[second])
        np.maximum.at(extreme, second, sign * density[first])
        density = sign * extreme
    return density
