"""Strand orientation from a bank of Gabor filters, with the confidence of Paris et al. 2004.

The method of the thesis (hair from eight photos, chapter 5.1; the filter is Jain and Farrokhnia's
1990, the feedback of the confidence Chai et al.'s 2012): the picture is filtered with kernels

    K(u, v) = exp(-(a^2 + b^2) / 2) cos(2 pi a sigma_u / lambda)
    a = (u cos t + v sin t) / sigma_u,    b = (v cos t - u sin t) / sigma_v

turned by t in equal steps over [0, pi), and a pixel takes the t of the largest |K * I|. The carrier
waves along t, so the strand runs at t + pi / 2. The confidence, over its 99th percentile, is then
filtered as if it was the photo, three times. The thesis prints the carrier on the unturned u
(`carrier = "as_printed"`) and leaves the kernel's mean in (`zero_mean = false`).

One difference: outside the hair the picture is filled, not black, so that the silhouette makes no
response. Kernel sizes are in pixels of the given picture, whatever its size.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.hookspecs import hookimpl
from hairkit.imaging.masked_filters import (
    blur,
    bounding_box,
    fill_beyond,
    hair_of,
    luminance,
    well_inside,
)
from hairkit.options import option
from hairkit.types.capture import View
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap, wrap_angle

_CHUNK = 4096
"""Pixels handled at a time, so that their responses fit into the cache."""
_BASIS_TOLERANCE = 1e-4
"""Relative error allowed when the bank is written in fewer basis kernels."""
_TOP_QUANTILE = 0.99
"""Quantile of the confidence that becomes 1, so that outliers do not dim the rest."""
_DOG_FINE, _DOG_WIDE = 0.4, 10.0
"""Sigmas in pixels of the two Gaussians whose difference keeps detail."""
_EDGE_SIGMA = 1.0
"""Gaussian in pixels by which the mask's edge, which mixes hair and backdrop, is left out."""
_LEAST_RIPPLE = 0.5 / 255
"""Amplitude of stripes below which a picture counts as constant: half a grey level."""


@dataclass(frozen=True)
class Options:
    """Settings of the filter bank; the defaults are the thesis's numbers."""

    kernel_size: int = option(9, low=3, high=63, doc="Edge of the kernel; made odd.", unit="px")
    sigma_u: float = option(1.8, low=0.3, high=20.0, doc="Envelope across the strand.", unit="px")
    sigma_v: float = option(2.4, low=0.3, high=20.0, doc="Envelope along the strand.", unit="px")
    wavelength: float = option(4.0, low=1.5, high=40.0, doc="Of the carrier.", unit="px")
    supersampling: int = option(10, low=1, high=32, doc="Samples per kernel pixel and axis.")
    angles: int = option(32, low=4, high=256, doc="Number of filter directions.")
    iterations: int = option(
        3, low=0, high=10, doc="Times that the confidence is filtered again as if it was the photo."
    )
    carrier: str = option(
        "rotated",
        choices=("rotated", "as_printed"),
        doc="Axis of the wave: turned with the envelope, or as the thesis prints it.",
    )
    zero_mean: bool = option(
        True, doc="Subtract the kernel's mean: constant brightness makes no response."
    )
    quadrature: bool = option(
        False, doc="Add the sine kernel: the response no longer depends on the stripe's phase."
    )
    difference_of_gaussians: bool = option(
        False, doc="First keep only detail, by a difference of Gaussians."
    )


@hookimpl
def orient(view: View, mask: Mask, options: Options) -> OrientationMap:
    """Return the strand's angle and its confidence at every hair pixel."""
    hair = hair_of(view, mask)
    radius = options.kernel_size // 2
    box = bounding_box(hair, 2 * radius)
    core = well_inside(hair[box], _EDGE_SIGMA)
    picture = luminance(view.image[box])
    if options.difference_of_gaussians:
        filled = fill_beyond(picture, core, _DOG_WIDE)
        picture = blur(filled, _DOG_FINE) - blur(filled, _DOG_WIDE)

    banks = gabor_kernels(options)
    bases = [_basis(bank) for bank in banks]
    least = _LEAST_RIPPLE * float(np.abs(banks).sum(axis=(2, 3)).mean()) * options.angles / 4
    strength = 1.0
    for _ in range(options.iterations + 1):
        filled = fill_beyond(picture, core, radius)
        angle, weight = _strongest(filled, hair[box], bases, options)
        top = float(np.quantile(weight[core], _TOP_QUANTILE))
        strength *= min(top / least, 1.0)
        picture = np.minimum(weight / max(top, 1e-12), 1).astype(np.float32)

    angle_map, confidence_map = np.zeros((2, *hair.shape), np.float32)
    angle_map[box] = angle
    # the share of the kernel that lies well inside the hair
    inside = np.minimum(blur(core.astype(np.float32), max(radius / 2, 0.5)), 1)
    confidence_map[box] = picture * strength * inside * hair[box]
    return OrientationMap(angle_map, confidence_map)


