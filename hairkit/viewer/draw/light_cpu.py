"""The light volume on the CPU: the compiled twin of viewer_density.comp and viewer_light.comp.

Optical depth is integrated towards the lights, and along the axes for the sky, with steps of
growing length, one cell lookup each; the density is smoothed first, where the shaders interpolate.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int32Array
from hairkit.parallel import parallel_for, thread_count
from hairkit.rendering.context import Renderer
from hairkit.rendering.head import Mesh
from hairkit.rendering.light import Lights
from hairkit.types.strands import Strands
from hairkit.viewer.draw.interface import HairDrawer
from hairkit.viewer.draw.light_gpu import LightVolume, solid_depth
from hairkit.viewer.draw.place_kernels import shared

STEPS, GROWTH = 9, 1.35
SKY_STEPS, SKY_GROWTH = 5, 1.7
START = 0.8
"""First sample, in cells from the centre of a cell, as in viewer_light.comp."""
_SKY = ((0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1))
_ONE, _HALF, _QUARTER = np.float32(1), np.float32(0.5), np.float32(0.25)


class SoftLightPass(LightVolume):
    """The light volume of hair drawn by `SoftHairPass`."""

    def __init__(self, gl: Renderer, guides: Strands, solids: list[Mesh]) -> None:
        super().__init__(gl, guides, solids)
        self._solids = np.ascontiguousarray(solid_depth(self.grid, solids).transpose(2, 1, 0))
        self._extinction, self._rough = np.zeros_like(self._solids), np.zeros_like(self._solids)
        self._dense = np.zeros((thread_count(), *self._solids.shape), np.uint32)
        self._coming = np.ones((*self._solids.shape, 4), np.float32)
        self.array = self._coming.copy()
        """(Z, Y, X, 4) transmittance towards key and rim light, visible share of the sky."""

    def _fill(self, hair: HairDrawer, hairs: int, per_micrometre: float) -> None:
        origin = self.grid.origin.astype(np.float32)
        per_metre, layers = np.float32(1 / self.grid.spacing), len(self._solids)
        parallel_for(
            fill_cells, len(self._dense), hair.places(), hairs, origin, per_metre, self._dense
        )
        extinction, rough = self._extinction, self._rough
        stops = np.float32(per_micrometre)
        parallel_for(
            sum_cells, layers, self._dense, self._solids, stops, extinction, rough, min_chunk=8
        )
        parallel_for(smooth_cells, layers, rough, extinction, min_chunk=8)

    def _light(self, lights: Lights, turn: int, turns: int) -> None:
        spacing = self.grid.spacing
        way_of_key, depth = _way(lights.key_direction, STEPS, GROWTH, spacing)
        way_of_rim, _ = _way(lights.rim_direction, STEPS, GROWTH, spacing)
        ways = [_way(direction, SKY_STEPS, SKY_GROWTH, spacing) for direction in _SKY]
        layers = -(-(len(self._extinction) - turn) // turns)
        parallel_for(
            light_cells,
            layers,
            self._extinction,
            np.stack([way_of_key, way_of_rim]),
            depth,
            np.stack([way for way, _ in ways]),
            ways[0][1],
            turn,
            turns,
            self._coming,
            min_chunk=2,
        )

    def _show(self) -> None:
        self.array, self._coming = self._coming, self.array
        self.texture.write(self.array.astype(np.float16))


def _way(
    direction: npt.ArrayLike, steps: int, growth: float, spacing: float
) -> tuple[Int32Array, Float32Array]:
    """Return cell offsets (steps, 3), z, y, x, along a direction, and metres in each."""
    length = growth ** np.arange(steps)
    middle = START + np.cumsum(length) - 0.5 * length
    cells = np.rint(middle[:, None] * np.asarray(direction, np.float64)[::-1])
    return cells.astype(np.int32), (length * spacing).astype(np.float32)


@shared
def fill_cells(  # type: ignore[no-untyped-def]
    first_chunk, last_chunk, places, count, origin, per_metre, dense
) -> None:  # pragma: no cover - compiled
    """Write micrometres of hair in each cell, `dense` (chunks, Z, Y, X), for points (S, m, 3)."""
    chunks, deep, high, wide = dense.shape
    for chunk in range(first_chunk, last_chunk):
        own = dense[chunk]
        own[:] = 0
        for s in range(count * chunk // chunks, count * (chunk + 1) // chunks):
            for k in range(1, places.shape[1]):
                x, y, z = places[s, k, 0], places[s, k, 1], places[s, k, 2]
                a, b, c = places[s, k - 1, 0], places[s, k - 1, 1], places[s, k - 1, 2]
                i = np.int64(np.floor((_HALF * (x + a) - origin[0]) * per_metre))
                j = np.int64(np.floor((_HALF * (y + b) - origin[1]) * per_metre))
                layer = np.int64(np.floor((_HALF * (z + c) - origin[2]) * per_metre))
                if 0 <= i < wide and 0 <= j < high and 0 <= layer < deep:
                    a, b, c = x - a, y - b, z - c
                    length = np.sqrt(a * a + b * b + c * c) * np.float32(1e6)
                    own[layer, j, i] += np.uint32(length)


@shared
def sum_cells(  # type: ignore[no-untyped-def]
    first, last, dense, solids, per_micrometre, extinction, rough
) -> None:  # pragma: no cover - compiled
    """Write layers of `rough` (Z, Y, X): extinction of hair and meshes, 1/m, smoothed by 1 2 1.

    Smoothed within the layers only; those of `extinction` are overwritten.
    """
    chunks, _, high, wide = dense.shape
    for layer in range(first, last):
        plain, lines = extinction[layer], rough[layer]
        for j in range(high):
            for i in range(wide):
                hair = np.uint32(0)
                for chunk in range(chunks):
                    hair += dense[chunk, layer, j, i]
                plain[j, i] = solids[layer, j, i] + per_micrometre * np.float32(hair)
        for i in range(wide):
            for j in range(high):
                beside = plain[max(j - 1, 0), i] + plain[min(j + 1, high - 1), i]
                lines[j, i] = _HALF * plain[j, i] + _QUARTER * beside
        for j in range(high):
            before = lines[j, 0]
            for i in range(wide):
                here = lines[j, i]
                after = lines[j, min(i + 1, wide - 1)]
                lines[j, i] = _HALF * here + _QUARTER * (before + after)
                before = here


@shared
def smooth_cells(first, last, rough, extinction) -> None:  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Write layers of `extinction` (Z, Y, X): `rough` smoothed by 1 2 1 across the layers."""
    deep, high, wide = rough.shape
    for layer in range(first, last):
        below, above = max(layer - 1, 0), min(layer + 1, deep - 1)
        for j in range(high):
            for i in range(wide):
                beside = rough[below, j, i] + rough[above, j, i]
                extinction[layer, j, i] = _HALF * rough[layer, j, i] + _QUARTER * beside


