"""Laws of Image Analogies: what the pseudo-code says, and what an analogy must do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from example_textures import blur as softened
from example_textures import draw_skin
from hairkit_plugins.image_analogies import allowed_pixels, blend_weights, find_regions
from hairkit_plugins.image_analogies.blur_match import blur, find_blur
from hairkit_plugins.image_analogies.features import (
    feature_weights,
    gather_feature,
    make_pair,
    squared_distance,
)
from hairkit_plugins.image_analogies.search_tree import (
    build_tree,
    gather_features,
    new_heap,
    search_tree,
)
from hairkit_plugins.image_analogies.synthesis import NOWHERE, Settings, synthesise
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_analogies import plain_analogy

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.errors import DataError, InputError
from hairkit.manager import Manager
from hairkit.types.skin import Texture
from hairkit.types.texture_example import TextureExample

WHOLE = 10**6
"""Leaves: all of them."""


def grey(size: int, seed: int, sigma: float = 1.0) -> Float32Array:
    """Return smooth noise (size, size, 1) around 0.5."""
    rng = np.random.default_rng(seed)
    field = cv2.GaussianBlur(rng.standard_normal((size, size)).astype(np.float32), (0, 0), sigma)
    return np.asarray(0.5 + 0.15 * field / field.std(), np.float32)[..., None]


def enhance(manager: Manager, texture: UInt8Array, example: Any, **values: object) -> UInt8Array:
    """Return the pixels that the plugin makes."""
    made = manager.call(
        "enhance_texture", "image_analogies", values, texture=Texture.encode(texture),
        example=example,
    )  # fmt: skip
    return np.asarray(made.pixels)


def psnr(first: Any, second: Any) -> float:
    """Return the peak signal-to-noise ratio of 8-bit pictures, decibels."""
    error = np.asarray(first, np.float64) - np.asarray(second, np.float64)
    return float(10 * np.log10(255**2 / max((error**2).mean(), 1e-9)))


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("alpha", [None, 0.3])
def test_the_search_of_all_leaves_is_the_plain_algorithm(
    channels: int, alpha: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With no component left out and every leaf looked at, B' is the twin's, pixel by pixel."""
    monkeypatch.setattr("hairkit_plugins.image_analogies.search_tree.COMPONENTS", 999)
    filtered, target = (
        np.concatenate([grey(20, seed + 9 * c) for c in range(channels)], axis=2) for seed in (1, 2)
    )
    source = blur(filtered, 1.0)
    made, _ = synthesise(source, filtered, target, Settings(2, 1.0, alpha, WHOLE))
    wanted = plain_analogy(source, filtered, target, 2, 1.0, alpha=alpha)
    np.testing.assert_allclose(made, wanted, atol=1e-6)


def test_every_pixel_is_one_of_the_example() -> None:
    """B'(q) = A'(s(q)) for the matches that are returned."""
    filtered, target = grey(40, 1), grey(33, 2)
    made, places = synthesise(blur(filtered, 1.0), filtered, target, Settings(3, 2.0, None, 8))
    np.testing.assert_array_equal(made, filtered[places[..., 0], places[..., 1]])


def test_an_example_of_itself_comes_back() -> None:
    """Where B is A, B' is A': features have their own pixels at distance 0, but at the border."""
    filtered = grey(48, 3)
    source = blur(filtered, 1.5)
    _, places = synthesise(source, filtered, source, Settings(3, 0.0, None, 64))
    own = np.stack(np.mgrid[:48, :48], axis=-1)
    assert (places == own).all(axis=2)[6:, 6:].mean() > 0.95


def test_greater_kappa_makes_larger_pieces() -> None:
    """The share of pixels that go on with their left neighbour's piece grows with kappa."""
    filtered, target = grey(64, 4), blur(grey(64, 5), 1.0)
    shares = []
    for kappa in (0.0, 2.0, 20.0):
        settings = Settings(3, kappa, None, 32)
        _, places = synthesise(blur(filtered, 1.0), filtered, target, settings)
        step = places[:, 1:] - places[:, :-1]
        shares.append(float((step == [0, 1]).all(axis=2).mean()))
    assert shares == sorted(shares)
    assert shares[2] > shares[0] + 0.1


