"""Buffers to measure with: coverage, direction, depth and visibility of hair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hairkit.arrays import BoolArray, Float32Array
from hairkit.rendering.context import Renderer, renderer
from hairkit.rendering.framebuffer import SUPERSAMPLE, average_samples, supersample_camera, target
from hairkit.rendering.gl_camera import DepthRange
from hairkit.rendering.hair import draw_ribbons, ribbons
from hairkit.rendering.head import draw_solid
from hairkit.types.camera import Camera
from hairkit.types.orientation import wrap_angle
from hairkit.types.preview import Surface
from hairkit.types.strands import Strands

Solids = Surface | Sequence[Surface] | None
"""Occluders of hair: a head, several meshes, or None."""

HEAD_PUSH = 0.002
"""Meshes are drawn this far behind their surface, metres, so that they never hide roots."""
SEEN_TOLERANCE = 0.001
"""A point up to this far behind the front strand of its pixel is visible, metres."""
_NOTHING, _HAIR, _SOLID = (0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)


def draw_layers(
    strands: Strands, solids: Solids, camera: Camera, *, width: float | Float32Array = 5e-4
) -> tuple[Float32Array, Float32Array]:
    """Return the coverage (H, W) of each pixel, 0 to 1, by visible hair and by bare meshes.

    `width` is the drawn diameter in metres, a number or (P,); a pixel at least.
    """
    fine = supersample_camera(camera, SUPERSAMPLE)
    meshes = _meshes(solids)
    depth = DepthRange.around(fine, strands.points, *[mesh.vertices for mesh in meshes])
    with renderer() as gl, target(gl, fine) as picture:
        _draw_solids(gl, meshes, fine, depth, _SOLID)
        program = gl.program("hair_flat", "flat")
        with ribbons(gl, strands, width) as buffers:
            draw_ribbons(
                gl, buffers, program, fine, depth, min_width_px=SUPERSAMPLE, u_colour=_HAIR
            )
        samples = np.asarray(picture.read()[..., :2], np.float32)
    shares = average_samples(samples, camera) / np.float32(255)
    return shares[..., 0], shares[..., 1]


@dataclass(frozen=True)
class Measurements:
    """Direction and depth of the visible strand at each pixel centre."""

    angle: Float32Array
    """(H, W) radians in [0, pi), as in `OrientationMap`; 0 without hair."""
    depth: Float32Array
    """(H, W) axial depth in metres, infinity without hair."""
    seen: BoolArray
    """(H, W) true where hair is the front-most surface."""


def draw_measurements(
    strands: Strands, solids: Solids, camera: Camera, *, width: float | Float32Array = 2e-4
) -> Measurements:
    """Return direction and depth of the visible strand at each pixel, in one pass."""
    meshes = _meshes(solids)
    depth = DepthRange.around(camera, strands.points, *[mesh.vertices for mesh in meshes])
    with renderer() as gl, target(gl, camera, "f4") as picture:
        _draw_solids(gl, meshes, camera, depth, _NOTHING)
        program = gl.program("hair_direction")
        with ribbons(gl, strands, width) as buffers:
            draw_ribbons(gl, buffers, program, camera, depth)
        values: Float32Array = np.asarray(picture.read(), np.float32)
    seen: BoolArray = values[..., 3] > 0.5
    angle = wrap_angle(np.arctan2(values[..., 1], values[..., 0]))
    return Measurements(
        np.where(seen, angle, np.float32(0)),
        np.where(seen, values[..., 2], np.float32(np.inf)),
        seen,
    )


def draw_depth(
    strands: Strands, head: Solids, camera: Camera, *, width: float | Float32Array = 2e-4
) -> Float32Array:
    """Return the axial depth (H, W) of the visible strand at each pixel, metres, else infinity."""
    return draw_measurements(strands, head, camera, width=width).depth


def visible_points(strands: Strands, head: Solids, camera: Camera) -> BoolArray:
    """Return which points (P,) are visible: not behind other hair or the head."""
    return points_at_depth(strands, draw_depth(strands, head, camera), camera)


def points_at_depth(strands: Strands, depth: Float32Array, camera: Camera) -> BoolArray:
    """Return which points (P,) are not behind the `depth` (H, W) of `draw_depth`."""
    pixels = camera.project(strands.points)
    inside = np.all((pixels >= 0) & (pixels < [camera.width, camera.height]), axis=1)
    column, row = np.where(inside[:, None], pixels, 0).astype(np.int64).T
    front = np.where(inside & np.isfinite(depth[row, column]), depth[row, column], -np.inf)
    return camera.depth(strands.points) <= front + SEEN_TOLERANCE


def _meshes(solids: Solids) -> Sequence[Surface]:
    if solids is None:
        return ()
    return solids if isinstance(solids, Sequence) else (solids,)


def _draw_solids(
    gl: Renderer,
    meshes: Sequence[Surface],
    camera: Camera,
    depth: DepthRange,
    colour: tuple[float, float, float, float],
) -> None:
    program = gl.program("solid", "flat")
    for mesh in meshes:
        draw_solid(gl, mesh, program, camera, depth, HEAD_PUSH, u_colour=colour)
