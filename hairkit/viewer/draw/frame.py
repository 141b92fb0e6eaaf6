"""Draw one frame offscreen: backdrop, meshes, hair, overlays."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import moderngl
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange
from hairkit.rendering.head import Solid
from hairkit.rendering.light import Lights
from hairkit.rendering.picture import HEAD_PUSH
from hairkit.rendering.skin_passes import draw_skin
from hairkit.simulation.rigid_motion import inverse_motion
from hairkit.types.camera import Camera
from hairkit.types.skin_look import SkinLook
from hairkit.viewer.draw.hair_cpu import SoftHairPass
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.hair_gpu import HairPass
from hairkit.viewer.draw.interface import HairDrawer, HairLook, HairScene, HairView
from hairkit.viewer.draw.light_cpu import SoftLightPass
from hairkit.viewer.draw.light_gpu import LightPass
from hairkit.viewer.draw.lines import Billboard, BillboardPass, LineSet, draw_lines
from hairkit.viewer.draw.meshes import SolidPass
from hairkit.viewer.draw.studio import StudioPass

KEY = (-0.45, 0.6, 0.75)
"""Direction towards the key light, camera axes: right, up, back."""
RIM = (0.55, 0.6, -0.55)
"""Direction towards the rim light, same axes."""
EDGE_SAMPLES = 4
"""Samples of a pixel at the edges of meshes on graphics cards. Software renderers take longer for
them than for the picture; there edges are smooth once the picture is refined."""
FIXED_SOLIDS = ("torso",)
"""Meshes that do not move with the head."""
DEPTH_STEP, DEPTH_MARGIN = 0.25, 0.025
"""Metres: steps of the depth range, and what it has beyond the farthest point at least."""
PULL = 0.002
"""Depth bias of overlaid lines, as a share of the depth range: skin does not hide them."""


@dataclass(frozen=True)
class FrameInputs:
    """The inputs of one frame, apart from what stays on the GPU."""

    camera: Camera
    """World frame, at the size of the frame."""
    world_from_head: Float64Array
    """(4, 4) pose of the head."""
    guide_rows: Float32Array | None
    """(G, m, 3) guides, head frame, metres; None: as before."""
    hair: HairLook | None
    """None: no hair."""
    show_head: bool = True
    floor: float = -0.4
    """Height of the floor, world, metres."""
    exposure: float = 0.75
    light_turn: float = 0.0
    """Angle by which the lights are turned round the head, radians."""
    backdrop: str = "grey"
    """One of `studio.BACKDROPS`."""
    whole_light: bool = False
    """True updates the whole light volume in this frame, for still pictures."""
    same_light: bool = False
    """True leaves the light volume as it is, for another sample of a still picture."""
    fine_skin: bool = False
    """True diffuses the light in skin and draws all its maps, for still pictures."""
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
    _reaches: dict[str, float] = field(default_factory=dict)
    """Farthest vertex of each solid from the middle of the head, metres."""
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
        self._studio = StudioPass(self.gl)
        self._backdrop_made: object = None
        self._scenery_made: object = None

    def release(self) -> None:
        """Free all GPU objects."""
        parts: list[Any] = [self.hair, self._light, self._head, *self._solids.values()]
        for part in [*parts, *self._billboards.values(), self._studio]:
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
        off = solid.vertices - self._head_room[0]
        self._reaches[name] = float(np.linalg.norm(off, axis=1).max())

    def upload_billboard(self, name: str, board: Billboard) -> None:
        """Upload a billboard that frames refer to by name."""
        if name in self._billboards:
            self._billboards[name].release()
        self._billboards[name] = BillboardPass(self.gl, board)

    def draw(self, inputs: FrameInputs) -> None:
        """Draw a frame; `read` and `texture` return it until the next one."""
        self._resize((inputs.camera.width, inputs.camera.height))
        own = _camera_in_head(inputs.camera, inputs.world_from_head)
        lights = studio_lights(own, inputs.exposure, inputs.light_turn)
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
        if self._fresh or not inputs.same_light:
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

    def write(self, picture: UInt8Array, left: int = 0, top: int = 0) -> None:
        """Put a picture (H, W, 3) RGB over a part of the frame."""
        height, width = picture.shape[:2]
        opaque = cv2.cvtColor(picture, cv2.COLOR_RGB2RGBA)
        self.texture.write(opaque, viewport=(left, top, width, height))

    def _depth(self, inputs: FrameInputs, own: Camera) -> DepthRange:
        """Return a depth range in coarse steps, so that frames can reuse the scenery."""
        middle, size = self._head_room
        off = self.cloud - middle.astype(np.float32)
        farthest = max(size, float(np.sqrt(np.einsum("pc,pc->p", off, off).max())))
        farthest = max([farthest, *(self._reaches[name] for name in inputs.solids)])
        reach = farthest + DEPTH_MARGIN + (0.6 if inputs.billboards or inputs.lines else 0)
        centre = float(own.depth(middle))
        near, far = np.floor((centre - reach) / DEPTH_STEP), np.ceil((centre + reach) / DEPTH_STEP)
        return DepthRange(max(DEPTH_STEP * float(near), 0.01), DEPTH_STEP * float(far))

    def _draw_backdrop(
        self, inputs: FrameInputs, own: Camera, depth: DepthRange, lighting: dict[str, Any]
    ) -> None:
        """Draw scenery and meshes if they or the light changed."""
        scenery = (self._light.shown, _scenery_key(inputs, depth))
        key = (scenery, inputs.world_from_head.tobytes(), inputs.show_head, inputs.solids)
        if key == self._backdrop_made:
            return
        self._backdrop_made = key
        fixed, moving = self._parts(inputs)
        if scenery != self._scenery_made:
            self._scenery_made = scenery
            self._studio.draw(self._scenery, inputs.camera, inputs.floor, inputs.backdrop)
            self._scenery_depths.clear(depth=1.0)
            self._scenery.use()
            self._draw_meshes(fixed, inputs, own, depth, lighting)
        self.gl.context.copy_framebuffer(self._samples, self._scenery)
        self._samples.use()
        self._draw_meshes(moving, inputs, own, depth, lighting)
        if self._sample_buffers:
            self.gl.context.copy_framebuffer(self._backdrop, self._samples)  # averages the samples

    def _parts(self, inputs: FrameInputs) -> tuple[list[SolidPass], list[SolidPass]]:
        """Return the meshes of the scenery, which stay when the head moves, and the others.

        Where light is diffused in skin, all are drawn at once and none belongs to the scenery.
        """
        fixed = [] if inputs.fine_skin else [n for n in inputs.solids if n in FIXED_SOLIDS]
        head = [self._head] if inputs.show_head else []
        moving = [self._solids[name] for name in inputs.solids if name not in fixed]
        return [self._solids[name] for name in fixed], head + moving

    def _draw_meshes(
        self,
        parts: list[SolidPass],
        inputs: FrameInputs,
        own: Camera,
        depth: DepthRange,
        lighting: dict[str, Any],
    ) -> None:
        """Draw meshes into the frame buffer in use; the neck bends between head and torso."""
        fixed = [name for name in FIXED_SOLIDS if name in inputs.solids]
        head_from_torso = inverse_motion(inputs.world_from_head) @ inputs.world_from_torso
        for part in parts:
            if part is self._head:
                part.place(head_from_torso if fixed else np.eye(4))
            elif any(part is self._solids[name] for name in fixed):
                part.place(head_from_torso)
        if inputs.fine_skin and parts:
            eye = {"u_eye": tuple(own.position.tolist())}
            solids, maps = [part.placed() for part in parts], [part.maps for part in parts]
            look, lit = SkinLook(), {**lighting, **eye}
            draw_skin(self.gl, solids, maps, own, depth, HEAD_PUSH, look, lit)
            return
        self.gl.context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        self.gl.context.cull_face = (
            "front"  # the picture is drawn upside down, which swaps the winding
        )
        for part in parts:
            part.draw(own, depth, HEAD_PUSH if part is self._head else 0.0, lighting)
        self.gl.context.cull_face = "back"

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
        self._backdrop_texture = context.texture(size, 4)
        self._depth_texture = context.depth_texture(size)
        self._depth_texture.compare_func = ""
        self._depth_texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        colour: Any = self._backdrop_texture
        depth: Any = self._depth_texture
        self._backdrop = context.framebuffer([colour], depth)
        samples = 0 if self.soft else min(EDGE_SAMPLES, context.max_samples)
        self._sample_buffers: tuple[moderngl.Renderbuffer, ...] = ()
        if samples:
            colour = context.renderbuffer(size, 4, samples=samples)
            depth = context.depth_renderbuffer(size, samples=samples)
            self._sample_buffers = colour, depth
        self._samples = context.framebuffer([colour], depth)
        colour = context.renderbuffer(size, 4, samples=samples)
        depth = context.depth_renderbuffer(size, samples=samples)
        self._scenery_buffers = colour, depth
        self._scenery = context.framebuffer([colour], depth)
        self._scenery_depths = context.framebuffer([], depth)
        self.texture = context.texture(size, 4)
        self.framebuffer = context.framebuffer([self.texture])
        self._overlaid = context.framebuffer([self.texture], self._depth_texture)
        self._size = size
        self._backdrop_made = self._scenery_made = None

    def _release_targets(self) -> None:
        if self._size == (0, 0):
            return
        parts: list[Any] = [self.framebuffer, self._overlaid, self._backdrop, self._samples]
        parts += [self._scenery, self._scenery_depths, *self._scenery_buffers]
        parts += [self.texture, self._backdrop_texture, self._depth_texture]
        for part in [*parts, *self._sample_buffers]:
            part.release()
        self._size = (0, 0)


def studio_lights(camera: Camera, exposure: float, turn: float = 0.0) -> Lights:
    """Return lights fixed to a camera: key above on the left, rim behind on the right.

    They are turned about the picture's vertical by `turn` radians, from above to the right.
    """
    x, y, z = camera.rotation[0], -camera.rotation[1], -camera.rotation[2]
    cosine, sine = np.cos(turn), np.sin(turn)
    axes = np.stack([cosine * x - sine * z, y, cosine * z + sine * x])
    return Lights.studio(np.array(KEY) @ axes, np.array(RIM) @ axes, exposure)


def _camera_in_head(camera: Camera, world_from_head: Float64Array) -> Camera:
    """Return a camera of the world in the head frame."""
    return replace(camera, camera_from_head=camera.camera_from_head @ world_from_head)


def _hair_depth(camera: Camera, cloud: Float32Array) -> DepthRange:
    depth = camera.depth(cloud)
    return DepthRange(float(depth.min()) - 0.005, float(depth.max()) + 0.005)


def _scenery_key(inputs: FrameInputs, depth: DepthRange) -> tuple[object, ...]:
    """Return what studio and fixed meshes are drawn from."""
    camera = inputs.camera
    return (
        camera.camera_from_head.tobytes(),
        (camera.focal, camera.width, camera.height),
        camera.centre.tobytes(),
        inputs.world_from_torso.tobytes(),
        tuple(name for name in inputs.solids if name in FIXED_SOLIDS),
        (inputs.floor, inputs.exposure),
        (inputs.light_turn, inputs.backdrop, inputs.fine_skin),
        depth,
    )
