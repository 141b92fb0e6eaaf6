"""Strands as camera-facing ribbons on the GPU, one triangle strip for each."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int64Array, UInt32Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.types.camera import Camera
from hairkit.types.groom import HairMaterial
from hairkit.types.strand_blocks import blocks, colours
from hairkit.types.strands import Strands

TEN_BITS = 1023
"""Largest number of a channel of a packed colour."""
_RESTART = 0xFFFFFFFF
_GROUP = 64  # local_size_x of ribbon_shape.glsl
_MOST_POINTS = 65535 * _GROUP  # groups of a dispatch, which every OpenGL allows
_SHAPED_BYTES = 32  # a RibbonPoint of ribbon.glsl
_GOLDEN_STEP = 0.6180339887498949
"""Inverse of the golden ratio: multiples of it, modulo 1, fill the unit interval evenly."""


@dataclass(frozen=True)
class RibbonBuffers:
    """A part of the strands on the GPU."""

    points: moderngl.Buffer
    shaped: moderngl.Buffer
    indices: moderngl.Buffer
    count: int


@contextlib.contextmanager
def ribbons(
    gl: Renderer,
    strands: Strands,
    width: float | npt.ArrayLike,
    material: HairMaterial | None = None,
) -> Iterator[tuple[RibbonBuffers, ...]]:
    """Upload strands for a block, `width` metres wide (a number or (P,)), in as many parts as
    OpenGL takes. Without colours of their own they have those of the material, if it is given."""
    records = _point_records(strands, width)
    if material is not None:
        for block in blocks(strands):
            own = colours(material, strands).at(block.strands)
            records[block.points, 6] = packed_colours(own).view(np.float32)
    with contextlib.ExitStack() as kept:
        yield tuple(
            _upload(gl, records[strands.offsets[first] : strands.offsets[end]], counts, kept)
            for first, end in pairwise(_cuts(strands))
            if len(counts := strands.counts[first:end])
        )


def _cuts(strands: Strands) -> Int64Array:
    """Return where strands are cut into parts of `_MOST_POINTS` points at most."""
    total, longest = len(strands.points), int(strands.counts.max(initial=0))
    parts = 1 + total // max(_MOST_POINTS - longest, 1)
    return np.searchsorted(strands.offsets, np.linspace(0, total, parts + 1))


def _upload(
    gl: Renderer, records: Float32Array, counts: Int64Array, kept: contextlib.ExitStack
) -> RibbonBuffers:
    points = gl.context.buffer(records)
    shaped = gl.context.buffer(reserve=_SHAPED_BYTES * len(records))
    indices = gl.context.buffer(_strip_indices(counts))
    for buffer in (points, shaped, indices):
        kept.callback(buffer.release)
    return RibbonBuffers(points, shaped, indices, len(records))


def draw_ribbons(
    gl: Renderer,
    parts: Sequence[RibbonBuffers],
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
    shape = gl.compute(shader)
    for each in (shape, program):
        set_camera(each, camera, depth)
        set_uniforms(each, u_min_width_px=min_width_px, **uniforms)
    for part in parts:
        set_uniforms(shape, u_count=part.count)
        part.points.bind_to_storage_buffer(0)
        part.shaped.bind_to_storage_buffer(1)
        shape.run(-(-part.count // _GROUP))
        gl.context.memory_barrier()
        array = gl.context.vertex_array(program, [], index_buffer=part.indices)
        array.render(moderngl.TRIANGLE_STRIP)
        array.release()


def strand_numbers(count: int) -> Float32Array:
    """Return a quasi-random number in [0, 1) for each strand (golden-ratio sequence)."""
    return np.asarray(np.mod(np.arange(count) * _GOLDEN_STEP, 1.0).astype(np.float32))


def packed_colours(colours: Float32Array) -> UInt32Array:
    """Return linear colours (..., 3) as `unpacked` of hair_colour.glsl reads them, (...)."""
    root = np.rint(TEN_BITS * np.sqrt(np.clip(colours, 0, 1))).astype(np.uint32)
    return np.asarray(1 << 30 | root[..., 2] << 20 | root[..., 1] << 10 | root[..., 0], np.uint32)


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


def _strip_indices(counts: Int64Array) -> npt.NDArray[np.uint32]:
    total, count = int(counts.sum()), len(counts)
    vertices = np.arange(2 * total, dtype=np.uint32)
    places = np.arange(2 * total) + np.repeat(np.arange(count), 2 * counts)
    indices = np.full(2 * total + count, _RESTART, np.uint32)
    indices[places] = vertices
    return indices
