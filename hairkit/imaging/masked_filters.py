"""Filters that respect a mask, and averages of undirected angles: the ground under every orienter.

An undirected angle t is averaged as the vector (cos 2t, sin 2t), so that 179 and 1 degree meet at 0
and not at 90. Values beyond a mask count for nothing: sums run over the mask and are divided by how
much of the kernel lies on it (normalised convolution, Knutsson and Westin 1993).
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

REFERENCE_HEIGHT = 1080
"""Lengths in pixels given to the orienters are for pictures of this height."""

_LOG_FLOOR = 0.15
"""Added to brightness before its logarithm, as a share of the mean: keeps noise in shadows low."""

_LEAST_CONTRAST = 0.25
"""Local deviation, as a share of the typical one, below which contrast is not raised further."""

_WIDE_SIGMA = 4.0
_HALVING_VARIANCE = 1.0
"""Square pixels that averaging 2 x 2 pixels and interpolating back add to a Gaussian."""

COHERENT_WINDOW = 9
COHERENT_RESULTANT = 0.85


def picture_scale(height: int) -> float:
    """Return what a length in pixels of a picture `REFERENCE_HEIGHT` high is multiplied with.

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

    The picture is mirrored at its border. Wide Gaussians (above `_WIDE_SIGMA`) are taken on a grid
    half as fine, several times as fast and right to about one percent of the range.
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
    inverse = np.divide(1, total, out=np.zeros_like(total), where=total > 1e-6)
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


def well_inside(mask: BoolArray, sigma: float, share: float = 0.9) -> BoolArray:
    """Return the part of `mask` whose surroundings (Gaussian `sigma`) lie on it by `share` or more.

    A mask too thin to have such a part comes back whole.
    """
    if sigma <= 0:
        return mask
    core = mask & (blur(mask.astype(np.float32), sigma) >= share)
    return core if core.any() else mask


def local_contrast(grey: Float32Array, weight: Float32Array, sigma: float) -> Float32Array:
    """Return brightness freed of shading: log, minus its local mean, over its local deviation.

    Means are taken by normalised convolution with a Gaussian of `sigma` pixels, so what lies beyond
    the weight, and the step at its edge, leave no trace. A change of exposure changes nothing.

    Parameters
    ----------
    grey, weight : (H, W)
        Linear or gamma-coded brightness in [0, 1]; 1 where it counts and 0 elsewhere.
    sigma : float
        In pixels.

    Returns
    -------
    (H, W) float32
        About unit deviation and at most 3; 0 beyond the weight and where brightness is constant.
    """
    inside = weight > 0
    mean = float(grey[inside].mean(dtype=np.float64))
    floor = _LOG_FLOOR * max(mean, 1 / 255)
    logarithm = np.log(grey + floor)
    detail = (logarithm - masked_blur(logarithm, weight, sigma)) * weight
    variance = masked_blur(detail * detail, weight, sigma)
    typical = float(variance[inside].mean(dtype=np.float64))
    least = max(_LEAST_CONTRAST**2 * typical, (0.5 / 255 / (mean + floor)) ** 2)
    scaled = detail / np.sqrt(np.maximum(variance, least))
    return np.asarray(np.clip(scaled, -3, 3), np.float32)


def fill_beyond(values: Float32Array, mask: BoolArray, sigma: float) -> Float32Array:
    """Return `values` with everything beyond `mask` replaced by means of the nearest masked values.

    The means come from normalised convolution with ever wider kernels (`sigma`, then double),
    so the fill meets the mask's edge without a step and fades to the mean of the mask.

    Raises `InputError` when the mask is empty or of another shape.
    """
    if mask.shape != values.shape or not mask.any():
        raise InputError(
            f"cannot fill values of shape {values.shape} beyond a mask of shape {mask.shape} "
            f"with {np.count_nonzero(mask)} pixels: wanted the same shape and at least one pixel"
        )
    filled = np.where(mask, values, values[mask].mean(dtype=np.float64)).astype(np.float32)
    reach, open_pixels = sigma, ~mask
    for _ in range(2):
        weight = blur(mask.astype(np.float32), reach)
        near = open_pixels & (weight > 1e-3)
        filled[near] = masked_blur(values, mask, reach)[near]
        open_pixels, reach = open_pixels & ~near, 2 * reach
    return filled


def double_angle(angle: npt.ArrayLike, weight: npt.ArrayLike = 1.0) -> Float32Array:
    """Return `weight * (cos 2 angle, sin 2 angle)` as (..., 2) float32: angles fit for adding."""
    twice = 2 * np.asarray(angle, np.float32)
    vectors = np.stack([np.cos(twice), np.sin(twice)], axis=-1)
    return np.asarray(vectors * np.asarray(weight, np.float32)[..., None], np.float32)


def single_angle(vectors: Float32Array) -> Float32Array:
    """Return the undirected angles in [0, pi) of (..., 2) double-angle vectors.

    >>> single_angle(double_angle([0.5, 3.0])).round(3).tolist()
    [0.5, 3.0]
    """
    return wrap_angle(0.5 * np.arctan2(vectors[..., 1], vectors[..., 0]))


def smooth_angles(
    angle: Float32Array, weight: Float32Array | BoolArray, sigma: float
) -> tuple[Float32Array, Float32Array]:
    """Return the Gaussian mean of undirected angles and how well the angles agree.

    Parameters
    ----------
    angle, weight : (H, W)
        Angles in radians and what each counts for; 0 beyond the mask.
    sigma : float
        Of the Gaussian, in pixels.

    Returns
    -------
    angle, coherence : (H, W) float32
        Angles in [0, pi); length of the mean resultant in [0, 1], 1 where all angles are equal.
    """
    mean = masked_blur(double_angle(angle), weight, sigma)
    return single_angle(mean), np.minimum(np.hypot(mean[..., 0], mean[..., 1]), 1)


def coherent_truth(
    angle: Float32Array,
    mask: BoolArray,
    window: int = COHERENT_WINDOW,
    resultant: float = COHERENT_RESULTANT,
) -> BoolArray:
    """Return where a true orientation is coherent enough to be scored against.

    A pixel is coherent when the double-angle vectors of the known pixels in the box of edge
    `window` around it have a mean of length at least `resultant`: crossing strands have no single
    orientation that an orienter could be asked for.

    Parameters
    ----------
    angle : (H, W)
        True strand angles in radians.
    mask : (H, W)
        Where the truth is known.
    window, resultant
        Edge of the box in pixels, least length of the mean in [0, 1].
    """
    weight = mask.astype(np.float32)

    def box(values: Float32Array) -> Float32Array:
        return np.asarray(
            cv2.blur(values, (window, window), borderType=cv2.BORDER_CONSTANT), np.float32
        )

    total = box(double_angle(angle, weight))
    length = np.hypot(total[..., 0], total[..., 1])
    return np.asarray(mask & (length >= resultant * box(weight)))
