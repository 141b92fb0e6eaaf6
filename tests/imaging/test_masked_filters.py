"""Laws of mask-aware filters and of averages of undirected angles."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.arrays import BoolArray, Float32Array
from hairkit.errors import InputError
from hairkit.imaging.masked_filters import (
    blur,
    bounding_box,
    coherent_truth,
    double_angle,
    fill_beyond,
    hair_of,
    local_contrast,
    luminance,
    masked_blur,
    picture_scale,
    single_angle,
    well_inside,
)
from hairkit.types.capture import View
from hairkit.types.mask import Mask
from hairkit.types.orientation import angle_between


def disc(size: int = 64, radius: float = 20.0) -> BoolArray:
    """A disc in the middle of a square picture."""
    y, x = np.mgrid[:size, :size] - (size - 1) / 2
    return np.asarray(np.hypot(x, y) < radius)


def ramp(size: int = 64) -> Float32Array:
    """Brightness that grows to the right and a little downwards."""
    y, x = np.mgrid[:size, :size]
    return (0.2 + 0.004 * x + 0.001 * y).astype(np.float32)


def test_luminance_of_grey_is_that_grey() -> None:
    """The weights sum to one: a grey picture keeps its value, 255 becomes 1."""
    image = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    np.testing.assert_allclose(luminance(image)[0], np.arange(256) / 255, atol=1e-6)


def test_masked_blur_keeps_a_constant_up_to_the_edge() -> None:
    """What lies beyond the mask has no influence, however large it is."""
    mask = disc()
    values = np.where(mask, 0.5, 1e4).astype(np.float32)
    np.testing.assert_allclose(masked_blur(values, mask, 3.0)[mask], 0.5, rtol=1e-4)


def test_masked_blur_is_a_plain_blur_under_a_full_mask() -> None:
    """With every pixel on the mask normalised convolution is convolution."""
    values = ramp()
    everywhere = np.ones(values.shape, bool)
    np.testing.assert_allclose(masked_blur(values, everywhere, 2.0), blur(values, 2.0), rtol=1e-5)


def test_masked_blur_handles_channels_one_by_one() -> None:
    """A picture of two channels gives the blurs of each."""
    values, mask = ramp(), disc()
    both = masked_blur(np.dstack([values, values.T]), mask, 2.0)
    np.testing.assert_allclose(both[..., 0], masked_blur(values, mask, 2.0), atol=1e-6)
    np.testing.assert_allclose(both[..., 1], masked_blur(values.T, mask, 2.0), atol=1e-6)


def test_masked_blur_is_zero_where_no_weight_reaches() -> None:
    """Far from the mask there is no mean to take."""
    mask = np.zeros((64, 64), bool)
    mask[2, 2] = True
    assert masked_blur(ramp(), mask, 1.0)[-1, -1] == 0


def test_fill_keeps_the_inside_and_stays_within_its_range() -> None:
    """Masked values come back unchanged; the fill is a mean of them."""
    values, mask = ramp(), disc()
    filled = fill_beyond(np.where(mask, values, 9).astype(np.float32), mask, 4.0)
    np.testing.assert_array_equal(filled[mask], values[mask])
    assert filled.min() >= values[mask].min() - 1e-5
    assert filled.max() <= values[mask].max() + 1e-5


def test_fill_removes_the_step_at_the_masks_edge() -> None:
    """A bright disc on black keeps no edge worth a hundredth of the step."""
    mask = disc()
    filled = fill_beyond(mask.astype(np.float32), mask, 4.0)
    assert np.ptp(filled) < 0.01


@pytest.mark.parametrize("mask", [np.zeros((8, 8), bool), np.ones((4, 4), bool)])
def test_fill_refuses_an_empty_or_foreign_mask(mask: BoolArray) -> None:
    """There is nothing to fill from, or no telling where."""
    with pytest.raises(InputError, match="wanted the same shape and at least one pixel"):
        fill_beyond(np.zeros((8, 8), np.float32), mask, 2.0)


def test_bounding_box_holds_the_mask_and_no_more_than_its_margin() -> None:
    """All of the mask lies in the box; without a margin every side touches it."""
    mask = disc()
    inner = mask[bounding_box(mask, 0)]
    assert inner.sum() == mask.sum()
    assert inner[0].any()
    assert inner[-1].any()
    assert inner[:, 0].any()
    assert inner[:, -1].any()
    assert mask[bounding_box(mask, 3)].shape == (inner.shape[0] + 6, inner.shape[1] + 6)
    assert mask[bounding_box(mask, 999)].shape == mask.shape


def test_bounding_box_refuses_an_empty_mask() -> None:
    """No pixel, no box."""
    with pytest.raises(InputError, match="is empty"):
        bounding_box(np.zeros((4, 5), bool), 1)


def test_well_inside_leaves_the_edge_out_and_thin_masks_whole() -> None:
    """The core is smaller than the disc; a one-pixel line has no core and is kept."""
    mask = disc()
    core = well_inside(mask, 1.0)
    assert 0 < core.sum() < mask.sum()
    assert not (core & ~mask).any()
    line = np.zeros((32, 32), bool)
    line[16] = True
    np.testing.assert_array_equal(well_inside(line, 1.0), line)


def test_local_contrast_ignores_exposure_and_background() -> None:
    """Twice the light, or another background, leave the contrast as it was."""
    rng = np.random.default_rng(3)
    mask = disc()
    grey = (0.2 + 0.1 * rng.random((64, 64))).astype(np.float32)
    weight = mask.astype(np.float32)
    base = local_contrast(grey, weight, 4.0)
    np.testing.assert_allclose(local_contrast(2 * grey, weight, 4.0), base, atol=1e-4)
    other = np.where(mask, grey, 0.9).astype(np.float32)
    np.testing.assert_allclose(local_contrast(other, weight, 4.0), base, atol=1e-4)
    assert 0.7 < base[mask].std() < 1.2


def test_local_contrast_of_constant_grey_is_nothing() -> None:
    """A grey blob has no detail, not even at its edge."""
    mask = disc()
    grey = np.where(mask, 0.4, 0.9).astype(np.float32)
    assert np.abs(local_contrast(grey, mask.astype(np.float32), 4.0)).max() < 1e-2


@given(st.floats(0, np.pi, exclude_max=True))
def test_double_angles_go_back_to_themselves(angle: float) -> None:
    """single_angle undoes double_angle, whatever the vector's length."""
    back = single_angle(double_angle([angle], [0.3]))
    assert angle_between(back, angle)[0] < 1e-5


