"""The picture behind the hair: the studio, and head, torso and other meshes before it.

What stayed the same is kept: the studio while the camera stays, fixed meshes until light or camera
change, and the whole layer until something in it moves.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

import moderngl
import numpy as np

from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange
from hairkit.rendering.head import Solid
from hairkit.rendering.picture import HEAD_PUSH
from hairkit.rendering.skin_passes import draw_skin
from hairkit.simulation.rigid_motion import inverse_motion
from hairkit.types.skin_look import SkinLook
from hairkit.viewer.draw.backdrop import BackdropPass
from hairkit.viewer.draw.interface import FrameInputs, MeshScene
from hairkit.viewer.draw.meshes import PlacedMesh, SolidPass

EDGE_SAMPLES = 4
"""Samples of a pixel at the edges of meshes on graphics cards. Software renderers take longer for
them than for the picture; there `mesh_edges` smooths outlines."""
FIXED_SOLIDS = ("torso",)
"""Meshes that do not move with the head."""

_Part = TypeVar("_Part", bound=PlacedMesh)


class MeshLayer(ABC, Generic[_Part]):
    """Studio and meshes of one size; subclasses draw them on the GPU or the CPU."""

    def __init__(self, gl: Renderer, head: Solid) -> None:
        self._gl = gl
        self._head = self._load(head)
        self._solids: dict[str, _Part] = {}
        self._studio = BackdropPass(gl)
        self._size = (0, 0)
        self._made: object = None
        self._scenery_made: object = None

    def release(self) -> None:
        """Free all GPU objects."""
        for part in (self._head, *self._solids.values()):
            part.release()
        self._studio.release()
        self._release_targets()

    def upload(self, name: str, solid: Solid) -> None:
        """Add or replace a mesh that frames refer to by name."""
        if name in self._solids:
            self._solids[name].release()
        self._solids[name] = self._load(solid)
        self.forget()

    def resize(self, size: tuple[int, int]) -> None:
        """Make targets of another width and height, pixels."""
        if size != self._size:
            self._release_targets()
            self._make_targets(size)
            self._size = size
            self.forget()

    def forget(self) -> None:
        """Draw everything anew the next time."""
        self._made = self._scenery_made = None

    def draw(self, scene: MeshScene) -> None:
        """Draw studio and meshes if they or the light changed."""
        inputs = scene.inputs
        scenery = (scene.light.shown, _scenery_key(inputs, scene.depth))
        key = (scenery, inputs.world_from_head.tobytes(), inputs.show_head, inputs.solids)
        if key == self._made:
            return
        fixed, moving = self._parts(inputs)
        if scenery != self._scenery_made:
            self._draw_scenery(scene, fixed)
        self._draw_moving(scene, moving)
        self._made, self._scenery_made = key, scenery

    @abstractmethod
    def show(self, target: moderngl.Framebuffer) -> None:
        """Copy the layer to a picture of one texture."""

    @abstractmethod
    def depth_texture(self) -> moderngl.Texture:
        """Return the depth of the meshes."""

    @abstractmethod
    def _load(self, solid: Solid) -> _Part:
        """Return a mesh that this layer can draw."""

    @abstractmethod
    def _make_targets(self, size: tuple[int, int]) -> None: ...

    @abstractmethod
    def _release_targets(self) -> None: ...

    @abstractmethod
    def _draw_scenery(self, scene: MeshScene, parts: list[_Part]) -> None:
        """Draw the studio, and meshes that stay when the head moves."""

    @abstractmethod
    def _draw_moving(self, scene: MeshScene, parts: list[_Part]) -> None:
        """Draw the other meshes over the scenery."""

    def _parts(self, inputs: FrameInputs) -> tuple[list[_Part], list[_Part]]:
        """Return the meshes of the scenery, which stay when the head moves, and the others.

        Where light is diffused in skin, all are drawn at once and none belongs to the scenery.
        """
        names = {name for name in FIXED_SOLIDS if name in inputs.solids}
        head_from_torso = inverse_motion(inputs.world_from_head) @ inputs.world_from_torso
        self._head.place(head_from_torso if names else np.eye(4))
        for name in names:
            self._solids[name].place(head_from_torso)
        fixed = set() if inputs.fine_skin else names
        head = [self._head] if inputs.show_head else []
        moving = [self._solids[name] for name in inputs.solids if name not in fixed]
        return [self._solids[name] for name in fixed], head + moving

    def _push(self, part: _Part) -> float:
        """Return how much farther than its surface the depth of a mesh is, metres."""
        return HEAD_PUSH if part is self._head else 0.0

    def _draw_fine_skin(self, scene: MeshScene, parts: Sequence[_Part]) -> None:
        """Draw meshes with diffused light into the frame buffer in use."""
        if parts:
            solids, maps = [part.placed() for part in parts], [part.maps for part in parts]
            lighting = _lighting(scene) | {"u_eye": tuple(scene.camera.position.tolist())}
            depth, look = scene.depth, SkinLook()
            draw_skin(self._gl, solids, maps, scene.camera, depth, HEAD_PUSH, look, lighting)


class GpuMeshLayer(MeshLayer[SolidPass]):
    """The layer on a GPU, with smooth edges of the meshes."""

    def show(self, target: moderngl.Framebuffer) -> None:
        """Copy the layer to a picture of one texture."""
        self._gl.context.copy_framebuffer(target, self._layer)

    def depth_texture(self) -> moderngl.Texture:
        """Return the depth of the meshes."""
        return self._depth_texture

    def _load(self, solid: Solid) -> SolidPass:
        return SolidPass(self._gl, solid)

    def _make_targets(self, size: tuple[int, int]) -> None:
        context = self._gl.context
        self._texture = context.texture(size, 4)
        self._depth_texture = context.depth_texture(size)
        self._depth_texture.compare_func = ""
        self._depth_texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        colour: Any = self._texture
        depth: Any = self._depth_texture
        self._layer = context.framebuffer([colour], depth)
        samples = min(EDGE_SAMPLES, context.max_samples)
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

    def _release_targets(self) -> None:
        if self._size == (0, 0):
            return
        parts: list[Any] = [self._layer, self._samples, self._scenery, self._scenery_depths]
        parts += [*self._scenery_buffers, self._texture, self._depth_texture]
        for part in [*parts, *self._sample_buffers]:
            part.release()

    def _draw_scenery(self, scene: MeshScene, parts: list[SolidPass]) -> None:
        inputs = scene.inputs
        self._studio.draw(self._scenery, inputs.camera, inputs.floor, inputs.backdrop)
        self._scenery_depths.clear(depth=1.0)
        self._scenery.use()
        self._draw_meshes(scene, parts)

    def _draw_moving(self, scene: MeshScene, parts: list[SolidPass]) -> None:
        context = self._gl.context
        context.copy_framebuffer(self._samples, self._scenery)
        self._samples.use()
        self._draw_meshes(scene, parts)
        if self._sample_buffers:
            context.copy_framebuffer(self._layer, self._samples)  # averages the samples

    def _draw_meshes(self, scene: MeshScene, parts: list[SolidPass]) -> None:
        if scene.inputs.fine_skin:
            self._draw_fine_skin(scene, parts)
            return
        context = self._gl.context
        context.enable_only(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
        context.cull_face = "front"  # the picture is drawn upside down, which swaps the winding
        for part in parts:
            part.draw(scene.camera, scene.depth, self._push(part), _lighting(scene))
        context.cull_face = "back"


def _lighting(scene: MeshScene) -> dict[str, Any]:
    """Return the values of `lighting.glsl` and `tone.glsl`."""
    return {**scene.lights.uniforms(), **scene.light.uniforms()}


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
