"""Draws what a session shows into a frame buffer of its own, offscreen, window or not."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import moderngl
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_uniforms
from hairkit.rendering.head import Solid
from hairkit.rendering.light import Lights
from hairkit.rendering.picture import BACKDROP_BOTTOM, BACKDROP_TOP, HEAD_PUSH
from hairkit.types.camera import Camera
from hairkit.viewer.draw.hair_cpu import SoftHairPass
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.hair_gpu import HairPass
from hairkit.viewer.draw.interface import GuidePlaces, HairDrawer, HairLook, HairScene, HairView
from hairkit.viewer.draw.light_cpu import SoftLightPass
from hairkit.viewer.draw.light_gpu import TURNS, LightPass
from hairkit.viewer.draw.lines import Board, BoardPass, LineSet, draw_lines
from hairkit.viewer.draw.meshes import SolidPass

KEY = (-0.45, 0.6, 0.75)
"""Towards the key light, camera axes: right, up, back."""
RIM = (0.55, 0.6, -0.55)
STUDIO_SIZE = (160, 90)
"""Pixels of the studio's picture, which is smooth and spread over the whole."""
STANDING = ("torso",)
"""Solids that stay in the world when the head moves."""
PULL = 0.002
"""Overlaid lines are drawn this share of the depth range nearer, so that skin does not cut them."""


@dataclass(frozen=True)
class Shot:
    """Everything that makes one picture, apart from what stays on the GPU."""

    camera: Camera
    """Of the world, at the picture's size."""
    world_from_head: Float64Array
    """(4, 4) where the head is."""
    guide_rows: GuidePlaces | None
    """(G, m, 3) present guides, head frame, an array or, drawn by shaders, a moderngl buffer; None
    where they are since the last picture."""
    hair: HairLook | None
    """None draws no hair."""
    show_head: bool = True
    floor: float = -0.4
    """Height of the floor, world, metres."""
    exposure: float = 0.75
    whole_light: bool = False
    """True: the light volume is brought up to date at once, for stills."""
    lines: tuple[tuple[LineSet, bool], ...] = ()
    """Lines in the world, and whether they move with the head."""
    boards: tuple[str, ...] = ()
    """Names of the boards shown."""
    board_opacity: float = 1.0
    solids: tuple[str, ...] = ()
    """Names of the other solids shown."""


