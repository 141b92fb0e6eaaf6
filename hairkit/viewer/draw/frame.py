"""Draw one frame offscreen: backdrop, meshes, hair, overlays."""

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
from hairkit.simulation.rigid_motion import inverse_motion
from hairkit.types.camera import Camera
from hairkit.viewer.draw.hair_cpu import SoftHairPass
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.hair_gpu import HairPass
from hairkit.viewer.draw.interface import GuidePlaces, HairDrawer, HairLook, HairScene, HairView
from hairkit.viewer.draw.light_cpu import SoftLightPass
from hairkit.viewer.draw.light_gpu import TURNS, LightPass
from hairkit.viewer.draw.lines import Billboard, BillboardPass, LineSet, draw_lines
from hairkit.viewer.draw.meshes import SolidPass

KEY = (-0.45, 0.6, 0.75)
"""Direction towards the key light, camera axes: right, up, back."""
RIM = (0.55, 0.6, -0.55)
"""Direction towards the rim light, same axes."""
STUDIO_SIZE = (160, 90)
"""Pixels of the studio picture, which is smooth and is scaled up to the frame."""
FIXED_SOLIDS = ("torso",)
"""Meshes that do not move with the head."""
PULL = 0.002
"""Depth bias of overlaid lines, as a share of the depth range: skin does not hide them."""


@dataclass(frozen=True)
class FrameInputs:
    """The inputs of one frame, apart from what stays on the GPU."""

    camera: Camera
    """World frame, at the size of the frame."""
    world_from_head: Float64Array
    """(4, 4) pose of the head."""
    guide_rows: GuidePlaces | None
    """(G, m, 3) guides, head frame: an array or, on the GPU, a moderngl buffer; None: as before."""
    hair: HairLook | None
    """None: no hair."""
    show_head: bool = True
    floor: float = -0.4
    """Height of the floor, world, metres."""
    exposure: float = 0.75
    whole_light: bool = False
    """True updates the whole light volume in this frame, for still pictures."""
    lines: tuple[tuple[LineSet, bool], ...] = ()
    """Line sets, and for each whether it moves with the head."""
    billboards: tuple[str, ...] = ()
    """Names of the billboards to draw."""
    billboard_opacity: float = 1.0
    solids: tuple[str, ...] = ()
    """Names of the other meshes to draw."""
    world_from_torso: Float64Array = field(default_factory=lambda: np.eye(4))
    """(4, 4) motion since rest of meshes that do not move with the head."""


