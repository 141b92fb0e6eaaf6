"""The light volume of moving hair: what reaches each place, kept up to date a part a picture."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from hairkit.render.context import Renderer
from hairkit.render.head import Mesh
from hairkit.render.light import FULL_HEAD, HAIR_WIDTH, STOPPED, Lights, hair_density
from hairkit.render.projection import set_uniforms
from hairkit.stored import Float32Array
from hairkit.strands import Strands
from hairkit.volume import VoxelGrid

CELL = 0.01
"""Edge of a cell, metres."""
MOST_CELLS = 56
"""Along the longest side; longer hair gets larger cells."""
REACH = 0.08
"""Room around the hair at rest, metres."""
TURNS = 6
"""Pictures that share the work of one volume."""


class LightPass:
    """A 3D texture of the light that reaches hair and head, in the head frame."""

    def __init__(self, gl: Renderer, guides: Strands, solids: list[Mesh]) -> None:
        self._gl = gl
        self.grid = _grid(guides, solids)
        cells = self.grid.shape
        self._cells: tuple[int, int, int] = (cells[0], cells[1], cells[2])
        taken = _solid_depth(self.grid, solids)
        self._solids = gl.context.buffer(np.ascontiguousarray(taken.transpose(2, 1, 0)))
        self._dense = gl.context.buffer(reserve=4 * taken.size)
        self.texture, self._coming = (_volume(gl, self._cells, 4, "f2") for _ in range(2))
        """What is seen; what is in the making, in turns, for one state of hair and lights."""
        self._taken = _volume(gl, self._cells, 1, "f4")
        self._turn = 0
        self._lights: Lights | None = None

    def release(self) -> None:
        """Free buffers and texture."""
        self._solids.release()
        self._dense.release()
        self._taken.release()
        self._coming.release()
        self.texture.release()

    def uniforms(self) -> dict[str, Any]:
        """Return the values of `lighting.glsl` that place the volume, bound as texture 0."""
        size = np.array(self.grid.shape) * self.grid.spacing
        return {
            "u_light": 0,
            "u_volume_origin": tuple(self.grid.origin.tolist()),
            "u_volume_size": tuple(size.tolist()),
        }

    def update(
        self, places: moderngl.Buffer, points: int, hairs: int, lights: Lights, *, whole: bool
    ) -> None:
        """Make a part of the next volume, or all of it, for the placed hair and the lights."""
        turns = 1 if whole else TURNS
        self._turn = 0 if whole else self._turn % TURNS
        if self._turn == 0 or self._lights is None:
            self._fill(places, points, hairs)
            self._lights = lights
        light = self._gl.compute("viewer_light")
        set_uniforms(
            light,
            u_cells=self._cells,
            u_spacing=self.grid.spacing,
            u_taken=3,
            u_key_direction=self._lights.key_direction,
            u_rim_direction=self._lights.rim_direction,
            u_turn=self._turn,
            u_turns=turns,
        )
        self._taken.use(3)
        self._coming.bind_to_image(0, read=False, write=True)
        x, y, z = self._cells
        light.run(-(-x // 8), -(-y // 8), -(-z // turns))
        self._gl.context.memory_barrier()
        self._turn += 1
        if self._turn == turns:
            self.texture, self._coming = self._coming, self.texture
            self._turn = 0

    def _fill(self, places: moderngl.Buffer, points: int, hairs: int) -> None:
        fill = self._gl.compute("viewer_density")
        self._dense.clear()
        places.bind_to_storage_buffer(3)
        self._dense.bind_to_storage_buffer(0)
        set_uniforms(fill, u_points=points, u_count=hairs, u_cells=self._cells, **self.uniforms())
        fill.run(max(-(-hairs // 64), 1))
        self._gl.context.memory_barrier()
        taken = self._gl.compute("viewer_taken")
        stands_for = max(FULL_HEAD / max(hairs, 1), 1.0) * HAIR_WIDTH * np.pi / 4
        per_micrometre = 1e-6 * stands_for * STOPPED / self.grid.spacing**3
        set_uniforms(taken, u_cells=self._cells, u_taken_by_hair=per_micrometre)
        self._solids.bind_to_storage_buffer(1)
        self._taken.bind_to_image(0, read=False, write=True)
        x, y, z = self._cells
        taken.run(-(-x // 8), -(-y // 8), z)
        self._gl.context.memory_barrier()


def _volume(
    gl: Renderer, cells: tuple[int, int, int], components: int, kind: str
) -> moderngl.Texture3D:
    """Return a texture of ones."""
    ones = np.ones(int(np.prod(cells)) * components, f"f{kind[1]}")
    texture = gl.context.texture3d(cells, components, ones.tobytes(), dtype=kind)
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = texture.repeat_z = False
    return texture


def _grid(guides: Strands, solids: list[Mesh]) -> VoxelGrid:
    clouds = [guides.points, *[solid.vertices for solid in solids]]
    low = np.min([cloud.min(axis=0) for cloud in clouds], axis=0) - REACH
    high = np.max([cloud.max(axis=0) for cloud in clouds], axis=0) + REACH
    return VoxelGrid.around(low, high, max(CELL, float((high - low).max()) / MOST_CELLS))


def _solid_depth(grid: VoxelGrid, solids: list[Mesh]) -> Float32Array:
    """Return (X, Y, Z) what solids take from light per metre."""
    nothing = Strands(np.empty((0, 3), np.float32), np.zeros(1, np.int64))
    fine = hair_density(nothing, solids)
    points = grid.centres().reshape(-1, 3)
    index = fine.grid.index_from_head(points)
    inside = ((index >= 0) & (index <= np.array(fine.grid.shape) - 1)).all(axis=1)
    taken = np.zeros(len(points), np.float32)
    taken[inside] = fine.grid.sample(fine.taken, points[inside])
    return taken.reshape(grid.shape)
