"""The light volume on the CPU: the compiled twin of viewer_density.comp and viewer_light.comp.

Optical depth is integrated towards the lights, and along the axes for the sky, with steps of
growing length, one cell lookup each; the density is smoothed first, where the shaders interpolate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int32Array, UInt32Array
from hairkit.parallel import parallel_for, thread_count
from hairkit.rendering.context import Renderer
from hairkit.rendering.light import Lights
from hairkit.simulation.lanes import stage
from hairkit.simulation.vectors import HALF, ONE, Number
from hairkit.types.preview import Surface
from hairkit.types.strands import Strands
from hairkit.viewer.draw.interface import HairDrawer
from hairkit.viewer.draw.light_gpu import LightVolume, solid_depth

STEPS, GROWTH = 9, 1.35
SKY_STEPS, SKY_GROWTH = 5, 1.7
START = 0.8
"""First sample, in cells from the centre of a cell, as in viewer_light.comp."""
_SKY = ((0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1))
_QUARTER, _MICROMETRES = np.float32(0.25), np.float32(1e6)
_WEIGHTS = np.float32(6)
"""Sum of the sky's weights: 2 of the direction up, 1 of each other."""
LAYERS = 8
"""Layers that are worth a call on another thread."""


class Ways(NamedTuple):
    """Samples of the extinction on the way to the light."""

    lights: Int32Array
    """(2, STEPS, 3) cells z, y, x from a cell towards key and rim light."""
    metres: Float32Array
    """(STEPS,) what each sample stands for."""
    sky: Int32Array
    """(5, SKY_STEPS, 3) the same towards the sky; up comes first."""
    sky_metres: Float32Array
    """(SKY_STEPS,)."""


class SoftLightPass(LightVolume):
    """The light volume of hair drawn by `SoftHairPass`."""

    def __init__(self, gl: Renderer, guides: Strands, solids: list[Surface]) -> None:
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
            sum_cells, layers, self._dense, self._solids, stops, extinction, rough, min_chunk=LAYERS
        )
        parallel_for(smooth_cells, layers, rough, extinction, min_chunk=LAYERS)

    def _light(self, lights: Lights, turn: int, turns: int) -> None:
        spacing = self.grid.spacing
        way_of_key, metres = _way(lights.key_direction, STEPS, GROWTH, spacing)
        way_of_rim, _ = _way(lights.rim_direction, STEPS, GROWTH, spacing)
        ways = [_way(direction, SKY_STEPS, SKY_GROWTH, spacing) for direction in _SKY]
        layers = -(-(len(self._extinction) - turn) // turns)
        parallel_for(
            light_cells,
            layers,
            self._extinction,
            Ways(
                np.stack([way_of_key, way_of_rim]),
                metres,
                np.stack([way for way, _ in ways]),
                ways[0][1],
            ),
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


@stage
def fill_cells(
    first_chunk: int,
    last_chunk: int,
    places: Float32Array,
    count: int,
    origin: Float32Array,
    per_metre: Number,
    dense: UInt32Array,
) -> None:
    """Write micrometres of hair in each cell, `dense` (chunks, Z, Y, X), for points (S, m, 3)."""
    chunks, deep, high, wide = dense.shape
    for chunk in range(first_chunk, last_chunk):
        own = dense[chunk]
        own[:] = 0
        for s in range(count * chunk // chunks, count * (chunk + 1) // chunks):
            for k in range(1, places.shape[1]):
                x, y, z = places[s, k, 0], places[s, k, 1], places[s, k, 2]
                a, b, c = places[s, k - 1, 0], places[s, k - 1, 1], places[s, k - 1, 2]
                i = int(np.floor((HALF * (x + a) - origin[0]) * per_metre))
                j = int(np.floor((HALF * (y + b) - origin[1]) * per_metre))
                layer = int(np.floor((HALF * (z + c) - origin[2]) * per_metre))
                if 0 <= i < wide and 0 <= j < high and 0 <= layer < deep:
                    a, b, c = x - a, y - b, z - c
                    length = np.sqrt(a * a + b * b + c * c) * _MICROMETRES
                    own[layer, j, i] += np.uint32(length)


@stage
def sum_cells(
    first: int,
    last: int,
    dense: UInt32Array,
    solids: Float32Array,
    per_micrometre: Number,
    extinction: Float32Array,
    rough: Float32Array,
) -> None:
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
                lines[j, i] = HALF * plain[j, i] + _QUARTER * beside
        for j in range(high):
            before = lines[j, 0]
            for i in range(wide):
                here = lines[j, i]
                after = lines[j, min(i + 1, wide - 1)]
                lines[j, i] = HALF * here + _QUARTER * (before + after)
                before = here


@stage
def smooth_cells(first: int, last: int, rough: Float32Array, extinction: Float32Array) -> None:
    """Write layers of `extinction` (Z, Y, X): `rough` smoothed by 1 2 1 across the layers."""
    deep, high, wide = rough.shape
    for layer in range(first, last):
        below, above = max(layer - 1, 0), min(layer + 1, deep - 1)
        for j in range(high):
            for i in range(wide):
                beside = rough[below, j, i] + rough[above, j, i]
                extinction[layer, j, i] = HALF * rough[layer, j, i] + _QUARTER * beside


@stage
def light_cells(
    first: int,
    last: int,
    extinction: Float32Array,
    ways: Ways,
    turn: int,
    turns: int,
    transmittance: Float32Array,
) -> None:
    """Write (Z, Y, X, 4) transmittance towards key and rim light, share of the sky.

    Of every `turns`-th layer, from `turn` on, those of numbers `first` to `last`. Only cells at
    hair or solids are worked on: nothing is lit elsewhere.
    """
    _, high, wide = extinction.shape
    for number in range(first, last):
        z = number * turns + turn
        for y in range(high):
            for x in range(wide):
                if extinction[z, y, x] <= 0:
                    transmittance[z, y, x, :] = ONE
                    continue
                transmittance[z, y, x, 0] = _reaching(
                    extinction, z, y, x, ways.lights[0], ways.metres
                )
                transmittance[z, y, x, 1] = _reaching(
                    extinction, z, y, x, ways.lights[1], ways.metres
                )
                sky = _reaching(extinction, z, y, x, ways.sky[0], ways.sky_metres)
                for way in ways.sky:
                    sky += _reaching(extinction, z, y, x, way, ways.sky_metres)
                transmittance[z, y, x, 2] = sky / _WEIGHTS


@stage
def _reaching(
    extinction: Float32Array, z: int, y: int, x: int, way: Int32Array, metres: Float32Array
) -> Number:
    """Return the transmittance along a way (steps, 3) from a cell."""
    deep, high, wide = extinction.shape
    total = np.float32(0)
    for step in range(way.shape[0]):
        c, b, a = z + way[step, 0], y + way[step, 1], x + way[step, 2]
        if not (0 <= c < deep and 0 <= b < high and 0 <= a < wide):
            break
        total += extinction[c, b, a] * metres[step]
    arriving: Number = np.exp(-total)
    return arriving
