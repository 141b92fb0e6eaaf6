"""Draw hair that follows guides on the CPU, and composite it over the picture.

Software OpenGL runs shaders on the CPU in lockstep and makes poor use of its caches; these compiled
loops draw the same hair about three times faster. Tests compare the result with `HairPass`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.parallel import parallel_for, thread_count
from hairkit.rendering.gl_camera import NEAREST, DepthRange, clip_from_camera
from hairkit.rendering.hair import strand_numbers
from hairkit.types.camera import Camera
from hairkit.viewer.draw import mesh_edges, place_kernels, raster_kernels, shade_kernels
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.interface import HairLook, HairScene, HairView
from hairkit.viewer.draw.region import NOWHERE, Region

MOST_CHUNKS = 8
"""Each thread draws into sums of its own, which are added up for every picture."""
PIECE = 256
"""Hairs that a thread shades at a time, at least."""
FARTHEST = 100.0
"""Guide coordinates are clamped to this, metres from the head's origin."""
EDGE = 3
"""Margin around the outermost points for the width of strokes, pixels."""


class SoftHairPass:
    """The hair's arrays and the compiled passes that draw it; the CPU twin of `HairPass`."""

    def __init__(self, body: HairBody) -> None:
        self.body = body
        count, points = len(body), body.points_each
        self._places = np.empty((count, points, 3), np.float32)
        self._seen = np.empty((count, points, 4), np.float32)
        self._looks = np.zeros((count, points, 4), np.float32)
        self._hidden = np.empty((count, points), np.int8)
        self._reach = np.empty((count, 2), np.float32)
        self._random = np.asarray(strand_numbers(count), np.float32)
        rest = np.ascontiguousarray(body.guide_rest, np.float32)
        guides = len(rest)
        self._rest = place_kernels.RestGuides(
            place_kernels.segments(rest), np.empty((guides, 4, points), np.float32)
        )
        place_kernels.carry_frames(0, guides, self._rest.segments, rest, self._rest.frames)
        self._edges = place_kernels.in_lanes(body.edges, np.zeros(3, np.float32))
        resting = np.array([0, 0, 0, 1, 1], np.float32)
        self._turns = place_kernels.in_lanes(np.tile(resting, (guides, points, 1)), resting)
        self._tones = shade_kernels.tone_table()
        self._chunks = min(thread_count(), MOST_CHUNKS)
        self._way = np.empty((self._chunks, *self._edges.shape[1:]), np.float32)
        self._sums = np.zeros((0, 4), np.float32)
        self._picture = np.empty((0, 0, 4), np.uint8)
        self._filled = np.empty((0, 0, 0, 0), np.uint32)
        self._hair_region = NOWHERE
        self._colours: tuple[object, Float32Array] | None = None

    def release(self) -> None:
        """Do nothing: there are no GPU objects."""

    def places(self) -> Float32Array:
        """Return the last positions (S, m, 3) of the hair, head frame, metres."""
        return self._places

    def move_guides(self, rows: Float32Array) -> Float32Array:
        """Move the guides to `rows` (G, m, 3), head frame, metres; return them as points (N, 3)."""
        # compiled loops do not check bounds: replace NaN and infinity of a diverged simulation
        tame = np.nan_to_num(np.clip(rows, -FARTHEST, FARTHEST))
        self._now = np.ascontiguousarray(tame, np.float32)
        rest, turns = self._rest, self._turns
        parallel_for(place_kernels.turn_guides, len(turns), *rest, self._now, turns, min_chunk=64)
        return self._now.reshape(-1, 3)

    def place(self, view: HairView, look: HairLook) -> None:
        """Interpolate the hair from the guides and accumulate its opacity by depth."""
        body, camera = self.body, view.camera
        self._camera = pack_camera(camera, view.depth)
        near, far = view.hair_depth.near, view.hair_depth.far
        per_metre = place_kernels.SLICES / (far - near)
        self._slices = np.array([near, per_metre, look.dimming], np.float32)
        tiles = (-(-camera.height // place_kernels.TILE), -(-camera.width // place_kernels.TILE))
        if self._filled.shape[2:] != tiles:
            self._filled = np.zeros((self._chunks, place_kernels.SLICES, *tiles), np.uint32)
            self._opacity = np.empty((place_kernels.SLICES + 1, *tiles), np.float32)
            self._used = np.zeros(4, np.int64)
        corners = np.empty((self._chunks, 4), np.float32)
        parallel_for(
            place_kernels.place_hair,
            self._chunks,
            self._now,
            self._turns,
            body.followed,
            body.weights,
            self._edges,
            body.widths,
            self._camera,
            self._slices,
            np.float32(look.times_wider),
            look.hairs,
            self._way,
            self._places,
            self._seen,
            self._filled,
            self._used,
            corners,
        )
        size = np.array([camera.width, camera.height])
        low = np.clip(np.floor(corners[:, :2].min(axis=0)) - EDGE, 0, size - 1).astype(int)
        high = np.clip(np.ceil(corners[:, 2:].max(axis=0)) + EDGE, low + 1, size).astype(int)
        self._hair_before, self._hair_region = self._hair_region, Region(*low, *high)
        tile = place_kernels.TILE  # shading interpolates between neighbours
        self._used[:2] = np.maximum(low // tile - 1, 0)
        self._used[2:] = np.minimum(high // tile + 2, tiles[::-1])
        opacity, rows = (self._filled, self._used, self._opacity), self._used[3] - self._used[1]
        parallel_for(place_kernels.accumulate_opacity, int(rows), *opacity, min_chunk=8)

    def draw(self, scene: HairScene) -> None:
        """Draw the meshes into the picture, and over them hair that is nearer."""
        view, look = scene.view, scene.look
        left, right = self._hair_region.left, self._hair_region.right
        solid = scene.meshes.depth[left:right]
        corner = np.array([left, 0], np.float32)
        if len(self._sums) < solid.size:
            self._sums = np.zeros((scene.meshes.depth.size, 4), np.float32)
        wider = np.float32(look.times_wider)
        beside = self._beside(view, float(wider))
        shading = shade_kernels.pack_shading(
            view.camera, scene.lights, scene.light.grid, direction=look.by_direction
        )
        parallel_for(
            shade_kernels.shade_hair,
            look.hairs,
            self._seen,
            self._places,
            self._fibres(look),
            self._random,
            self._opacity,
            self._slices,
            shading,
            scene.light.array,
            self._tones,
            solid,
            corner,
            beside,
            self._looks,
            self._hidden,
            self._reach,
            min_chunk=PIECE,
        )
        parallel_for(
            raster_kernels.draw_hair,
            -(-(right - left) // raster_kernels.STRIP),
            self._seen,
            self._looks,
            self._hidden,
            self._reach,
            self.body.widths,
            solid,
            self._camera,
            wider,
            int(look.smooth),
            look.hairs,
            corner,
            beside,
            self._sums,
        )
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
        parallel_for(raster_kernels.composite, rows, *parts, min_chunk=32)
        meshes.smooth(self._picture, self._replaced)

    def _beside(self, view: HairView, wider: float) -> np.float32:
        """Return how far a stroke may reach beside its ends, pixels."""
        scale = view.camera.focal
        if view.camera.model == "perspective":
            scale /= max(view.hair_depth.near, NEAREST)
        widest = float(self.body.widths.max(initial=0.0)) * wider * scale
        return np.float32(min(widest, raster_kernels.WIDEST) + 1)

    def _fibres(self, look: HairLook) -> Float32Array:
        key = (look.root_colour, look.tip_colour)
        if self._colours is None or self._colours[0] != key:
            made = shade_kernels.fibre_colours(*key, self._random, self.body.points_each)
            self._colours = (key, made)
        return self._colours[1]


def pack_camera(camera: Camera, depth: DepthRange) -> Float32Array:
    """Return (24,): clip_from_head by rows, forward and offset, size, focal length, perspective."""
    matrix = clip_from_camera(camera, depth) @ camera.camera_from_head
    rest = [
        *camera.forward, camera.translation[2], camera.width, camera.height, camera.focal,
        float(camera.model == "perspective"),
    ]  # fmt: skip
    return np.concatenate([matrix.ravel(), rest]).astype(np.float32)
