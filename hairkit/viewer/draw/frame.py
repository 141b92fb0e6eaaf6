"""Draw one frame offscreen: backdrop, meshes, hair, overlays."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import cv2
import moderngl
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import NEAREST, DepthRange
from hairkit.rendering.head import Solid
from hairkit.rendering.light import Lights
from hairkit.types.camera import Camera
from hairkit.viewer.draw.hair_cpu import SoftHairPass
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.hair_gpu import HairPass
from hairkit.viewer.draw.interface import FrameInputs, HairDrawer, HairScene, HairView, MeshScene
from hairkit.viewer.draw.light_cpu import SoftLightPass
from hairkit.viewer.draw.light_gpu import LightPass
from hairkit.viewer.draw.lines import Billboard, BillboardPass, draw_lines
from hairkit.viewer.draw.mesh_cpu import SoftMeshLayer
from hairkit.viewer.draw.mesh_layer import GpuMeshLayer, MeshLayer

KEY = (-0.45, 0.6, 0.75)
"""Direction towards the key light, camera axes: right, up, back."""
RIM = (0.55, 0.6, -0.55)
"""Direction towards the rim light, same axes."""
DEPTH_STEP, DEPTH_MARGIN = 0.25, 0.025
"""Metres: steps of the depth range, and what it has beyond the farthest point at least."""
AROUND, THICKNESS = 0.6, 0.005
"""Metres: how much farther lines and billboards reach, and drawn hair than its guides in depth."""
PULL = 0.002
"""Depth bias of overlaid lines, as a share of the depth range: skin does not hide them."""


@dataclass
class FrameRenderer:
    """Frame buffers and render passes; use it inside `renderer()` only."""

    gl: Renderer
    head: Solid
    body: HairBody
    soft: bool | None = None
    """True draws hair on the CPU, False on the GPU; None: CPU for software renderers."""
    _size: tuple[int, int] = (0, 0)
    _reaches: dict[str, float] = field(default_factory=dict)
    """Farthest vertex of each solid from the middle of the head, metres."""
    _billboards: dict[str, BillboardPass] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.soft is None:
            self.soft = self.gl.software
        self.hair = self._drawer(self.body)
        volume = SoftLightPass if self.soft else LightPass
        self._light = volume(self.gl, self.body.guides, [self.head])
        layer = SoftMeshLayer if self.soft else GpuMeshLayer
        self._meshes: MeshLayer[Any] = layer(self.gl, self.head)
        low, high = self.head.vertices.min(axis=0), self.head.vertices.max(axis=0)
        middle = np.asarray((low + high) / 2, np.float64)
        size = float(np.linalg.norm(self.head.vertices - middle, axis=1).max())
        self._head_room = middle, size
        self._fresh = True

    def release(self) -> None:
        """Free all GPU objects."""
        parts: list[Any] = [self.hair, self._light, self._meshes, *self._billboards.values()]
        for part in parts:
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
        self._meshes.upload(name, solid)
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
        moved = inputs.camera.camera_from_head @ inputs.world_from_head
        own = replace(inputs.camera, camera_from_head=moved)
        lights = studio_lights(own, inputs.exposure, inputs.light_turn)
        if inputs.guide_rows is not None or self._fresh:
            rows = self.body.guide_rest if inputs.guide_rows is None else inputs.guide_rows
            self.cloud = self.hair.move_guides(rows)
            """(N, 3) points that bound the guides, head frame."""
        depth = self._depth(inputs, own)
        away = own.depth(self.cloud)
        near, far = float(away.min()) - THICKNESS, float(away.max()) + THICKNESS
        view = HairView(own, depth, DepthRange(near, far))
        if inputs.hair is not None:
            self.hair.place(view, inputs.hair)
        hairs = 0 if inputs.hair is None else inputs.hair.hairs
        if self._fresh or not inputs.same_light:
            whole = inputs.whole_light or self._fresh
            self._light.update(self.hair, hairs, lights, whole=whole)
        self._fresh = False
        self._light.texture.use(0)
        self._meshes.draw(MeshScene(inputs, own, depth, lights, self._light))
        if inputs.hair is None:
            self._meshes.show(self.framebuffer)
        else:
            parts = lights, self._light, self._meshes, self.framebuffer
            self.hair.draw(HairScene(view, inputs.hair, *parts))
        self._draw_overlays(inputs, own, depth)
        self.gl.home.use()

    def _drawer(self, body: HairBody) -> HairDrawer:
        return SoftHairPass(body) if self.soft else HairPass(self.gl, body)

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
        reach = farthest + DEPTH_MARGIN + (AROUND if inputs.billboards or inputs.lines else 0)
        centre = float(own.depth(middle))
        near, far = np.floor((centre - reach) / DEPTH_STEP), np.ceil((centre + reach) / DEPTH_STEP)
        return DepthRange(max(DEPTH_STEP * float(near), NEAREST), DEPTH_STEP * float(far))

    def _draw_overlays(self, inputs: FrameInputs, own: Camera, depth: DepthRange) -> None:
        if not inputs.lines and not inputs.billboards:
            return
        context = self.gl.context
        self._meshes.depth_texture()
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
        self._meshes.resize(size)
        self.texture = self.gl.context.texture(size, 4)
        self.framebuffer = self.gl.context.framebuffer([self.texture])
        depth: Any = self._meshes.depth_texture()
        self._overlaid = self.gl.context.framebuffer([self.texture], depth)
        self._size = size

    def _release_targets(self) -> None:
        if self._size != (0, 0):
            for part in (self.framebuffer, self._overlaid, self.texture):
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
