"""Laws of skin in two layers: energy, reciprocity and limits of the twins, and of the shaders."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.special import iti0k0
from skin_twins import below, diffuse, distribution, fresnel, reflect

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.head_model.template import default_head
from hairkit.rendering import Solid, draw_views
from hairkit.rendering.context import renderer, shader_source
from hairkit.rendering.head import head_solid
from hairkit.rendering.light import Lights
from hairkit.rendering.skin_lobe import TAPS, diffusion_kernel
from hairkit.rendering.skin_passes import _diffuse
from hairkit.types.camera import Camera
from hairkit.types.groom import HairMaterial
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.skin_look import LOBES, SkinLook
from hairkit.types.strands import Strands

UP = np.array([0.0, 0.0, 1.0])
LOBE_SHADER = """#version 430
layout(local_size_x = 1) in;
layout(std430, binding = 0) buffer Light { vec4 lights[]; };
layout(std430, binding = 1) buffer Eye { vec4 eyes[]; };
layout(std430, binding = 2) buffer Result { vec2 results[]; };
uniform int u_lobe; uniform float u_alpha; uniform float u_f0;
void main() {
    uint i = gl_GlobalInvocationID.x;
    vec3 l = lights[i].xyz, v = eyes[i].xyz;
    results[i] = vec2(oil(u_lobe, u_alpha, u_f0, vec3(0.0, 0.0, 1.0), l, v), below(u_f0, l.z, v.z));
}
"""


def directions(polar: Float64Array, around: Float64Array) -> Float64Array:
    """Return unit vectors (N, 3) by angles from the normal and around it."""
    ring = np.sin(polar)
    return np.stack([ring * np.cos(around), ring * np.sin(around), np.cos(polar)], axis=-1)


def hemisphere(steps: int = 400) -> tuple[Float64Array, Float64Array]:
    """Return directions (N, 3) and their solid angles (N,)."""
    polar = (np.arange(steps) + 0.5) * np.pi / 2 / steps
    around = (np.arange(steps) + 0.5) * 2 * np.pi / steps
    angles = np.meshgrid(polar, around, indexing="ij")
    area = np.sin(angles[0]) * (np.pi / 2 / steps) * (2 * np.pi / steps)
    return directions(*angles).reshape(-1, 3), area.ravel()


def pairs(count: int = 300) -> tuple[Float64Array, Float64Array]:
    """Return random directions above the surface, twice."""
    rng = np.random.default_rng(1)
    first, second = (
        directions(np.arccos(rng.uniform(0.02, 1, count)), rng.uniform(0, 2 * np.pi, count))
        for _ in range(2)
    )
    return first, second


@pytest.mark.parametrize("roughness", [0.4, 0.55, 0.9])
@pytest.mark.parametrize("lobe", LOBES)
def test_facets_cover_the_surface_once(lobe: str, roughness: float) -> None:
    """The projected area of all facets is that of the surface: int D (n.h) = 1."""
    way, area = hemisphere()
    total = (distribution(lobe, roughness**2, way[:, 2]) * way[:, 2] * area).sum()
    assert total == pytest.approx(1, abs=5e-3)


@pytest.mark.parametrize("lobe", LOBES)
def test_light_and_eye_can_be_swapped(lobe: str) -> None:
    """Helmholtz: f(l, v) = f(v, l) of the oil and of what is below."""
    look, (light, eye) = SkinLook(lobe=lobe), pairs()
    forth = reflect(look, UP, light, eye) / light[:, 2]
    np.testing.assert_allclose(forth, reflect(look, UP, eye, light) / eye[:, 2], rtol=1e-9)
    swapped = below(look, eye[:, 2], light[:, 2])
    np.testing.assert_allclose(below(look, light[:, 2], eye[:, 2]), swapped)


@pytest.mark.parametrize("roughness", [0.4, 0.55, 0.9])
@pytest.mark.parametrize("lobe", LOBES)
def test_no_more_light_leaves_than_arrives(lobe: str, roughness: float) -> None:
    """The white furnace: oil and white flesh together return at most all, from any direction."""
    look = SkinLook(lobe=lobe, roughness=roughness)
    way, area = hemisphere(200)
    for cosine in (1.0, 0.7, 0.4, 0.15):
        eye = np.array([np.sqrt(1 - cosine**2), 0, cosine])
        oil = (reflect(look, UP, way, np.tile(eye, (len(way), 1))) * area).sum()
        flesh = (below(look, way[:, 2], cosine) / np.pi * way[:, 2] * area).sum()
        assert oil >= 0
        assert oil + flesh <= 1.0


@pytest.mark.parametrize("lobe", LOBES)
def test_smooth_oil_is_a_mirror(lobe: str) -> None:
    """The limit of a smooth film: it reflects what Fresnel's equations say, nothing backwards."""
    look = SkinLook(lobe=lobe, roughness=0.25)
    way, area = hemisphere(800)
    for cosine in (0.95, 0.7):
        eye = np.array([np.sqrt(1 - cosine**2), 0, cosine])
        oil = reflect(look, UP, way, np.tile(eye, (len(way), 1))) * area
        assert oil.sum() == pytest.approx(float(fresnel(look.f0, cosine)), rel=0.05)
        mean = (way * oil[:, None]).sum(axis=0) / oil.sum()
        np.testing.assert_allclose(mean, eye * [-1, 1, 1], atol=0.03)


