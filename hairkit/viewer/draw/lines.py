"""Coloured polylines and billboards: guides, field lines, camera frusta, photos."""

from __future__ import annotations

from dataclasses import dataclass

import moderngl
import numpy as np

from hairkit.arrays import Float32Array, Int64Array, UInt8Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.types.camera import Camera

_RESTART = 0xFFFFFFFF


@dataclass(frozen=True, eq=False)
class LineSet:
    """Polylines with a colour at each point."""

    points: Float32Array
    """(P, 3) metres."""
    offsets: Int64Array
    """(L + 1,) first point of each line."""
    colours: Float32Array
    """(P, 4) sRGB and opacity in [0, 1]."""


@dataclass(frozen=True, eq=False)
class Billboard:
    """A picture in 3D space."""

    corners: Float32Array
    """(4, 3) metres: top left, top right, bottom left, bottom right."""
    image: UInt8Array
    """(H, W, 4) sRGB and opacity."""


def draw_lines(
    gl: Renderer, lines: LineSet, camera: Camera, depth: DepthRange, pull: float = 0.0
) -> None:
    """Draw lines, `pull` of the depth range nearer to the camera than they are."""
    program = gl.program("viewer_line")
    set_camera(program, camera, depth)
    set_uniforms(program, u_pull=pull)
    values = np.concatenate([lines.points, lines.colours], axis=1)
    vertices = gl.context.buffer(np.ascontiguousarray(values, np.float32))
    indices = gl.context.buffer(_strip_indices(lines))
    array = gl.context.vertex_array(
        program, [(vertices, "3f 4f", "in_position", "in_colour")], index_buffer=indices
    )
    array.render(moderngl.LINE_STRIP)
    for part in (array, vertices, indices):
        part.release()


class BillboardPass:
    """A billboard on the GPU."""

    def __init__(self, gl: Renderer, board: Billboard) -> None:
        self._gl = gl
        self._program = gl.program("viewer_billboard")
        height, width = board.image.shape[:2]
        image = np.ascontiguousarray(board.image)
        self._texture = gl.context.texture((width, height), 4, image.tobytes())
        self._texture.build_mipmaps()
        uv = np.array([[0, 0], [1, 0], [0, 1], [1, 1]], np.float32)
        values = np.concatenate([board.corners, uv], axis=1).astype(np.float32)
        self._vertices = gl.context.buffer(values)
        self._array = gl.context.vertex_array(
            self._program, [(self._vertices, "3f 2f", "in_position", "in_uv")]
        )

    def draw(self, camera: Camera, depth: DepthRange, opacity: float) -> None:
        """Draw the picture."""
        set_camera(self._program, camera, depth)
        self._texture.use(3)
        set_uniforms(self._program, u_image=3, u_opacity=opacity)
        self._array.render(moderngl.TRIANGLE_STRIP)

    def release(self) -> None:
        """Free texture and buffers."""
        for part in (self._array, self._vertices, self._texture):
            part.release()


def _strip_indices(lines: LineSet) -> bytes:
    total, count = len(lines.points), len(lines.offsets) - 1
    owner = np.repeat(np.arange(count), np.diff(lines.offsets))
    indices = np.full(total + count, _RESTART, np.uint32)
    indices[np.arange(total) + owner] = np.arange(total)
    return indices.tobytes()
