"""Draw hair that follows guides on the CPU, and composite it over the picture.

Software OpenGL runs shaders on the CPU in lockstep and makes poor use of its caches; these compiled
loops draw the same hair about three times faster. Tests compare the result with `HairPass`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.parallel import parallel_for, thread_count
from hairkit.rendering.gl_camera import NEAREST
from hairkit.rendering.hair import strand_numbers
from hairkit.viewer.draw import mesh_edges, place_kernels, raster_kernels, shade_kernels
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.interface import HairLook, HairScene, HairView
from hairkit.viewer.draw.place_kernels import SLICES, TILE
from hairkit.viewer.draw.records import (
    Chunks,
    Columns,
    Guides,
    HairData,
    HairShading,
    HairState,
    Strokes,
    ViewCells,
    project_from,
    shading_of,
)
from hairkit.viewer.draw.region import NOWHERE, Region

MOST_CHUNKS = 8
"""Each thread draws into sums of its own, which are added up for every picture."""
PIECE, GUIDES, TILES, ROWS = 256, 64, 8, 32
"""Least numbers of hairs, of guides, of rows of tiles and of rows of pixels for a thread."""
FARTHEST = 100.0
"""Guide coordinates are clamped to this, metres from the head's origin."""
EDGE = 3
"""Margin around the outermost points for the width of strokes, pixels."""


