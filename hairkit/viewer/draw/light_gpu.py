"""The light volume of moving hair: transmittance on a grid, updated over several frames."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import moderngl
import numpy as np

from hairkit.arrays import Float32Array
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import set_uniforms
from hairkit.rendering.light import ABSORBED_SHARE, FULL_HEAD, HAIR_WIDTH, Lights, hair_density
from hairkit.types.preview import Surface
from hairkit.types.strands import Strands
from hairkit.types.volume import VoxelGrid
from hairkit.viewer.draw.interface import HairDrawer

CELL = 0.01
"""Edge of a cell, metres."""
MOST_CELLS = 56
"""Cells along the longest side; longer hair gets larger cells."""
MARGIN = 0.08
"""Margin around the hair at rest, metres."""
GROUP, TILE = 64, 8
"""Strands of a work group; edge of its tile of cells."""
TURNS = 6
"""Frames over which the update of one volume is spread."""


class LightVolume(ABC):
    """A 3D texture of the light that reaches hair and head, head frame."""

    def __init__(self, gl: Renderer, guides: Strands, solids: list[Surface]) -> None:
        self._gl = gl
        self.grid = _grid(guides, solids)
        cells = self.grid.shape
        self._cells: tuple[int, int, int] = (cells[0], cells[1], cells[2])
        self.texture = self._volume(4, "f2")
        """Transmittance towards key and rim light, visible share of the sky."""
        self.shown = 0
        """Number of volumes shown so far."""
        self._turn = 0
        self._lights: Lights | None = None

    def release(self) -> None:
        """Free the texture."""
        self.texture.release()

    def uniforms(self) -> dict[str, Any]:
        """Return the values of `light_volume.glsl` that place the volume, bound as texture 0."""
        size = np.array(self.grid.shape) * self.grid.spacing
        return {
            "u_light": 0,
            "u_volume_origin": tuple(self.grid.origin.tolist()),
            "u_volume_size": tuple(size.tolist()),
        }

    def update(self, hair: HairDrawer, hairs: int, lights: Lights, *, whole: bool) -> None:
        """Compute a part of the next volume, or all of it, for the present hair and lights.

        A volume belongs to one state of hair and lights; it is shown once it is complete.
        """
        turns = 1 if whole else TURNS
        self._turn = 0 if whole else self._turn % TURNS
        if self._turn == 0 or self._lights is None:
            stands_for = max(FULL_HEAD / max(hairs, 1), 1.0) * HAIR_WIDTH * np.pi / 4
            per_micrometre = 1e-6 * stands_for * ABSORBED_SHARE / self.grid.spacing**3
            self._fill(hair, hairs, per_micrometre)
            self._lights = lights
        self._light(self._lights, self._turn, turns)
        self._turn += 1
        if self._turn == turns:
            self._show()
            self.shown += 1
            self._turn = 0

    @abstractmethod
    def _fill(self, hair: HairDrawer, hairs: int, per_micrometre: float) -> None:
        """Compute the extinction of hair, `per_micrometre` in a cell, and meshes."""

    @abstractmethod
    def _light(self, lights: Lights, turn: int, turns: int) -> None:
        """Compute the transmittance of every `turns`-th layer, from `turn` on."""

    @abstractmethod
    def _show(self) -> None:
        """Show the finished volume."""

    def _volume(self, components: int, kind: str) -> moderngl.Texture3D:
        """Return a 3D texture of ones."""
        ones = np.ones(int(np.prod(self._cells)) * components, f"f{kind[1]}")
        texture = self._gl.context.texture3d(self._cells, components, ones.tobytes(), dtype=kind)
        texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = texture.repeat_z = False
        return texture


class LightPass(LightVolume):
    """The light volume of hair drawn by `HairPass`."""

    def __init__(self, gl: Renderer, guides: Strands, solids: list[Surface]) -> None:
        super().__init__(gl, guides, solids)
        extinction = solid_depth(self.grid, solids)
        self._solids = gl.context.buffer(np.ascontiguousarray(extinction.transpose(2, 1, 0)))
        self._dense = gl.context.buffer(reserve=4 * extinction.size)
        self._coming = self._volume(4, "f2")
        self._extinction = self._volume(1, "f4")

    def release(self) -> None:
        """Free buffers and textures."""
        super().release()
        for part in (self._solids, self._dense, self._extinction, self._coming):
            part.release()

    def _fill(self, hair: HairDrawer, hairs: int, per_micrometre: float) -> None:
        fill = self._gl.compute("viewer_density")
        self._dense.clear()
        hair.places().bind_to_storage_buffer(3)
        self._dense.bind_to_storage_buffer(0)
        points = hair.body.points_each
        set_uniforms(fill, u_points=points, u_count=hairs, u_cells=self._cells, **self.uniforms())
        fill.run(max(-(-hairs // GROUP), 1))
        self._gl.context.memory_barrier()
        extinction = self._gl.compute("viewer_extinction")
        set_uniforms(extinction, u_cells=self._cells, u_hair_extinction=per_micrometre)
        self._solids.bind_to_storage_buffer(1)
        self._extinction.bind_to_image(0, read=False, write=True)
        x, y, z = self._cells
        extinction.run(-(-x // TILE), -(-y // TILE), z)
        self._gl.context.memory_barrier()

    def _light(self, lights: Lights, turn: int, turns: int) -> None:
        light = self._gl.compute("viewer_light")
        set_uniforms(
            light,
            u_cells=self._cells,
            u_spacing=self.grid.spacing,
            u_extinction=3,
            u_key_direction=lights.key_direction,
            u_rim_direction=lights.rim_direction,
            u_turn=turn,
            u_turns=turns,
        )
        self._extinction.use(3)
        self._coming.bind_to_image(0, read=False, write=True)
        x, y, z = self._cells
        light.run(-(-x // TILE), -(-y // TILE), -(-z // turns))
        self._gl.context.memory_barrier()

    def _show(self) -> None:
        self.texture, self._coming = self._coming, self.texture


def _grid(guides: Strands, solids: list[Surface]) -> VoxelGrid:
    clouds = [guides.points, *[solid.vertices for solid in solids]]
    low = np.min([cloud.min(axis=0) for cloud in clouds], axis=0) - MARGIN
    high = np.max([cloud.max(axis=0) for cloud in clouds], axis=0) + MARGIN
    return VoxelGrid.around(low, high, max(CELL, float((high - low).max()) / MOST_CELLS))


def solid_depth(grid: VoxelGrid, solids: list[Surface]) -> Float32Array:
    """Return the extinction (X, Y, Z) of meshes, per metre."""
    nothing = Strands(np.empty((0, 3), np.float32), np.zeros(1, np.int64))
    fine = hair_density(nothing, solids)
    points = grid.centres().reshape(-1, 3)
    index = fine.grid.index_from_head(points)
    inside = ((index >= 0) & (index <= np.array(fine.grid.shape) - 1)).all(axis=1)
    extinction = np.zeros(len(points), np.float32)
    extinction[inside] = fine.grid.sample(fine.extinction, points[inside])
    return extinction.reshape(grid.shape)
