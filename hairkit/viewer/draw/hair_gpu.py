"""Draw hair that follows guides with compute shaders; on software renderers `hair_cpu` is faster.

Passes: rotation of the guides since rest; interpolation and projection of the hair, whose opacity
is splatted into view cells; accumulation of opacity by depth; shading and rasterisation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from hairkit.arrays import Float32Array
from hairkit.errors import InputError
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import set_camera, set_uniforms
from hairkit.rendering.hair import packed_colours, strand_numbers
from hairkit.types.camera import Camera
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.interface import HairLook, HairScene, HairView
from hairkit.viewer.draw.place_kernels import SLICES, TILE

_GROUP, COLOURS, SUMS = 64, 5, 7
"""Invocations of a work group; bindings of guides' colours and of sums, as in the shaders."""
_POINT, _BLOCK = 12, 64
"""Bytes of a point: three words; and of a block of sums, see viewer_accumulation.glsl."""
_WORD, _HALF_FLOAT = 65535, 6e4
"""Largest 16-bit number; about the largest half float."""
EDGE = 8
"""Margin around the guides for the width of strokes, pixels."""
MOST_GUIDES = 65_535
NEAR_HAIR, OFF_GUIDES = 0.05, 0.06
"""Metres: hair nearer to the camera than the first may cover the whole picture; hair is within the
second of its guides."""