@dataclass
class FrameRenderer:
    """Frame buffers and render passes; use it inside `renderer()` only."""

    gl: Renderer
    head: Solid
    body: HairBody
    soft: bool | None = None
    """True draws hair on the CPU, False on the GPU; None: CPU for software renderers."""
    _size: tuple[int, int] = (0, 0)
    _solids: dict[str, SolidPass] = field(default_factory=dict)
    _billboards: dict[str, BillboardPass] = field(default_factory=dict)

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
        self._studio_upscale_quad, self._studio_quad = (
            self.gl.context.vertex_array(self.gl.program("viewer_screen", fragment), [])
            for fragment in ("viewer_backdrop", "viewer_studio")
        )
        self._small_studio_texture = self.gl.context.texture(STUDIO_SIZE, 4, dtype="f2")
        self._small_studio_texture.repeat_x = self._small_studio_texture.repeat_y = False
        self._small_studio = self.gl.context.framebuffer([self._small_studio_texture])
        self._studio_made: object = None
        self._backdrop_made: object = None
        self._age = 0

    def release(self) -> None:
        """Free all GPU objects."""
        parts: list[Any] = [self.hair, self._light, self._head, *self._solids.values()]
        parts += [*self._billboards.values(), self._studio_upscale_quad, self._studio_quad]
        for part in [*parts, self._small_studio, self._small_studio_texture]:
            part.release()
        self._release_targets()

    def replace_body(self, body: HairBody) -> None:
        """Replace the hair."""
        self.hair.release()
        self.body = body
        self.hair = self._drawer(body)
        self._fresh = True

    def upload_solid(self, name: str, solid: Solid) -> None:
        """Upload a mesh that frames refer to by name."""
        if name in self._solids:
            self._solids[name].release()
        self._solids[name] = SolidPass(self.gl, solid, by_vertex=bool(self.soft))

    def upload_billboard(self, name: str, board: Billboard) -> None:
        """Upload a billboard that frames refer to by name."""
        if name in self._billboards:
            self._billboards[name].release()
        self._billboards[name] = BillboardPass(self.gl, board)

    def draw(self, inputs: FrameInputs) -> None:
        """Draw a frame; `read` and `texture` return it until the next one."""
        self._resize((inputs.camera.width, inputs.camera.height))
        own = _camera_in_head(inputs.camera, inputs.world_from_head)
        lights = studio_lights(own, inputs.exposure)
        lighting = {**lights.uniforms(), **self._light.uniforms()}
        if inputs.guide_rows is not None or self._fresh:
            rows = self.body.guide_rest if inputs.guide_rows is None else inputs.guide_rows
            self.cloud = self.hair.move_guides(rows)
            """(N, 3) points that bound the guides, head frame."""
        depth = self._depth(inputs, own)
        view = HairView(own, depth, _hair_depth(own, self.cloud))
        if inputs.hair is not None:
            self.hair.place(view, inputs.hair)
        hairs = 0 if inputs.hair is None else inputs.hair.hairs
        whole = inputs.whole_light or self._fresh
        self._light.update(self.hair, hairs, lights, whole=whole)
        self._fresh = False
        self._light.texture.use(0)
        self._draw_backdrop(inputs, own, depth, lighting)
        self.gl.context.copy_framebuffer(self.framebuffer, self._backdrop)
        if inputs.hair is not None:
            parts = self._backdrop, self._depth_texture, self.framebuffer
            self.hair.draw(HairScene(view, inputs.hair, lights, self._light, *parts))
        self._draw_overlays(inputs, own, depth)
        self.gl.home.use()

    def _drawer(self, body: HairBody) -> HairDrawer:
        return SoftHairPass(self.gl, body) if self.soft else HairPass(self.gl, body)

    def read(self) -> UInt8Array:
        """Return the frame (H, W, 3) RGB."""
        data = self.framebuffer.read(components=3, alignment=1)
        shape = (self._size[1], self._size[0], 3)
        return np.frombuffer(data, np.uint8).reshape(shape)

    def _depth(self, inputs: FrameInputs, own: Camera) -> DepthRange:
        """Return a depth range in coarse steps, so that frames can reuse the backdrop."""
        middle, size = self._head_room
        off = self.cloud - middle.astype(np.float32)
        farthest = max(size, float(np.sqrt(np.einsum("pc,pc->p", off, off).max())))
        radius = np.ceil(farthest / 0.25 + 0.1) * 0.25 + (
            0.6 if inputs.billboards or inputs.lines else 0
        )
        centre = float(own.depth(middle))
        return DepthRange(max(centre - radius, 0.01), centre + radius)

    def _draw_backdrop(
        self, inputs: FrameInputs, own: Camera, depth: DepthRange, lighting: dict[str, Any]
    ) -> None:
        """Draw studio and meshes if they changed, or every `TURNS` frames for the light on them."""
        key = _backdrop_key(inputs, depth)
        self._age += 1
        if key == self._backdrop_made and self._age < TURNS and not inputs.whole_light:
            return
        self._backdrop_made, self._age = key, 0
        self._draw_studio(inputs)
        self.gl.context.copy_framebuffer(self._backdrop, self._studio)
        self._depths.clear(depth=1.0)
        self._backdrop.use()
        self.gl.context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self.gl.context.cull_face = (
            "front"  # the picture is drawn upside down, which swaps the winding
        )
        if inputs.show_head:
            self._head.draw(own, depth, HEAD_PUSH, lighting)
        for name in inputs.solids:
            if name in FIXED_SOLIDS:
                head_from_world = inverse_motion(inputs.world_from_head)
                self._solids[name].place(head_from_world @ inputs.world_from_torso)
            self._solids[name].draw(own, depth, 0.0, lighting)
        self.gl.context.cull_face = "back"

    def _draw_studio(self, inputs: FrameInputs) -> None:
        """Draw the studio at low resolution and scale it up, only if the camera has changed."""
        camera = inputs.camera.resized(*STUDIO_SIZE)
        key = (camera.camera_from_head.tobytes(), camera.focal, inputs.floor)
        if key == self._studio_made:
            return
        self._studio_made = key
        self._small_studio.use()
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
            u_floor=inputs.floor,
            u_shadow_radius=0.35,
        )
        self._studio_quad.render(moderngl.TRIANGLES, vertices=3)
        self._studio.use()
        self._small_studio_texture.use(4)
        spread = self.gl.program("viewer_screen", "viewer_backdrop")
        set_uniforms(spread, u_studio=4, u_size=self._size)
        self._studio_upscale_quad.render(moderngl.TRIANGLES, vertices=3)

    def _draw_overlays(self, inputs: FrameInputs, own: Camera, depth: DepthRange) -> None:
        if not inputs.lines and not inputs.billboards:
            return
        context = self.gl.context
        self._overlaid.use()
        self._overlaid.depth_mask = False
        context.enable_only(moderngl.DEPTH_TEST | moderngl.BLEND)
        context.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
        for name in inputs.billboards:
            self._billboards[name].draw(inputs.camera, depth, inputs.billboard_opacity)
        for lines, moving in inputs.lines:
            if len(lines.points):
                draw_lines(self.gl, lines, own if moving else inputs.camera, depth, PULL)

    def _resize(self, size: tuple[int, int]) -> None:
        if size == self._size:
            return
        self._release_targets()
        context = self.gl.context
        self._studio_texture = context.texture(size, 4)
        self._studio = context.framebuffer([self._studio_texture])
        self._backdrop_texture = context.texture(size, 4)
        self._depth_texture = context.depth_texture(size)
        self._depth_texture.compare_func = ""
        self._depth_texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._backdrop = context.framebuffer([self._backdrop_texture], self._depth_texture)
        self._depths = context.framebuffer([], self._depth_texture)
        self.texture = context.texture(size, 4)
        self.framebuffer = context.framebuffer([self.texture])
        self._overlaid = context.framebuffer([self.texture], self._depth_texture)
        self._size = size
        self._backdrop_made = self._studio_made = None

    def _release_targets(self) -> None:
        if self._size == (0, 0):
            return
        for part in (self.framebuffer, self._overlaid, self._backdrop, self._studio, self._depths):
            part.release()
        for texture in (
            self.texture,
            self._backdrop_texture,
            self._studio_texture,
            self._depth_texture,
        ):
            texture.release()
        self._size = (0, 0)


