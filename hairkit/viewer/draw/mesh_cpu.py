"""Studio and meshes drawn on the CPU by compiled loops on all cores.

A software renderer shades vertices and sets up triangles on one core, which took a quarter of a
picture's time; these loops share the work, and hand picture and depth to the hair as arrays.
"""

from __future__ import annotations

from typing import Any

import cv2
import moderngl
import numpy as np

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.parallel import parallel_for
from hairkit.rendering.context import Renderer
from hairkit.rendering.head import Solid
from hairkit.types.skin_look import SkinLook
from hairkit.viewer.draw import mesh_edges, mesh_kernels, mesh_raster, shade_kernels
from hairkit.viewer.draw.interface import MeshScene
from hairkit.viewer.draw.mesh_layer import MeshLayer
from hairkit.viewer.draw.meshes import PlacedMesh
from hairkit.viewer.draw.records import project_from, shading_of
from hairkit.viewer.draw.region import NOWHERE, Region

CHUNKS = 8
"""Parts of a mesh whose seen faces are listed apart."""
PIECE, COLUMNS = 512, 32
"""Vertices and columns of pixels that are worth a call on another thread."""


class SoftSolid(PlacedMesh):
    """A mesh in arrays that the kernels read, and what their passes hand on."""

    def __init__(self, gl: Renderer, solid: Solid) -> None:
        super().__init__(gl, solid)
        count, faces = len(solid.vertices), len(solid.faces)
        uv = np.zeros((count, 2)) if solid.uv is None else solid.uv
        held = np.ones(count) if solid.held is None else solid.held
        self._mesh = mesh_kernels.MeshData(
            np.array(solid.vertices, np.float32, order="C"),
            np.array(solid.normals, np.float32, order="C"),
            np.array(solid.colours, np.float32, order="C"),
            np.array(uv, np.float32, order="C"),
            np.array(held, np.float32),
            np.array(solid.faces, np.int32, order="C"),
        )
        self._state = mesh_kernels.MeshState(
            np.empty((count, 3), np.float32),
            np.empty((count, 3), np.float32),
            np.empty((count, 4), np.float32),
            np.empty(count, np.uint8),
            np.empty((count, 3), np.float32),
            np.empty((count, 3), np.float32),
            np.empty(faces, np.int32),
            np.empty((faces, 2), np.int32),
            np.empty(CHUNKS, np.int32),
            np.empty((CHUNKS, 4), np.int32),
        )
        self._edges = mesh_edges.list_edges(self._mesh.vertices, self._mesh.faces)
        self._outlines = np.empty((len(self._edges), 3), np.int32)
        look = SkinLook()
        self._oil = mesh_kernels.Oil(
            np.float32(solid.scatter), np.float32(look.roughness**2), np.float32(look.f0)
        )
        textured = solid.uv is not None and solid.maps is not None
        picture = solid.maps.albedo if textured and solid.maps is not None else None
        self._albedo = mipmaps(None if picture is None else picture.pixels[::-1])

    def draw(
        self, scene: MeshScene, push: float, picture: UInt8Array, depth: Float32Array
    ) -> Region:
        """Draw the mesh into a picture (H, W, 4) and its depth (W, H), `push` metres farther.

        Returns the region that it covers.
        """
        mesh, state = self._mesh, self._state
        motion = self.motion[:3].astype(np.float32)
        camera = project_from(scene.camera, scene.depth)
        light = shading_of(scene.camera, scene.lights, scene.light.grid, scene.light.array)
        count, (width, height) = len(mesh.vertices), depth.shape
        placing = mesh, motion, camera, np.float32(push), state
        parallel_for(mesh_kernels.place_vertices, count, *placing, min_chunk=PIECE)
        parallel_for(mesh_kernels.select_faces, CHUNKS, mesh, width, height, state)
        lit = mesh, light, self._oil, state
        parallel_for(mesh_kernels.light_vertices, count, *lit, min_chunk=PIECE)
        strips, drawn = -(-width // mesh_raster.STRIP), (self._albedo, depth, picture)
        parallel_for(mesh_raster.draw_faces, strips, mesh, state, *drawn)
        self._outline_count = mesh_edges.select_outlines(self._edges, state.seen, self._outlines)
        low, high = state.covered[:, :2].min(axis=0), state.covered[:, 2:].max(axis=0)
        return Region(*low.tolist(), *high.tolist())

    def smooth(
        self,
        meshes: UInt8Array,
        depth: Float32Array,
        picture: UInt8Array,
        replaced: mesh_edges.Replaced,
    ) -> None:
        """Smooth the outlines of the mesh as it was drawn last; see `smooth_outlines`."""
        outlines, seen = self._outlines[: self._outline_count], self._state.seen
        mesh_edges.smooth_outlines(outlines, seen, meshes, depth, picture, replaced)


class SoftMeshLayer(MeshLayer[SoftSolid]):
    """The layer as arrays on the CPU."""

    picture: UInt8Array
    """(H, W, 4) RGBA, opaque."""
    depth: Float32Array
    """(W, H) depth buffer, 1 where there is no mesh."""
    _changed = NOWHERE
    _moved = NOWHERE
    """Region of the meshes that move."""
    _fixed: tuple[SoftSolid, ...] = ()
    """Meshes of the scenery."""
    _outlined: tuple[SoftSolid, ...] = ()
    """Meshes of which outlines are to be smoothed."""

    def take_changed(self) -> Region:
        """Return the region that has changed since the last call."""
        changed, self._changed = self._changed, NOWHERE
        return changed

    def smooth(self, picture: UInt8Array, replaced: mesh_edges.Replaced) -> None:
        """Smooth the outlines of meshes in a picture (H, W, 4) of them and what is before them."""
        for part in self._outlined:
            part.smooth(self.picture, self.depth, picture, replaced)

    def show(self, target: moderngl.Framebuffer) -> None:
        """Copy the layer to a picture of one texture."""
        texture: Any = target.color_attachments[0]
        shown = self.picture.copy()
        self.smooth(shown, mesh_edges.Replaced.for_picture(shown))
        texture.write(shown)

    def depth_texture(self) -> moderngl.Texture:
        """Return the depth of the meshes."""
        self._depth_texture.write(np.ascontiguousarray(self.depth.T))
        return self._depth_texture

    def _load(self, solid: Solid) -> SoftSolid:
        return SoftSolid(self._gl, solid)

    def _make_targets(self, size: tuple[int, int]) -> None:
        width, height = size
        self.picture, self._scenery = (np.empty((height, width, 4), np.uint8) for _ in range(2))
        self.depth, self._scenery_depth = (np.empty(size, np.float32) for _ in range(2))
        self._depth_texture = self._gl.context.depth_texture(size)
        self._depth_texture.compare_func = ""

    def _release_targets(self) -> None:
        if self._size != (0, 0):
            self._depth_texture.release()

    def _draw_scenery(self, scene: MeshScene, parts: list[SoftSolid]) -> None:
        inputs = scene.inputs
        self._scenery[:] = self._studio.read(inputs.camera, inputs.floor, inputs.backdrop)
        self._scenery_depth[:] = 1.0
        for part in parts:
            part.draw(scene, self._push(part), self._scenery, self._scenery_depth)
        self._moved, self._fixed = Region(0, 0, *self._size), tuple(parts)

    def _draw_moving(self, scene: MeshScene, parts: list[SoftSolid]) -> None:
        before, self._moved = self._moved, NOWHERE
        restored = self._scenery, self._scenery_depth, self.picture, self.depth
        columns, region = before.right - before.left, np.array(before)
        parallel_for(mesh_raster.restore, columns, region, *restored, min_chunk=COLUMNS)
        if scene.inputs.fine_skin:
            self._read_fine_skin(scene, parts)
            self._outlined = ()  # samples of a still picture are smooth together
            self._moved = Region(0, 0, *self._size)
        else:
            for part in parts:
                covered = part.draw(scene, self._push(part), self.picture, self.depth)
                self._moved = self._moved.union(covered)
            self._outlined = (*self._fixed, *parts)
        self._changed = self._changed.union(before).union(self._moved)

    def _read_fine_skin(self, scene: MeshScene, parts: list[SoftSolid]) -> None:
        """Draw meshes with diffused light by shaders, over the studio."""
        context, size = self._gl.context, self._size
        colours, depths = context.texture(size, 4, self.picture), context.depth_texture(size)
        target = context.framebuffer([colours], depths)
        target.use()
        target.depth_mask = True
        context.framebuffer([], depths).clear(depth=1.0)
        self._draw_fine_skin(scene, parts)
        (width, height), pixels = size, target.read(components=4, alignment=1)
        self.picture[:] = np.frombuffer(pixels, np.uint8).reshape(height, width, 4)
        pixels = target.read(components=1, attachment=-1, alignment=1, dtype="f4")
        self.depth[:] = np.frombuffer(pixels, np.float32).reshape(height, width).T
        self._gl.home.use()
        for made in (target, colours, depths):
            made.release()


def mipmaps(pixels: UInt8Array | None) -> mesh_raster.Albedo:
    """Return a picture (H, W, 3), lowest row first, and its halves down to one texel."""
    levels, sizes, start = [], [], 0
    while pixels is not None:
        height, width = pixels.shape[:2]
        levels.append(np.ascontiguousarray(pixels).reshape(-1, 3))
        sizes.append((start, width, height))
        start += width * height
        if (height, width) == (1, 1):
            break
        half = max(width // 2, 1), max(height // 2, 1)
        smaller = cv2.resize(np.ascontiguousarray(pixels), half, interpolation=cv2.INTER_AREA)
        pixels = np.asarray(smaller, np.uint8)
    texels = np.concatenate(levels) if levels else np.empty((0, 3), np.uint8)
    tones = np.rint(255 * shade_kernels.tone_table()).astype(np.uint8)
    return mesh_raster.Albedo(texels, np.array(sizes, np.int32).reshape(-1, 3), tones)