@dataclass
class Stage:
    """Frame buffers and passes; used inside `renderer()` only."""

    gl: Renderer
    head: Solid
    body: HairBody
    soft: bool | None = None
    """True draws hair on the processor, False by shaders; None: what suits the renderer."""
    _size: tuple[int, int] = (0, 0)
    _solids: dict[str, SolidPass] = field(default_factory=dict)
    _boards: dict[str, BoardPass] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.soft is None:
            self.soft = self.gl.software
        self.hair = self._drawer(self.body)
        volume = SoftLightPass if self.soft else LightPass
        self._light = volume(self.gl, self.body.guides, [self.head])
        self._head = SolidPass(self.gl, self.head, by_vertex=self.soft)
        low, high = self.head.vertices.min(axis=0), self.head.vertices.max(axis=0)
        middle = np.asarray((low + high) / 2, np.float64)
        size = float(np.linalg.norm(self.head.vertices - middle, axis=1).max())
        self._head_room = middle, size
        self._fresh = True
        self._spread, self._backdrop = (
            self.gl.context.vertex_array(self.gl.program("viewer_screen", fragment), [])
            for fragment in ("viewer_backdrop", "viewer_studio")
        )
        self._sketch_texture = self.gl.context.texture(STUDIO_SIZE, 4, dtype="f2")
        self._sketch_texture.repeat_x = self._sketch_texture.repeat_y = False
        self._sketch = self.gl.context.framebuffer([self._sketch_texture])
        self._studio_made: object = None
        self._set_made: object = None
        self._age = 0

    def release(self) -> None:
        """Free everything on the GPU."""
        parts: list[Any] = [self.hair, self._light, self._head, *self._solids.values()]
        parts += [*self._boards.values(), self._spread, self._backdrop]
        for part in [*parts, self._sketch, self._sketch_texture]:
            part.release()
        self._release_targets()

    def replace_body(self, body: HairBody) -> None:
        """Show other hair."""
        self.hair.release()
        self.body = body
        self.hair = self._drawer(body)
        self._fresh = True

    def keep_solid(self, name: str, solid: Solid) -> None:
        """Hold a mesh that shots may show by name."""
        if name in self._solids:
            self._solids[name].release()
        self._solids[name] = SolidPass(self.gl, solid, by_vertex=bool(self.soft))

    def keep_board(self, name: str, board: Board) -> None:
        """Hold a picture that shots may show by name."""
        if name in self._boards:
            self._boards[name].release()
        self._boards[name] = BoardPass(self.gl, board)

    def draw(self, shot: Shot) -> None:
        """Draw the picture; `read` and `texture` give it until the next one."""
        self._resize((shot.camera.width, shot.camera.height))
        own = _in_head(shot.camera, shot.world_from_head)
        lights = studio_lights(own, shot.exposure)
        lighting = {**lights.uniforms(), **self._light.uniforms()}
        if shot.guide_rows is not None or self._fresh:
            rows = self.body.guide_rest if shot.guide_rows is None else shot.guide_rows
            self.cloud = self.hair.move_guides(rows)
            """(N, 3) points that stand for where the guides are, head frame."""
        depth = self._depth(shot, own)
        view = HairView(own, depth, _hair_depth(own, self.cloud))
        if shot.hair is not None:
            self.hair.place(view, shot.hair)
        hairs = 0 if shot.hair is None else shot.hair.hairs
        whole = shot.whole_light or self._fresh
        self._light.update(self.hair, hairs, lights, whole=whole)
        self._fresh = False
        self._light.texture.use(0)
        self._draw_set(shot, own, depth, lighting)
        self.gl.context.copy_framebuffer(self.framebuffer, self._set)
        if shot.hair is not None:
            parts = self._set, self._depth_texture, self.framebuffer
            self.hair.draw(HairScene(view, shot.hair, lights, self._light, *parts))
        self._draw_overlays(shot, own, depth)
        self.gl.home.use()

    def _drawer(self, body: HairBody) -> HairDrawer:
        return SoftHairPass(self.gl, body) if self.soft else HairPass(self.gl, body)

    def read(self) -> UInt8Array:
        """Return the picture (H, W, 3) RGB."""
        data = self.framebuffer.read(components=3, alignment=1)
        shape = (self._size[1], self._size[0], 3)
        return np.frombuffer(data, np.uint8).reshape(shape)

    def read_depth(self) -> Float32Array:
        """Return the depth buffer (H, W) of the solids: 1 where there are none."""
        data = self._depth_texture.read(alignment=1)
        return np.frombuffer(data, np.float32).reshape(self._size[1], self._size[0])

    def _depth(self, shot: Shot, own: Camera) -> DepthRange:
        """Return a range that changes only with the camera, so that still parts can be kept."""
        middle, size = self._head_room
        off = self.cloud - middle.astype(np.float32)
        farthest = max(size, float(np.sqrt(np.einsum("pc,pc->p", off, off).max())))
        radius = np.ceil(farthest / 0.25 + 0.1) * 0.25 + (0.6 if shot.boards or shot.lines else 0)
        centre = float(own.depth(middle))
        return DepthRange(max(centre - radius, 0.01), centre + radius)

    def _draw_set(
        self, shot: Shot, own: Camera, depth: DepthRange, lighting: dict[str, Any]
    ) -> None:
        """Draw studio and solids; what hair does to their light is brought up to date in turns."""
        key = _set_key(shot, depth)
        self._age += 1
        if key == self._set_made and self._age < TURNS and not shot.whole_light:
            return
        self._set_made, self._age = key, 0
        self._draw_studio(shot)
        self.gl.context.copy_framebuffer(self._set, self._studio)
        self._depths.clear(depth=1.0)
        self._set.use()
        self.gl.context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self.gl.context.cull_face = "front"  # pictures are drawn upside down
        if shot.show_head:
            self._head.draw(own, depth, HEAD_PUSH, lighting)
        for name in shot.solids:
            if name in STANDING:
                self._solids[name].place(np.asarray(np.linalg.inv(shot.world_from_head), float))
            self._solids[name].draw(own, depth, 0.0, lighting)
        self.gl.context.cull_face = "back"

    def _draw_studio(self, shot: Shot) -> None:
        """Draw what changes with the camera only: small, for it is smooth, and then spread."""
        camera = shot.camera.resized(*STUDIO_SIZE)
        key = (camera.camera_from_head.tobytes(), camera.focal, shot.floor)
        if key == self._studio_made:
            return
        self._studio_made = key
        self._sketch.use()
        self.gl.context.enable_only(moderngl.NOTHING)
        shares = np.diag([camera.width, camera.height, 1.0])
        rays = camera.rotation.T @ np.linalg.inv(_intrinsics(camera)) @ shares
        set_uniforms(
            self.gl.program("viewer_screen", "viewer_studio"),
            u_size=STUDIO_SIZE,
            u_eye=tuple(camera.position.tolist()),
            u_ray_from_place=tuple(rays.T.ravel().tolist()),
            u_wall_top=tuple(c / 255 for c in BACKDROP_TOP),
            u_wall_bottom=tuple(c / 255 for c in BACKDROP_BOTTOM),
            u_floor=shot.floor,
            u_shadow_radius=0.35,
        )
        self._backdrop.render(moderngl.TRIANGLES, vertices=3)
        self._studio.use()
        self._sketch_texture.use(4)
        spread = self.gl.program("viewer_screen", "viewer_backdrop")
        set_uniforms(spread, u_studio=4, u_size=self._size)
        self._spread.render(moderngl.TRIANGLES, vertices=3)

    def _draw_overlays(self, shot: Shot, own: Camera, depth: DepthRange) -> None:
        if not shot.lines and not shot.boards:
            return
        context = self.gl.context
        self._overlaid.use()
        self._overlaid.depth_mask = False
        context.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        for name in shot.boards:
            self._boards[name].draw(shot.camera, depth, shot.board_opacity)
        for lines, moving in shot.lines:
            if len(lines.points):
                draw_lines(self.gl, lines, own if moving else shot.camera, depth, PULL)

    def _resize(self, size: tuple[int, int]) -> None:
        if size == self._size:
            return
        self._release_targets()
        context = self.gl.context
        self._studio_texture = context.texture(size, 4)
        self._studio = context.framebuffer([self._studio_texture])
        self._set_texture = context.texture(size, 4)
        self._depth_texture = context.depth_texture(size)
        self._depth_texture.compare_func = ""
        self._depth_texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._set = context.framebuffer([self._set_texture], self._depth_texture)
        self._depths = context.framebuffer([], self._depth_texture)
        self.texture = context.texture(size, 4)
        self.framebuffer = context.framebuffer([self.texture])
        self._overlaid = context.framebuffer([self.texture], self._depth_texture)
        self._size = size
        self._set_made = self._studio_made = None

    def _release_targets(self) -> None:
        if self._size == (0, 0):
            return
        for part in (self.framebuffer, self._overlaid, self._set, self._studio, self._depths):
            part.release()
        for texture in (self.texture, self._set_texture, self._studio_texture, self._depth_texture):
            texture.release()
        self._size = (0, 0)