class HairPass:
    """The hair's buffers on the GPU and the passes that draw it."""

    def __init__(self, gl: Renderer, body: HairBody) -> None:
        self._gl = gl
        self.body = body
        if len(body.guides) > MOST_GUIDES:
            raise InputError(
                f"{len(body.guides)} guides, expected at most {MOST_GUIDES}; mark fewer as guides"
            )
        count, points = len(body), body.points_each
        context = gl.context
        self._rest = context.buffer(np.ascontiguousarray(body.guide_rest, np.float32))
        self._now = context.buffer(np.ascontiguousarray(body.guide_rest, np.float32))
        self._guides = context.buffer(reserve=_POINT * len(body.guides) * points)
        self._hairs = context.buffer(_hair_records(body))
        self._edges = context.buffer(_edge_records(body))
        self._colours = context.buffer(packed_colours(body.colours))
        self._places = context.buffer(reserve=_POINT * count * points)
        self._view: _ViewBuffers | None = None
        self._resolve = context.vertex_array(gl.program("viewer_screen", "viewer_resolve"), [])

    def release(self) -> None:
        """Free the buffers."""
        guides = self._rest, self._now, self._guides, self._colours
        for buffer in (*guides, self._hairs, self._edges, self._places):
            buffer.release()
        self._resolve.release()
        if self._view is not None:
            self._view.release()

    def places(self) -> moderngl.Buffer:
        """Return the last positions (S, m, 3) of the hair, float32, head frame, metres."""
        return self._places

    def move_guides(self, rows: Float32Array) -> Float32Array:
        """Move the guides to `rows` (G, m, 3), head frame, metres; return them as points (N, 3)."""
        self._now.write(np.ascontiguousarray(rows, np.float32))
        for binding, buffer in enumerate((self._rest, self._now, self._guides)):
            buffer.bind_to_storage_buffer(binding)
        self._run("viewer_guides", len(self.body.guides))
        self._cloud = np.asarray(rows, np.float32).reshape(-1, 3)
        return self._cloud

    def place(self, view: HairView, look: HairLook) -> None:
        """Interpolate the hair from the guides and accumulate its opacity by depth."""
        buffers = self._resize_buffers(view.camera)
        near, far = view.hair_depth.near, view.hair_depth.far
        self._shared: dict[str, Any] = {
            "u_tiles": buffers.tiles,
            "u_slice_range": (near, SLICES / (far - near)),
            "u_wider": look.times_wider,
        }
        buffers.filled.clear()
        self._guides.bind_to_storage_buffer(0)
        self._hairs.bind_to_storage_buffer(1)
        self._edges.bind_to_storage_buffer(2)
        self._places.bind_to_storage_buffer(3)
        buffers.filled.bind_to_storage_buffer(4)
        self._run("viewer_place", look.hairs, view, **self._shared)
        buffers.opacity.bind_to_image(0, read=False, write=True)
        self._run("viewer_opacity", buffers.tiles[0] * buffers.tiles[1], **self._shared)

    def draw(self, scene: HairScene) -> None:
        """Draw the meshes into the picture, and over them hair that is nearer."""
        scene.meshes.show(scene.target)
        view, look = scene.view, scene.look
        buffers = self._resize_buffers(view.camera)
        scene.meshes.depth_texture().use(1)
        buffers.opacity.use(2)
        self._hairs.bind_to_storage_buffer(1)
        self._edges.bind_to_storage_buffer(2)
        self._places.bind_to_storage_buffer(3)
        self._colours.bind_to_storage_buffer(COLOURS)
        buffers.sums.bind_to_storage_buffer(SUMS)
        self._run(
            "viewer_raster",
            look.hairs,
            view,
            u_eye=tuple(view.camera.position.tolist()),
            u_show_direction=float(look.by_direction),
            u_solid_depth=1,
            u_opacity=2,
            u_picture=buffers.size,
            u_smooth=float(look.smooth),
            u_dimming=look.dimming,
            **self._shared,
            **scene.lights.uniforms(),
            **scene.light.uniforms(),
        )
        frame = _frame_of(view.camera, self._cloud)
        self._composite(scene.target, buffers, frame, look.dimming)

    def _composite(
        self,
        target: moderngl.Framebuffer,
        buffers: _ViewBuffers,
        frame: tuple[int, int, int, int],
        dimming: float,
    ) -> None:
        """Blend the accumulated hair over `target` inside a frame, and clear the sums."""
        context = self._gl.context
        target.use()
        target.scissor = frame
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        program = self._gl.program("viewer_screen", "viewer_resolve")
        set_uniforms(program, u_picture=buffers.size, u_dimming=dimming)
        buffers.sums.bind_to_storage_buffer(SUMS)
        self._resolve.render(moderngl.TRIANGLES, vertices=3)
        target.scissor = (0, 0, *buffers.size)

    def _run(self, shader: str, count: int, view: HairView | None = None, **uniforms: Any) -> None:
        program = self._gl.compute(shader)
        if view is not None:
            set_camera(program, view.camera, view.depth)
        set_uniforms(program, u_points=self.body.points_each, u_count=count, **uniforms)
        program.run(max(-(-count // _GROUP), 1))
        self._gl.context.memory_barrier()

    def _resize_buffers(self, camera: Camera) -> _ViewBuffers:
        size = (camera.width, camera.height)
        if self._view is None or self._view.size != size:
            if self._view is not None:
                self._view.release()
            self._view = _ViewBuffers.of(self._gl.context, size)
        return self._view


@dataclass(frozen=True)
class _ViewBuffers:
    """Buffers whose size depends on that of the picture."""

    size: tuple[int, int]
    tiles: tuple[int, int]
    filled: moderngl.Buffer
    opacity: moderngl.Texture3D
    sums: moderngl.Buffer

    @classmethod
    def of(cls, context: moderngl.Context, size: tuple[int, int]) -> _ViewBuffers:
        tiles = (-(-size[0] // TILE), -(-size[1] // TILE))
        opacity = context.texture3d((*tiles, SLICES + 1), 1, dtype="f4")
        opacity.filter = (moderngl.LINEAR, moderngl.LINEAR)
        opacity.repeat_x = opacity.repeat_y = opacity.repeat_z = False
        # whole blocks of 2 x 4 pixels, see viewer_accumulation.glsl
        blocks = -(-size[0] // 2) * -(-size[1] // 4)
        sums = context.buffer(reserve=_BLOCK * blocks)
        sums.clear()
        filled = context.buffer(reserve=4 * tiles[0] * tiles[1] * SLICES)
        return cls(size, tiles, filled, opacity, sums)

    def release(self) -> None:
        for part in (self.filled, self.opacity, self.sums):
            part.release()


def _frame_of(camera: Camera, cloud: Float32Array) -> tuple[int, int, int, int]:
    """Return x, y, width, height, in pixels, of a frame that holds all hair of these guides."""
    size = np.array([camera.width, camera.height])
    depth = camera.depth(cloud)
    if depth.min() < NEAR_HAIR:
        return 0, 0, camera.width, camera.height
    pixels = camera.project(cloud)
    margin = EDGE + OFF_GUIDES * camera.focal / float(depth.min())
    low = np.clip(np.floor(pixels.min(axis=0) - margin), 0, size)
    high = np.clip(np.ceil(pixels.max(axis=0) + margin), low + 1, size + 1)
    x, y, width, height = np.concatenate([low, high - low]).astype(int).tolist()
    return x, y, width, height


def _hair_records(body: HairBody) -> bytes:
    """Pack three words for each strand: guides, third guide and random number, two weights."""
    guides = body.followed.astype(np.uint32)
    random = np.rint(strand_numbers(len(body)) * _WORD).astype(np.uint32)
    weights = np.rint(np.clip(body.weights, 0, 1) * _WORD).astype(np.uint32)
    words = [
        guides[:, 0] | guides[:, 1] << 16,
        guides[:, 2] | random << 16,
        weights[:, 0] | weights[:, 1] << 16,
    ]
    return np.stack(words, axis=1).astype(np.uint32).tobytes()


def _edge_records(body: HairBody) -> bytes:
    """Pack two words for each point: edge and diameter in millimetres, as half floats."""
    values = np.concatenate([body.edges, body.widths[..., None]], axis=2) * 1e3
    return np.clip(values, -_HALF_FLOAT, _HALF_FLOAT).astype(np.float16).tobytes()
