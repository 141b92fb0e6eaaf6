"""Strands as ribbons on the GPU: one buffer of points, one triangle strip a strand."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hairkit.camera import Camera
from hairkit.render.context import Renderer
from hairkit.render.projection import DepthRange, set_camera, set_uniforms
from hairkit.stored import Float32Array
from hairkit.strands import Strands

_RESTART = 0xFFFFFFFF


@dataclass(frozen=True)
class RibbonBuffers:
    """A strand set on the GPU."""

    points: moderngl.Buffer
    indices: moderngl.Buffer


@contextlib.contextmanager
def ribbons(
    gl: Renderer, strands: Strands, width: float | npt.ArrayLike
) -> Iterator[RibbonBuffers | None]:
    """Keep strands on the GPU for a block, `width` metres wide (a number or (P,)).

    Yields `None`, which draws nothing, when there is no strand.
    """
    if not len(strands):
        yield None
        return
    points = gl.context.buffer(_point_records(strands, width))
    indices = gl.context.buffer(_strip_indices(strands))
    try:
        yield RibbonBuffers(points, indices)
    finally:
        points.release()
        indices.release()


def draw_ribbons(
    gl: Renderer,
    buffers: RibbonBuffers | None,
    program: moderngl.Program,
    camera: Camera,
    depth: DepthRange,
    *,
    min_width_px: float = 1.0,
    **uniforms: Any,
) -> None:
    """Draw all ribbons with `program` (whose vertex shader includes `ribbon.glsl`)."""
    if buffers is None:
        return
    set_camera(program, camera, depth)
    set_uniforms(program, u_min_width_px=min_width_px, **uniforms)
    buffers.points.bind_to_storage_buffer(0)
    array = gl.context.vertex_array(program, [], index_buffer=buffers.indices)
    array.render(moderngl.TRIANGLE_STRIP)
    array.release()


def strand_numbers(count: int) -> Float32Array:
    """Return one random-looking number in [0, 1) a strand, the same in every run (golden ratio)."""
    golden = 0.6180339887498949
    numbers: Float32Array = np.mod(np.arange(count) * golden, 1.0).astype(np.float32)
    return numbers


def _point_records(strands: Strands, width: float | npt.ArrayLike) -> Float32Array:
    arc = strands.arc_lengths()
    length = np.repeat(arc[strands.offsets[1:] - 1], strands.counts)
    fraction = arc / np.maximum(length, 1e-9)
    # ribbon.glsl tells roots and tips by exactly 0 and 1, and inner points by anything between
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
