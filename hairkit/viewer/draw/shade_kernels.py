"""Shading of hair fibres: the compiled twin of lighting.glsl, marschner.glsl and tone.glsl.

Marschner et al. 2003 in the cheap form of those shaders: R, TT and TRT as Gaussians about tilted
cones, and the diffuse term of Kajiya and Kay (1989) for multiple scattering. All float32.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.colour import srgb_from_linear
from hairkit.parallel import compiled_with
from hairkit.rendering.light import Lights
from hairkit.types.camera import Camera
from hairkit.types.volume import VoxelGrid
from hairkit.viewer.draw.place_kernels import TILE, count_hidden, inlined, shared

LANES, FIELDS = 64, 14
"""Points shaded together, and values of each."""
DENSE = np.float32(0.4)
"""Share of a tile's mean optical depth that is applied: locks are denser than gaps."""
ALL_HIDDEN = 3
"""Of the places of a stroke that `count_hidden` looks at."""
HIDDEN = np.float32(0.14)
"""Points with a lower transmittance towards the camera are not drawn."""

TONES, BRIGHTEST = 4096, 7.3
"""Entries of the tone table; radiance times exposure of its last entry, which is white."""
EYE, FORWARD, KEY, KEY_COLOUR, RIM, RIM_COLOUR, SKY, ORIGIN, PER_METRE, EXPOSURE = range(0, 30, 3)
"""First index of each group of three values in `shading`; the last group is the exposure, whether
the camera is perspective, and whether directions are shown."""
_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)
_BOUNCED, _TINY, _FAR = np.float32(0.35), np.float32(1e-20), np.float32(1e9)
_TILT, _ROUGHNESS = np.float32(0.0524), np.float32(0.14)
_FRESNEL, _TT, _TRT = np.float32(0.0465), np.float32(0.09), np.float32(0.17)
_OTHER, _JITTER = np.float32(61.8034), np.float32(0.12)


def tone_table() -> Float32Array:
    """Return the tone (TONES,) of radiance (k / (TONES - 1))^2 BRIGHTEST, as in tone.glsl."""
    x = (np.arange(TONES) / (TONES - 1)) ** 2 * BRIGHTEST
    film = np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0, 1)
    return srgb_from_linear(film).astype(np.float32)


def pack_shading(
    camera: Camera, lights: Lights, grid: VoxelGrid, *, direction: bool
) -> Float32Array:
    """Return (30,) what `shade` is told: camera, lights, and where the light volume lies."""
    sky = np.array(lights.sky_colour) * 0.65 + np.array(lights.ground_colour) * 0.35
    flags = [lights.exposure, float(camera.model == "perspective"), float(direction)]
    parts = [
        camera.position, camera.forward, lights.key_direction, lights.key_colour,
        lights.rim_direction, lights.rim_colour, sky, grid.origin, np.full(3, 1 / grid.spacing),
        flags,
    ]  # fmt: skip
    return np.concatenate([np.asarray(part, np.float64).ravel() for part in parts]).astype("f4")


def fibre_colours(
    root: tuple[float, float, float],
    tip: tuple[float, float, float],
    random: Float32Array,
    points: int,
) -> Float32Array:
    """Return linear colours (S, points, 3) of fibres, varied by random numbers (S,)."""
    share = np.linspace(0, 1, points, dtype=np.float32)[:, None]
    along = np.array(root, np.float32) * (1 - share) + np.array(tip, np.float32) * share
    power = (0.85 + 0.3 * random)[:, None, None]
    bright = 0.8 + 0.4 * np.mod(random * np.float32(_OTHER), 1.0)
    colours: Float32Array = along[None] ** power.astype(np.float32)
    return np.asarray(colours * bright[:, None, None], np.float32)


