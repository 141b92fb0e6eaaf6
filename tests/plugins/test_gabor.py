"""Laws of the Gabor orienter."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hairkit_plugins.gabor import Options, angle_and_confidence, gabor_kernels, orient
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.arrays import BoolArray, Float64Array
from hairkit.imaging.masked_filters import fill_beyond, luminance, well_inside
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import OrientationMap, angle_between

FINE = Options(quadrature=True, iterations=0)


def run(grey: Float64Array, hair: BoolArray, options: Options) -> OrientationMap:
    """Orient a grey picture with values from 0 to 255."""
    image = np.repeat(np.clip(np.rint(grey), 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    labels = np.where(hair, HAIR, 0).astype(np.uint8)
    return orient(View("front", 0.0, image), Mask(labels, True), options)


def disc(size: int = 120, radius: float = 45.0) -> BoolArray:
    """A disc of hair in the middle."""
    y, x = np.mgrid[:size, :size] - (size - 1) / 2
    return np.asarray(np.hypot(x, y) < radius)


def stripes(angle_deg: float, size: int = 120, wavelength: float = 4.5) -> Float64Array:
    """Stripes whose strands run at the angle, on mid grey."""
    y, x = np.mgrid[:size, :size]
    turn = np.radians(angle_deg)
    return 120 + 50 * np.sin(2 * np.pi / wavelength * (y * np.cos(turn) - x * np.sin(turn)))


def inside(hair: BoolArray) -> BoolArray:
    """Hair farther from its edge than a kernel reaches."""
    return cv2.erode(hair.astype(np.uint8), np.ones((15, 15), np.uint8)) > 0


@given(st.floats(0, 179.9))
@settings(max_examples=10)
def test_stripes_have_the_angle_they_were_drawn_with(angle_deg: float) -> None:
    """In quadrature the mean is within half a step of the 32 filter directions."""
    hair = disc()
    found = run(stripes(angle_deg), hair, FINE)
    error = np.degrees(angle_between(found.angle, np.radians(angle_deg)))[inside(hair)]
    assert error.mean() < 180 / 32 / 2 + 0.2


@pytest.mark.parametrize("index", [0, 5, 16, 27])
def test_the_thesis_filter_names_the_nearest_of_its_directions(index: int) -> None:
    """The strand runs across the carrier: stripes along one of 32 directions are called so."""
    hair = disc()
    angle = index * np.pi / 32
    found = run(stripes(np.degrees(angle)), hair, Options(iterations=0))
    right = angle_between(found.angle, angle) < 1e-3
    assert right[inside(hair)].mean() > 0.8


@pytest.mark.parametrize("options", [FINE, Options()])
def test_a_turned_photo_turns_the_angles(options: Options) -> None:
    """Rotating the photo by 90 degrees moves the map along and adds 90 degrees."""
    rng = np.random.default_rng(1)
    hair = disc()
    grey = stripes(22.5) + rng.normal(0, 10, hair.shape)
    straight, turned = (run(np.rot90(grey, k), np.rot90(hair, k), options) for k in (0, 1))
    gap = np.degrees(angle_between(np.rot90(straight.angle) - np.pi / 2, turned.angle))
    assert (gap[np.rot90(hair)] < 0.5).mean() > 0.99
    difference = np.abs(np.rot90(straight.confidence) - turned.confidence)
    assert np.quantile(difference, 0.99) < 0.01


@pytest.mark.parametrize(("gain", "offset"), [(0.5, 0.0), (0.6, 90.0)])
def test_brightness_and_contrast_leave_the_angles(gain: float, offset: float) -> None:
    """A kernel of zero mean sees neither; rounding to grey levels moves few pixels."""
    rng = np.random.default_rng(2)
    hair = disc()
    grey = np.rint(stripes(40) + rng.normal(0, 10, hair.shape))
    first = run(grey, hair, FINE)
    second = run(gain * grey + offset, hair, FINE)
    assert np.degrees(angle_between(first.angle, second.angle)[hair]).mean() < 1


def test_zero_mean_kernels_sum_to_nothing_and_the_printed_ones_do_not() -> None:
    """Every kernel of the bank, cosine and sine."""
    sums = gabor_kernels(Options(quadrature=True)).sum(axis=(2, 3))
    np.testing.assert_allclose(sums, 0, atol=1e-12)
    assert np.abs(gabor_kernels(Options(zero_mean=False)).sum(axis=(2, 3))).min() > 1e-3


def test_kernels_follow_their_formula() -> None:
    """With one sample a pixel the kernel is the formula of the thesis at the pixel's centre."""
    options = Options(supersampling=1, zero_mean=False)
    bank = gabor_kernels(options)[0]
    turn, u, v = 5 * np.pi / 32, 2, -1
    a = (u * np.cos(turn) + v * np.sin(turn)) / 1.8
    b = (v * np.cos(turn) - u * np.sin(turn)) / 2.4
    wanted = np.exp(-0.5 * (a**2 + b**2)) * np.cos(2 * np.pi * a * 1.8 / 4)
    assert bank[5, 4 + v, 4 + u] == pytest.approx(wanted)
    printed = gabor_kernels(Options(supersampling=1, zero_mean=False, carrier="as_printed"))[0]
    assert printed[5, 4 + v, 4 + u] == pytest.approx(
        np.exp(-0.5 * (a**2 + b**2)) * np.cos(2 * np.pi * u / 4), abs=1e-12
    )


