"""Shading of hair fibres: the compiled twin of lighting.glsl, marschner.glsl and tone.glsl.

Marschner et al. 2003 in the cheap form of those shaders: R, TT and TRT as Gaussians about tilted
cones, and the diffuse term of Kajiya and Kay (1989) for multiple scattering. All float32.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from hairkit.arrays import Float32Array, Int64Array
from hairkit.colour import srgb_from_linear
from hairkit.parallel import compiled_with
from hairkit.rendering.fibre import (
    BOUNCED,
    BRIGHTS,
    DIFFUSE,
    DIRECTION_BASE,
    FILM,
    FRESNEL,
    LEAST_BRIGHT,
    LEAST_POWER,
    OTHER,
    POWERS,
    R_SCALE,
    ROUGHNESS,
    SKYWARD,
    SPREAD,
    TILT,
    TRT_FOCUS,
    TRT_SHARE,
    TT_FOCUS,
    TT_SHARE,
)
from hairkit.rendering.light import Lights
from hairkit.simulation.lanes import LANES, One, Three, lanes_of, put, stage, three
from hairkit.simulation.vectors import (
    HALF,
    ONE,
    TWO,
    ZERO,
    Number,
    Vector,
    dot,
    inlined,
    minus,
    times,
)
from hairkit.viewer.draw.place_kernels import TILE, count_hidden
from hairkit.viewer.draw.records import Columns, HairShading, HairState, Shading, Strokes

DENSE = np.float32(0.4)
"""Share of a tile's mean optical depth that is applied: locks are denser than gaps."""
ALL_HIDDEN = 3
"""Of the places of a stroke that `count_hidden` looks at."""
HIDDEN = np.float32(0.14)
"""Points with a lower transmittance towards the camera are not drawn."""
TONES, BRIGHTEST = 4096, np.float32(7.3)
"""Entries of the tone table; radiance times exposure of its last entry, which is white."""
HALF_PI = np.float32(1.5707963)
ARCSINE = tuple(np.float32(c) for c in (1.5707288, -0.2121144, 0.0742610, -0.0187293))
"""Polynomial of (pi / 2 - asin x) / sqrt(1 - x) (Abramowitz and Stegun 1964, 4.4.45)."""
DECAY = np.float32(1 / 1024)
"""Over the power to which `_decay` raises, ten squares."""
_TINY, _SMALL, _FAR = np.float32(1e-20), np.float32(1e-6), np.float32(1e9)
_THREE, _PER_TILE = np.float32(3), np.float32(1 / TILE)


class Batch(Protocol):
    """A record of points that are shaded together."""

    place: Three
    """Metres."""
    along: Three
    """From the point before to the point after, metres."""
    colour: Three
    """Linear RGB."""
    random: One
    """The strand's random number."""
    other: One
    """Another one."""
    reached: Three
    """Transmittance towards key and rim light, visible share of the sky."""
    lit: Three
    """Result: a place in the tone table, or a colour of directions."""


BATCH = lanes_of(Batch)[np.float32]


class Opacity(NamedTuple):
    """Hair before the points."""

    depth: Float32Array
    """(SLICES + 1, tiles y, tiles x) optical depth before each slice of the view cells."""
    near: np.float32
    """Depth of the first slice, metres."""
    slices_per_metre: np.float32
    dimming: np.float32
    """Share of that optical depth that dims a point."""


def tone_table() -> Float32Array:
    """Return the tone (TONES,) of radiance (k / (TONES - 1))^2 BRIGHTEST, as in tone.glsl."""
    x = (np.arange(TONES) / (TONES - 1)) ** 2 * float(BRIGHTEST)
    a, b, c, d, e = FILM
    film = np.clip(x * (a * x + b) / (x * (c * x + d) + e), 0, 1)
    return srgb_from_linear(film).astype(np.float32)


