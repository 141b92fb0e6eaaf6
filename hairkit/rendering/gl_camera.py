"""OpenGL matrices of a `Camera`, consistent with `Camera.project`.

The top row of the picture is OpenGL's bottom row (y in clip space points down), so that a target is
read back as an array [row, column] without flipping.
"""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.types.camera import Camera

Program = moderngl.Program | moderngl.ComputeShader

EMPTY_RANGE = (0.1, 1.0)
"""Depths that are assumed where no point is drawn, metres."""
MARGIN = 0.01
"""Gap between the outermost points and the near and far plane, metres: ribbons have a width."""
MARGIN_SHARE = 0.01
"""What is added to that gap, over the depth of the scene."""
NEAREST = 0.01
"""Smallest near plane of a perspective camera, and smallest depth of a range, metres."""


@dataclass(frozen=True)
class DepthRange:
    """Near and far plane, axial depth in metres."""

    near: float
    far: float

    @classmethod
    def around(cls, camera: Camera, *point_sets: npt.ArrayLike) -> DepthRange:
        """Return a range that contains all point sets (N, 3), in front of a perspective camera."""
        depths = [camera.depth(points) for points in point_sets if len(np.asarray(points))]
        low = min((float(depth.min()) for depth in depths), default=EMPTY_RANGE[0])
        high = max((float(depth.max()) for depth in depths), default=EMPTY_RANGE[1])
        margin = MARGIN + MARGIN_SHARE * (high - low)
        near = low - margin
        if camera.model == "perspective":
            near = max(near, NEAREST)
        return cls(near, max(high + margin, near + NEAREST))


def clip_from_camera(camera: Camera, depth: DepthRange) -> Float64Array:
    """Return the (4, 4) projection of camera coordinates to OpenGL clip space."""
    near, far = depth.near, depth.far
    scale = 2 * camera.focal / np.array([camera.width, camera.height])
    shift = 2 * camera.centre / np.array([camera.width, camera.height]) - 1
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = scale
    if camera.model == "orthographic":
        matrix[0, 3], matrix[1, 3] = shift
        matrix[2, 2], matrix[2, 3] = 2 / (far - near), -(far + near) / (far - near)
        matrix[3, 3] = 1
        return matrix
    matrix[0, 2], matrix[1, 2] = shift
    matrix[2, 2], matrix[2, 3] = (far + near) / (far - near), -2 * far * near / (far - near)
    matrix[3, 2] = 1
    return matrix


def set_camera(program: Program, camera: Camera, depth: DepthRange) -> None:
    """Set the camera uniforms that a program uses."""
    clip_from_head = clip_from_camera(camera, depth) @ camera.camera_from_head
    set_uniforms(
        program,
        u_clip_from_head=tuple(clip_from_head.T.ravel().tolist()),  # by columns
        u_forward=tuple(camera.forward.tolist()),
        u_depth_offset=float(camera.translation[2]),
        u_size_px=(camera.width, camera.height),
        u_focal_px=camera.focal,
        u_perspective=float(camera.model == "perspective"),
    )


def set_uniforms(program: Program, **values: object) -> None:
    """Set uniforms by name; skip those that the compiler removed as unused."""
    for name, value in values.items():
        if name in program:
            program[name] = value
