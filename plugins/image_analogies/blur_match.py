"""The Gaussian blur that makes a sharp example look like a texture.

A Gaussian of deviation s multiplies the power at frequency f by exp(-4 pi^2 s^2 f^2). If the
texture shows the same kind of surface as the example, blurred, the logarithm of the ratio of their
power spectra is a straight line over f^2 with the slope -4 pi^2 s^2; contrast only moves it up or
down. The line is fitted by least squares to the radial means of both spectra, up to the
frequency at which the texture's power sinks into noise.
"""

from __future__ import annotations

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array, Float64Array

EDGE = 256
"""Pixels of the square pieces from which spectra are taken, at most."""
NOISE_MARGIN = 4.0
"""Power over that of the highest frequencies at which detail is told from noise."""
LOWEST_FREQUENCY = 0.02
"""Cycles a pixel, below which spectra are those of shapes and shading, not of the surface."""
NOISE_FREQUENCY = 0.45
"""Cycles a pixel above which the power of a blurred picture is taken for noise."""
LEAST_BINS = 4
"""Frequencies that a line is fitted to, at least."""
_QUANTISATION = 1 / (12 * 255**2)
"""Variance of the rounding to 8 bits of values from 0 to 1."""


def find_blur(example: Float32Array, texture: Float32Array) -> float:
    """Return the Gaussian's deviation in pixels; 0 where the texture is no less sharp.

    `example` (H, W) and `texture` (h, w) are luminances from 0 to 1.
    """
    edge = min(EDGE, *example.shape, *texture.shape)
    frequency, sharp = radial_spectrum(example, edge)
    blurred = radial_spectrum(texture, edge)[1]
    clear = _above_noise(frequency, sharp) & _above_noise(frequency, blurred)
    used = (frequency > LOWEST_FREQUENCY) & (clear | (frequency < frequency[LEAST_BINS + 1]))
    used &= frequency < NOISE_FREQUENCY
    ratio = np.log(blurred[used] + _QUANTISATION) - np.log(sharp[used] + _QUANTISATION)
    slope = np.polyfit(frequency[used] ** 2, ratio, 1, w=np.sqrt(frequency[used]))[0]
    return float(np.sqrt(max(-slope, 0.0)) / (2 * np.pi))


def _above_noise(frequency: Float64Array, power: Float64Array) -> BoolArray:
    """Return (N,) whether the power is detail, at a frequency and all lower ones."""
    floor = max(float(np.median(power[frequency > NOISE_FREQUENCY])), _QUANTISATION)
    return np.asarray(np.cumsum(power < NOISE_MARGIN * floor) == 0)


def radial_spectrum(image: Float32Array, edge: int) -> tuple[Float64Array, Float64Array]:
    """Return frequencies (N,) in cycles a pixel and the mean power (N,) at each.

    Pieces of `edge` pixels, half overlapping, are multiplied by a Hann window and averaged
    (Welch 1967).
    """
    hann = np.hanning(edge)[:, None] * np.hanning(edge)
    starts = [
        np.unique(np.linspace(0, n - edge, -(-2 * n // edge)).astype(int)) for n in image.shape
    ]
    power = np.zeros((edge, edge))
    for y in starts[0]:
        for x in starts[1]:
            piece = image[y : y + edge, x : x + edge].astype(np.float64)
            power += np.abs(np.fft.fft2((piece - piece.mean()) * hann)) ** 2
    power /= len(starts[0]) * len(starts[1]) * (hann**2).sum()
    along = np.fft.fftfreq(edge)
    radius = np.rint(np.hypot(along[:, None], along) * edge).astype(int)
    count = edge // 2
    total = np.bincount(radius.ravel(), power.ravel())[1:count]
    return np.arange(1, count) / edge, total / np.bincount(radius.ravel())[1:count]


def blur(image: Float32Array, sigma: float) -> Float32Array:
    """Return an image (H, W, C) under a Gaussian of so many pixels."""
    if sigma <= 0:
        return image
    smooth = cv2.GaussianBlur(image, (0, 0), sigma, borderType=cv2.BORDER_REFLECT)
    return np.asarray(smooth, np.float32).reshape(image.shape)