def studio_lights(camera: Camera, exposure: float) -> Lights:
    """Return lights that go with a camera, key above its left, rim behind on the right."""
    x, y, z = camera.rotation[0], -camera.rotation[1], -camera.rotation[2]
    axes = np.stack([x, y, z])
    return Lights.studio(np.array(KEY) @ axes, np.array(RIM) @ axes, exposure)


def _in_head(camera: Camera, world_from_head: Float64Array) -> Camera:
    """Return the camera of the world as the head sees it."""
    return replace(camera, camera_from_head=camera.camera_from_head @ world_from_head)


def _hair_depth(camera: Camera, cloud: Float32Array) -> DepthRange:
    depth = camera.depth(cloud)
    return DepthRange(float(depth.min()) - 0.005, float(depth.max()) + 0.005)


def _set_key(shot: Shot, depth: DepthRange) -> tuple[object, ...]:
    camera = shot.camera
    return (
        camera.camera_from_head.tobytes(),
        (camera.focal, camera.width, camera.height),
        shot.world_from_head.tobytes(),
        (shot.show_head, shot.solids, shot.floor, shot.exposure),
        depth,
    )


def _intrinsics(camera: Camera) -> Float64Array:
    x, y = camera.centre
    return np.array([[camera.focal, 0, x], [0, camera.focal, y], [0, 0, 1]])