def light_around(lights: Lights) -> Vector:
    """Return the light of the sky that hair scatters, linear RGB: `ambient` of lighting.glsl."""
    up = 0.5 + 0.5 * float(SKYWARD)
    mixed = np.array(lights.sky_colour) * up + np.array(lights.ground_colour) * (1 - up)
    red, green, blue = mixed.astype(np.float32)
    return red, green, blue


def fibre_colours(own: Float32Array, random: Float32Array) -> Float32Array:
    """Return linear colours (S, m, 3) of fibres, those of their own varied by numbers (S,)."""
    power = (LEAST_POWER + POWERS * random)[:, None, None]
    bright = LEAST_BRIGHT + BRIGHTS * np.mod(random * OTHER, 1.0)
    colours: Float32Array = own ** power.astype(np.float32)
    return np.asarray(colours * bright[:, None, None], np.float32)


@compiled_with(allocates=True, fastmath=True)
def shade_hair(
    first: int,
    last: int,
    state: HairState,
    opacity: Float32Array,
    strokes: Strokes,
    shading: HairShading,
    columns: Columns,
) -> None:
    """Write `looks`, `hidden` and `reach` of some strands.

    `opacity` is that of `ViewCells`. Points with a transmittance up to `HIDDEN` are not shaded, and
    those of which both strokes are behind meshes get a transmittance of 0. `hidden` is 3 at the
    last point and where an end is not shaded.
    """
    batch, which = np.empty(1, BATCH), np.empty((LANES, 2), np.int64)
    before = Opacity(opacity, strokes.near, strokes.slices_per_metre, DENSE * strokes.dimming)
    _shade_chunk(first, last, state, before, shading, columns, batch[0], which)


@stage
def _shade_chunk(
    first: int,
    last: int,
    state: HairState,
    before: Opacity,
    shading: HairShading,
    columns: Columns,
    batch: Batch,
    which: Int64Array,
) -> None:
    """Gather visible points, shade them in batches of `LANES`, and scatter the results.

    `which` (LANES, 2) are strand and point of each in the batch.
    """
    waiting, looks, hidden, reach = 0, state.looks, state.hidden, state.reach
    for s in range(first, last):
        seen, covered = state.seen[s], True
        reach[s, 0], reach[s, 1] = _FAR, -_FAR
        for k in range(looks.shape[1]):
            hidden[s, k] = _stroke_hidden(seen, k, columns)
            was_covered, covered = covered, hidden[s, k] == ALL_HIDDEN
            arriving: Number = ZERO
            if not (was_covered and covered):
                arriving = _visibility(seen, k, before)
            looks[s, k, 3] = arriving
            if k > 0 and min(arriving, looks[s, k - 1, 3]) <= HIDDEN:
                hidden[s, k - 1] = ALL_HIDDEN
            if arriving <= HIDDEN:
                continue
            reach[s, 0] = min(reach[s, 0], seen[k, 0] - columns.beside)
            reach[s, 1] = max(reach[s, 1], seen[k, 0] + columns.beside)
            _gather(batch, waiting, s, k, state.places, shading)
            which[waiting, 0], which[waiting, 1] = s, k
            waiting += 1
            if waiting == LANES:
                _flush(batch, which, waiting, shading, looks)
                waiting = 0
    _flush(batch, which, waiting, shading, looks)


@inlined
def _stroke_hidden(seen: Float32Array, k: int, columns: Columns) -> int:
    """Return to how many of both ends and the middle of the stroke from point k meshes are nearer.

    There is none from the last point.
    """
    if k == len(seen) - 1:
        return ALL_HIDDEN
    a = seen[k, 0] - columns.left, seen[k, 1], seen[k, 2]
    b = seen[k + 1, 0] - columns.left, seen[k + 1, 1], seen[k + 1, 2]
    return count_hidden(a, b, columns.solid)


