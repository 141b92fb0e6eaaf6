"""Shaded meshes that stay on the GPU: head, hull, torso."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.rendering.head import Solid, bind_maps, upload_maps
from hairkit.types.camera import Camera
from hairkit.types.skin_look import SkinLook


class SolidPass:
    """A shaded mesh, lit at its pixels or, for software renderers, at its vertices."""

    def __init__(self, gl: Renderer, solid: Solid, *, by_vertex: bool = False) -> None:
        self._gl = gl
        self.solid = solid
        self._program = gl.program("viewer_skin" if by_vertex else "skin")
        uv = np.zeros((len(solid.vertices), 2)) if solid.uv is None else solid.uv
        values = np.concatenate([solid.vertices, solid.normals, solid.colours, uv], axis=1)
        self._values = np.ascontiguousarray(values, np.float32)
        self._placed = np.eye(4)
        held = np.ones(len(solid.vertices), np.float32) if solid.held is None else solid.held
        self._held = np.flatnonzero(held)
        self._share = held[self._held, None]
        self._vertices = gl.context.buffer(self._values)
        self._faces = gl.context.buffer(np.ascontiguousarray(solid.faces, np.uint32))
        self._array = gl.context.vertex_array(
            self._program,
            [(self._vertices, "3f 3f 3f 2f", "in_position", "in_normal", "in_colour", "in_uv")],
            index_buffer=self._faces,
        )
        self._kept = contextlib.ExitStack()
        self.maps = self._kept.enter_context(upload_maps(gl, solid))
        for texture in self.maps.values() if by_vertex else ():
            texture.filter = (moderngl.LINEAR_MIPMAP_NEAREST, moderngl.LINEAR)  # half the work
        """Its pictures on the GPU, by kind."""

    def place(self, matrix: Float64Array) -> None:
        """Move the mesh by a rigid motion (4, 4) from its original pose, as far as it is `held`."""
        if np.array_equal(matrix, self._placed):
            return
        self._placed = matrix
        moved = self._values.copy()
        moved[self._held, :3], moved[self._held, 3:6] = self._motion()
        self._vertices.write(moved)

    def placed(self) -> Solid:
        """Return the mesh where it is now."""
        vertices, normals = self.solid.vertices.copy(), self.solid.normals.copy()
        vertices[self._held], normals[self._held] = self._motion()
        return replace(self.solid, vertices=vertices, normals=normals)

    def _motion(self) -> tuple[Float32Array, Float32Array]:
        """Return positions and normals of the vertices that `place` moves."""
        matrix = self._placed.astype(np.float32)
        place, normal = self.solid.vertices[self._held], self.solid.normals[self._held]
        turn, share = matrix[:3, :3].T, self._share
        place = place + share * (place @ turn + matrix[:3, 3] - place)
        return place, normal + share * (normal @ turn - normal)

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
        """Free the buffers."""
        for part in (self._array, self._vertices, self._faces):
            part.release()
        self._kept.close()