def gabor_kernels(options: Options) -> Float64Array:
    """Return the filters, (1 or 2, angles, size, size): cosine and, in quadrature, sine kernels.

    Every pixel of a kernel is the mean over a `supersampling` x `supersampling` grid on it.
    """
    radius, samples = options.kernel_size // 2, options.supersampling
    within = (np.arange(samples) + 0.5) / samples - 0.5
    axis = (np.arange(-radius, radius + 1)[:, None] + within).ravel()
    u, v = axis[None, None, :], axis[None, :, None]
    turn = (np.pi * np.arange(options.angles) / options.angles)[:, None, None]
    across = u * np.cos(turn) + v * np.sin(turn)
    along = v * np.cos(turn) - u * np.sin(turn)
    envelope = np.exp(-0.5 * ((across / options.sigma_u) ** 2 + (along / options.sigma_v) ** 2))
    wave_axis = across if options.carrier == "rotated" else np.broadcast_to(u, across.shape)
    phase = 2 * np.pi / options.wavelength * wave_axis
    kernels = [envelope * np.cos(phase)]
    if options.quadrature:
        kernels.append(envelope * np.sin(phase))
    edge = 2 * radius + 1
    cells = (-1, options.angles, edge, samples, edge, samples)
    bank = np.stack(kernels).reshape(cells).mean(axis=(3, 5))
    if options.zero_mean:
        window = envelope.reshape(cells).mean(axis=(3, 5))
        bank -= window * (bank.sum((2, 3)) / window.sum((2, 3)))[:, :, None, None]
    return np.asarray(bank, np.float64)


def _basis(bank: Float64Array) -> tuple[Float32Array, Float32Array]:
    """Return few kernels (rank, size, size) and factors (rank, angles) whose products are the bank.

    Rotated copies of one smooth kernel span few dimensions (Perona 1995), so a third of the
    convolutions are enough.
    """
    angles, size, _ = bank.shape
    left, strength, right = np.linalg.svd(bank.reshape(angles, -1), full_matrices=False)
    rank = max(int(np.count_nonzero(strength > _BASIS_TOLERANCE * strength[0])), 1)
    kernels = right[:rank].reshape(rank, size, size)
    return kernels.astype(np.float32), (left[:, :rank] * strength[:rank]).T.astype(np.float32)


def _strongest(
    picture: Float32Array,
    hair: BoolArray,
    bases: list[tuple[Float32Array, Float32Array]],
    options: Options,
) -> tuple[Float32Array, Float32Array]:
    """Return the strand angle of the strongest response and Paris's confidence, 0 off the hair."""
    inputs = [
        np.stack([cv2.filter2D(picture, cv2.CV_32F, k)[hair] for k in kernels], axis=1)
        for kernels, _ in bases
    ]
    count = int(np.count_nonzero(hair))
    angles, weights = np.empty(count, np.float32), np.empty(count, np.float32)
    for start in range(0, count, _CHUNK):
        part = slice(start, start + _CHUNK)
        parts = [rows[part] @ factors for rows, (_, factors) in zip(inputs, bases, strict=True)]
        response = np.abs(parts[0]) if len(parts) == 1 else np.hypot(*parts)
        angles[part], weights[part] = angle_and_confidence(response)
    angle, weight = np.zeros((2, *hair.shape), np.float32)
    angle[hair], weight[hair] = angles, weights
    return angle, weight


def angle_and_confidence(response: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Return the strand angle (P,) of the largest of the responses F (P, angles), and a confidence.

    That (P,), in units of F, is `w = sum over t of sqrt(d(t, t~) (F(t) - F(t~))^2)`, d the angle on
    the half circle between t and the strongest direction t~ (Paris et al. 2004).
    """
    count = response.shape[1]
    steps = np.arange(count)
    gap = np.minimum(steps, count - steps) * (np.pi / count)
    root = np.sqrt(gap[(steps[None, :] - steps[:, None]) % count]).astype(np.float32)
    rows, best = np.arange(len(response)), response.argmax(axis=1)
    peak = response[rows, best]
    weight = peak * root[0].sum() - np.einsum("pt,pt->p", root[best], response)
    return wrap_angle(best * (np.pi / count) + np.pi / 2), np.maximum(weight, 0)
