"""Frame buffers: a colour and a depth buffer, supersampling, and read-back as an array."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Literal, TypeVar

import cv2
import moderngl
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array
from hairkit.errors import RenderError
from hairkit.rendering.context import Renderer
from hairkit.types.camera import Camera

Sample = TypeVar("Sample", np.uint8, np.float32)

SUPERSAMPLE = 2
"""Samples along each edge of a pixel; faster and better than multisampling for thin ribbons."""


class Target:
    """A frame buffer of the camera's size; the first row is the top of the picture."""

    def __init__(self, framebuffer: moderngl.Framebuffer, kind: Literal["f1", "f4"]) -> None:
        self._framebuffer = framebuffer
        self._kind = kind

    def read(self) -> npt.NDArray[np.uint8] | Float32Array:
        """Return (H, W, 4): uint8, or float32 for a target of kind `f4`."""
        data = self._framebuffer.read(components=4, dtype=self._kind)
        shape = (*self._framebuffer.size[::-1], 4)
        if self._kind == "f1":
            return np.frombuffer(data, np.uint8).reshape(shape)
        return np.frombuffer(data, np.float32).reshape(shape)


@contextlib.contextmanager
def target(gl: Renderer, camera: Camera, kind: Literal["f1", "f4"] = "f1") -> Iterator[Target]:
    """Bind a cleared target for a block, with depth testing; raises `RenderError` if too large."""
    size = (camera.width, camera.height)
    limit = int(gl.context.info["GL_MAX_VIEWPORT_DIMS"][0])
    if max(size) > limit:
        raise RenderError(
            f"picture of {size[0]} x {size[1]} samples, expected at most {limit}; draw it smaller"
        )
    colour = gl.context.renderbuffer(size, 4, dtype=kind)
    depth = gl.context.depth_renderbuffer(size)
    framebuffer = gl.context.framebuffer([colour], depth)
    try:
        framebuffer.use()
        framebuffer.clear(0.0, 0.0, 0.0, 0.0)
        gl.context.enable_only(moderngl.DEPTH_TEST)
        yield Target(framebuffer, kind)
    finally:
        gl.home.use()
        framebuffer.release()
        colour.release()
        depth.release()


def supersample_camera(camera: Camera, factor: int) -> Camera:
    """Return the camera with `factor` samples along each edge of a pixel."""
    return camera.resized(camera.width * factor, camera.height * factor)


def average_samples(samples: npt.NDArray[Sample], camera: Camera) -> npt.NDArray[Sample]:
    """Average samples (k H, k W, C), uint8 or float32, over each pixel; return (H, W, C)."""
    if samples.shape[:2] == (camera.height, camera.width):
        return samples
    size = (camera.width, camera.height)
    return np.asarray(cv2.resize(samples, size, interpolation=cv2.INTER_AREA), samples.dtype)
