"""Lights, and a volume of their transmittance through hair and head.

Optical depth is integrated through a grid of hair density along each light's direction: a coarse
form of opacity shadow maps (Kim and Neumann 2001), computed on the CPU.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, uniform_filter

from hairkit.arrays import Float32Array
from hairkit.types.camera import Camera
from hairkit.types.preview import Surface
from hairkit.types.strands import Strands
from hairkit.types.volume import VoxelGrid

CELL = 0.005
"""Edge of a cell of the light volume, metres."""
MARGIN = 5
"""Cells around hair and meshes, so that at its border the volume has all of the light."""
MAX_EDGE = 128
"""Cells along the longest side at most; hair that is longer gets larger cells."""
FULL_HEAD = 100_000
"""Hairs on a head; fewer strands absorb as much light as this many."""
HAIR_WIDTH = 8e-5
"""Diameter of a hair for the shadows, metres."""
ABSORBED_SHARE = 0.3
"""Share of the light at a hair that is absorbed; the rest scatters forward (dark hair)."""
STEPS = 28
"""Samples along the ray to a light."""
STEP_GROWTH, FIRST_STEP = 1.08, 0.9
"""Ratio of successive steps along that ray, and the first sample in cells."""
SOFTNESS = 0.008
"""Sigma of the Gaussian that smooths transmittance, metres: lamps are wide, and light that hair
scatters goes sideways too. Contrast at 3 px over the photos' is 1.29 on `straight_long` and 0.78 on
`curls`; 1.43 and 0.82 with half of it, 1.12 and 0.72 with twice as much."""
SOLID = 250.0
"""Optical depth of meshes, per metre."""
KEY_DIRECTION, RIM_DIRECTION = (-0.45, -0.6, -0.75), (0.55, -0.6, 0.55)
"""Towards the lights at a camera, in its axes (x right, y down): above left, behind right."""
EXPOSURE = 0.5
"""Factor of the light at a camera: skin and hair are about as bright as in photos of lit rooms."""
SKY_WEIGHTS = (1.0, 2.0, 1.0)
"""Weights of the sky along +x, +y and +z; that along the opposite axes is 1."""


@dataclass(frozen=True)
class Lights:
    """Key light, rim light and sky; directions point towards the light, head frame, unit."""

    key_direction: tuple[float, float, float]
    rim_direction: tuple[float, float, float]
    key_colour: tuple[float, float, float] = (2.3, 2.2, 2.05)
    rim_colour: tuple[float, float, float] = (1.5, 1.55, 1.65)
    sky_colour: tuple[float, float, float] = (0.75, 0.78, 0.85)
    ground_colour: tuple[float, float, float] = (0.35, 0.33, 0.32)
    exposure: float = 0.7

    @classmethod
    def at_camera(cls, camera: Camera) -> Lights:
        """Return lights fixed to a camera: key above on the left, rim behind on the right."""
        key, rim = np.array(KEY_DIRECTION), np.array(RIM_DIRECTION)
        return cls.studio(key @ camera.rotation, rim @ camera.rotation, EXPOSURE)

    @classmethod
    def studio(cls, key: npt.ArrayLike, rim: npt.ArrayLike, exposure: float = 0.7) -> Lights:
        """Return a sky, a warm key and a cool rim light from directions (3,) towards the lights."""
        return cls(_unit(key), _unit(rim), exposure=exposure)

    def uniforms(self) -> dict[str, Any]:
        """Return the values of `lighting.glsl` and `tone.glsl`."""
        return {f"u_{field.name}": getattr(self, field.name) for field in fields(self)}


@dataclass(frozen=True)
class Density:
    """Extinction coefficient of hair and meshes on a grid."""

    grid: VoxelGrid
    extinction: Float32Array
    """(X, Y, Z) optical depth per metre."""


@dataclass(frozen=True)
class LightVolume:
    """Transmittance of the lights in each cell."""

    grid: VoxelGrid
    transmittance: Float32Array
    """(X, Y, Z, 3): transmittance towards key and rim light, share of the sky seen."""

    @property
    def size(self) -> tuple[int, int, int]:
        """Number of cells along x, y, z."""
        x, y, z = self.grid.shape
        return x, y, z

    def texels(self) -> bytes:
        """Return the values in OpenGL's order, x fastest."""
        return self.transmittance.transpose(2, 1, 0, 3).tobytes()

    def uniforms(self) -> dict[str, Any]:
        """Return the values of `light_volume.glsl` that place the volume."""
        size = np.array(self.grid.shape) * self.grid.spacing
        return {
            "u_volume_origin": tuple(self.grid.origin.tolist()),
            "u_volume_size": tuple(size.tolist()),
        }