def test_alpha_1_follows_the_filtered_example_alone() -> None:
    """Graham's weight: at 1 the source counts nothing, at 0 the filtered picture counts nothing."""
    filtered, target = grey(32, 6), blur(grey(32, 7), 1.0)
    source = blur(filtered, 1.0)
    for alpha, middle in ((0.0, slice(34, None)), (1.0, slice(0, 34))):
        assert not feature_weights(1, alpha, coarsest=False)[middle].any()
    near, far = (
        synthesise(source, filtered, target, Settings(1, 0.0, alpha, WHOLE))[1]
        for alpha in (0.05, 0.95)
    )
    distance = [float(np.abs(source[p[..., 0], p[..., 1]] - target).mean()) for p in (near, far)]
    assert distance[0] < distance[1]


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6), st.integers(17, 300))
def test_the_tree_finds_the_nearest_point(seed: int, count: int) -> None:
    """A search of all leaves agrees with an exhaustive one; a limit below it finds nothing."""
    image = grey(32, seed % 1000)
    pair = make_pair(image, image, None, None)
    roots = feature_weights(1, None, coarsest=True)
    rng = np.random.default_rng(seed)
    places = rng.integers(0, 32, (count, 2)).astype(np.int32)
    tree = build_tree(pair, places, roots, 0, len(roots))
    features = np.empty((count, len(roots)), np.float32)
    gather_features(pair, places, roots, features)
    query = features[0] + rng.normal(0, 0.02, len(roots)).astype(np.float32)
    reduced = (features - query) @ tree.components
    distances = (reduced**2).sum(axis=1)
    place, heap = np.empty(2, np.int32), new_heap(WHOLE, (tree,))
    assert search_tree(tree, heap, query, WHOLE, np.inf, place)
    found = np.flatnonzero((places == place).all(axis=1))
    assert distances[found].min() <= distances.min() * (1 + 1e-3) + 1e-7
    assert not search_tree(tree, heap, query, WHOLE, 0.5 * float(distances.min()), place)


def test_features_are_windows() -> None:
    """Weights of the four windows sum up to 1 each; the distance is that of NumPy."""
    roots = feature_weights(3, None, coarsest=False)
    np.testing.assert_allclose((roots**2).sum(), 4, rtol=1e-5)
    image = np.concatenate([grey(16, n) for n in range(3)], axis=2)
    pair = make_pair(image, image, cv2.pyrDown(image), cv2.pyrDown(image))
    first, second = np.empty_like(roots), np.empty_like(roots)
    gather_feature(pair, 5, 6, roots, first)
    gather_feature(pair, 9, 3, roots, second)
    window = image[3:8, 4:9].ravel()
    np.testing.assert_allclose(first[:75], roots[:75] * window, rtol=1e-6)
    np.testing.assert_allclose(
        squared_distance(first, second), ((first - second) ** 2).sum(), rtol=1e-4
    )


@pytest.mark.parametrize("sigma", [0.8, 1.5, 3.0, 5.0])
def test_the_blur_is_found(sigma: float) -> None:
    """Of a blurred picture of the same surface, darker and of less contrast, within 15 %."""
    sharp, other = (draw_skin(256, seed, scale=2.0).astype(np.float32).mean(axis=2) / 255
                    for seed in (1, 2))  # fmt: skip
    texture = np.rint(255 * (0.2 + 0.6 * cv2.GaussianBlur(other, (0, 0), sigma))) / 255
    assert find_blur(sharp, texture.astype(np.float32)) == pytest.approx(sigma, rel=0.15)
    assert find_blur(texture.astype(np.float32), sharp) == 0


def test_sharpening_is_nearer_to_the_truth_than_the_texture(manager: Manager) -> None:
    """Skin from a scan gets the power of its detail back, with a source made from the close-up."""
    close_up, truth = draw_skin(160, 1, scale=2.0), draw_skin(160, 2, scale=2.0)
    scan = cv2.GaussianBlur(truth, (0, 0), 1.5)
    made = enhance(manager, scan, TextureExample(Texture.encode(close_up)))
    detail = [
        float(cv2.Laplacian(cv2.cvtColor(p, cv2.COLOR_RGB2GRAY), cv2.CV_32F).std())
        for p in (scan, made, truth)
    ]
    assert detail[0] < 0.5 * detail[2]
    assert detail[1] == pytest.approx(detail[2], rel=0.4)
    smooth = [cv2.GaussianBlur(p, (0, 0), 1.5) for p in (made, truth)]
    assert psnr(*smooth) > 30


def test_luminance_is_remapped(manager: Manager) -> None:
    """A darker example of half the contrast gives what the bright one gives, within rounding."""
    texture, example = draw_skin(64, 3, scale=2.0), draw_skin(64, 4, scale=2.0)
    dark = (20 + 0.5 * example.astype(np.float64)).astype(np.uint8)
    bright, remapped = (
        enhance(manager, texture, TextureExample(Texture.encode(e), Texture.encode(softened(e))))
        for e in (example, dark)
    )
    plain = enhance(
        manager, texture,
        TextureExample(Texture.encode(dark), Texture.encode(softened(dark))), remap=False,
    )  # fmt: skip
    assert psnr(remapped, bright) > psnr(plain, bright) + 3


def test_chrominance_stays_the_textures(manager: Manager) -> None:
    """Without `colours` only the luminance is synthesised: differences of channels stay."""
    texture = draw_skin(48, 5)
    example = TextureExample(Texture.encode(draw_skin(48, 6)))
    made = enhance(manager, texture, example).astype(int)
    inside = ((made > 0) & (made < 255)).all(axis=2)
    change = made[..., 0] - made[..., 1] - (texture[..., 0].astype(int) - texture[..., 1])
    assert np.abs(change[inside]).max() <= 1


