"""Laws of the U-Net in NumPy."""

from __future__ import annotations

import numpy as np

from hairkit.imaging import unet


def test_a_convolution_equals_its_definition() -> None:
    """One output of a layer is the sum over its window, written out."""
    x = np.random.default_rng(2).normal(size=(14, 8, 8)).astype(np.float32)
    weights = unet.shipped_weights("imaging", "hair_network.npz")
    kernels, bias = (weights[f"entry.{part}"] for part in ("weight", "bias"))
    result = unet._convolve(x, weights, "entry", stride=2)
    window = x[:, 3:6, 1:4]
    assert result.shape == (len(kernels), 4, 4)
    assert np.allclose(result[:, 2, 1], (kernels * window).sum(axis=(1, 2, 3)) + bias, atol=1e-4)
