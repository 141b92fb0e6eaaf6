"""Pictures to measure with: how much of a pixel hair covers, and which way the visible hair runs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.camera import Camera
from hairkit.head import Head
from hairkit.orientation import wrap_angle
from hairkit.render.context import renderer
from hairkit.render.hair import draw_ribbons, ribbons
from hairkit.render.head import draw_solid
from hairkit.render.projection import DepthRange
from hairkit.render.target import SUPERSAMPLE, averaged, supersampled, target
from hairkit.stored import BoolArray, Float32Array
from hairkit.strands import Strands

HEAD_PUSH = 0.002
"""The head is drawn this much behind its surface, metres, so that it never hides roots."""

_HAIR, _HEAD = (1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)


def draw_layers(
    strands: Strands,
    head: Head | None,
    camera: Camera,
    *,
    width: float = 5e-4,
    min_width_px: float = 1.0,
    supersample: int = SUPERSAMPLE,
) -> tuple[Float32Array, Float32Array]:
    """Return the shares (H, W) in [0, 1] of each pixel that visible hair and the bare head cover.

    `width` is the drawn diameter of every strand in metres, `min_width_px` its least in pixels.
    """
    fine = supersampled(camera, supersample)
    depth = DepthRange.around(fine, strands.points, head.vertices if head else ())
    with renderer() as gl, target(gl, fine) as picture:
        if head is not None:
            draw_solid(
                gl, head, gl.program("solid", "flat"), fine, depth, HEAD_PUSH, u_colour=_HEAD
            )
        if len(strands):
            least = min_width_px * supersample
            program = gl.program("hair_flat", "flat")
            with ribbons(gl, strands, width) as buffers:
                draw_ribbons(gl, buffers, program, fine, depth, min_width_px=least, u_colour=_HAIR)
        share = averaged(np.asarray(picture.read(), np.uint8)[..., :2], camera)
    shares = share.astype(np.float32) / 255
    return shares[..., 0], shares[..., 1]


def draw_coverage(
    strands: Strands,
    head: Head | None,
    camera: Camera,
    *,
    width: float = 5e-4,
    min_width_px: float = 1.0,
) -> Float32Array:
    """Return the share (H, W) in [0, 1] of each pixel that hair in front of the head covers."""
    return draw_layers(strands, head, camera, width=width, min_width_px=min_width_px)[0]


def draw_directions(
    strands: Strands,
    head: Head | None,
    camera: Camera,
    *,
    width: float = 2e-4,
    min_width_px: float = 1.0,
) -> tuple[Float32Array, BoolArray]:
    """Return the 2D angle (H, W) of the strand seen at each pixel's centre, and where one is seen.

    Angles are undirected, in [0, pi), from +x towards +y, as in `OrientationMap`; 0 where no hair is.
    """
    depth = DepthRange.around(camera, strands.points, head.vertices if head else ())
    with renderer() as gl, target(gl, camera, "f4") as picture:
        if head is not None:
            black = (0.0, 0.0, 0.0, 0.0)
            draw_solid(
                gl, head, gl.program("solid", "flat"), camera, depth, HEAD_PUSH, u_colour=black
            )
        if len(strands):
            program = gl.program("hair_direction")
            with ribbons(gl, strands, width) as buffers:
                draw_ribbons(gl, buffers, program, camera, depth, min_width_px=min_width_px)
        direction = np.asarray(picture.read(), np.float32)
    seen: npt.NDArray[np.bool_] = direction[..., 2] > 0.5
    angle = wrap_angle(np.arctan2(direction[..., 1], direction[..., 0]))
    return np.where(seen, angle, np.float32(0)), seen