def test_supersampling_is_the_mean_over_the_pixel() -> None:
    """Ten by ten samples are close to a hundred by hundred, and not to one."""
    coarse, fine, finest = (
        gabor_kernels(Options(angles=4, supersampling=n, zero_mean=False)) for n in (1, 10, 32)
    )
    assert np.abs(fine - finest).max() < 0.1 * np.abs(coarse - finest).max()


def test_responses_from_the_basis_equal_plain_filtering() -> None:
    """One `cv2.filter2D` a direction, then the formulas pixel by pixel, give the same map."""
    rng = np.random.default_rng(3)
    options = Options(iterations=0, quadrature=True)
    grey = stripes(70) + rng.normal(0, 20, (120, 120))
    everywhere = np.ones(grey.shape, bool)
    found = run(grey, everywhere, options)

    image = np.repeat(np.clip(np.rint(grey), 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    core = well_inside(everywhere, 1.0)
    picture = fill_beyond(luminance(image), core, 4)
    cosine, sine = gabor_kernels(options)
    response = np.stack(
        [
            np.hypot(cv2.filter2D(picture, cv2.CV_32F, c), cv2.filter2D(picture, cv2.CV_32F, s))
            for c, s in zip(cosine, sine, strict=True)
        ],
        axis=-1,
    )
    direction = np.rint((found.angle - np.pi / 2) * 32 / np.pi).astype(int) % 32
    chosen = np.take_along_axis(response, direction[..., None], axis=-1)[..., 0]
    np.testing.assert_allclose(chosen, response.max(axis=-1), rtol=1e-2)
    assert (direction == response.argmax(axis=-1)).mean() > 0.99


def test_confidence_is_the_formula_of_paris() -> None:
    """Written out as a loop over the directions."""
    rng = np.random.default_rng(4)
    response = rng.random((50, 12)).astype(np.float32)
    angle, weight = angle_and_confidence(response)
    for row in range(len(response)):
        best = int(response[row].argmax())
        wanted = 0.0
        for index in range(12):
            gap = float(angle_between(index * np.pi / 12, best * np.pi / 12))
            wanted += np.sqrt(gap * float(response[row, index] - response[row, best]) ** 2)
        assert weight[row] == pytest.approx(wanted, rel=1e-4)
        assert angle_between(angle[row], best * np.pi / 12 + np.pi / 2) < 1e-5


def test_a_constant_blob_has_no_orientation_even_at_its_edge() -> None:
    """The silhouette makes no confidence, with the thesis's settings and in quadrature."""
    hair = disc()
    grey = cv2.GaussianBlur(np.where(hair, 60.0, 230.0), (0, 0), 0.3)
    for options in (Options(), FINE):
        assert run(grey, hair, options).confidence.max() < 0.05


def test_noise_is_less_sure_than_stripes() -> None:
    """Of one picture, half noise and half stripes of equal strength, stripes are surer."""
    rng = np.random.default_rng(5)
    hair = disc()
    left = np.zeros(hair.shape, bool)
    left[:, :60] = True
    grey = np.where(left, stripes(90), 120 + rng.normal(0, 35, hair.shape))
    found = run(grey, hair, FINE).confidence
    core = inside(hair)
    assert found[core & ~left].mean() < 0.5 * found[core & left].mean()


def test_confidence_falls_where_the_kernel_leaves_the_hair() -> None:
    """On even stripes the last pixels before the edge are less sure than the middle."""
    hair = disc()
    found = run(stripes(30), hair, FINE).confidence
    rim = hair & ~(cv2.erode(hair.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0)
    assert found[rim].mean() < 0.7 * found[inside(hair)].mean()


def test_difference_of_gaussians_removes_slow_shading() -> None:
    """A bright fold of light is no strand once only fine detail is kept."""
    hair = disc()
    _, x = np.mgrid[:120, :120]
    fold = 80 * np.exp(-0.5 * ((x - 60) / 8.0) ** 2)
    grey = 60 + fold + 0.15 * (stripes(0) - 120)
    shared = {"zero_mean": False, "quadrature": True, "iterations": 0, "kernel_size": 9}
    near = [
        np.degrees(angle_between(run(grey, hair, options).angle, 0))[inside(hair)].mean()
        for options in (Options(**shared), Options(**shared, difference_of_gaussians=True))
    ]
    assert near[1] < 0.5 * near[0]


def test_an_iteration_filters_the_confidence_as_if_it_was_the_photo() -> None:
    """Orienting the confidence map of n iterations gives the angles of n + 1."""
    rng = np.random.default_rng(6)
    everywhere = np.ones((120, 120), bool)
    grey = stripes(45) * 0.3 + 80 + rng.normal(0, 16, everywhere.shape)
    first, both = (run(grey, everywhere, Options(iterations=n)) for n in (0, 1))
    again = run(255.0 * first.confidence, everywhere, Options(iterations=0))
    same = angle_between(again.angle, both.angle) < 1e-3
    assert same.mean() > 0.95
