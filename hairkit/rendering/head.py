"""Head and other meshes on the GPU."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array
from hairkit.head_model.bust import CLOTH, bust_under
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.types.camera import Camera
from hairkit.types.groom import HairMaterial
from hairkit.types.head import Head
from hairkit.types.preview import Surface
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.strands import Strands

SKIN = (0.42, 0.24, 0.17)
"""Linear RGB of skin."""
SCALP_TINT = 0.9
"""Weight of the hair colour on the scalp."""
MAPS = {
    "albedo": (6, "u_albedo", "u_textured"),
    "normal": (7, "u_normals", "u_has_normals"),
    "roughness": (8, "u_rough", "u_has_rough"),
}
"""A head's maps: texture unit, which no other picture is bound to, sampler, and the uniform that
says whether there is one."""


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
    maps: SkinMaps | None = None
    """Pictures of the surface; the colours are multiplied by the albedo."""
    held: Float32Array | None = None
    """(V,) share by which a vertex goes with what the mesh stands on: 1 at the end of a neck."""


def head_solid(head: Head, material: HairMaterial) -> Solid:
    """Return the head with skin colours, its scalp tinted with the colour of the hair there."""
    albedo = None if head.maps is None else head.maps.albedo
    skin = np.array(SKIN, np.float32)
    grown = head.scalp if head.density is None else head.scalp * head.density
    scalp = np.clip(grown, 0, 1)[:, None] * np.float32(SCALP_TINT)
    colours = (1 - scalp) * skin + scalp * (0.5 * material.root_colour)
    if albedo is not None:
        colours = colours / skin  # the picture has the skin's colour
    normals = head.normals().astype(np.float32)
    return Solid(
        head.vertices, head.faces, normals, colours, uv=head.uv, maps=head.maps, held=_neck(head)
    )


def _neck(head: Head) -> Float32Array:
    """Return (V,) 1 at the lower joint of the neck and below, 0 at the upper one and above."""
    low, high = head.joints[:2, 1]
    share = np.clip((high - head.vertices[:, 1]) / max(float(high - low), 1e-6), 0.0, 1.0)
    return np.asarray((share * share * (3 - 2 * share)).astype(np.float32))


def bust_solid(
    head: Head, strands: Strands | None = None, motion: Float64Array | None = None
) -> Solid | None:
    """Return a clothed bust under a head that ends at its neck; None under other heads.

    Head and strands are at rest; `motion` (4, 4) moves the bust, None leaves it.
    """
    bust = bust_under(head, strands)
    if bust is None:
        return None
    move = (np.eye(4) if motion is None else motion).astype(np.float32)
    vertices, normals = bust.vertices @ move[:3, :3].T + move[:3, 3], bust.normals @ move[:3, :3].T
    colours = np.tile(np.array(CLOTH, np.float32), (len(bust.vertices), 1))
    return Solid(vertices, bust.faces, normals, colours, scatter=0.0)


@contextlib.contextmanager
def upload_maps(gl: Renderer, solid: object) -> Iterator[dict[str, moderngl.Texture]]:
    """Yield the pictures of a solid on the GPU with their mipmaps, by kind."""
    maps = solid.maps if isinstance(solid, Solid) and solid.maps is not None else SkinMaps()
    uploaded = {}
    try:
        for kind, picture in maps.present().items():
            if kind in MAPS:
                uploaded[kind] = _upload(gl, picture)
        yield uploaded
    finally:
        for texture in uploaded.values():
            texture.release()


def bind_maps(maps: Mapping[str, moderngl.Texture]) -> dict[str, Any]:
    """Bind the pictures, and return the uniforms that name them."""
    uniforms: dict[str, Any] = {}
    for kind, (unit, sampler, present) in MAPS.items():
        uniforms |= {sampler: unit, present: float(kind in maps)}
        if kind in maps:
            maps[kind].use(unit)
    return uniforms


def _upload(gl: Renderer, picture: Texture) -> moderngl.Texture:
    pixels = np.ascontiguousarray(picture.pixels[::-1])  # v runs upwards
    texture = gl.context.texture(pixels.shape[1::-1], 3, pixels, alignment=1)
    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


def draw_solid(
    gl: Renderer,
    mesh: Surface,
    program: moderngl.Program,
    camera: Camera,
    depth: DepthRange,
    push: float,
    maps: Mapping[str, moderngl.Texture] | None = None,
    **uniforms: Any,
) -> None:
    """Draw a mesh with `program` (`solid.vert` or `skin.vert`), its depth `push` metres behind.

    `maps` are its pictures from `upload_maps`; None draws it without them.
    """
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
    set_uniforms(program, **bind_maps(maps or {}))
    array.render(moderngl.TRIANGLES)
    array.release()
    for buffer in (faces, *[buffer for buffer, _, _ in used]):
        buffer.release()