def test_limits_of_the_film() -> None:
    """Without a step of the index nothing is reflected at right angles; grazing light always is."""
    assert SkinLook(ior=1.0).f0 == 0
    assert SkinLook().f0 == pytest.approx(0.0278, abs=1e-4)
    assert below(SkinLook(ior=1.0), 1.0, 1.0) == 1
    assert fresnel(0.028, 0.0) == 1
    assert (reflect(SkinLook(), UP, -UP, UP) == 0).all()
    for wrong in ({"lobe": "phong"}, {"roughness": 1.2}, {"mean_free_path": (0.1, -1.0, 0.1)}):
        with pytest.raises(InputError, match="expected"):
            SkinLook(**wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("lobe", LOBES)
def test_the_shader_is_the_twin(lobe: str) -> None:
    """The lobe and what is below, on the GPU and in NumPy."""
    look, (light, eye) = SkinLook(lobe=lobe), pairs()
    with renderer() as gl:
        version, main = LOBE_SHADER.split("\n", 1)
        source = f"{version}\n{shader_source('skin_lobe.glsl')}\n{main}"
        program = gl.context.compute_shader(source)
        program["u_lobe"], program["u_f0"] = LOBES.index(lobe), look.f0
        program["u_alpha"] = look.roughness**2
        buffers = [
            gl.context.buffer(np.pad(each, ((0, 0), (0, 1))).astype(np.float32))
            for each in (light, eye)
        ]
        buffers.append(gl.context.buffer(reserve=8 * len(light)))
        for number, buffer in enumerate(buffers):
            buffer.bind_to_storage_buffer(number)
        program.run(len(light))
        found = np.frombuffer(buffers[2].read(), np.float32).reshape(-1, 2)
    np.testing.assert_allclose(found[:, 0], reflect(look, UP, light, eye), rtol=2e-3, atol=1e-6)
    np.testing.assert_allclose(found[:, 1], below(look, light[:, 2], eye[:, 2]), rtol=1e-4)


def test_the_kernel_keeps_the_light() -> None:
    """Weights of each channel sum up to 1, the nearer the heavier by width; red goes farthest."""
    kernel = diffusion_kernel(SkinLook())
    assert kernel.shape == (TAPS, 4)
    np.testing.assert_allclose(kernel[:, :3].sum(axis=0), 1, rtol=1e-12)
    assert (kernel[:, :3] >= 0).all()
    spread = (kernel[:, :3] * kernel[:, 3:] ** 2).sum(axis=0)
    assert spread[0] > spread[1] > spread[2]
    none = diffusion_kernel(SkinLook(mean_free_path=(0.0, 0.001, 0.001)))
    np.testing.assert_array_equal(none[:, 0], [1] + [0] * (TAPS - 1))


def test_the_edge_of_a_shadow_is_that_of_the_profile() -> None:
    """Across a straight edge the separable kernel is exact: the integral of K0."""
    path, metres = 0.002, 0.00025
    step = np.zeros((4, 200, 3))
    step[:, 100:] = 1
    made = diffuse(step, SkinLook(mean_free_path=(path,) * 3), metres)[2, :, 0]
    x = (np.arange(200) - 99.5) * metres / path
    wanted = 0.5 + np.sign(x) / np.pi * iti0k0(np.abs(x))[1]
    assert np.abs(made - wanted).mean() < 0.006
    assert np.abs(made - wanted).max() < 0.08
    np.testing.assert_allclose(made + made[::-1], 1, atol=1e-9)


def test_both_passes_of_the_shader_are_the_twin() -> None:
    """A pattern of light on a plane, within the half floats of the GPU."""
    rng = np.random.default_rng(2)
    light = rng.uniform(0, 2, (48, 64, 3))
    look, metres = SkinLook(), 0.0008
    camera = Camera.on_turn(0.0, distance=1.0, focal=1 / metres, width=64, height=48)
    flat = replace(camera, model="orthographic")
    with renderer() as gl:
        layers = [gl.context.texture((64, 48), 4, dtype="f4") for _ in range(4)]
        for layer in layers:
            layer.repeat_x = layer.repeat_y = False
        layers[0].write(np.dstack([light, np.ones((48, 64))]).astype(np.float32))
        layers[1].write(np.ones((48, 64, 4), np.float32))
        gl.context.disable(gl.context.DEPTH_TEST)
        _diffuse(gl, layers, flat, look, (0, 0, 64, 48))
        found = np.frombuffer(layers[0].read(), np.float32).reshape(48, 64, 4)
        for layer in layers:
            layer.release()
    np.testing.assert_allclose(found[..., :3], diffuse(light, look, metres), atol=0.02)
    np.testing.assert_array_equal(found[..., 3], 1)


def plane(
    normal: Float64Array = UP, maps: SkinMaps | None = None, scatter: float = 1.0, **values: Any
) -> UInt8Array:
    """Return a picture of a square of 10 cm that faces the camera."""
    corners = 0.05 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    solid = Solid(
        corners,
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        np.tile(normal / np.linalg.norm(normal), (4, 1)).astype(np.float32),
        np.full((4, 3), 0.4, np.float32),
        uv=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32),
        maps=maps,
        scatter=scatter,
    )
    camera = Camera.on_turn(0.0, distance=0.6, focal=400, width=80, height=80)
    empty = Strands(np.zeros((0, 3), np.float32), np.zeros(1, np.int64))
    lights = Lights.studio((0.5, 0.6, 0.8), (0.7, 0.1, 0.6), exposure=0.15)
    [picture] = draw_views(
        empty, None, [camera], solids=[solid], lights=lights, skin=SkinLook(**values)
    )
    return picture[30:50, 30:50]


