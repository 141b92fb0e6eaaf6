"""Filters that respect a mask, and averages of undirected angles, shared by the orienters.

An undirected angle t is averaged as the vector (cos 2t, sin 2t), so that the mean of 179 and 1
degree is 0 and not 90. Values outside a mask are ignored: sums run over the mask and are divided by
the share of the kernel on it (normalised convolution, Knutsson and Westin 1993).
"""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import BoolArray, Float32Array, UInt8Array
from hairkit.errors import InputError
from hairkit.types.capture import View
from hairkit.types.mask import Mask
from hairkit.types.orientation import wrap_angle

REDUCED_HEIGHT = 360
"""Rows of the picture that is labelled first; edges are then refined at full size."""
REFERENCE_HEIGHT = 1080
"""Rows of the picture that options in pixels refer to; `picture_scale` converts them."""
_LOG_FLOOR = 0.15
"""Added to brightness before its logarithm, as a share of the mean: keeps noise in shadows low."""
_LEAST_CONTRAST = 0.25
"""Local deviation, as a share of the mean one, below which contrast is not amplified further."""
_MOST_CONTRAST = 3.0
"""Local deviations at which contrast is clipped, so that highlights do not dominate."""
_SURROUNDED = 0.9
"""Share of a pixel's surroundings on the mask from which it lies well inside."""
_GREY_LEVEL = 1 / 255
"""One step of an 8-bit image."""
_NO_WEIGHT = 1e-6
"""Share of a kernel on the mask below which its mean is rounding noise, and taken as 0."""
_FILL_WEIGHT = 1e-3
"""Share of a kernel on the mask from which its mean fills a pixel outside the mask."""
_FILL_PASSES = 2
"""Kernels, each twice as wide as the last, that fill the outside of a mask."""
_WIDE_SIGMA = 4.0
"""Pixels; Gaussians wider than this are computed at half the size."""
_HALVING_VARIANCE = 1.0
"""Square pixels that averaging 2 x 2 pixels and interpolating back add to a Gaussian."""
COHERENT_WINDOW = 9
"""Edge in pixels of the box in which a true orientation has to be coherent to be scored."""
COHERENT_RESULTANT = 0.85
"""Least mean resultant of the double angles in that box."""


def reduced_size(width: int, height: int) -> tuple[int, int]:
    """Return (width, height) of the picture that is labelled first, `REDUCED_HEIGHT` at most."""
    rows = min(height, REDUCED_HEIGHT)
    return max(round(width * rows / height), 1), rows


def picture_scale(height: int) -> float:
    """Return the scale from pixels at `REFERENCE_HEIGHT` to those of a picture `height` high.

    >>> picture_scale(540)
    0.5
    """
    return height / REFERENCE_HEIGHT


def hair_of(view: View, mask: Mask) -> BoolArray:
    """Return the (H, W) hair pixels of `mask`.

    Raises `InputError` when the mask is not as large as the photo.
    """
    hair = mask.hair
    if hair.shape != (view.height, view.width):
        raise InputError(
            f"mask of {view.name} is {hair.shape[1]} x {hair.shape[0]} pixels, "
            f"expected {view.width} x {view.height} as the photo"
        )
    return hair


def luminance(image: UInt8Array) -> Float32Array:
    """Return the (H, W) luma of an (H, W, 3) RGB image as float32 in [0, 1] (Rec. 601 weights)."""
    scaled = np.asarray(image, np.float32) * np.float32(1 / 255)
    return np.asarray(cv2.cvtColor(scaled, cv2.COLOR_RGB2GRAY), np.float32)


