"""Shaded meshes: where they are, and how a GPU draws them."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from functools import cached_property
from typing import Any

import moderngl
import numpy as np

from hairkit.arrays import Float64Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.rendering.head import Solid, bind_maps, upload_maps
from hairkit.types.camera import Camera
from hairkit.types.skin_look import SkinLook


class PlacedMesh:
    """A mesh that follows a rigid motion as far as its vertices are held."""

    def __init__(self, gl: Renderer, solid: Solid) -> None:
        self._gl = gl
        self.solid = solid
        self.motion = np.eye(4)
        """(4, 4) from the original pose."""
        self._kept = contextlib.ExitStack()

    @cached_property
    def maps(self) -> dict[str, moderngl.Texture]:
        """The mesh's pictures on the GPU, by kind."""
        return self._kept.enter_context(upload_maps(self._gl, self.solid))

    def place(self, motion: Float64Array) -> None:
        """Move the mesh by a rigid motion (4, 4) from its original pose, as far as it is `held`."""
        self.motion = motion

    def placed(self) -> Solid:
        """Return the mesh where it is now."""
        solid = self.solid
        share = np.float32(1) if solid.held is None else solid.held[:, None]
        matrix = self.motion.astype(np.float32)
        place, normal, turn = solid.vertices, solid.normals, matrix[:3, :3].T
        place = place + share * (place @ turn + matrix[:3, 3] - place)
        return replace(solid, vertices=place, normals=normal + share * (normal @ turn - normal))

    def release(self) -> None:
        """Free all GPU objects."""
        self._kept.close()


class SolidPass(PlacedMesh):
    """A mesh on the GPU, lit at its pixels."""

    def __init__(self, gl: Renderer, solid: Solid) -> None:
        super().__init__(gl, solid)
        self._program = gl.program("skin")
        uv = np.zeros((len(solid.vertices), 2)) if solid.uv is None else solid.uv
        values = np.concatenate([solid.vertices, solid.normals, solid.colours, uv], axis=1)
        self._values = np.ascontiguousarray(values, np.float32)
        self._vertices = gl.context.buffer(self._values)
        self._faces = gl.context.buffer(np.ascontiguousarray(solid.faces, np.uint32))
        self._array = gl.context.vertex_array(
            self._program,
            [(self._vertices, "3f 3f 3f 2f", "in_position", "in_normal", "in_colour", "in_uv")],
            index_buffer=self._faces,
        )

    def place(self, motion: Float64Array) -> None:
        """Move the mesh by a rigid motion (4, 4) from its original pose, as far as it is `held`."""
        if np.array_equal(motion, self.motion):
            return
        super().place(motion)
        moved, now = self._values.copy(), self.placed()
        moved[:, :3], moved[:, 3:6] = now.vertices, now.normals
        self._vertices.write(moved)

    def draw(
        self, camera: Camera, depth: DepthRange, push: float, lighting: dict[str, Any]
    ) -> None:
        """Draw the mesh with its depth `push` metres behind its surface."""
        set_camera(self._program, camera, depth)
        set_uniforms(
            self._program,
            u_push_m=push,
            u_eye=tuple(camera.position.tolist()),
            u_scatter=self.solid.scatter,
            u_wrapped=1.0,
            **SkinLook().uniforms(),
            **bind_maps(self.maps),
            **lighting,
        )
        self._array.render(moderngl.TRIANGLES)

    def release(self) -> None:
        """Free all GPU objects."""
        for part in (self._array, self._vertices, self._faces):
            part.release()
        super().release()