def test_numbers_become_what_they_stand_for(manager: Manager) -> None:
    """Texture by numbers: each label's pixels have the colours of that label in the example."""
    rng = np.random.default_rng(1)
    kinds = np.array([[200, 30, 30], [30, 30, 200]], np.uint8)
    paints = np.array([[90, 160, 60], [220, 210, 170]])
    first = (np.arange(48)[:, None] + np.arange(48) > 48).astype(int)
    second = (np.arange(48)[:, None] < 20 + 0 * np.arange(48)).astype(int)
    painted = (paints[first] + rng.normal(0, 10, (48, 48, 1))).clip(0, 255).astype(np.uint8)
    example = TextureExample(Texture.encode(painted), Texture.encode(kinds[first]))
    made = enhance(manager, kinds[second], example, colours=True, remap=False)
    for kind in (0, 1):
        inside = cv2.erode((second == kind).astype(np.uint8), np.ones((7, 7))) > 0
        np.testing.assert_allclose(made[inside].mean(axis=0), paints[kind], atol=6)


def test_regions_are_blended_without_a_seam(manager: Manager) -> None:
    """Weights sum up to 1, are 1 away from borders and linear across them."""
    regions = np.repeat([[0] * 30 + [1] * 34], 20, axis=0).astype(np.int32)
    weights = blend_weights(regions, 2, 10)
    np.testing.assert_allclose(weights.sum(axis=0), 1, atol=1e-6)
    np.testing.assert_allclose(weights[0, 10, :24], 1)
    np.testing.assert_allclose(np.diff(weights[0, 10, 25:35]), -1 / 11, atol=1e-5)
    assert allowed_pixels(regions, 1).sum() == 20 * 34
    assert allowed_pixels(regions, 7).all()


def test_regions_are_those_of_the_colours(manager: Manager) -> None:
    """Two areas are told apart in both pictures, and each is made from its own."""
    halves = np.full((64, 64, 3), (210, 150, 130), np.uint8)
    halves[:, 32:] = (120, 60, 70)
    texture = (halves * np.random.default_rng(2).uniform(0.9, 1.1, (64, 64, 1))).astype(np.uint8)
    example = np.ascontiguousarray(texture[:, ::-1])
    first, second = find_regions(texture / np.float32(255), example / np.float32(255), 2)
    assert first[5, 5] == second[5, 60] != first[5, 60] == second[5, 5]
    pair = TextureExample(Texture.encode(example), Texture.encode(example))
    made = enhance(manager, texture, pair, regions=2, border=4, colours=True)
    assert psnr(cv2.blur(made, (9, 9)), cv2.blur(texture, (9, 9))) > 30


def test_pixels_outside_of_a_mask_are_left_alone() -> None:
    """What is not wanted stays B, what is not allowed is never used."""
    filtered, target = grey(32, 8), grey(32, 9)
    allowed, wanted = np.zeros((2, 32, 32), np.bool_)
    allowed[:, :16], wanted[8:20] = True, True
    settings = Settings(3, 2.0, None, 32)
    made, places = synthesise(blur(filtered, 1), filtered, target, settings, allowed, wanted)
    np.testing.assert_array_equal(made[~wanted], target[~wanted])
    assert (places[~wanted] == NOWHERE).all()
    assert allowed[places[wanted][:, 0], places[wanted][:, 1]].all()


def test_equal_input_gives_equal_output(manager: Manager) -> None:
    """Nothing is random."""
    example = TextureExample(Texture.encode(draw_skin(48, 1)))
    first, second = (enhance(manager, draw_skin(40, 2), example, regions=2) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_what_cannot_be_an_example_is_refused(manager: Manager) -> None:
    """No example at all, and a pair of different sizes."""
    with pytest.raises(InputError, match="no example"):
        enhance(manager, draw_skin(16, 1), None)
    small, large = Texture.encode(draw_skin(16, 1)), Texture.encode(draw_skin(20, 1))
    with pytest.raises(DataError, match="16 x 16 pixels"):
        TextureExample(large, small)
    with pytest.raises(DataError, match="16 x 16 pixels"):
        replace(TextureExample(large), source=small)


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (7, 3)])
def test_small_pictures_are_no_fault(manager: Manager, shape: tuple[int, int]) -> None:
    """Any size of either picture gives a result."""
    texture = np.full((*shape, 3), 90, np.uint8)
    example = TextureExample(Texture.encode(draw_skin(16, 1)))
    for first, second in ((texture, example), (draw_skin(16, 1), TextureExample(
        Texture.encode(texture)))):  # fmt: skip
        assert enhance(manager, first, second, blur=1.0).shape == first.shape
