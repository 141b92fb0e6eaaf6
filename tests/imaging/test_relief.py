"""Laws of bump and normal maps, and of pictures of differences."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.errors import DataError
from hairkit.imaging.relief import (
    bump_from_albedo,
    draw_difference,
    normal_from_height,
)


def normals_of(pixels: UInt8Array) -> Float32Array:
    """Return the unit normals (H, W, 3) of a normal map."""
    normal = pixels.astype(np.float32) * np.float32(2 / 255) - 1
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.asarray(normal / np.maximum(length, 1e-9), np.float32)


@given(st.integers(-3, 3), st.integers(-3, 3), st.floats(0.5, 200.0))
def test_a_plane_has_the_normal_of_its_slope(right: int, up: int, depth: float) -> None:
    """Heights that rise to the right lean the normal to the left, and up likewise."""
    row, column = np.mgrid[:20, :20]
    height = (128 + right * (column - 10) - up * (row - 10)).astype(np.uint8)
    found = normals_of(normal_from_height(height, depth))[5:-5, 5:-5]
    wanted = np.array([-right * depth / 255, -up * depth / 255, 1.0])
    wanted /= np.linalg.norm(wanted)
    assert np.abs(found - wanted).max() < 0.01


def test_normals_turn_with_the_picture() -> None:
    """A quarter turn of the heights turns the normals about z."""
    rng = np.random.default_rng(1)
    height = cv2.GaussianBlur(rng.integers(0, 255, (32, 32)).astype(np.uint8), (0, 0), 2)
    normal = normals_of(normal_from_height(height, 30.0))
    turned = normals_of(normal_from_height(np.rot90(height).copy(), 30.0))
    expected = np.rot90(normal)[..., [1, 0, 2]] * [-1, 1, 1]  # counter-clockwise, v up
    np.testing.assert_allclose(turned, expected, atol=0.01)


def test_a_dome_has_the_normals_of_a_sphere() -> None:
    """Around its top, to the rounding of heights to 8 bits."""
    row, column = np.mgrid[:129, :129] - 64.0
    radius = 120.0
    dome = np.sqrt(radius**2 - row**2 - column**2)
    low, high = dome.min(), dome.max()
    height = np.rint(255 * (dome - low) / (high - low)).astype(np.uint8)
    found = normals_of(normal_from_height(height, float(high - low)))
    wanted = np.stack([column, -row, dome], axis=-1) / radius
    assert np.abs(found - wanted)[8:-8, 8:-8].mean() < 0.02


def test_bump_maps_use_all_heights_and_keep_their_order() -> None:
    """The histogram is even, and what is darker is never higher."""
    rng = np.random.default_rng(2)
    grey = np.clip(rng.normal(150, 12, (64, 64)), 0, 255).astype(np.uint8)
    bump = bump_from_albedo(np.repeat(grey[..., None], 3, axis=2))
    counts = np.histogram(bump, bins=4)[0]
    assert counts.min() > 0.2 * bump.size
    order = np.argsort(grey, axis=None)
    assert (np.diff(bump.ravel()[order].astype(int)) >= 0).all()


def test_differences_are_white_red_and_blue() -> None:
    """Equal is white, brighter red, darker blue; a smaller picture is enlarged first."""
    before = np.full((8, 8, 3), 100, np.uint8)
    after = before.copy()
    after[:, :2], after[:, 6:] = 140, 60
    drawn = draw_difference(before, after)
    np.testing.assert_array_equal(drawn[0, 4], 255)
    assert drawn[0, 0, 0] > drawn[0, 0, 2]
    assert drawn[0, 7, 0] < drawn[0, 7, 2]
    np.testing.assert_array_equal(draw_difference(before[:4, :4], after), drawn)
    with pytest.raises(DataError, match="different shapes"):
        draw_difference(before[:4], after)
