"""Head and other meshes on the GPU."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import moderngl
import numpy as np

from hairkit.arrays import Float32Array, Int32Array
from hairkit.head_model.bust import CLOTH, bust_under
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.types.camera import Camera
from hairkit.types.groom import HairMaterial
from hairkit.types.head import Head
from hairkit.types.skin import Texture
from hairkit.types.strands import Strands

SKIN = (0.42, 0.24, 0.17)
"""Linear RGB of skin."""
SCALP_TINT = 0.75
"""Weight of the hair colour on the scalp."""
ALBEDO_UNIT = 6
"""Texture unit of the albedo, which no other picture is bound to."""


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
    uv: Float32Array | None = None
    """(V, 2) texture coordinates."""
    albedo: Texture | None = None
    """Picture by which the colours are multiplied."""


def head_solid(head: Head, material: HairMaterial) -> Solid:
    """Return the head with skin colours and a scalp tinted with the colour of the hair."""
    albedo = None if head.maps is None else head.maps.albedo
    skin = np.array(SKIN, np.float32)
    scalp = np.clip(head.scalp, 0, 1)[:, None] * np.float32(SCALP_TINT)
    colours = (1 - scalp) * skin + scalp * (0.5 * material.root_colour)
    if albedo is not None:
        colours = colours / skin  # the picture has the skin's colour
    normals = head.normals().astype(np.float32)
    return Solid(head.vertices, head.faces, normals, colours, uv=head.uv, albedo=albedo)


def bust_solid(head: Head, strands: Strands | None = None) -> Solid | None:
    """Return a clothed bust under a head that ends at its neck; None under other heads."""
    bust = bust_under(head, strands)
    if bust is None:
        return None
    colours = np.tile(np.array(CLOTH, np.float32), (len(bust.vertices), 1))
    return Solid(bust.vertices, bust.faces, bust.normals, colours, scatter=0.0)


@contextlib.contextmanager
def albedo_texture(gl: Renderer, solid: object) -> Iterator[dict[str, Any]]:
    """Bind a solid's picture, if it has one, and yield the uniforms that name it."""
    picture = solid.albedo if isinstance(solid, Solid) else None
    with upload_albedo(gl, picture) as texture:
        if texture is not None:
            texture.use(ALBEDO_UNIT)
        yield {"u_albedo": ALBEDO_UNIT, "u_textured": float(texture is not None)}


@contextlib.contextmanager
def upload_albedo(gl: Renderer, picture: Texture | None) -> Iterator[moderngl.Texture | None]:
    """Yield the picture on the GPU with its mipmaps, or None."""
    if picture is None:
        yield None
        return
    pixels = np.ascontiguousarray(picture.pixels[::-1])  # v runs upwards
    texture = gl.context.texture(pixels.shape[1::-1], 3, pixels, alignment=1)
    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    try:
        yield texture
    finally:
        texture.release()


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
        if mesh.uv is not None:
            attributes["in_uv"] = mesh.uv
    used = [
        (gl.context.buffer(np.ascontiguousarray(values, np.float32)), f"{values.shape[1]}f", name)
        for name, values in attributes.items()
        if name in program
    ]
    faces = gl.context.buffer(np.ascontiguousarray(mesh.faces, np.uint32))
    array = gl.context.vertex_array(program, used, index_buffer=faces)
    with albedo_texture(gl, mesh) as picture:
        set_uniforms(program, **picture)
        array.render(moderngl.TRIANGLES)
    array.release()
    for buffer in (faces, *[buffer for buffer, _, _ in used]):
        buffer.release()