@stage
def _gather(
    batch: Batch, lane: int, s: int, k: int, places: Float32Array, shading: HairShading
) -> None:
    """Write point k of strand s into a lane: tangent, colour, random numbers, light."""
    before, after = max(k - 1, 0), min(k + 1, places.shape[1] - 1)
    place = places[s, k, 0], places[s, k, 1], places[s, k, 2]
    for c in range(3):
        batch.along[c, lane] = places[s, after, c] - places[s, before, c]
        batch.colour[c, lane] = shading.colours[s, k, c]
    put(batch.place, lane, place)
    other = shading.random[s] * OTHER
    batch.random[lane], batch.other[lane] = shading.random[s], other - np.floor(other)
    put(batch.reached, lane, light_at(place, shading.light))


@stage
def _flush(
    batch: Batch, which: Int64Array, count: int, shading: HairShading, looks: Float32Array
) -> None:
    """Shade the batch, and write its first `count` lanes."""
    if shading.by_direction:
        _show_direction(batch)
    else:
        _light_lanes(batch, shading.light, shading.around)
    for n in range(count):
        for c in range(3):
            value = batch.lit[c, n]
            if not shading.by_direction:
                value = shading.tones[min(int(value + HALF), TONES - 1)]
            looks[which[n, 0], which[n, 1], c] = value


@stage
def _show_direction(batch: Batch) -> None:
    """Colour by direction: red for x, green for z, blue for y."""
    low, high = DIRECTION_BASE, ONE - DIRECTION_BASE
    for n in range(LANES):
        x, y, z = three(batch.along, n)
        over = high / np.sqrt(x * x + y * y + z * z + _TINY)
        bright = (HALF + HALF * batch.reached[2, n]) * (high + low * batch.other[n])
        colour = low + over * abs(x), low + over * abs(z), low + over * abs(y)
        put(batch.lit, n, times(bright, colour))


@stage
def _light_lanes(batch: Batch, light: Shading, around: Vector) -> None:
    """Compute the radiance of each lane's point towards the camera, as an index of the tones."""
    key, rim, bright = light.key, light.rim, light.exposure / BRIGHTEST
    size = np.float32(TONES - 1)
    for n in range(LANES):
        eye, tangent = to_eye(light, three(batch.place, n)), three(batch.along, n)
        eye = times(ONE / np.sqrt(dot(eye, eye)), eye)
        tangent = times(ONE / np.sqrt(dot(tangent, tangent) + _TINY), tangent)
        sin_out = dot(tangent, eye)
        out = sin_out, _arcsine(sin_out)
        beside = dot(key.direction, eye)
        a = _fibre(dot(tangent, key.direction), out, beside, batch.random[n])
        beside = dot(rim.direction, eye)
        b = _fibre(dot(tangent, rim.direction), out, beside, batch.other[n])
        by_key, by_rim, sky = three(batch.reached, n)
        a, b, sky = times(by_key, a), times(by_rim, b), BOUNCED * (ONE - sky) + sky
        for c in range(3):
            own = batch.colour[c, n]
            deep = own * np.sqrt(own)
            sent = key.colour[c] * (a[0] + own * a[1] + deep * a[2])
            sent += rim.colour[c] * (b[0] + own * b[1] + deep * b[2])
            sent += around[c] * sky * own
            batch.lit[c, n] = size * np.sqrt(sent * bright)


@inlined
def to_eye(light: Shading, place: Vector) -> Vector:
    """Return a vector towards the eye; constant for orthographic cameras."""
    away = times(light.perspective, minus(light.eye, place))
    return minus(away, times(ONE - light.perspective, light.forward))