def test_truth_is_coherent_on_smooth_hair_and_not_where_strands_cross() -> None:
    """Two layers at right angles leave no orientation to ask for; a turning field does."""
    y, x = np.mgrid[:60, :60]
    smooth = (np.pi * x / 200).astype(np.float32)
    crossed = np.where((x + y) % 2, 0.2, 0.2 + np.pi / 2).astype(np.float32)
    mask = disc(60, 25)
    np.testing.assert_array_equal(coherent_truth(smooth, mask), mask)
    assert not coherent_truth(crossed, mask).any()


def test_lengths_scale_with_the_pictures_height() -> None:
    """A picture twice as high has kernels twice as large."""
    assert picture_scale(2160) == 2 * picture_scale(1080) == 2


def test_a_mask_of_another_size_is_named() -> None:
    """The error tells whose mask it is and both sizes, width first."""
    view = View("left", 90.0, np.zeros((6, 4, 3), np.uint8))
    labels = np.full((4, 6), 255, np.uint8)
    with pytest.raises(InputError, match="mask of left is 6 x 4 pixels, expected 4 x 6"):
        hair_of(view, Mask(labels, True))


@pytest.mark.parametrize(("sigma", "tolerance"), [(2.0, 1e-3), (5.0, 0.01), (12.0, 0.01)])
def test_blur_is_the_gaussian_also_where_it_takes_a_coarser_grid(
    sigma: float, tolerance: float
) -> None:
    """Constants stay, and a blob becomes the blob under OpenCV's Gaussian."""
    np.testing.assert_allclose(blur(np.ones((21, 30), np.float32), sigma), 1, rtol=1e-5)
    blob = disc(121, 9).astype(np.float32)
    wanted = cv2.GaussianBlur(blob, (0, 0), sigma)
    np.testing.assert_allclose(blur(blob, sigma), wanted, atol=tolerance)
