"""Draw hair that follows guides on the CPU, and composite it over the picture.

Software OpenGL runs shaders on the CPU in lockstep and makes poor use of its caches; these compiled
loops draw the same hair about three times faster. Tests compare the result with `HairPass`.
"""

from __future__ import annotations

import moderngl
import numpy as np

from hairkit.arrays import Float32Array
from hairkit.parallel import parallel_for, thread_count
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import NEAREST, clip_from_camera, set_uniforms
from hairkit.rendering.hair import strand_numbers
from hairkit.viewer.draw import place_kernels, raster_kernels, shade_kernels
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.interface import HairLook, HairScene, HairView

MOST_CHUNKS = 8
"""Each thread draws into sums of its own, which are added up for every picture."""
PIECE = 256
"""Hairs that a thread shades at a time, at least."""
FARTHEST = 100.0
"""Guide coordinates are clamped to this, metres from the head's origin."""
EDGE = 3
"""Margin around the outermost points for the width of strokes, pixels."""


class SoftHairPass:
    """The hair's arrays and the compiled passes that draw it; the CPU twin of `HairPass`."""

    def __init__(self, gl: Renderer, body: HairBody) -> None:
        self._gl = gl
        self.body = body
        count, points = len(body), body.points_each
        self._places = np.empty((count, points, 3), np.float32)
        self._seen = np.empty((count, points, 4), np.float32)
        self._looks = np.zeros((count, points, 4), np.float32)
        self._reach = np.empty((count, 2), np.float32)
        self._random = np.asarray(strand_numbers(count), np.float32)
        self._rest = np.ascontiguousarray(body.guide_rest, np.float32)
        self._tones = shade_kernels.tone_table()
        self._chunks = min(thread_count(), MOST_CHUNKS)
        self._sums = np.zeros((0, 4), np.float32)
        self._colours: tuple[object, Float32Array] | None = None
        self._texture: moderngl.Texture | None = None
        lay = gl.program("viewer_screen", "viewer_composite")
        self._composite_quad = gl.context.vertex_array(lay, [])

    def release(self) -> None:
        """Free all GPU objects."""
        self._composite_quad.release()
        if self._texture is not None:
            self._texture.release()

    def places(self) -> Float32Array:
        """Return the last positions (S, m, 3) of the hair, head frame, metres."""
        return self._places

    def move_guides(self, rows: Float32Array) -> Float32Array:
        """Move the guides to `rows` (G, m, 3), head frame, metres; return them as points (N, 3)."""
        # compiled loops do not check bounds: replace NaN and infinity of a diverged simulation
        tame = np.nan_to_num(np.clip(rows, -FARTHEST, FARTHEST))
        self._now = np.ascontiguousarray(tame, np.float32)
        self._turns = place_kernels.guide_turns(self._rest, self._now)
        return self._now.reshape(-1, 3)

    def place(self, view: HairView, look: HairLook) -> None:
        """Interpolate the hair from the guides and accumulate its opacity by depth."""
        body, camera = self.body, view.camera
        self._camera = pack_camera(view)
        near, far = view.hair_depth.near, view.hair_depth.far
        per_metre = place_kernels.SLICES / (far - near)
        self._slices = np.array([near, per_metre, look.dimming], np.float32)
        tiles = (-(-camera.height // place_kernels.TILE), -(-camera.width // place_kernels.TILE))
        filled = np.empty((self._chunks, place_kernels.SLICES, *tiles), np.uint32)
        corners = np.empty((self._chunks, 4), np.float32)
        chunks = self._chunks
        parallel_for(
            place_kernels.place_hair,
            chunks,
            self._now,
            self._turns,
            body.followed,
            body.weights,
            body.offsets,
            body.widths,
            self._camera,
            self._slices,
            np.float32(look.times_wider),
            look.hairs,
            self._places,
            self._seen,
            filled,
            corners,
        )
        self._opacity = np.empty((place_kernels.SLICES + 1, *tiles), np.float32)
        parallel_for(place_kernels.accumulate_opacity, tiles[0], filled, self._opacity, min_chunk=8)
        size = np.array([camera.width, camera.height])
        low = np.clip(np.floor(corners[:, :2].min(axis=0)) - EDGE, 0, size - 1)
        high = np.clip(np.ceil(corners[:, 2:].max(axis=0)) + EDGE, low + 1, size)
        self._frame = low.astype(np.int64), (high - low).astype(np.int64)

    def draw(self, scene: HairScene) -> None:
        """Draw the hair over the picture, behind nearer meshes."""
        view, look = scene.view, scene.look
        (x, y), (width, height) = self._frame[0].tolist(), self._frame[1].tolist()
        frame = (x, y, width, height)
        depth = scene.solids.read(frame, components=1, attachment=-1, alignment=1, dtype="f4")
        solid = np.ascontiguousarray(np.frombuffer(depth, np.float32).reshape(height, width).T)
        corner = self._frame[0].astype(np.float32)
        if len(self._sums) < width * height:
            self._sums = np.zeros((view.camera.width * view.camera.height, 4), np.float32)
        wider = np.float32(look.times_wider)
        shading = shade_kernels.pack_shading(
            view.camera, scene.lights, scene.light.grid, direction=look.by_direction
        )
        parallel_for(
            shade_kernels.shade_hair,
            look.hairs,
            self._seen,
            self._places,
            self._fibres(look),
            self._random,
            self._opacity,
            self._slices,
            shading,
            scene.light.array,
            self._tones,
            solid,
            corner,
            self._beside(view, float(wider)),
            self._looks,
            self._reach,
            min_chunk=PIECE,
        )
        parallel_for(
            raster_kernels.draw_hair,
            -(-width // raster_kernels.STRIP),
            self._seen,
            self._looks,
            self._reach,
            self.body.widths,
            solid,
            self._camera,
            wider,
            int(look.smooth),
            look.hairs,
            corner,
            self._sums,
        )
        picture = np.empty((height, width, 4), np.uint8)
        parallel_for(raster_kernels.resolve, height, self._sums, picture, min_chunk=32)
        self._composite(scene.target, picture, frame)

    def _composite(
        self, target: moderngl.Framebuffer, picture: object, frame: tuple[int, int, int, int]
    ) -> None:
        context, size = self._gl.context, target.size
        if self._texture is None or self._texture.size != size:
            if self._texture is not None:
                self._texture.release()
            self._texture = context.texture(size, 4)
            self._texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._texture.write(picture, viewport=frame)
        target.use()
        target.scissor = frame
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        self._texture.use(5)
        set_uniforms(self._gl.program("viewer_screen", "viewer_composite"), u_hair=5)
        self._composite_quad.render(moderngl.TRIANGLES, vertices=3)
        target.scissor = (0, 0, *size)

    def _beside(self, view: HairView, wider: float) -> np.float32:
        """Return how far a stroke may reach beside its ends, pixels."""
        scale = view.camera.focal
        if view.camera.model == "perspective":
            scale /= max(view.hair_depth.near, NEAREST)
        widest = float(self.body.widths.max(initial=0.0)) * wider * scale
        return np.float32(min(widest, raster_kernels.WIDEST) + 1)

    def _fibres(self, look: HairLook) -> Float32Array:
        key = (look.root_colour, look.tip_colour)
        if self._colours is None or self._colours[0] != key:
            made = shade_kernels.fibre_colours(*key, self._random, self.body.points_each)
            self._colours = (key, made)
        return self._colours[1]


def pack_camera(view: HairView) -> Float32Array:
    """Return (24,): clip_from_head by rows, forward and offset, size, focal length, perspective."""
    camera = view.camera
    matrix = clip_from_camera(camera, view.depth) @ camera.camera_from_head
    rest = [
        *camera.forward, camera.translation[2], camera.width, camera.height, camera.focal,
        float(camera.model == "perspective"),
    ]  # fmt: skip
    return np.concatenate([matrix.ravel(), rest]).astype(np.float32)
