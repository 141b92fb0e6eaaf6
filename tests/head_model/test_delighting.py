"""Laws of the light that is taken out of a head's colours."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import Float32Array
from hairkit.head_model.delighting import GAMMA, find_shading, harmonics

SIZE = 200
LIGHTS = {
    "even": [1.0, 0, 0, 0, 0, 0, 0, 0, 0],
    "above": [1.0, 0.35, 0.1, 0, 0, 0, 0, 0, 0],
    "side": [1.0, 0.1, 0.15, -0.4, 0.05, 0, 0.05, -0.1, 0.05],
}


def sphere() -> Float32Array:
    """Return the normals (S, S, 3) of a sphere seen from all sides by an equirectangular map."""
    azimuth, polar = np.meshgrid(
        np.linspace(-np.pi, np.pi, SIZE), np.linspace(0.1, np.pi - 0.1, SIZE)
    )
    parts = [np.sin(polar) * np.sin(azimuth), np.cos(polar), np.sin(polar) * np.cos(azimuth)]
    return np.stack(parts, axis=-1).astype(np.float32)


def mottled(seed: int = 0) -> Float32Array:
    """Return the albedo (S, S, 3) of skin with pores, sRGB, and two dark brows."""
    noise = np.random.default_rng(seed).normal(1, 0.05, (SIZE, SIZE, 1))
    albedo = np.array([190, 145, 120]) * noise
    albedo[60:66, 50:90] = albedo[60:66, 110:150] = [60, 40, 30]
    return albedo.astype(np.float32)


@pytest.mark.parametrize("light", LIGHTS)
def test_light_is_taken_out(light: str) -> None:
    """Skin under any smooth light, divided by its shading, is its albedo but for one factor."""
    normals, albedo = sphere(), mottled()
    irradiance = harmonics(normals) @ np.array(LIGHTS[light])
    photo = albedo * irradiance[..., None].astype(np.float32) ** (1 / GAMMA)
    found = photo / find_shading(photo, np.ones((SIZE, SIZE), np.float32), normals)
    ratio = (found / albedo)[..., 1]
    ratio /= np.median(ratio)
    assert np.abs(ratio - 1).mean() < 0.02
    assert np.abs(ratio - 1).max() < 0.15


def test_what_is_dark_by_itself_stays() -> None:
    """Brows stay as dark beside skin as they are, and the level of the picture is kept."""
    albedo = mottled()
    shading = find_shading(albedo, np.ones((SIZE, SIZE), np.float32), sphere())
    assert abs(float(np.log(shading).mean())) < 0.01
    assert np.abs(np.log(shading)).max() < 0.05


def test_only_seen_skin_counts() -> None:
    """Colours without weight change nothing, and a map that no view sees is left alone."""
    normals, photo = sphere(), mottled()
    weight = np.zeros((SIZE, SIZE), np.float32)
    weight[:, 50:150] = 1
    other = np.where(weight[..., None] > 0, photo, 7.0).astype(np.float32)
    seen = weight > 0
    np.testing.assert_allclose(
        find_shading(other, weight, normals)[seen], find_shading(photo, weight, normals)[seen]
    )
    np.testing.assert_array_equal(find_shading(photo, 0 * weight, normals), 1)
