"""Strands as camera-facing ribbons on the GPU, one triangle strip for each."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.types.camera import Camera
from hairkit.types.strands import Strands

_RESTART = 0xFFFFFFFF
_GROUP = 64  # local_size_x of ribbon_shape.glsl
_SHAPED_BYTES = 32  # a RibbonPoint of ribbon.glsl
_GOLDEN_STEP = 0.6180339887498949
"""Inverse of the golden ratio: multiples of it, modulo 1, fill the unit interval evenly."""


@dataclass(frozen=True)
class RibbonBuffers:
    """Strands on the GPU."""

    points: moderngl.Buffer
    shaped: moderngl.Buffer
    indices: moderngl.Buffer
    count: int


@contextlib.contextmanager
def ribbons(
    gl: Renderer, strands: Strands, width: float | npt.ArrayLike
) -> Iterator[RibbonBuffers | None]:
    """Upload strands for a block, `width` metres wide (a number or (P,)).

    Yields `None`, which draws nothing, if there are no strands.
    """
    if not len(strands):
        yield None
        return
    points = gl.context.buffer(_point_records(strands, width))
    shaped = gl.context.buffer(reserve=_SHAPED_BYTES * len(strands.points))
    indices = gl.context.buffer(_strip_indices(strands))
    try:
        yield RibbonBuffers(points, shaped, indices, len(strands.points))
    finally:
        for buffer in (points, shaped, indices):
            buffer.release()


def draw_ribbons(
    gl: Renderer,
    buffers: RibbonBuffers | None,
    program: moderngl.Program,
    camera: Camera,
    depth: DepthRange,
    *,
    shader: str = "ribbon_flat",
    min_width_px: float = 1.0,
    **uniforms: Any,
) -> None:
    """Shape all ribbons by `shader.comp`, then draw them with `program`.

    The program's vertex shader includes `ribbon_vertex.glsl`. Shaping is a pass of its own because
    compute shaders run on all cores of a software renderer, vertex shaders on one.
    """
    if buffers is None:
        return
    shape = gl.compute(shader)
    for part in (shape, program):
        set_camera(part, camera, depth)
        set_uniforms(part, u_min_width_px=min_width_px, u_count=buffers.count, **uniforms)
    buffers.points.bind_to_storage_buffer(0)
    buffers.shaped.bind_to_storage_buffer(1)
    shape.run(-(-buffers.count // _GROUP))
    gl.context.memory_barrier()
    array = gl.context.vertex_array(program, [], index_buffer=buffers.indices)
    array.render(moderngl.TRIANGLE_STRIP)
    array.release()


def strand_numbers(count: int) -> Float32Array:
    """Return a quasi-random number in [0, 1) for each strand (golden-ratio sequence)."""
    numbers: Float32Array = np.mod(np.arange(count) * _GOLDEN_STEP, 1.0).astype(np.float32)
    return numbers


def _point_records(strands: Strands, width: float | npt.ArrayLike) -> Float32Array:
    arc = strands.arc_lengths()
    length = np.repeat(arc[strands.offsets[1:] - 1], strands.counts)
    fraction = arc / np.maximum(length, 1e-9)
    # ribbon_shape.glsl detects roots and tips by exactly 0 and 1
    fraction = np.clip(fraction, 1e-6, 1 - 1e-6)
    fraction[strands.offsets[:-1]] = 0
    fraction[strands.offsets[1:] - 1] = 1
    records = np.zeros((len(strands.points), 8), np.float32)
    records[:, :3] = strands.points
    records[:, 3] = fraction
    records[:, 4] = width
    records[:, 5] = np.repeat(strand_numbers(len(strands)), strands.counts)
    return records


def _strip_indices(strands: Strands) -> npt.NDArray[np.uint32]:
    total, count = len(strands.points), len(strands)
    vertices = np.arange(2 * total, dtype=np.uint32)
    places = np.arange(2 * total) + np.repeat(np.arange(count), 2 * strands.counts)
    indices = np.full(2 * total + count, _RESTART, np.uint32)
    indices[places] = vertices
    return indices
