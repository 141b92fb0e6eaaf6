"""Place and light meshes on the CPU: the compiled twin of skin.vert and skin.glsl.

Light is computed at the vertices, which is fine enough for these meshes, and multiplied by the
albedo at the pixels, by `mesh_raster`. Only vertices of faces that are seen are lit. All float32.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hairkit.arrays import Float32Array, Int32Array, UInt8Array
from hairkit.rendering.skin_lobe import LIFT, WRAP
from hairkit.simulation.lanes import stage
from hairkit.simulation.vectors import (
    HALF,
    ONE,
    TWO,
    ZERO,
    Number,
    Vector,
    dot,
    inlined,
    plus,
    times,
)
from hairkit.viewer.draw.place_kernels import project_point
from hairkit.viewer.draw.records import Lamp, Projection, Shading
from hairkit.viewer.draw.shade_kernels import BRIGHTEST, light_at, to_eye

_FOUR, _TINY = np.float32(4), np.float32(1e-9)


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

    places: Float32Array
    """(V, 3) metres, head frame."""
    normals: Float32Array
    """(V, 3) not normalised."""
    seen: Float32Array
    """(V, 4) pixel x and y, depth-buffer depth, axial depth."""
    wanted: UInt8Array
    """(V,) 1 for vertices of faces that are seen."""
    flesh: Float32Array
    """(V, 3) light that leaves the flesh, times exposure, over `BRIGHTEST`."""
    oil: Float32Array
    """(V, 3) light that the oil reflects, the same."""
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


@stage
def place_vertices(
    first: int,
    last: int,
    mesh: MeshData,
    motion: Float32Array,
    camera: Projection,
    push: np.float32,
    state: MeshState,
) -> None:
    """Write places and projections of vertices that follow `motion` (3, 4) as far as they are held.

    Their depth is that of a place `push` metres farther from the camera.
    """
    seen = state.seen
    for v in range(first, last):
        share = mesh.held[v]
        for c in range(3):
            place, normal = mesh.vertices[v, c], mesh.normals[v, c]
            to, turned = motion[c, 3] - place, -normal
            for d in range(3):
                to += motion[c, d] * mesh.vertices[v, d]
                turned += motion[c, d] * mesh.normals[v, d]
            state.places[v, c] = place + share * to
            state.normals[v, c] = normal + share * turned
        at = row(state.places, v)
        seen[v, 0], seen[v, 1], _, seen[v, 3] = project_point(camera, at)
        _, _, seen[v, 2], _ = project_point(camera, plus(at, times(push, camera.forward)))
        state.wanted[v] = 0


@stage
def select_faces(
    first: int, last: int, mesh: MeshData, wide: int, high: int, state: MeshState
) -> None:
    """Write which faces of some chunks face the camera and hold the middle of a pixel."""
    seen, chunks, count = state.seen, len(state.counts), len(mesh.faces)
    for chunk in range(first, last):
        start = count * chunk // chunks
        at = start
        least_x, least_y, most_x, most_y = wide, high, 0, 0
        for f in range(start, count * (chunk + 1) // chunks):
            a, b, c = mesh.faces[f, 0], mesh.faces[f, 1], mesh.faces[f, 2]
            if min(seen[a, 3], seen[b, 3], seen[c, 3]) <= ZERO or area(seen, a, b, c) >= ZERO:
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
def row(values: Float32Array, v: int) -> Vector:
    """Return the vector in a row of (V, 3)."""
    return values[v, 0], values[v, 1], values[v, 2]


@inlined
def area(seen: Float32Array, a: int, b: int, c: int) -> Number:
    """Return twice the area of a face in the picture, below 0 if it faces the camera."""
    x, y = seen[a, 0], seen[a, 1]
    twice: Number = (seen[b, 0] - x) * (seen[c, 1] - y) - (seen[c, 0] - x) * (seen[b, 1] - y)
    return twice


@inlined
def pixel_middles(a: Number, b: Number, c: Number, size: int) -> tuple[int, int]:
    """Return the first and last pixel whose middle is between the least and largest coordinate."""
    low = max(min(a, b, c) - HALF, ZERO)
    high = min(max(a, b, c) - HALF, np.float32(size - 1))
    return int(np.ceil(low)), int(np.floor(high))


@stage
def light_vertices(
    first: int, last: int, mesh: MeshData, light: Shading, oil: Oil, state: MeshState
) -> None:
    """Light the wanted vertices: skin in two layers, as in skin.glsl."""
    bright = light.exposure / BRIGHTEST
    for v in range(first, last):
        if state.wanted[v] == 0:
            continue
        place, normal = row(state.places, v), row(state.normals, v)
        normal = times(ONE / np.sqrt(max(dot(normal, normal), _TINY)), normal)
        by_key, by_rim, sky = light_at(plus(place, times(LIFT, normal)), light)
        eye = to_eye(light, place)
        eye = times(ONE / np.sqrt(max(dot(eye, eye), _TINY)), eye)
        up = HALF + HALF * normal[1]
        flesh, oily = state.flesh[v], state.oil[v]
        for c in range(3):
            flesh[c] = (light.ground[c] + up * (light.sky[c] - light.ground[c])) * sky
            oily[c] = ZERO
        _add_lamp(light.key, by_key, normal, eye, oil, flesh, oily)
        _add_lamp(light.rim, by_rim, normal, eye, oil, flesh, oily)
        for c in range(3):
            flesh[c] *= mesh.colours[v, c] * bright
            oily[c] *= bright


@inlined
def _add_lamp(
    lamp: Lamp,
    reached: Number,
    normal: Vector,
    eye: Vector,
    oil: Oil,
    flesh: Float32Array,
    oily: Float32Array,
) -> None:
    """Add the light of a lamp, of which a share arrives, to what flesh and oil send, (3,) each."""
    facing, seen = dot(normal, lamp.direction), dot(normal, eye)
    entering, reflected = _reflect(oil, facing, seen, dot(lamp.direction, eye))
    for c in range(3):
        arriving = lamp.colour[c] * reached
        wrap = WRAP[c] * oil.scatter
        flesh[c] += arriving * max((facing + wrap) / (ONE + wrap), ZERO) * entering
        oily[c] += arriving * reflected


@inlined
def _reflect(oil: Oil, facing: Number, seen: Number, between: Number) -> tuple[Number, Number]:
    """Return the share of a light that leaves the flesh, and what the oil reflects.

    As in skin_lobe.glsl: GGX with Smith's shadowing (Walter et al. 2007), Fresnel by Schlick 1994.
    `facing`, `seen` and `between` are cosines of the normal and the light, the normal and the eye,
    and the light and the eye.
    """
    nl, nv = min(max(facing, ZERO), ONE), min(max(seen, ZERO), ONE)
    whole = (ONE - oil.f0) * (ONE - oil.f0)
    below = (ONE - _fresnel(oil.f0, nl)) * (ONE - _fresnel(oil.f0, nv)) / whole
    entering = ONE + oil.scatter * (below - ONE)
    if nl <= ZERO or nv <= ZERO:
        return entering, ZERO
    half = np.sqrt(max(TWO + TWO * between, _TINY))
    nh, vh = min((nl + nv) / half, ONE), min((ONE + between) / half, ONE)
    square = oil.alpha * oil.alpha
    spread = nh * nh * (square - ONE) + ONE
    lobe = square / (spread * spread)  # times pi, as the light is
    shadow = _smith(square, nl) * _smith(square, nv)
    reflected = lobe * shadow * _fresnel(oil.f0, vh) / (_FOUR * nv)
    return entering, oil.scatter * reflected


@inlined
def _fresnel(f0: Number, cosine: Number) -> Number:
    a = ONE - cosine
    return f0 + (ONE - f0) * a * a * a * a * a


@inlined
def _smith(square: Number, c: Number) -> Number:
    shadow: Number = TWO * c / (c + np.sqrt(square + (ONE - square) * c * c))
    return shadow