@compiled_with(allocates=True, fastmath=True)
def shade_hair(  # type: ignore[no-untyped-def]
    first, last, seen, places, colours, random, opacity, slices, shading, light, tones, solid,
    frame, beside, looks, hidden, reach,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Write `looks` (S, m, 4) of some strands: colour, and transmittance towards the camera.

    `seen`, `places` and `opacity` come from `place_kernels`; `slices` are the nearest depth, slices
    per metre and `HairLook.dimming`; `light` (Z, Y, X, 4) is the light volume; `solid` and `frame`
    are those of `raster_kernels.draw_hair`. Points with a transmittance up to `HIDDEN` are not
    shaded, and those of which both strokes are behind meshes get a transmittance of 0. `hidden`
    (S, m) is `count_hidden` of the stroke from each point, 3 at the last point and where an end
    is not shaded. The columns of the others and `beside` pixels on either side are in between
    `reach` (S, 2).
    """
    points = np.empty(FIELDS * LANES, np.float32)
    lit = np.empty(3 * LANES, np.float32)
    which = np.empty((LANES, 2), np.int64)
    _shade_chunk(
        seen, places, colours, random, opacity, slices, shading, light, tones, solid, frame,
        beside, first, last, looks, hidden, reach, points, lit, which,
    )  # fmt: skip


@shared
def _shade_chunk(  # type: ignore[no-untyped-def]
    seen, places, colours, random, opacity, slices, shading, light, tones, solid, frame,
    beside, first, last, looks, hidden, reach, points, lit, which,
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Gather visible points, shade them in batches of `LANES`, and scatter the results."""
    waiting = 0
    for s in range(first, last):
        other = random[s] * _OTHER
        other -= np.floor(other)
        covered = True
        reach[s, 0], reach[s, 1] = _FAR, -_FAR
        for k in range(looks.shape[1]):
            hidden[s, k] = _stroke_hidden(seen, s, k, solid, frame)
            before, covered = covered, hidden[s, k] == ALL_HIDDEN
            arriving = _ZERO
            if not (before and covered):
                arriving = _visibility(seen, s, k, opacity, slices)
            looks[s, k, 3] = arriving
            if k > 0 and min(arriving, looks[s, k - 1, 3]) <= HIDDEN:
                hidden[s, k - 1] = ALL_HIDDEN
            if arriving <= HIDDEN:
                continue
            reach[s, 0] = min(reach[s, 0], seen[s, k, 0] - beside)
            reach[s, 1] = max(reach[s, 1], seen[s, k, 0] + beside)
            _gather(places, colours, s, k, random[s], other, shading, light, points, waiting)
            which[waiting, 0], which[waiting, 1] = s, k
            waiting += 1
            if waiting == LANES:
                _flush(points, shading, tones, lit, which, waiting, looks)
                waiting = 0
    _flush(points, shading, tones, lit, which, waiting, looks)


@inlined
def _stroke_hidden(seen, s, k, solid, frame):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return to how many of both ends and the middle of the stroke from point k meshes are nearer.

    There is none from the last point.
    """
    if k == seen.shape[1] - 1:
        return ALL_HIDDEN
    ax, ay, az = seen[s, k, 0] - frame[0], seen[s, k, 1] - frame[1], seen[s, k, 2]
    bx, by, bz = seen[s, k + 1, 0] - frame[0], seen[s, k + 1, 1] - frame[1], seen[s, k + 1, 2]
    return count_hidden(ax, ay, az, bx, by, bz, solid)


@shared
def _gather(  # type: ignore[no-untyped-def]
    places, colours, s, k, random, other, shading, light, points, at
) -> None:  # pragma: no cover - compiled
    """Write one point into a lane: tangent, colour, random numbers, light."""
    before, after = max(k - 1, 0), min(k + 1, places.shape[1] - 1)
    x, y, z = places[s, k, 0], places[s, k, 1], places[s, k, 2]
    points[at], points[LANES + at], points[2 * LANES + at] = x, y, z
    for c in range(3):
        points[(3 + c) * LANES + at] = places[s, after, c] - places[s, before, c]
        points[(6 + c) * LANES + at] = colours[s, k, c]
    points[9 * LANES + at], points[10 * LANES + at] = random, other
    key, rim, sky = light_at(x, y, z, shading, light)
    points[11 * LANES + at], points[12 * LANES + at], points[13 * LANES + at] = key, rim, sky


@shared
def _flush(points, shading, tones, lit, which, count, looks) -> None:  # type: ignore[no-untyped-def] # pragma: no cover
    if shading[EXPOSURE + 2] > _HALF:
        _show_direction(points, lit)
    else:
        _light_lanes(points, shading, lit)
    for n in range(count):
        s, k = which[n, 0], which[n, 1]
        for c in range(3):
            value = lit[c * LANES + n]
            if shading[EXPOSURE + 2] <= _HALF:
                value = tones[min(np.int64(value + _HALF), TONES - 1)]
            looks[s, k, c] = value


@shared
def _show_direction(points, lit) -> None:  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Colour by direction: red for x, green for z, blue for y."""
    low, high = np.float32(0.2), np.float32(0.8)
    for n in range(LANES):
        x, y, z = points[3 * LANES + n], points[4 * LANES + n], points[5 * LANES + n]
        over = high / np.sqrt(x * x + y * y + z * z + _TINY)
        bright = (_HALF + _HALF * points[13 * LANES + n]) * (high + low * points[10 * LANES + n])
        lit[n] = (low + over * abs(x)) * bright
        lit[LANES + n] = (low + over * abs(z)) * bright
        lit[2 * LANES + n] = (low + over * abs(y)) * bright


@shared
def _light_lanes(points, shading, lit) -> None:  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Compute the radiance of each lane's point towards the camera, as an index of the tones."""
    ex, ey, ez = shading[EYE], shading[EYE + 1], shading[EYE + 2]
    fx, fy, fz = shading[FORWARD], shading[FORWARD + 1], shading[FORWARD + 2]
    kx, ky, kz = shading[KEY], shading[KEY + 1], shading[KEY + 2]
    rx, ry, rz = shading[RIM], shading[RIM + 1], shading[RIM + 2]
    kr, kg, kb = shading[KEY_COLOUR], shading[KEY_COLOUR + 1], shading[KEY_COLOUR + 2]
    rr, rg, rb = shading[RIM_COLOUR], shading[RIM_COLOUR + 1], shading[RIM_COLOUR + 2]
    sr, sg, sb = shading[SKY], shading[SKY + 1], shading[SKY + 2]
    bright, perspective = shading[EXPOSURE] / np.float32(BRIGHTEST), shading[EXPOSURE + 1]
    size = np.float32(TONES - 1)
    for n in range(LANES):
        # towards the eye; constant for orthographic cameras
        x = perspective * (ex - points[n]) - (_ONE - perspective) * fx
        y = perspective * (ey - points[LANES + n]) - (_ONE - perspective) * fy
        z = perspective * (ez - points[2 * LANES + n]) - (_ONE - perspective) * fz
        over = _ONE / np.sqrt(x * x + y * y + z * z)
        x, y, z = x * over, y * over, z * over
        tx, ty, tz = points[3 * LANES + n], points[4 * LANES + n], points[5 * LANES + n]
        over = _ONE / np.sqrt(tx * tx + ty * ty + tz * tz + _TINY)
        tx, ty, tz = tx * over, ty * over, tz * over
        sin_out, beside = tx * x + ty * y + tz * z, kx * x + ky * y + kz * z
        away = _arcsine(sin_out)
        a, b, c = _fibre(tx * kx + ty * ky + tz * kz, sin_out, away, beside, points[9 * LANES + n])
        beside = rx * x + ry * y + rz * z
        d, e, f = _fibre(tx * rx + ty * ry + tz * rz, sin_out, away, beside, points[10 * LANES + n])
        key, rim, sky = points[11 * LANES + n], points[12 * LANES + n], points[13 * LANES + n]
        a, b, c, d, e, f = a * key, b * key, c * key, d * rim, e * rim, f * rim
        sky = _BOUNCED * (_ONE - sky) + sky
        red, green, blue = points[6 * LANES + n], points[7 * LANES + n], points[8 * LANES + n]
        deep = red * np.sqrt(red)
        sent = kr * (a + red * b + deep * c) + rr * (d + red * e + deep * f) + sr * sky * red
        lit[n] = size * np.sqrt(sent * bright)
        deep = green * np.sqrt(green)
        sent = kg * (a + green * b + deep * c) + rg * (d + green * e + deep * f) + sg * sky * green
        lit[LANES + n] = size * np.sqrt(sent * bright)
        deep = blue * np.sqrt(blue)
        sent = kb * (a + blue * b + deep * c) + rb * (d + blue * e + deep * f) + sb * sky * blue
        lit[2 * LANES + n] = size * np.sqrt(sent * bright)


@inlined
def _fibre(sin_in, sin_out, away, beside, jitter):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the factors of white, of the colour and of its power 3/2 in the scattered light.

    Arguments: sines of the angles to the normal plane, the second angle, and the dot product of
    both directions.
    """
    half = _HALF * (_arcsine(sin_in) + away) + (jitter - _HALF) * _JITTER
    square_in = max(_ONE - sin_in * sin_in, _ZERO)
    squares = square_in * max(_ONE - sin_out * sin_out, _ZERO)
    cos_phi = (beside - sin_in * sin_out) / np.sqrt(squares + np.float32(1e-6))
    cos_phi = min(max(cos_phi, -_ONE), _ONE)
    cos_half = np.sqrt(_HALF + _HALF * cos_phi)
    r = np.float32(0.16) * cos_half * _lobe(half + _TWO * _TILT, _ROUGHNESS)
    tt = _decay(np.float32(-4) * (cos_phi + _ONE)) * _lobe(half - _TILT, _HALF * _ROUGHNESS)
    trt = _decay(np.float32(3) * (cos_phi - _ONE))
    trt *= _lobe(half - np.float32(3) * _TILT, _TWO * _ROUGHNESS)
    cos_in = np.sqrt(square_in)
    diffuse = np.float32(0.26) + np.float32(0.26) * cos_half
    return cos_in * _FRESNEL * r, cos_in * (_TT * tt + diffuse), cos_in * _TRT * trt


@inlined
def _lobe(x, width):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    return _decay(-_HALF * x * x / (width * width)) / width


@inlined
def _decay(x):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return exp(x), x <= 0, as (1 + x / 1024)^1024, which vectorises; relative error 5e-4 x^2."""
    y = max(_ONE + x * np.float32(1 / 1024), _ZERO)
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
def _arcsine(x):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the arc sine to 7e-5 (Abramowitz and Stegun 1964, 4.4.45)."""
    a = min(abs(x), _ONE)
    rest = np.float32(1.5707288) + a * (
        np.float32(-0.2121144) + a * (np.float32(0.0742610) + a * np.float32(-0.0187293))
    )
    value = np.float32(1.5707963) - np.sqrt(_ONE - a) * rest
    return value if x >= _ZERO else -value


@inlined
def light_at(x, y, z, shading, light):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Interpolate the light volume (Z, Y, X, 4) at a point: key light, rim light, sky."""
    deep, high, wide = light.shape[:3]
    i, u = _locate((x - shading[ORIGIN]) * shading[PER_METRE] - _HALF, wide)
    j, v = _locate((y - shading[ORIGIN + 1]) * shading[PER_METRE] - _HALF, high)
    k, w = _locate((z - shading[ORIGIN + 2]) * shading[PER_METRE] - _HALF, deep)
    key = rim = sky = _ZERO
    for a in range(2):
        along_z = w if a else _ONE - w
        for b in range(2):
            part = along_z * (v if b else _ONE - v)
            near, far = part * (_ONE - u), part * u
            key += near * light[k + a, j + b, i, 0] + far * light[k + a, j + b, i + 1, 0]
            rim += near * light[k + a, j + b, i, 1] + far * light[k + a, j + b, i + 1, 1]
            sky += near * light[k + a, j + b, i, 2] + far * light[k + a, j + b, i + 1, 2]
    return key, rim, sky


@inlined
def _visibility(seen, s, k, opacity, slices):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the transmittance from a point to the camera through the hair before it."""
    depth = seen[s, k, 3]
    if depth < _ZERO:
        return _ZERO
    layers, rows, columns = opacity.shape
    layer, w = _locate((depth - slices[0]) * slices[1], layers)
    j, v = _locate(seen[s, k, 1] * np.float32(1 / TILE) - _HALF, rows)
    i, u = _locate(seen[s, k, 0] * np.float32(1 / TILE) - _HALF, columns)
    total = _ZERO
    for a in range(2):
        along = w if a else _ONE - w
        for b in range(2):
            part = along * (v if b else _ONE - v)
            here, beside = opacity[layer + a, j + b, i], opacity[layer + a, j + b, i + 1]
            total += part * (here + u * (beside - here))
    return _decay(-DENSE * slices[2] * total)


@inlined
def _locate(place, count):  # type: ignore[no-untyped-def] # pragma: no cover - compiled
    """Return the cell before a coordinate, and the fraction towards the next one."""
    place = min(max(place, _ZERO), np.float32(count - 1))
    cell = min(np.int64(place), count - 2)
    return cell, place - np.float32(cell)
