"""Place and light meshes on the CPU: the compiled twin of skin.vert and skin.glsl.

Light is computed at the vertices, which is fine enough for these meshes, and multiplied by the
albedo at the pixels, by `mesh_raster`. Only vertices of faces that are seen are lit. All float32.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Int32Array, UInt8Array
from hairkit.viewer.draw.place_kernels import inlined, project_point, shared
from hairkit.viewer.draw.shade_kernels import (
    BRIGHTEST,
    EXPOSURE,
    EYE,
    FORWARD,
    KEY,
    KEY_COLOUR,
    RIM,
    RIM_COLOUR,
    light_at,
)

_ZERO, _HALF, _ONE, _TWO = np.float32(0), np.float32(0.5), np.float32(1), np.float32(2)
_TINY = np.float32(1e-9)
_LIFT = np.float32(0.007)
_WRAP = np.array([0.28, 0.18, 0.14], np.float32)
"""As in skin.glsl."""


class MeshData(NamedTuple):
    """A mesh at rest."""

    vertices: Float32Array
    """(V, 3) metres."""
    normals: Float32Array
    """(V, 3) outward unit normals."""
    colours: Float32Array
    """(V, 3) linear RGB."""
    uv: Float32Array
    """(V, 2) texture coordinates."""
    held: Float32Array
    """(V,) share by which a vertex follows `Placing.motion`."""
    faces: Int32Array
    """(F, 3)."""


class MeshState(NamedTuple):
    """What the passes over a mesh hand on."""

    placed: Float32Array
    """(V, 6) places and normals, metres, head frame."""
    seen: Float32Array
    """(V, 4) pixel x and y, depth-buffer depth, axial depth."""
    wanted: UInt8Array
    """(V,) 1 for vertices of faces that are seen."""
    lit: Float32Array
    """(V, 6) light that leaves the flesh and light that the oil reflects, times `bright`."""
    front: Int32Array
    """(F,) faces that are seen; each chunk of the faces fills its part from the start."""
    columns: Int32Array
    """(F, 2) first and last column of these faces."""
    counts: Int32Array
    """(chunks,) how many faces of a chunk are seen."""
    covered: Int32Array
    """(chunks, 4) pixels that they cover, the values of `region.Region`."""


class Oil(NamedTuple):
    """Surface of a mesh; GGX is the only lobe here."""

    scatter: np.float32
    """1 skin, 0 cloth."""
    alpha: np.float32
    """Roughness of the microfacets."""
    f0: np.float32
    """Reflectance at normal incidence."""


@shared
def place_vertices(
    first: int,
    last: int,
    mesh: MeshData,
    motion: Float32Array,
    camera: Float32Array,
    push: np.float32,
    state: MeshState,
) -> None:  # pragma: no cover - compiled
    """Write places and projections of vertices that follow `motion` (3, 4) as far as they are held.

    Their depth is that of a place `push` metres farther from the camera.
    """
    placed, seen = state.placed, state.seen
    for v in range(first, last):
        share = mesh.held[v]
        for c in range(3):
            place, normal = mesh.vertices[v, c], mesh.normals[v, c]
            to, turned = motion[c, 3] - place, -normal
            for d in range(3):
                to += motion[c, d] * mesh.vertices[v, d]
                turned += motion[c, d] * mesh.normals[v, d]
            placed[v, c], placed[v, c + 3] = place + share * to, normal + share * turned
        x, y, z = placed[v, 0], placed[v, 1], placed[v, 2]
        seen[v, 0], seen[v, 1], _, seen[v, 3] = project_point(camera, x, y, z)
        x, y, z = x + push * camera[16], y + push * camera[17], z + push * camera[18]
        _, _, seen[v, 2], _ = project_point(camera, x, y, z)
        state.wanted[v] = 0


@shared
def select_faces(
    first: int, last: int, mesh: MeshData, wide: int, high: int, state: MeshState
) -> None:  # pragma: no cover - compiled
    """Write which faces of some chunks face the camera and hold the middle of a pixel."""
    seen, chunks, count = state.seen, len(state.counts), len(mesh.faces)
    for chunk in range(first, last):
        start = count * chunk // chunks
        at = start
        least_x, least_y, most_x, most_y = wide, high, 0, 0
        for f in range(start, count * (chunk + 1) // chunks):
            a, b, c = mesh.faces[f, 0], mesh.faces[f, 1], mesh.faces[f, 2]
            if min(seen[a, 3], seen[b, 3], seen[c, 3]) <= _ZERO or area(seen, a, b, c) >= _ZERO:
                continue
            left, right = pixel_middles(seen[a, 0], seen[b, 0], seen[c, 0], wide)
            top, bottom = pixel_middles(seen[a, 1], seen[b, 1], seen[c, 1], high)
            if left <= right and top <= bottom:
                state.front[at], state.columns[at, 0], state.columns[at, 1] = f, left, right
                state.wanted[a] = state.wanted[b] = state.wanted[c] = 1
                least_x, least_y = min(least_x, left), min(least_y, top)
                most_x, most_y = max(most_x, right + 1), max(most_y, bottom + 1)
                at += 1
        state.counts[chunk] = at - start
        state.covered[chunk, 0], state.covered[chunk, 1] = least_x, least_y
        state.covered[chunk, 2], state.covered[chunk, 3] = most_x, most_y


@inlined
def area(seen: Float32Array, a: int, b: int, c: int) -> Any:  # pragma: no cover - compiled
    """Return twice the area of a face in the picture, below 0 if it faces the camera."""
    x, y = seen[a, 0], seen[a, 1]
    return (seen[b, 0] - x) * (seen[c, 1] - y) - (seen[c, 0] - x) * (seen[b, 1] - y)


@inlined
def pixel_middles(a: Any, b: Any, c: Any, size: int) -> Any:  # pragma: no cover - compiled
    """Return the first and last pixel whose middle is between the least and largest coordinate."""
    low = max(min(a, b, c) - _HALF, _ZERO)
    high = min(max(a, b, c) - _HALF, np.float32(size - 1))
    return np.int64(np.ceil(low)), np.int64(np.floor(high))


@shared
def light_vertices(
    first: int,
    last: int,
    mesh: MeshData,
    shading: Float32Array,
    ambient: Float32Array,
    light: Float32Array,
    oil: Oil,
    state: MeshState,
) -> None:  # pragma: no cover - compiled
    """Light the wanted vertices: skin in two layers, as in skin.glsl.

    `shading` is that of the hair, `ambient` (2, 3) are the colours of ground and sky, `light` is
    the light volume.
    """
    perspective, bright = shading[EXPOSURE + 1], shading[EXPOSURE] / np.float32(BRIGHTEST)
    for v in range(first, last):
        if state.wanted[v] == 0:
            continue
        x, y, z = state.placed[v, 0], state.placed[v, 1], state.placed[v, 2]
        nx, ny, nz = state.placed[v, 3], state.placed[v, 4], state.placed[v, 5]
        over = _ONE / np.sqrt(max(nx * nx + ny * ny + nz * nz, _TINY))
        nx, ny, nz = nx * over, ny * over, nz * over
        lifted = x + _LIFT * nx, y + _LIFT * ny, z + _LIFT * nz
        reached = light_at(lifted[0], lifted[1], lifted[2], shading, light)
        ex = perspective * (shading[EYE] - x) - (_ONE - perspective) * shading[FORWARD]
        ey = perspective * (shading[EYE + 1] - y) - (_ONE - perspective) * shading[FORWARD + 1]
        ez = perspective * (shading[EYE + 2] - z) - (_ONE - perspective) * shading[FORWARD + 2]
        over = _ONE / np.sqrt(max(ex * ex + ey * ey + ez * ez, _TINY))
        ex, ey, ez = ex * over, ey * over, ez * over
        up = _HALF + _HALF * ny
        for c in range(3):
            sky = ambient[0, c] + up * (ambient[1, c] - ambient[0, c])
            state.lit[v, c], state.lit[v, c + 3] = sky * reached[2], _ZERO
        for lamp in range(2):
            way, colour = (RIM, RIM_COLOUR) if lamp else (KEY, KEY_COLOUR)
            lx, ly, lz = shading[way], shading[way + 1], shading[way + 2]
            facing, seen = nx * lx + ny * ly + nz * lz, nx * ex + ny * ey + nz * ez
            entering, reflected = _reflect(oil, facing, seen, lx * ex + ly * ey + lz * ez)
            for c in range(3):
                arriving = shading[colour + c] * reached[lamp]
                wrap = _WRAP[c] * oil.scatter
                diffuse = max((facing + wrap) / (_ONE + wrap), _ZERO)
                state.lit[v, c] += arriving * diffuse * entering
                state.lit[v, c + 3] += arriving * reflected
        for c in range(3):
            state.lit[v, c] *= mesh.colours[v, c] * bright
            state.lit[v, c + 3] *= bright


@inlined
def _reflect(oil: Oil, facing: Any, seen: Any, between: Any) -> Any:  # pragma: no cover - compiled
    """Return the share of a light that leaves the flesh, and what the oil reflects.

    As in skin_lobe.glsl: GGX with Smith's shadowing (Walter et al. 2007), Fresnel by Schlick 1994.
    `facing`, `seen` and `between` are cosines of the normal and the light, the normal and the eye,
    and the light and the eye.
    """
    nl, nv = min(max(facing, _ZERO), _ONE), min(max(seen, _ZERO), _ONE)
    whole = (_ONE - oil.f0) * (_ONE - oil.f0)
    below = (_ONE - _fresnel(oil.f0, nl)) * (_ONE - _fresnel(oil.f0, nv)) / whole
    entering = _ONE + oil.scatter * (below - _ONE)
    if nl <= _ZERO or nv <= _ZERO:
        return entering, _ZERO
    half = np.sqrt(max(_TWO + _TWO * between, _TINY))
    nh, vh = min((nl + nv) / half, _ONE), min((_ONE + between) / half, _ONE)
    square = oil.alpha * oil.alpha
    spread = nh * nh * (square - _ONE) + _ONE
    lobe = square / (spread * spread)  # times pi, as the light is
    shadow = _smith(square, nl) * _smith(square, nv)
    reflected = lobe * shadow * _fresnel(oil.f0, vh) / (np.float32(4) * nv)
    return entering, oil.scatter * reflected


@inlined
def _fresnel(f0: Any, cosine: Any) -> Any:  # pragma: no cover - compiled
    a = _ONE - cosine
    return f0 + (_ONE - f0) * a * a * a * a * a


@inlined
def _smith(square: Any, c: Any) -> Any:  # pragma: no cover - compiled
    return _TWO * c / (c + np.sqrt(square + (_ONE - square) * c * c))