def test_a_normal_map_is_a_turned_normal() -> None:
    """A map of one normal gives what geometry with that normal gives, a flat one nothing."""
    for way in (np.array([0.0, 0.0, 1.0]), np.array([0.3, 0.0, 1.0]), np.array([-0.1, 0.4, 1.0])):
        unit = way / np.linalg.norm(way)
        colour = np.rint(255 * (0.5 + 0.5 * unit)).astype(np.uint8)
        normal = Texture.encode(np.tile(colour, (4, 4, 1)))
        mapped, turned = plane(maps=SkinMaps(normal=normal)), plane(way)
        assert np.abs(mapped.astype(int) - turned).max() <= 3
    assert np.abs(plane(np.array([0.3, 0, 1.0])).astype(int) - plane()).max() > 5


def test_a_roughness_map_is_the_roughness() -> None:
    """A map of one level gives what that roughness gives."""
    for level in (80, 200):
        grey = Texture.encode(np.full((4, 4), level, np.uint8))
        mapped = plane(maps=SkinMaps(roughness=grey))
        assert np.abs(mapped.astype(int) - plane(roughness=level / 255)).max() <= 2
    assert (plane(roughness=0.3) != plane(roughness=0.8)).any()


def test_cloth_has_neither_layer() -> None:
    """Lobe and roughness change skin, and nothing that does not scatter."""
    rough = {"lobe": "beckmann", "roughness": 0.2}
    assert (plane() != plane(**rough)).any()
    np.testing.assert_array_equal(plane(scatter=0.0), plane(scatter=0.0, **rough))


def test_the_scalp_is_tinted_where_hair_grows_alone() -> None:
    """A bald part has the colours of the face; a head of unknown density is tinted all over."""
    head, material = default_head(), HairMaterial()
    scalp, bald = head.scalp == 1, head.vertices[:, 0] > 0
    whole = head_solid(head, material).colours
    half = head_solid(replace(head, density=np.where(bald, 0, 1)), material).colours
    face = whole[head.scalp == 0]
    assert (half[scalp & bald] == face[0]).all()
    np.testing.assert_array_equal(half[~bald], whole[~bald])
    assert not np.isclose(whole[scalp], face[0]).all(axis=1).any()
