"""Head and other meshes on the GPU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import moderngl
import numpy as np

from hairkit.arrays import Float32Array, Int32Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.types.camera import Camera
from hairkit.types.groom import HairMaterial
from hairkit.types.head import Head

SKIN = (0.42, 0.24, 0.17)
"""Linear RGB of skin."""
SCALP_TINT = 0.75
"""Weight of the hair colour on the scalp."""


class Mesh(Protocol):
    """A triangle mesh: a `Head`, or anything else with vertices and faces."""

    @property
    def vertices(self) -> Float32Array:
        """(V, 3) metres."""
        ...

    @property
    def faces(self) -> Int32Array:
        """(F, 3) vertex indices."""
        ...


@dataclass(frozen=True)
class Solid:
    """A mesh with the attributes of `skin.vert`."""

    vertices: Float32Array
    faces: Int32Array
    normals: Float32Array
    """(V, 3) outward unit normals."""
    colours: Float32Array
    """(V, 3) linear RGB."""
    scatter: float = 1.0
    """Subsurface scattering: 1 for skin, 0 for cloth."""


def head_solid(head: Head, material: HairMaterial) -> Solid:
    """Return the head with skin colours and a scalp tinted with the colour of the hair."""
    colours = np.tile(np.array(SKIN, np.float32), (len(head.vertices), 1))
    scalp = np.clip(head.scalp, 0, 1)[:, None] * np.float32(SCALP_TINT)
    colours = (1 - scalp) * colours + scalp * (0.5 * material.root_colour)
    return Solid(head.vertices, head.faces, head.normals().astype(np.float32), colours)


def draw_solid(
    gl: Renderer,
    mesh: Mesh,
    program: moderngl.Program,
    camera: Camera,
    depth: DepthRange,
    push: float,
    **uniforms: Any,
) -> None:
    """Draw a mesh with `program` (`solid.vert` or `skin.vert`), its depth `push` metres behind."""
    set_camera(program, camera, depth)
    set_uniforms(program, u_push_m=push, **uniforms)
    attributes = {"in_position": mesh.vertices}
    if isinstance(mesh, Solid):
        attributes |= {"in_normal": mesh.normals, "in_colour": mesh.colours}
    used = [
        (gl.context.buffer(np.ascontiguousarray(values, np.float32)), "3f", name)
        for name, values in attributes.items()
        if name in program
    ]
    faces = gl.context.buffer(np.ascontiguousarray(mesh.faces, np.uint32))
    array = gl.context.vertex_array(program, used, index_buffer=faces)
    array.render(moderngl.TRIANGLES)
    array.release()
    for buffer in (faces, *[buffer for buffer, _, _ in used]):
        buffer.release()
