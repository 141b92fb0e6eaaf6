"""Laws of the super-resolution by coupled dictionaries."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from example_textures import draw_skin
from hairkit_plugins.super_resolution import (
    Options,
    _codes,
    enlarge_luminance,
    learn_dictionaries,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.arrays import UInt8Array
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.types.skin import Texture
from hairkit.types.texture_example import TextureExample

FEW = {"atoms": 64, "rounds": 4, "samples": 3000}
"""Settings of a quick run."""


def small(pixels: UInt8Array, factor: int = 2) -> UInt8Array:
    """Return a picture made smaller."""
    size = (pixels.shape[1] // factor, pixels.shape[0] // factor)
    return np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), np.uint8)


def psnr(first: UInt8Array, second: UInt8Array) -> float:
    """Return the peak signal-to-noise ratio, decibels."""
    error = first.astype(np.float64) - second
    return float(10 * np.log10(255**2 / (error**2).mean()))


def test_it_is_nearer_to_the_truth_than_interpolation(manager: Manager) -> None:
    """Skin enlarged after other skin is better by half a decibel than by interpolation."""
    truth, close_up = draw_skin(192, 1), draw_skin(192, 2)
    texture = small(truth)
    made = manager.call(
        "enhance_texture", "super_resolution", FEW,
        texture=Texture.encode(texture), example=TextureExample(Texture.encode(close_up)),
    ).pixels  # fmt: skip
    cubic = cv2.resize(texture, (192, 192), interpolation=cv2.INTER_CUBIC)
    assert psnr(made, truth) > psnr(np.asarray(cubic, np.uint8), truth) + 0.6


@pytest.mark.parametrize("factor", [2, 3])
def test_made_small_again_it_is_the_texture(factor: int) -> None:
    """Back projection: the mean over each pixel of the texture stays, within one level."""
    options = Options(factor=factor, atoms=32, rounds=2, samples=2000)
    picture = draw_skin(96, 3, scale=2.0)[..., 0].astype(np.float32) / 255
    learned = learn_dictionaries(picture, options)
    texture = draw_skin(40, 4, scale=2.0)[..., 0].astype(np.float32) / 255
    made = enlarge_luminance(texture, learned, options)
    assert made.shape == (40 * factor, 40 * factor)
    again = cv2.resize(made, (40, 40), interpolation=cv2.INTER_AREA)
    assert np.abs(again - texture).mean() < 1 / 255


def test_what_is_flat_stays_flat() -> None:
    """A texture of one colour gets no detail."""
    options = Options(atoms=32, rounds=2, samples=2000)
    picture = draw_skin(96, 3, scale=2.0)[..., 0].astype(np.float32) / 255
    flat = np.full((20, 20), 0.6, np.float32)
    made = enlarge_luminance(flat, learn_dictionaries(picture, options), options)
    np.testing.assert_allclose(made, 0.6, atol=1e-4)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.integers(1, 4))
def test_matching_pursuit_finds_sparse_codes(seed: int, sparsity: int) -> None:
    """Codes have so many atoms at most; the rest is orthogonal to them, and falls with each.

    Over orthonormal atoms the codes are the largest products.
    """
    rng = np.random.default_rng(seed)
    atoms = rng.normal(size=(20, 40))
    atoms /= np.linalg.norm(atoms, axis=0)
    data = rng.normal(size=(30, 20))
    codes = _codes(data, atoms, sparsity)
    assert ((codes != 0).sum(axis=1) <= sparsity).all()
    rest = data - codes @ atoms.T
    products = np.abs(rest @ atoms)
    assert products[codes != 0].max(initial=0) < 1e-4 * np.abs(data).max()
    fewer = data - _codes(data, atoms, max(sparsity - 1, 1)) @ atoms.T
    assert (np.linalg.norm(rest, axis=1) <= np.linalg.norm(fewer, axis=1) + 1e-6).all()
    basis = np.linalg.qr(atoms[:, :20])[0]
    plain = data @ basis
    limit = np.sort(np.abs(plain), axis=1)[:, -sparsity, None]
    wanted = np.where(np.abs(plain) >= limit, plain, 0)
    np.testing.assert_allclose(_codes(data, basis, sparsity), wanted, atol=1e-4)


def test_equal_input_gives_equal_output(manager: Manager) -> None:
    """The seed decides; another one gives other dictionaries."""
    arguments = {
        "texture": Texture.encode(draw_skin(40, 1)),
        "example": TextureExample(Texture.encode(draw_skin(64, 2))),
    }
    first, second, other = (
        manager.call("enhance_texture", "super_resolution", {**FEW, "seed": s}, **arguments).pixels
        for s in (0, 0, 1)
    )
    np.testing.assert_array_equal(first, second)
    assert (first != other).any()


def test_what_cannot_be_enlarged_is_refused(manager: Manager) -> None:
    """No example, one without detail, one that is too small, a result that is too large."""

    def refused(texture: UInt8Array, example: UInt8Array | None, said: str) -> None:
        given = None if example is None else TextureExample(Texture.encode(example))
        with pytest.raises(InputError, match=said):
            manager.call(
                "enhance_texture", "super_resolution", None,
                texture=Texture.encode(texture), example=given,
            )  # fmt: skip

    skin = draw_skin(64, 1)
    refused(skin, None, "no example")
    refused(skin, np.full((64, 64, 3), 9, np.uint8), "0 patches with detail")
    refused(skin, skin[:20], "too few for patches")
    refused(np.zeros((4100, 4100, 3), np.uint8), skin, "more than")
    refused(skin[:2], skin, "smaller than a patch")