def studio_lights(camera: Camera, exposure: float) -> Lights:
    """Return lights fixed to a camera: key above on the left, rim behind on the right."""
    x, y, z = camera.rotation[0], -camera.rotation[1], -camera.rotation[2]
    axes = np.stack([x, y, z])
    return Lights.studio(np.array(KEY) @ axes, np.array(RIM) @ axes, exposure)


def _camera_in_head(camera: Camera, world_from_head: Float64Array) -> Camera:
    """Return a camera of the world in the head frame."""
    return replace(camera, camera_from_head=camera.camera_from_head @ world_from_head)


def _hair_depth(camera: Camera, cloud: Float32Array) -> DepthRange:
    depth = camera.depth(cloud)
    return DepthRange(float(depth.min()) - 0.005, float(depth.max()) + 0.005)


def _backdrop_key(inputs: FrameInputs, depth: DepthRange) -> tuple[object, ...]:
    camera = inputs.camera
    return (
        camera.camera_from_head.tobytes(),
        (camera.focal, camera.width, camera.height),
        inputs.world_from_head.tobytes(),
        (inputs.show_head, inputs.solids, inputs.floor, inputs.exposure),
        depth,
    )


def _intrinsics(camera: Camera) -> Float64Array:
    x, y = camera.centre
    return np.array([[camera.focal, 0, x], [0, camera.focal, y], [0, 0, 1]])
