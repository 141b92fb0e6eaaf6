"""Draws hair that follows guides, by compute shaders only; the sums are resolved by the stage.

Passes: guides turned since rest; hair placed, projected and counted in cells of the view; cells
summed to what hides what; hair shaded and drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np

from hairkit.camera import Camera
from hairkit.errors import InputError
from hairkit.render.context import Renderer
from hairkit.render.hair import strand_numbers
from hairkit.render.projection import DepthRange, set_camera, set_uniforms
from hairkit.stored import Float32Array
from hairkit.viewer.hair_body import HairBody

SLICES, TILE = 32, 16
"""As in viewer_hair.glsl."""
_GROUP = 64
MOST_GUIDES = 65_535
FULL_LOOK = 50_000
"""Fewer hairs are drawn wider, so that they cover the head as this many would."""
WIDEST = 5.0


@dataclass(frozen=True)
class HairLook:
    """How the hair is drawn in one picture."""

    hairs: int
    """Strands drawn, the guides first."""
    smooth: bool
    """True: strokes have soft edges; False is faster."""
    root_colour: tuple[float, float, float]
    tip_colour: tuple[float, float, float]
    by_direction: bool = False
    wider: float | None = None
    """How many times wider than they are strands are drawn; None: by their number."""

    @property
    def times_wider(self) -> float:
        """How many times wider strands are drawn."""
        if self.wider is not None:
            return self.wider
        return float(np.clip(np.sqrt(FULL_LOOK / max(self.hairs, 1)), 1.0, WIDEST))


class HairPass:
    """The hair's buffers on the GPU and the passes that draw it."""

    def __init__(self, gl: Renderer, body: HairBody) -> None:
        self._gl = gl
        self.body = body
        if len(body.guides) > MOST_GUIDES:
            raise InputError(f"{len(body.guides)} guides, the viewer draws at most {MOST_GUIDES}")
        count, points = len(body), body.points_each
        context = gl.context
        self._rest = context.buffer(np.ascontiguousarray(body.guide_rest, np.float32))
        self._now = context.buffer(np.ascontiguousarray(body.guide_rest, np.float32))
        self._guides = context.buffer(reserve=20 * len(body.guides) * points)
        self._hairs = context.buffer(_hair_records(body))
        self._offsets = context.buffer(_offset_records(body))
        self.places = context.buffer(reserve=12 * count * points)
        self._view: _ViewBuffers | None = None

    @property
    def sums(self) -> moderngl.Buffer | None:
        """Sums of colour and weight a pixel, None before the first picture."""
        return None if self._view is None else self._view.sums

    def release(self) -> None:
        """Free the buffers."""
        buffers = (self._rest, self._now, self._guides, self._hairs, self._offsets, self.places)
        for buffer in buffers:
            buffer.release()
        if self._view is not None:
            self._view.release()

    def move_guides(self, rows: Float32Array) -> None:
        """Put the guides at `rows` (G, m, 3), head frame, metres."""
        self._now.write(np.ascontiguousarray(rows, np.float32))
        self._rest.bind_to_storage_buffer(0)
        self._now.bind_to_storage_buffer(1)
        self._guides.bind_to_storage_buffer(2)
        self._run("viewer_guide", len(self.body.guides) * self.body.points_each)

    def place(
        self, camera: Camera, hair_depth: DepthRange, depth: DepthRange, look: HairLook
    ) -> None:
        """Place the hair and find what of it hides what; `hair_depth` holds the hair alone."""
        view = self._sized(camera)
        slices = (hair_depth.near, SLICES / (hair_depth.far - hair_depth.near))
        self._shared: dict[str, Any] = {
            "u_tiles": view.tiles,
            "u_slice_range": slices,
            "u_wider": look.times_wider,
        }
        view.filled.clear()
        self._guides.bind_to_storage_buffer(0)
        self._hairs.bind_to_storage_buffer(1)
        self._offsets.bind_to_storage_buffer(2)
        self.places.bind_to_storage_buffer(3)
        view.filled.bind_to_storage_buffer(4)
        self._run("viewer_hair", look.hairs, camera, depth, **self._shared)
        view.opacity.bind_to_image(0, read=False, write=True)
        self._run("viewer_opacity", view.tiles[0] * view.tiles[1], **self._shared)

    def draw(
        self,
        camera: Camera,
        depth: DepthRange,
        look: HairLook,
        solid_depth: moderngl.Texture,
        lighting: dict[str, Any],
    ) -> None:
        """Draw the placed hair into `sums`, hidden by what `solid_depth` holds.

        `lighting` are the values of the lights; the light volume's texture is bound as `u_light`
        says.
        """
        view = self._sized(camera)
        solid_depth.use(1)
        view.opacity.use(2)
        self._hairs.bind_to_storage_buffer(1)
        self._offsets.bind_to_storage_buffer(2)
        self.places.bind_to_storage_buffer(3)
        view.sums.bind_to_storage_buffer(7)
        self._run(
            "viewer_stroke",
            look.hairs,
            camera,
            depth,
            u_eye=tuple(camera.position.tolist()),
            u_root_colour=look.root_colour,
            u_tip_colour=look.tip_colour,
            u_show_direction=float(look.by_direction),
            u_solid_depth=1,
            u_opacity=2,
            u_picture=(camera.width, camera.height),
            u_smooth=float(look.smooth),
            **self._shared,
            **lighting,
        )

    def _run(
        self,
        shader: str,
        count: int,
        camera: Camera | None = None,
        depth: DepthRange | None = None,
        **uniforms: Any,
    ) -> None:
        program = self._gl.compute(shader)
        if camera is not None and depth is not None:
            set_camera(program, camera, depth)
        set_uniforms(program, u_points=self.body.points_each, u_count=count, **uniforms)
        program.run(max(-(-count // _GROUP), 1))
        self._gl.context.memory_barrier()

    def _sized(self, camera: Camera) -> _ViewBuffers:
        size = (camera.width, camera.height)
        if self._view is None or self._view.size != size:
            if self._view is not None:
                self._view.release()
            self._view = _ViewBuffers.of(self._gl.context, size)
        return self._view


@dataclass(frozen=True)
class _ViewBuffers:
    """What depends on the picture's size."""

    size: tuple[int, int]
    tiles: tuple[int, int]
    filled: moderngl.Buffer
    opacity: moderngl.Texture3D
    sums: moderngl.Buffer

    @classmethod
    def of(cls, context: moderngl.Context, size: tuple[int, int]) -> _ViewBuffers:
        tiles = (-(-size[0] // TILE), -(-size[1] // TILE))
        opacity = context.texture3d((*tiles, SLICES + 1), 1, dtype="f4")
        opacity.filter = (moderngl.LINEAR, moderngl.LINEAR)
        opacity.repeat_x = opacity.repeat_y = opacity.repeat_z = False
        # whole blocks of 2 x 4 pixels, see viewer_sums.glsl
        blocks = -(-size[0] // 2) * -(-size[1] // 4)
        sums = context.buffer(reserve=64 * blocks)
        sums.clear()
        filled = context.buffer(reserve=4 * tiles[0] * tiles[1] * SLICES)
        return cls(size, tiles, filled, opacity, sums)

    def release(self) -> None:
        for part in (self.filled, self.opacity, self.sums):
            part.release()


def _hair_records(body: HairBody) -> bytes:
    """Return three words a hair: guides, last guide and random number, weights of two guides."""
    guides = body.followed.astype(np.uint32)
    random = np.rint(strand_numbers(len(body)) * 65535).astype(np.uint32)
    weights = np.rint(np.clip(body.weights, 0, 1) * 65535).astype(np.uint32)
    words = [
        guides[:, 0] | guides[:, 1] << 16,
        guides[:, 2] | random << 16,
        weights[:, 0] | weights[:, 1] << 16,
    ]
    return np.stack(words, axis=1).astype(np.uint32).tobytes()


def _offset_records(body: HairBody) -> bytes:
    """Return two words a point: offset and diameter in millimetres, as half floats."""
    values = np.concatenate([body.offsets, body.widths[..., None]], axis=2) * 1e3
    return np.clip(values, -6e4, 6e4).astype(np.float16).tobytes()
