"""Laws of the structure tensor orienter."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hairkit_plugins.structure_tensor import Options, orient
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.arrays import BoolArray, Float64Array, UInt8Array
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import OrientationMap, angle_between

SIZE = 1080
"""Options are meant for pictures of this height; the hair takes a part of them."""


def run(grey: Float64Array, hair: BoolArray, options: Options | None = None) -> OrientationMap:
    """Orient a grey picture with values from 0 to 255."""
    image = np.repeat(np.clip(np.rint(grey), 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    labels: UInt8Array = np.where(hair, HAIR, 0).astype(np.uint8)
    return orient(View("front", 0.0, image), Mask(labels, True), options or Options())


def patch(height: int = SIZE, width: int = 300, edge: int = 120) -> BoolArray:
    """A disc of hair in the upper part of a tall picture."""
    y, x = np.mgrid[:height, :width]
    return np.asarray(np.hypot(x - width / 2, y - 150 * height / SIZE) < edge * height / SIZE)


def stripes(angle_deg: float, shape: tuple[int, int], wavelength: float = 7.0) -> Float64Array:
    """Stripes whose strands run at the angle, on mid grey."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    turn = np.radians(angle_deg)
    return 120 + 40 * np.sin(2 * np.pi / wavelength * (y * np.cos(turn) - x * np.sin(turn)))


def inside(hair: BoolArray, margin: int = 8) -> BoolArray:
    """Hair at least `margin` pixels from its edge."""
    return cv2.erode(hair.astype(np.uint8), np.ones((2 * margin + 1,) * 2, np.uint8)) > 0


@given(st.floats(0, 179.9), st.floats(4.0, 12.0))
@settings(max_examples=12)
def test_stripes_have_the_angle_they_were_drawn_with(angle_deg: float, wavelength: float) -> None:
    """Any angle and width of stripes, within a degree everywhere and surely."""
    hair = patch()
    found = run(stripes(angle_deg, hair.shape, wavelength), hair)
    error = np.degrees(angle_between(found.angle, np.radians(angle_deg)))
    assert error[inside(hair)].max() < 1
    assert found.confidence[inside(hair)].min() > 0.7


def test_a_turned_photo_turns_the_angles() -> None:
    """Rotating a square photo by 90 degrees moves the map along and adds 90 degrees."""
    rng = np.random.default_rng(1)
    hair = np.zeros((240, 240), bool)
    hair[60:190, 40:170] = True
    options = Options(window_sigma=24.0, finest_window=6.0)
    grey = stripes(25, hair.shape) + rng.normal(0, 12, hair.shape)
    straight, turned = (run(np.rot90(grey, k), np.rot90(hair, k), options) for k in (0, 1))
    gap = angle_between(np.rot90(straight.angle) - np.pi / 2, turned.angle)
    assert np.degrees(gap)[np.rot90(inside(hair))].max() < 1


@pytest.mark.parametrize(("gain", "offset"), [(0.5, 0.0), (1.5, -10.0), (0.7, 40.0)])
def test_brightness_and_contrast_leave_the_angles(gain: float, offset: float) -> None:
    """Exposure and contrast change no angle by more than a few degrees, on noisy stripes."""
    rng = np.random.default_rng(2)
    hair = patch()
    grey = stripes(60, hair.shape) + rng.normal(0, 15, hair.shape)
    gap = angle_between(run(grey, hair).angle, run(gain * grey + offset, hair).angle)
    assert np.degrees(gap[inside(hair)]).mean() < 1


def test_shading_does_not_count_as_strands() -> None:
    """A strong gradient of light across the hair leaves the stripes' angle."""
    hair = patch()
    _, x = np.mgrid[: hair.shape[0], : hair.shape[1]]
    found = run(stripes(10, hair.shape) * 0.5 + 0.5 * x, hair)
    error = np.degrees(angle_between(found.angle, np.radians(10)))
    assert error[inside(hair)].max() < 2


def test_a_constant_blob_has_no_orientation_even_at_its_edge() -> None:
    """The silhouette against a bright background makes no confidence, smooth edge or not."""
    hair = patch()
    hard = np.where(hair, 60.0, 230.0)
    assert run(hard, hair).confidence.max() < 0.02
    assert run(cv2.GaussianBlur(hard, (0, 0), 0.6), hair).confidence.max() < 0.1