def blur(values: Float32Array, sigma: float) -> Float32Array:
    """Return `values` (H, W) or (H, W, C) under a Gaussian of `sigma` pixels.

    The picture is mirrored at its border. Gaussians above `_WIDE_SIGMA` are computed at half the
    size, which is several times as fast and correct to about one percent of the range.
    """
    height, width = values.shape[:2]
    if sigma <= _WIDE_SIGMA or min(height, width) < 2:
        blurred = cv2.GaussianBlur(values, (0, 0), sigma, borderType=cv2.BORDER_REFLECT_101)
    else:
        even = cv2.copyMakeBorder(values, 0, height % 2, 0, width % 2, cv2.BORDER_REFLECT_101)
        size = (even.shape[1], even.shape[0])
        half = cv2.resize(even, (size[0] // 2, size[1] // 2), interpolation=cv2.INTER_AREA)
        half = blur(np.asarray(half, np.float32), math.sqrt(sigma**2 - _HALVING_VARIANCE) / 2)
        blurred = cv2.resize(half, size, interpolation=cv2.INTER_LINEAR)[:height, :width]
    return np.asarray(blurred, np.float32).reshape(values.shape)


def masked_blur(
    values: Float32Array, weight: Float32Array | BoolArray, sigma: float
) -> Float32Array:
    """Return the Gaussian mean of `values` weighted with `weight`: normalised convolution.

    Parameters
    ----------
    values : (H, W) or (H, W, C)
    weight : (H, W)
        At least 0; a mask counts as 0 and 1.
    sigma : float
        Of the Gaussian, in pixels.

    Returns
    -------
    (H, W) or (H, W, C) float32
        0 where no weight lies within reach of the kernel.
    """
    weight = np.asarray(weight, np.float32)
    total = blur(weight, sigma)
    inverse = np.divide(1, total, out=np.zeros_like(total), where=total > _NO_WEIGHT)
    if values.ndim == 3:
        return blur(values * weight[..., None], sigma) * inverse[..., None]
    return blur(values * weight, sigma) * inverse


def bounding_box(mask: BoolArray, margin: int) -> tuple[slice, slice]:
    """Return the rows and columns that hold `mask`, grown by `margin` pixels within the picture.

    Raises `InputError` when the mask is empty.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        raise InputError(f"mask of shape {mask.shape} is empty, wanted at least one pixel")
    return (
        slice(max(int(rows[0]) - margin, 0), int(rows[-1]) + 1 + margin),
        slice(max(int(columns[0]) - margin, 0), int(columns[-1]) + 1 + margin),
    )


def well_inside(mask: BoolArray, sigma: float) -> BoolArray:
    """Return the part of `mask` whose surroundings (Gaussian `sigma`) lie on it, too.

    A mask that is too thin to have such a part is returned whole.
    """
    if sigma <= 0:
        return mask
    core = mask & (blur(mask.astype(np.float32), sigma) >= _SURROUNDED)
    return core if core.any() else mask


def local_contrast(grey: Float32Array, weight: Float32Array, sigma: float) -> Float32Array:
    """Return log brightness minus its local mean, divided by its local deviation.

    Means are normalised convolutions with a Gaussian of `sigma` pixels, so pixels without weight,
    and the step at the mask's edge, have no effect. A change of exposure changes nothing.

    Parameters
    ----------
    grey, weight : (H, W)
        Linear or gamma-coded brightness in [0, 1]; 1 on the mask and 0 elsewhere.
    sigma : float
        In pixels.

    Returns
    -------
    (H, W) float32
        About unit deviation and at most 3; 0 outside the mask and where brightness is constant.
    """
    inside = weight > 0
    mean = float(grey[inside].mean(dtype=np.float64))
    floor = _LOG_FLOOR * max(mean, _GREY_LEVEL)
    logarithm = np.log(grey + floor)
    detail = (logarithm - masked_blur(logarithm, weight, sigma)) * weight
    variance = masked_blur(detail * detail, weight, sigma)
    typical = float(variance[inside].mean(dtype=np.float64))
    least = max(_LEAST_CONTRAST**2 * typical, (0.5 * _GREY_LEVEL / (mean + floor)) ** 2)
    scaled = detail / np.sqrt(np.maximum(variance, least))
    return np.asarray(np.clip(scaled, -_MOST_CONTRAST, _MOST_CONTRAST), np.float32)


def fill_beyond(values: Float32Array, mask: BoolArray, sigma: float) -> Float32Array:
    """Return `values` with pixels outside `mask` replaced by means of the nearest inside.

    The means are normalised convolutions with wider and wider kernels (`sigma`, then double), so
    the fill has no step at the mask's edge and fades to the mean of the mask.

    Raises `InputError` when the mask is empty or of another shape.
    """
    if mask.shape != values.shape or not mask.any():
        raise InputError(
            f"cannot fill values of shape {values.shape} beyond a mask of shape {mask.shape} "
            f"with {np.count_nonzero(mask)} pixels: wanted the same shape and at least one pixel"
        )
    filled = np.where(mask, values, values[mask].mean(dtype=np.float64)).astype(np.float32)
    reach, open_pixels = sigma, ~mask
    for _ in range(_FILL_PASSES):
        weight = blur(mask.astype(np.float32), reach)
        near = open_pixels & (weight > _FILL_WEIGHT)
        filled[near] = masked_blur(values, mask, reach)[near]
        open_pixels, reach = open_pixels & ~near, 2 * reach
    return filled


def double_angle(angle: npt.ArrayLike, weight: npt.ArrayLike = 1.0) -> Float32Array:
    """Return `weight * (cos 2 angle, sin 2 angle)` as (..., 2) float32, which can be averaged."""
    twice = 2 * np.asarray(angle, np.float32)
    vectors = np.stack([np.cos(twice), np.sin(twice)], axis=-1)
    return np.asarray(vectors * np.asarray(weight, np.float32)[..., None], np.float32)


def single_angle(vectors: Float32Array) -> Float32Array:
    """Return the undirected angles in [0, pi) of (..., 2) double-angle vectors.

    >>> single_angle(double_angle([0.5, 3.0])).round(3).tolist()
    [0.5, 3.0]
    """
    return wrap_angle(0.5 * np.arctan2(vectors[..., 1], vectors[..., 0]))


def coherent_truth(angle: Float32Array, mask: BoolArray) -> BoolArray:
    """Return where a true orientation is coherent enough to be scored against.

    A pixel is coherent when the double-angle vectors of the known pixels in the box of edge
    `COHERENT_WINDOW` around it have a mean of length at least `COHERENT_RESULTANT`: where strands
    cross there is no single orientation to compare with.

    Parameters
    ----------
    angle : (H, W)
        True strand angles in radians.
    mask : (H, W)
        Where the truth is known.
    """
    weight = mask.astype(np.float32)

    def box(values: Float32Array) -> Float32Array:
        return np.asarray(
            cv2.blur(values, (COHERENT_WINDOW,) * 2, borderType=cv2.BORDER_CONSTANT), np.float32
        )

    total = box(double_angle(angle, weight))
    length = np.hypot(total[..., 0], total[..., 1])
    return np.asarray(mask & (length >= COHERENT_RESULTANT * box(weight)))
