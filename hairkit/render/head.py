"""The head and other meshes on the GPU."""

from __future__ import annotations

from typing import Any, Protocol

import moderngl
import numpy as np

from hairkit.camera import Camera
from hairkit.render.context import Renderer
from hairkit.render.projection import DepthRange, set_camera, set_uniforms
from hairkit.stored import Float32Array, Int32Array


class Mesh(Protocol):
    """What is drawn as a solid: a `Head`, or anything else with vertices and faces."""

    @property
    def vertices(self) -> Float32Array:
        """(V, 3) metres."""
        ...

    @property
    def faces(self) -> Int32Array:
        """(F, 3) vertex indices."""
        ...


def draw_solid(
    gl: Renderer,
    mesh: Mesh,
    program: moderngl.Program,
    camera: Camera,
    depth: DepthRange,
    push: float,
    **uniforms: Any,
) -> None:
    """Draw a mesh with `solid.vert`, its depth `push` metres behind its surface."""
    set_camera(program, camera, depth)
    set_uniforms(program, u_push_m=push, **uniforms)
    vertices = gl.context.buffer(np.ascontiguousarray(mesh.vertices, np.float32))
    faces = gl.context.buffer(np.ascontiguousarray(mesh.faces, np.uint32))
    array = gl.context.vertex_array(program, [(vertices, "3f", "in_position")], index_buffer=faces)
    array.render(moderngl.TRIANGLES)
    for used in (array, vertices, faces):
        used.release()