@shared
def light_cells(  # type: ignore[no-untyped-def]
    first, last, extinction, ways, depth, sky_ways, sky_depth, turn, turns, transmittance
) -> None:  # pragma: no cover - compiled
    """Write (Z, Y, X, 4) transmittance towards key and rim light, share of the sky.

    Of every `turns`-th layer, from `turn` on, those of numbers `first` to `last`.

    `ways` (2, STEPS, 3) and `sky_ways` (5, SKY_STEPS, 3) are cells z, y, x on the way, of so many
    metres each. Only cells at hair or solids are worked on: nothing is lit elsewhere.
    """
    _, high, wide = extinction.shape
    for number in range(first, last):
        z = number * turns + turn
        for y in range(high):
            for x in range(wide):
                if extinction[z, y, x] <= 0:
                    transmittance[z, y, x, :] = _ONE
                    continue
                transmittance[z, y, x, 0] = _reaching(extinction, z, y, x, ways[0], depth)
                transmittance[z, y, x, 1] = _reaching(extinction, z, y, x, ways[1], depth)
                sky = _reaching(extinction, z, y, x, sky_ways[0], sky_depth)
                for way in range(5):
                    sky += _reaching(extinction, z, y, x, sky_ways[way], sky_depth)
                transmittance[z, y, x, 2] = sky / np.float32(6)


@shared
def _reaching(extinction, z, y, x, way, depth):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    deep, high, wide = extinction.shape
    total = np.float32(0)
    for step in range(way.shape[0]):
        c, b, a = z + way[step, 0], y + way[step, 1], x + way[step, 2]
        if not (0 <= c < deep and 0 <= b < high and 0 <= a < wide):
            break
        total += extinction[c, b, a] * depth[step]
    return np.exp(-total)
