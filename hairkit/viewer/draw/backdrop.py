"""The backdrop of the head: a wall, and a floor with the soft shadow of head and shoulders."""

from __future__ import annotations

import moderngl
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import set_uniforms
from hairkit.rendering.picture import BACKDROP_BOTTOM, BACKDROP_TOP
from hairkit.types.camera import Camera

BACKDROPS = {
    "grey": (BACKDROP_TOP, BACKDROP_BOTTOM),
    "white": ((246, 246, 246), (252, 252, 252)),
    "dark": ((22, 24, 28), (52, 55, 60)),
    "warm": ((112, 96, 84), (176, 158, 142)),
    "green": ((0, 177, 64), (0, 177, 64)),
}
"""sRGB of the wall at its top and at the floor; green is for keying and has no shadow."""
SIZE = (160, 90)
"""Pixels of the studio picture, which is smooth and is scaled up to the frame."""
SHADOW_RADIUS = 0.35
"""Metres from the middle of the shadow at which it has faded."""


class BackdropPass:
    """Draws the backdrop at low resolution and scales it up to a frame."""

    def __init__(self, gl: Renderer) -> None:
        self._gl = gl
        self._wide, self._fine = (
            gl.context.vertex_array(gl.program("viewer_screen", fragment), [])
            for fragment in ("viewer_backdrop", "viewer_studio")
        )
        self._texture = gl.context.texture(SIZE, 4, dtype="f2")
        self._texture.repeat_x = self._texture.repeat_y = False
        self._small = gl.context.framebuffer([self._texture])
        self._full: moderngl.Framebuffer | None = None
        self._made: object = None
        self._read: UInt8Array | None = None

    def release(self) -> None:
        """Free all GPU objects."""
        for part in (self._wide, self._fine, self._small, self._texture):
            part.release()
        self._release_full()

    def _release_full(self) -> None:
        if self._full is not None:
            self._full.color_attachments[0].release()
            self._full.release()
            self._full = None

    def draw(self, target: moderngl.Framebuffer, full: Camera, floor: float, backdrop: str) -> None:
        """Fill `target`, the picture of a camera `full` in the world, of the same size.

        What is the same as before is copied, which is much faster on software renderers.
        """
        self._gl.context.copy_framebuffer(target, self._update(full, floor, backdrop))

    def read(self, full: Camera, floor: float, backdrop: str) -> UInt8Array:
        """Return the studio (H, W, 4) as a camera in the world sees it, RGBA."""
        before = self._made
        drawn = self._update(full, floor, backdrop)
        if self._read is None or before != self._made:
            pixels = np.frombuffer(drawn.read(components=4, alignment=1), np.uint8)
            self._read = pixels.reshape(full.height, full.width, 4)
        return self._read

    def _update(self, full: Camera, floor: float, backdrop: str) -> moderngl.Framebuffer:
        """Return the studio, drawn anew if camera or studio changed."""
        key = (full.camera_from_head.tobytes(), full.focal, full.centre.tobytes(), floor, backdrop)
        size = full.width, full.height
        if self._full is None or (size, key) != self._made:
            self._made = size, key
            self._full = self._draw_full(size, full.resized(*SIZE), floor, backdrop)
        return self._full

    def _draw_full(
        self, size: tuple[int, int], small: Camera, floor: float, backdrop: str
    ) -> moderngl.Framebuffer:
        context = self._gl.context
        context.enable_only(moderngl.NOTHING)
        self._draw_small(small, floor, backdrop)
        if self._full is None or self._full.size != size:
            self._release_full()
        full = self._full or context.framebuffer([context.texture(size, 4)])
        full.use()
        self._texture.use(4)
        spread = self._gl.program("viewer_screen", "viewer_backdrop")
        set_uniforms(spread, u_studio=4, u_size=size)
        self._wide.render(moderngl.TRIANGLES, vertices=3)
        return full

    def _draw_small(self, camera: Camera, floor: float, backdrop: str) -> None:
        self._small.use()
        top, bottom = BACKDROPS[backdrop]
        shares = np.diag([camera.width, camera.height, 1.0])
        x, y = camera.centre
        lens = np.array([[camera.focal, 0, x], [0, camera.focal, y], [0, 0, 1]])
        rays = camera.rotation.T @ np.linalg.inv(lens) @ shares
        set_uniforms(
            self._gl.program("viewer_screen", "viewer_studio"),
            u_size=SIZE,
            u_eye=tuple(camera.position.tolist()),
            u_ray_from_place=tuple(rays.T.ravel().tolist()),
            u_wall_top=tuple(c / 255 for c in top),
            u_wall_bottom=tuple(c / 255 for c in bottom),
            u_floor=floor,
            u_shadow_radius=SHADOW_RADIUS,
            u_shaded=float(top != bottom),
        )
        self._fine.render(moderngl.TRIANGLES, vertices=3)
