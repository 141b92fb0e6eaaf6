"""Skin on the GPU: its layers apart, the light in the flesh diffused, and all together."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import moderngl
import numpy as np

from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import DepthRange, set_uniforms
from hairkit.rendering.head import Solid, draw_solid
from hairkit.rendering.skin_lobe import diffusion_kernel
from hairkit.types.camera import Camera
from hairkit.types.skin_look import SkinLook

FIRST_UNIT = 1
"""First of the texture units of the layers; 0 is the light volume's."""
Box = tuple[int, int, int, int]
"""Left, top, width and height, pixels."""
_WAYS = ((1.0, 0.0), (0.0, 1.0))


def draw_skin(
    gl: Renderer,
    solids: Sequence[Solid],
    maps: Sequence[Mapping[str, moderngl.Texture]],
    camera: Camera,
    depth: DepthRange,
    push: float,
    look: SkinLook,
    uniforms: dict[str, Any],
) -> None:
    """Draw meshes into the bound frame buffer, with the depth that hides what is behind them.

    `maps` are those of each mesh (`upload_maps`), `push` metres are added to their depth;
    `uniforms` are those of light, eye and exposure.
    """
    shown = gl.context.fbo
    with _layers(gl, (camera.width, camera.height)) as layers:
        depths = gl.context.depth_renderbuffer(layers[0].size)
        front = gl.context.framebuffer(layers[:3], depths)
        front.use()
        front.clear()
        gl.context.enable_only(moderngl.DEPTH_TEST)
        for solid, pictures in zip(solids, maps, strict=True):
            own = {**uniforms, **look.uniforms(), "u_scatter": solid.scatter, "u_wrapped": 0.0}
            program = gl.program("skin", "skin_layers")
            draw_solid(gl, solid, program, camera, depth, push, pictures, **own)
        gl.context.disable(moderngl.DEPTH_TEST)
        skins = [solid for solid in solids if solid.scatter > 0]
        if skins and max(look.mean_free_path) > 0:
            _diffuse(gl, layers, camera, look, _box(skins, camera))
        shown.use()
        shown.scissor = _box(solids, camera)
        front.release()
        depths.release()
        gl.context.enable_only(moderngl.DEPTH_TEST)
        names = ("u_diffuse", "u_surface", "u_specular")
        _fill(gl, "skin_combine", dict(zip(names, layers, strict=False)), uniforms)
        shown.scissor = (0, 0, camera.width, camera.height)


@contextlib.contextmanager
def _layers(gl: Renderer, size: tuple[int, int]) -> Iterator[list[moderngl.Texture]]:
    """Yield textures for diffuse, albedo, specular, whose alpha is a depth, and one more."""
    layers = [gl.context.texture(size, 4, dtype=kind) for kind in ("f2", "f2", "f4", "f2")]
    for texture in layers:
        texture.repeat_x = texture.repeat_y = False
    try:
        yield layers
    finally:
        for texture in layers:
            texture.release()


def _diffuse(
    gl: Renderer, layers: list[moderngl.Texture], camera: Camera, look: SkinLook, box: Box
) -> None:
    """Replace the diffuse layer by itself under the kernel, along rows and then columns.

    `box` holds all that scatters.
    """
    taps = [tuple(row) for row in diffusion_kernel(look).tolist()]
    ends = (layers[0], layers[3]), (layers[3], layers[0])
    before = gl.context.fbo
    for way, (given, made) in zip(_WAYS, ends, strict=True):
        framebuffer = gl.context.framebuffer([made])
        framebuffer.use()
        if made is layers[3]:
            framebuffer.clear()  # neighbours beyond the box are read
        framebuffer.scissor = box
        lens = {
            "u_taps": taps,
            "u_way": way,
            "u_focal_px": camera.focal,
            "u_perspective": float(camera.model == "perspective"),
        }
        _fill(gl, "skin_diffuse", {"u_diffuse": given, "u_surface": layers[1]}, lens)
        before.use()  # one that is in use cannot be released
        framebuffer.release()


def _box(solids: Sequence[Solid], camera: Camera) -> Box:
    """Return the part of the picture that meshes are in; all of it where one is behind the eye."""
    whole = np.array([camera.width, camera.height])
    places = np.concatenate([camera.project(solid.vertices) for solid in solids])
    if not np.isfinite(places).all():
        return (0, 0, camera.width, camera.height)
    low = np.clip(np.floor(places.min(axis=0)) - 1, 0, whole).astype(int)
    high = np.clip(np.ceil(places.max(axis=0)) + 1, low, whole).astype(int)
    return (int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


def _fill(
    gl: Renderer, name: str, textures: dict[str, moderngl.Texture], uniforms: dict[str, Any]
) -> None:
    """Run a fragment shader over the whole bound frame buffer."""
    program = gl.program("viewer_screen", name)
    for unit, (sampler, texture) in enumerate(textures.items(), FIRST_UNIT):
        texture.use(unit)
        set_uniforms(program, **{sampler: unit})
    set_uniforms(program, **uniforms)
    array = gl.context.vertex_array(program, [])
    array.render(moderngl.TRIANGLES, vertices=3)
    array.release()