class SoftHairPass:
    """The hair's arrays and the compiled passes that draw it; the CPU twin of `HairPass`."""

    def __init__(self, body: HairBody) -> None:
        self.body = body
        count, points = len(body), body.points_each
        self._state = HairState(
            np.empty((count, points, 3), np.float32),
            np.empty((count, points, 4), np.float32),
            np.zeros((count, points, 4), np.float32),
            np.empty((count, points), np.int8),
            np.empty((count, 2), np.float32),
        )
        self._random = np.asarray(strand_numbers(count), np.float32)
        rest = np.ascontiguousarray(body.guide_rest, np.float32)
        guides = len(rest)
        self._rest = place_kernels.RestGuides(
            place_kernels.segments(rest), np.empty((guides, 4, points), np.float32)
        )
        place_kernels.carry_frames(0, guides, self._rest.segments, rest, self._rest.frames)
        edges = place_kernels.in_lanes(body.edges, np.zeros(3, np.float32))
        self._hair = HairData(body.followed, body.weights, edges, body.widths)
        resting = np.array([1, 0, 0, 0, 1], np.float32)
        turns = place_kernels.in_lanes(np.tile(resting, (guides, points, 1)), resting)
        self._guides = Guides(rest, turns)
        self._tones = shade_kernels.tone_table()
        chunks = min(thread_count(), MOST_CHUNKS)
        self._chunks = Chunks(
            np.empty((chunks, *edges.shape[1:]), np.float32), np.empty((chunks, 4), np.float32)
        )
        self._cells = self._make_cells((0, 0))
        self._sums = np.zeros((0, 4), np.float32)
        self._picture = np.empty((0, 0, 4), np.uint8)
        self._hair_region = NOWHERE
        mixed = np.einsum("sg,sgkc->skc", body.weights, body.colours[body.followed])
        self._colours = shade_kernels.fibre_colours(mixed, self._random)

    def release(self) -> None:
        """Do nothing: there are no GPU objects."""

    def places(self) -> Float32Array:
        """Return the last positions (S, m, 3) of the hair, head frame, metres."""
        return self._state.places

    def move_guides(self, rows: Float32Array) -> Float32Array:
        """Move the guides to `rows` (G, m, 3), head frame, metres; return them as points (N, 3)."""
        # compiled loops do not check bounds: replace NaN and infinity of a diverged simulation
        tame = np.nan_to_num(np.clip(rows, -FARTHEST, FARTHEST))
        now = Guides(np.ascontiguousarray(tame, np.float32), self._guides.turns)
        parallel_for(place_kernels.turn_guides, len(tame), self._rest, now, min_chunk=GUIDES)
        self._guides = now
        return now.points.reshape(-1, 3)

    def place(self, view: HairView, look: HairLook) -> None:
        """Interpolate the hair from the guides and accumulate its opacity by depth."""
        camera, near, far = view.camera, view.hair_depth.near, view.hair_depth.far
        self._strokes = Strokes(
            project_from(camera, view.depth),
            np.float32(near),
            np.float32(SLICES / (far - near)),
            np.float32(look.dimming),
            np.float32(look.times_wider),
            look.hairs,
            look.smooth,
        )
        tiles = (-(-camera.height // TILE), -(-camera.width // TILE))
        if self._cells.filled.shape[2:] != tiles:
            self._cells = self._make_cells(tiles)
        cells, chunks = self._cells, self._chunks
        placing = self._guides, self._hair, self._strokes, self._state, cells, chunks
        parallel_for(place_kernels.place_hair, len(chunks.corners), *placing)
        corners = chunks.corners
        size = np.array([camera.width, camera.height])
        low = np.clip(np.floor(corners[:, :2].min(axis=0)) - EDGE, 0, size - 1).astype(int)
        high = np.clip(np.ceil(corners[:, 2:].max(axis=0)) + EDGE, low + 1, size).astype(int)
        self._hair_before, self._hair_region = self._hair_region, Region(*low, *high)
        cells.used[:2] = np.maximum(low // TILE - 1, 0)  # shading interpolates between neighbours
        cells.used[2:] = np.minimum(high // TILE + 2, tiles[::-1])
        rows = int(cells.used[3] - cells.used[1])
        parallel_for(place_kernels.accumulate_opacity, rows, cells, min_chunk=TILES)

    def draw(self, scene: HairScene) -> None:
        """Draw the meshes into the picture, and over them hair that is nearer."""
        view, look = scene.view, scene.look
        left, right = self._hair_region.left, self._hair_region.right
        solid = scene.meshes.depth[left:right]
        if len(self._sums) < solid.size:
            self._sums = np.zeros((scene.meshes.depth.size, 4), np.float32)
        beside = self._beside(view, look.times_wider)
        columns = Columns(solid, np.float32(left), beside, self._sums)
        light = shading_of(view.camera, scene.lights, scene.light.grid, scene.light.array)
        around = shade_kernels.light_around(scene.lights)
        shading = HairShading(
            light, self._colours, self._random, around, look.by_direction, self._tones
        )
        lit = self._state, self._cells.opacity, self._strokes, shading, columns
        parallel_for(shade_kernels.shade_hair, look.hairs, *lit, min_chunk=PIECE)
        drawn = self._state, self.body.widths, self._strokes, columns
        strips = -(-(right - left) // raster_kernels.STRIP)
        parallel_for(raster_kernels.draw_hair, strips, *drawn)
        self._composite(scene.meshes)
        target: Any = scene.target.color_attachments[0]
        target.write(self._picture)

    def _composite(self, meshes: Any) -> None:
        """Write the picture where hair or meshes are or were, and clear the sums.

        Outlines of meshes are smoothed last, so that hair behind them shows through.
        """
        behind, hair = meshes.picture, self._hair_region
        changed = self._hair_before.union(hair).union(meshes.take_changed())
        if self._picture.shape != behind.shape:
            self._picture, changed = np.empty_like(behind), Region(0, 0, *behind.shape[1::-1])
            self._replaced = mesh_edges.Replaced.for_picture(behind)
        parts = self._sums, np.array(hair), np.array(changed), behind, self._picture
        rows = changed.bottom - changed.top
        mesh_edges.put_back(self._picture, self._replaced)
        parallel_for(raster_kernels.composite, rows, *parts, min_chunk=ROWS)
        meshes.smooth(self._picture, self._replaced)

    def _make_cells(self, tiles: tuple[int, int]) -> ViewCells:
        """Return empty cells of so many tiles, y and x."""
        filled = np.zeros((len(self._chunks.corners), SLICES, *tiles), np.uint32)
        return ViewCells(filled, np.empty((SLICES + 1, *tiles), np.float32), np.zeros(4, np.int64))

    def _beside(self, view: HairView, wider: float) -> np.float32:
        """Return how far a stroke may reach beside its ends, pixels."""
        scale = view.camera.focal
        if view.camera.model == "perspective":
            scale /= max(view.hair_depth.near, NEAREST)
        widest = float(self.body.widths.max(initial=0.0)) * wider * scale
        return np.float32(min(widest, float(raster_kernels.WIDEST)) + 1)