def test_the_edge_is_as_right_as_the_middle() -> None:
    """Stripes that meet the silhouette at an angle keep theirs up to the last hair pixel."""
    hair = patch()
    grey = np.where(hair, stripes(35, hair.shape), 250)
    found = run(grey, hair)
    error = np.degrees(angle_between(found.angle, np.radians(35)))
    assert error[hair].max() < 3


def test_noise_has_low_confidence() -> None:
    """A picture of noise alone is not sure of anything, and stripes in it are."""
    rng = np.random.default_rng(4)
    hair = patch()
    noise = 120 + rng.normal(0, 25, hair.shape)
    assert run(noise, hair).confidence[hair].mean() < 0.15
    assert run(noise + stripes(80, hair.shape) - 120, hair).confidence[hair].mean() > 0.5


def test_confidence_is_higher_where_errors_are_smaller() -> None:
    """In the most confident half of a picture that gets noisier downwards, errors are smaller."""
    rng = np.random.default_rng(5)
    hair = patch()
    y, _ = np.mgrid[: hair.shape[0], : hair.shape[1]]
    grey = stripes(50, hair.shape) - 120
    grey = 120 + 0.3 * grey + rng.normal(0, 1, hair.shape) * np.clip((y - 100) * 0.8, 2, 60)
    found = run(grey, hair)
    error = np.degrees(angle_between(found.angle, np.radians(50)))[hair]
    sure = found.confidence[hair] >= np.median(found.confidence[hair])
    assert error[sure].mean() < 0.5 * error[~sure].mean()


def test_curls_are_kept_where_they_show() -> None:
    """Clear waves are followed: the wide window alone would flatten them."""
    hair = patch(edge=140)
    y, x = np.mgrid[: hair.shape[0], : hair.shape[1]]
    swing = 0.6 * 80 / (2 * np.pi)
    grey = 120 + 40 * np.sin(2 * np.pi / 6 * (x - swing * np.sin(2 * np.pi * y / 80)))
    slope = 0.6 * np.cos(2 * np.pi * y / 80)
    truth = np.arctan2(1.0, slope)
    core = inside(hair, 12)
    followed = np.degrees(angle_between(run(grey, hair).angle, truth))[core].mean()
    flat = np.degrees(angle_between(np.pi / 2, truth))[core].mean()
    assert followed < 0.4 * flat


def test_lengths_follow_the_pictures_height() -> None:
    """A photo of half the size gives the same map at half the size."""
    rng = np.random.default_rng(6)
    hair = patch()
    y, x = np.mgrid[: hair.shape[0], : hair.shape[1]]
    grey = 120 + 40 * np.sin(np.hypot(x + 40, y + 60) * 2 * np.pi / 14)
    grey += cv2.GaussianBlur(rng.normal(0, 20, hair.shape), (0, 0), 2.0)
    small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    large, half = run(grey, hair), run(small, hair[1::2, 1::2])
    gap = np.degrees(angle_between(large.angle[1::2, 1::2], half.angle))
    assert gap[inside(hair[1::2, 1::2])].mean() < 3


@pytest.mark.parametrize(
    "options",
    [
        Options(window_sigma=2.0, finest_window=2.0),
        Options(window_sigma=4.0, finest_window=2.0),
        Options(edge_sigma=0.0, noise_gain=0.0),
    ],
)
def test_every_setting_finds_clean_stripes(options: Options) -> None:
    """One window, two windows, no seam: all agree on clean stripes."""
    hair = patch()
    found = run(stripes(115, hair.shape), hair, options)
    error = np.degrees(angle_between(found.angle, np.radians(115)))
    assert error[inside(hair)].mean() < 2


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (40, 1)])
def test_the_smallest_hair_gives_a_valid_map(shape: tuple[int, int]) -> None:
    """One pixel or one line of hair is no error."""
    hair = np.zeros((200, 100), bool)
    hair[20 : 20 + shape[0], 20 : 20 + shape[1]] = True
    found = run(stripes(20, hair.shape), hair)
    assert found.angle.shape == hair.shape
    assert not found.confidence[~hair].any()


def test_equal_photos_give_equal_bytes() -> None:
    """Nothing random and nothing racing."""
    hair = patch()
    grey = stripes(75, hair.shape)
    first, second = run(grey, hair), run(grey, hair)
    assert first.angle.tobytes() == second.angle.tobytes()
    assert first.confidence.tobytes() == second.confidence.tobytes()