def hair_density(strands: Strands, solids: Sequence[Surface], cell: float = CELL) -> Density:
    """Return the extinction of hair and meshes on a grid around them, its cells `cell` metres."""
    points = [strands.points, *[solid.vertices for solid in solids]]
    low = np.min([p.min(axis=0) for p in points if len(p)], axis=0) - MARGIN * cell
    high = np.max([p.max(axis=0) for p in points if len(p)], axis=0) + MARGIN * cell
    grid = VoxelGrid.around(low, high, max(cell, float((high - low).max()) / MAX_EDGE))
    extinction = _hair_extinction(grid, strands)
    under = np.zeros(grid.shape, np.float32)
    for solid in solids:
        _mark_below_surface(under, grid, solid)
    extinction += SOLID * uniform_filter(under, 3)
    return Density(grid, extinction)


def light_volume(density: Density, lights: Lights) -> LightVolume:
    """Return the transmittance of the lights through `density`."""
    grid, extinction = density.grid, density.extinction
    transmittance = np.empty((*grid.shape, 3), np.float32)
    for channel, direction in enumerate((lights.key_direction, lights.rim_direction)):
        depth = _optical_depth_towards(extinction, grid.spacing, np.array(direction))
        transmittance[..., channel] = np.exp(-depth)
    transmittance[..., 2] = _sky_visibility(extinction, grid.spacing)
    sigma = SOFTNESS / grid.spacing
    return LightVolume(grid, gaussian_filter(transmittance, sigma, axes=(0, 1, 2)))


def _hair_extinction(grid: VoxelGrid, strands: Strands) -> Float32Array:
    if not len(strands):
        return np.zeros(grid.shape, np.float32)
    vectors, first = strands.segments()
    middle = strands.points[first] + 0.5 * vectors
    cell = np.ravel_multi_index(tuple(grid.nearest_cell(middle).T), grid.shape)
    cells = int(np.prod(grid.shape))
    length = np.bincount(cell, np.linalg.norm(vectors, axis=1), cells).reshape(grid.shape)
    # mean projected area over all directions: pi / 4 of length times width
    stands_for = max(FULL_HEAD / len(strands), 1.0) * HAIR_WIDTH * np.pi / 4
    extinction = length * stands_for * ABSORBED_SHARE / grid.spacing**3
    return np.asarray(uniform_filter(extinction.astype(np.float32), 3), np.float32)


def _mark_below_surface(marks: Float32Array, grid: VoxelGrid, solid: Surface) -> None:
    """Set the cells just below the surface of a mesh to 1."""
    corners = solid.vertices[solid.faces].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    weights = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]], np.float64)
    weights /= weights.sum(axis=1, keepdims=True)
    for weight in weights:
        under = np.einsum("k,fkc->fc", weight, corners) - 2.0 * grid.spacing * normal
        marks[tuple(grid.nearest_cell(under).T)] = 1


def _optical_depth_towards(
    extinction: Float32Array, spacing: float, direction: npt.NDArray[np.float64]
) -> Float32Array:
    """Return the optical depth (X, Y, Z) from each cell to the light, in growing steps.

    A step leads all cells by the same whole number of cells: the grid is added to itself, shifted.
    """
    edges = np.cumsum(STEP_GROWTH ** np.arange(STEPS + 1)) * FIRST_STEP
    total = np.zeros_like(extinction)
    for near, far in pairwise(edges):
        shift = np.rint(0.5 * (near + far) * direction).astype(int)
        if (np.abs(shift) >= extinction.shape).any():
            break  # beyond the grid there is nothing
        size = zip(shift.tolist(), total.shape, strict=True)
        here = tuple(slice(max(-s, 0), n - max(s, 0)) for s, n in size)
        there = tuple(slice(p.start + s, p.stop + s) for p, s in zip(here, shift, strict=True))
        total[here] += extinction[there] * np.float32((far - near) * spacing)
    return total


def _sky_visibility(extinction: Float32Array, spacing: float) -> Float32Array:
    """Return the mean transmittance (X, Y, Z) along the six axes, with double weight upwards."""
    total = np.zeros_like(extinction)
    for axis, weight_up in enumerate(SKY_WEIGHTS):
        before = np.cumsum(extinction, axis=axis) * spacing
        after = before.take([-1], axis=axis) - before
        total += np.exp(-(before - extinction * spacing)) + weight_up * np.exp(-after)
    return total / np.float32(3 + sum(SKY_WEIGHTS))


def _unit(direction: npt.ArrayLike) -> tuple[float, float, float]:
    vector = np.asarray(direction, np.float64)
    x, y, z = (vector / np.linalg.norm(vector)).tolist()
    return (x, y, z)