@inlined
def _fibre(sin_in: Number, out: tuple[Number, Number], beside: Number, jitter: Number) -> Vector:
    """Return the factors of white, of the colour and of its power 3/2 in the scattered light.

    Arguments: sine of the light's angle to the normal plane, sine and angle of the eye's, and the
    dot product of both directions.
    """
    half = HALF * (_arcsine(sin_in) + out[1]) + (jitter - HALF) * SPREAD
    square_in = max(ONE - sin_in * sin_in, ZERO)
    squares = square_in * max(ONE - out[0] * out[0], ZERO)
    cos_phi = (beside - sin_in * out[0]) / np.sqrt(squares + _SMALL)
    cos_phi = min(max(cos_phi, -ONE), ONE)
    cos_half = np.sqrt(HALF + HALF * cos_phi)
    r = R_SCALE * cos_half * _lobe(half + TWO * TILT, ROUGHNESS)
    tt = _decay(-TT_FOCUS * (cos_phi + ONE)) * _lobe(half - TILT, HALF * ROUGHNESS)
    trt = _decay(TRT_FOCUS * (cos_phi - ONE))
    trt *= _lobe(half - _THREE * TILT, TWO * ROUGHNESS)
    cos_in = np.sqrt(square_in)
    diffuse = DIFFUSE + DIFFUSE * cos_half
    return cos_in * FRESNEL * r, cos_in * (TT_SHARE * tt + diffuse), cos_in * TRT_SHARE * trt


@inlined
def _lobe(x: Number, width: Number) -> Number:
    return _decay(-HALF * x * x / (width * width)) / width


@inlined
def _decay(x: Number) -> Number:
    """Return exp(x), x <= 0, as (1 + x / 1024)^1024, which vectorises; relative error 5e-4 x^2."""
    y = max(ONE + x * DECAY, ZERO)
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    y *= y
    return y * y


@inlined
def _arcsine(x: Number) -> Number:
    """Return the arc sine to 7e-5."""
    a, (p, q, r, s) = min(max(x, -x), ONE), ARCSINE
    value: Number = HALF_PI - np.sqrt(ONE - a) * (p + a * (q + a * (r + a * s)))
    return value if x >= ZERO else -value


@inlined
def light_at(place: Vector, light: Shading) -> Vector:
    """Interpolate the light volume at a point: key light, rim light, sky."""
    volume, over = light.volume, light.per_metre
    deep, high, wide = volume.shape[:3]
    at = minus(place, light.origin)
    i, u = _locate(at[0] * over - HALF, wide)
    j, v = _locate(at[1] * over - HALF, high)
    k, w = _locate(at[2] * over - HALF, deep)
    key = rim = sky = ZERO
    for a in range(2):
        along_z = w if a else ONE - w
        for b in range(2):
            part = along_z * (v if b else ONE - v)
            near, far = part * (ONE - u), part * u
            key += near * volume[k + a, j + b, i, 0] + far * volume[k + a, j + b, i + 1, 0]
            rim += near * volume[k + a, j + b, i, 1] + far * volume[k + a, j + b, i + 1, 1]
            sky += near * volume[k + a, j + b, i, 2] + far * volume[k + a, j + b, i + 1, 2]
    return key, rim, sky


@inlined
def _visibility(seen: Float32Array, k: int, before: Opacity) -> Number:
    """Return the transmittance from a point to the camera through the hair before it."""
    depth = seen[k, 3]
    if depth < ZERO:
        return ZERO
    opacity = before.depth
    layers, rows, columns = opacity.shape
    layer, w = _locate((depth - before.near) * before.slices_per_metre, layers)
    j, v = _locate(seen[k, 1] * _PER_TILE - HALF, rows)
    i, u = _locate(seen[k, 0] * _PER_TILE - HALF, columns)
    total = ZERO
    for a in range(2):
        along = w if a else ONE - w
        for b in range(2):
            part = along * (v if b else ONE - v)
            here, beside = opacity[layer + a, j + b, i], opacity[layer + a, j + b, i + 1]
            total += part * (here + u * (beside - here))
    return _decay(-before.dimming * total)


@inlined
def _locate(place: Number, count: int) -> tuple[int, Number]:
    """Return the cell before a coordinate, and the fraction towards the next one."""
    place = min(max(place, ZERO), np.float32(count - 1))
    cell = min(int(place), count - 2)
    return cell, place - np.float32(cell)
