"""Textured cards as a game engine draws them: cut out where their alpha is low, lit simply."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import moderngl
import numpy as np
from hairkit_plugins.cards.scene import CUTOFF

from hairkit.arrays import Float32Array, Int32Array, UInt8Array
from hairkit.rendering.context import Renderer, renderer
from hairkit.rendering.framebuffer import SUPERSAMPLE, average_samples, supersample_camera, target
from hairkit.rendering.gl_camera import DepthRange, set_camera, set_uniforms
from hairkit.rendering.head import draw_solid
from hairkit.types.camera import Camera
from hairkit.types.preview import Surface

VERTEX_SHADER = """#version 430
uniform mat4 u_clip_from_head;
in vec3 in_position; in vec3 in_normal; in vec2 in_uv;
out vec3 v_normal; out vec2 v_uv;
void main() {
    gl_Position = u_clip_from_head * vec4(in_position, 1.0);
    v_normal = in_normal;
    v_uv = in_uv;
}
"""
FRAGMENT_SHADER = """#version 430
uniform sampler2D u_cards; uniform vec3 u_forward; uniform float u_cutoff, u_ambient;
in vec3 v_normal; in vec2 v_uv;
out vec4 out_colour;
void main() {
    vec4 albedo = texture(u_cards, v_uv);
    if (albedo.a < u_cutoff) discard;
    float lit = u_ambient + (1.0 - u_ambient) * abs(dot(normalize(v_normal), u_forward));
    out_colour = vec4(albedo.rgb * lit, 1.0);
}
"""
"""The albedo, lit from the camera (Lambert) above ambient light, where alpha reaches the cutoff."""
AMBIENT = 0.35
"""Share of the light that comes from everywhere."""
SKIN_GREY = (0.55, 0.5, 0.47, 0.0)
"""sRGB of meshes behind the cards; they cover nothing."""
PUSH = 0.002
"""Metres that meshes are drawn behind their surface, so that they do not hide roots."""


@dataclass(frozen=True, eq=False)
class TexturedMesh:
    """Triangles with a picture."""

    vertices: Float32Array
    """(V, 3) metres."""
    faces: Int32Array
    """(F, 3), seen from both sides."""
    normals: Float32Array
    """(V, 3) unit normals."""
    uv: Float32Array
    """(V, 2) from the picture's upper left corner."""
    picture: UInt8Array
    """(H, W, 4) RGBA."""


def draw_cards(
    cards: TexturedMesh,
    solid: Surface | None,
    cameras: Sequence[Camera],
) -> list[UInt8Array]:
    """Return (H, W, 4) RGBA for each camera; alpha is the pixel's coverage by cards."""
    pictures = []
    with renderer() as gl:
        texture = _upload(gl, cards.picture)
        for camera in cameras:
            fine = supersample_camera(camera, SUPERSAMPLE)
            meshes = [cards.vertices] + ([] if solid is None else [solid.vertices])
            depth = DepthRange.around(fine, *meshes)
            with target(gl, fine) as picture:
                if solid is not None:
                    program = gl.program("solid", "flat")
                    draw_solid(gl, solid, program, fine, depth, PUSH, u_colour=SKIN_GREY)
                _draw(gl, cards, texture, fine, depth)
                samples = np.asarray(picture.read(), np.uint8)
            pictures.append(average_samples(samples, camera))
        texture.release()
    return pictures


def _upload(gl: Renderer, picture: UInt8Array) -> moderngl.Texture:
    texture = gl.context.texture(picture.shape[1::-1], 4, np.ascontiguousarray(picture))
    texture.build_mipmaps(max_level=2)
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture


def _draw(
    gl: Renderer,
    cards: TexturedMesh,
    texture: moderngl.Texture,
    camera: Camera,
    depth: DepthRange,
) -> None:
    program = gl.context.program(vertex_shader=VERTEX_SHADER, fragment_shader=FRAGMENT_SHADER)
    set_camera(program, camera, depth)
    texture.use(0)
    set_uniforms(program, u_cards=0, u_cutoff=CUTOFF, u_ambient=AMBIENT)
    attributes = {"in_position": cards.vertices, "in_normal": cards.normals, "in_uv": cards.uv}
    used = [
        (gl.context.buffer(np.ascontiguousarray(values, np.float32)), f"{values.shape[1]}f", name)
        for name, values in attributes.items()
    ]
    faces = gl.context.buffer(np.ascontiguousarray(cards.faces, np.uint32))
    array = gl.context.vertex_array(program, used, index_buffer=faces)
    array.render(moderngl.TRIANGLES)
    array.release()
    program.release()
    for buffer in (faces, *[buffer for buffer, _, _ in used]):
        buffer.release()
