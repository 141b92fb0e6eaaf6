"""Shaded pictures of hair on a head."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.errors import InputError
from hairkit.rendering.context import Renderer, renderer
from hairkit.rendering.framebuffer import average_samples, supersample_camera, target
from hairkit.rendering.gl_camera import DepthRange
from hairkit.rendering.hair import RibbonBuffers, draw_ribbons, ribbons
from hairkit.rendering.head import Solid, bust_solid, head_solid, upload_maps
from hairkit.rendering.light import FULL_HEAD, Lights, LightVolume, hair_density, light_volume
from hairkit.rendering.skin_passes import draw_skin
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.head import Head
from hairkit.types.skin_look import SkinLook
from hairkit.types.strands import Strands

BACKDROP_TOP, BACKDROP_BOTTOM = (176, 180, 184), (214, 216, 218)
"""sRGB of the neutral backdrop."""
HEAD_PUSH = 0.0015
"""Meshes are drawn this far behind their surface, metres, so that they do not hide roots."""
WIDEST = 5.0
"""Strands fewer than `FULL_HEAD` are drawn wider, so that they hide the scalp as this many would,
by this factor at most."""
SAMPLES = 3
"""Along each edge of a pixel: with two, a hair that stands alone is a row of dots."""
HALF_STEP = 127
"""Half of 255: added before the division by 255, so that it rounds to the nearest level."""


def draw(
    hair: Groom | Strands,
    head: Head | None,
    camera: Camera,
    *,
    width: int | None = None,
    height: int | None = None,
    material: HairMaterial | None = None,
    lights: Lights | None = None,
    background: UInt8Array | None = None,
    solids: Sequence[Solid] = (),
    bust: bool = False,
    supersample: int = SAMPLES,
    skin: SkinLook | None = None,
) -> UInt8Array:
    """Return a picture (H, W, 3) uint8 RGB of hair on a head, antialiased.

    Parameters
    ----------
    hair
        A groom or strands, drawn as they are: `densify` guides first.
    head
        None: the head of the groom, or no head for `Strands`.
    camera
        The camera; a point is drawn at its `camera.project`.
    width, height
        Size of the picture; the camera is scaled to it. By default the camera's own.
    material
        Width of the hair, and its colour where strands have none of their own; None: the groom's,
        or the default.
    lights
        None: lights fixed to the camera.
    background
        (H, W, 3) picture behind; None: a neutral grey.
    solids
        Other shaded meshes, such as shoulders.
    bust
        Draw a clothed bust under a head that ends at its neck.
    supersample
        Samples along each edge of a pixel.
    skin
        How skin reflects and scatters light; None: `SkinLook()`.
    """
    sized = _resize_camera(camera, width, height)
    return draw_views(
        hair,
        head,
        [sized],
        material=material,
        lights=lights,
        backgrounds=None if background is None else [background],
        solids=solids,
        bust=bust,
        supersample=supersample,
        skin=skin,
    )[0]


def draw_views(
    hair: Groom | Strands,
    head: Head | None,
    cameras: Sequence[Camera],
    *,
    material: HairMaterial | None = None,
    lights: Lights | None = None,
    backgrounds: Sequence[UInt8Array] | None = None,
    solids: Sequence[Solid] = (),
    bust: bool = False,
    supersample: int = SAMPLES,
    skin: SkinLook | None = None,
) -> list[UInt8Array]:
    """Return one picture for each camera, as `draw` does, but upload hair and head once."""
    strands = hair.strands if isinstance(hair, Groom) else hair
    if isinstance(hair, Groom):
        head = hair.head if head is None else head
        material = material or hair.material
    material, skin = material or HairMaterial(), skin or SkinLook()
    below = bust_solid(head, strands) if bust and head is not None else None
    own = [head_solid(head, material)] if head is not None else []
    shown = (*own, *([below] if below is not None else []), *solids)
    density = hair_density(strands, shown)
    pictures = []
    with (
        renderer() as gl,
        ribbons(gl, strands, display_width(strands, material), material) as buffers,
        contextlib.ExitStack() as uploads,
        contextlib.ExitStack() as kept,
    ):
        maps = [uploads.enter_context(upload_maps(gl, solid)) for solid in shown]
        volume: LightVolume | None = None
        for index, camera in enumerate(cameras):
            shot = _Shot(
                supersample_camera(camera, supersample), lights or Lights.at_camera(camera)
            )
            if volume is None or lights is None:
                kept.close()
                volume = light_volume(density, shot.lights)
                kept.enter_context(_light_texture(gl, volume))
            samples = _shoot(gl, shot, strands, buffers, shown, maps, volume, skin)
            background = backgrounds[index] if backgrounds is not None else backdrop(camera)
            pictures.append(_over(average_samples(samples, camera), background))
    return pictures


def backdrop(camera: Camera) -> UInt8Array:
    """Return the neutral background (H, W, 3): grey, lighter towards the floor."""
    t = np.linspace(0, 1, camera.height)[:, None, None]
    column = (1 - t) * np.array(BACKDROP_TOP) + t * np.array(BACKDROP_BOTTOM)
    return np.repeat(np.rint(column).astype(np.uint8), camera.width, axis=1)


@dataclass(frozen=True)
class _Shot:
    camera: Camera
    lights: Lights


def _resize_camera(camera: Camera, width: int | None, height: int | None) -> Camera:
    if width is None and height is None:
        return camera
    if width is None:
        width = round(camera.width * (height or camera.height) / camera.height)
    if height is None:
        height = round(camera.height * width / camera.width)
    if abs(width * camera.height - height * camera.width) > max(camera.width, camera.height):
        raise InputError(
            f"picture size {width} x {height}, expected the aspect of the camera"
            f" ({camera.width} x {camera.height}); pass only width or only height"
        )
    return camera.resized(width, height)


def display_width(strands: Strands, material: HairMaterial) -> float | Float32Array:
    """Return the width, or widths (P,), of strands in pictures, metres."""
    wider = float(np.clip(FULL_HEAD / max(len(strands), 1), 1.0, WIDEST))
    return wider * (material.width if strands.widths is None else strands.widths)


@contextlib.contextmanager
def _light_texture(gl: Renderer, light: LightVolume) -> Iterator[None]:
    texture = gl.context.texture3d(light.size, 3, light.texels(), dtype="f4", alignment=1)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = texture.repeat_z = False
    texture.use(0)
    try:
        yield
    finally:
        texture.release()


def _shoot(
    gl: Renderer,
    shot: _Shot,
    strands: Strands,
    buffers: Sequence[RibbonBuffers],
    solids: Sequence[Solid],
    maps: Sequence[Mapping[str, moderngl.Texture]],
    light: LightVolume,
    skin: SkinLook,
) -> UInt8Array:
    """Return the samples (k H, k W, 4), alpha 255 where something was drawn."""
    camera = shot.camera
    depth = DepthRange.around(camera, strands.points, *[solid.vertices for solid in solids])
    uniforms: dict[str, Any] = {
        **shot.lights.uniforms(),
        **light.uniforms(),
        "u_light": 0,
        "u_eye": tuple(camera.position.tolist()),
    }
    with target(gl, camera) as picture:
        if solids:
            draw_skin(gl, solids, maps, camera, depth, HEAD_PUSH, skin, uniforms)
        draw_ribbons(
            gl, buffers, gl.program("hair"), camera, depth, shader="hair_ribbon_shade", **uniforms
        )
        return np.asarray(picture.read(), np.uint8)


def _over(picture: UInt8Array, background: UInt8Array) -> UInt8Array:
    if background.shape[:2] != picture.shape[:2]:
        raise InputError(
            f"background has shape {background.shape}, expected {(*picture.shape[:2], 3)}"
        )
    clear = 255 - picture[..., 3:].astype(np.uint16)
    mixed = picture[..., :3] + (background * clear + HALF_STEP) // 255
    return np.minimum(mixed, 255).astype(np.uint8)
