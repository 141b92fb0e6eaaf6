"""The light of a fibre is one formula: on paper, in shaders, and in compiled loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.rendering import fibre
from hairkit.rendering.context import renderer, shader_source
from hairkit.viewer.draw import shade_kernels

COUNT = 2000
TOLERANCE = 2e-3
"""Largest difference of scattered light; a level of a picture is about twice as much."""
SHADER = """#version 430
layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer Given { vec4 given[]; };
layout(std430, binding = 1) writeonly buffer Found { vec4 found[]; };
%s
void main() {
    uint i = gl_GlobalInvocationID.x;
    vec4 t = given[4 * i], light = given[4 * i + 1], eye = given[4 * i + 2], own = given[4 * i + 3];
    found[i] = vec4(fibre(t.xyz, light.xyz, eye.xyz, own.xyz, t.w), 0);
}
"""


def cases() -> tuple[npt.NDArray[Any], ...]:
    """Return tangents, directions to light and eye, colours (N, 3) and random numbers (N,)."""
    generator = np.random.default_rng(3)
    directions = generator.standard_normal((3, COUNT, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    return *directions, generator.uniform(0.01, 0.6, (COUNT, 3)), generator.random(COUNT)


def scattered(
    tangent: npt.NDArray[Any],
    light: npt.NDArray[Any],
    eye: npt.NDArray[Any],
    colour: npt.NDArray[Any],
    jitter: npt.NDArray[Any],
) -> npt.NDArray[Any]:
    """Return the light (N, 3): equations 5 to 8 of Marschner et al. with Gaussian azimuths."""
    sin_in, sin_out = (tangent * light).sum(axis=1), (tangent * eye).sum(axis=1)
    half = 0.5 * (np.arcsin(sin_in) + np.arcsin(sin_out)) + (jitter - 0.5) * fibre.SPREAD
    across = (light * eye).sum(axis=1) - sin_in * sin_out
    cosine = np.clip(across / np.sqrt((1 - sin_in**2) * (1 - sin_out**2) + 1e-6), -1, 1)
    cos_half = np.sqrt(0.5 + 0.5 * cosine)

    def lobe(tilts: float, width: float) -> npt.NDArray[Any]:
        x = (half - tilts * fibre.TILT) / (width * fibre.ROUGHNESS)
        return np.asarray(np.exp(-0.5 * x * x) / (width * fibre.ROUGHNESS))

    r = fibre.FRESNEL * fibre.R_SCALE * cos_half * lobe(-2, 1)
    tt = fibre.TT_SHARE * np.exp(-fibre.TT_FOCUS * (cosine + 1)) * lobe(1, 0.5)
    trt = fibre.TRT_SHARE * np.exp(fibre.TRT_FOCUS * (cosine - 1)) * lobe(3, 2)
    diffuse = fibre.DIFFUSE * (1 + cos_half)
    parts = r[:, None] + (tt + diffuse)[:, None] * colour + trt[:, None] * colour**1.5
    return np.asarray(np.sqrt(1 - sin_in**2)[:, None] * parts)


def test_shaders_and_loops_scatter_as_the_formula_says() -> None:
    """2,000 random fibres, lights and eyes: the picture's and the viewer's light is the paper's."""
    given = cases()
    tangent, light, eye, colour, jitter = given
    wanted = scattered(*given)
    assert np.abs(drawn(*given) - wanted).max() < TOLERANCE
    sin_in, sin_out = (tangent * light).sum(axis=1), (tangent * eye).sum(axis=1)
    rows = zip(sin_in, sin_out, (light * eye).sum(axis=1), jitter, strict=True)
    single = np.float32
    factors = np.array(
        [
            shade_kernels._fibre(single(a), (single(b), np.arcsin(single(b))), single(c), single(j))
            for a, b, c, j in rows
        ]
    )
    white, own, deep = factors.T[..., None]
    assert np.abs(white + own * colour + deep * colour**1.5 - wanted).max() < TOLERANCE


def drawn(*given: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the light (N, 3) that `marschner.glsl` computes."""
    tangent, light, eye, colour, jitter = given
    records = np.zeros((COUNT, 4, 4), np.float32)
    records[:, 0, :3], records[:, 0, 3] = tangent, jitter
    records[:, 1, :3], records[:, 2, :3], records[:, 3, :3] = light, eye, colour
    with renderer() as gl:
        made = gl.context.compute_shader(SHADER % shader_source("marschner.glsl"))
        inputs, output = gl.context.buffer(records), gl.context.buffer(reserve=16 * COUNT)
        inputs.bind_to_storage_buffer(0)
        output.bind_to_storage_buffer(1)
        made.run(COUNT)
        gl.context.memory_barrier()
        found = np.frombuffer(output.read(), np.float32).reshape(COUNT, 4)[:, :3]
        for part in (inputs, output, made):
            part.release()
    return found
