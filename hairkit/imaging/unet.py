"""A small U-Net (Ronneberger, Fischer and Brox 2015) in NumPy, and its files of weights.

It has a stride of two at its entry and a sub-pixel convolution at its end (Shi et al. 2016);
`training` has it in PyTorch.
"""

from __future__ import annotations

import os
from functools import cache
from importlib import resources

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.storage import read_npz

Weights = dict[str, Float32Array]
"""Kernels (C out, C in, k, k) and biases (C out,) of every layer: `first.weight`, `first.bias`."""


def run_network(values: Float32Array, weights: Weights) -> Float32Array:
    """Return the answer (C out, H, W) to features (C in, H, W); H and W are multiples of 32."""
    levels = sum(name.startswith("up") for name in weights) // 2
    x = _relu(_convolve(_relu(_convolve(values, weights, "entry", stride=2)), weights, "first"))
    kept = [x]
    for level in range(levels):
        x = _relu(_convolve(_halve(x), weights, f"down{level}a"))
        x = _relu(_convolve(x, weights, f"down{level}b"))
        kept.append(x)
    for level in reversed(range(levels)):
        doubled = x.repeat(2, axis=1).repeat(2, axis=2)
        x = _relu(_convolve(np.concatenate([doubled, kept[level]]), weights, f"up{level}"))
    scores = _convolve(x, weights, "exit")
    classes, rows, columns = len(scores) // 4, *scores.shape[1:]
    blocks = scores.reshape(classes, 2, 2, rows, columns).transpose(0, 3, 1, 4, 2)
    return blocks.reshape(classes, 2 * rows, 2 * columns)


def read_weights(path: str | os.PathLike[str]) -> Weights:
    """Return the weights in a file of `training/hair_network`."""
    return {name: array.astype(np.float32) for name, array in read_npz(path).items()}


@cache
def shipped_weights(package: str, name: str) -> Weights:
    """Return the weights in a file of one of hairkit's packages, such as `imaging`."""
    with resources.as_file(resources.files("hairkit") / package / name) as file:
        return read_weights(file)


def _convolve(x: Float32Array, weights: Weights, name: str, stride: int = 1) -> Float32Array:
    """Return the correlation of x (C, h, w), padded with zeros, with the kernels of a layer."""
    kernels, bias = weights[f"{name}.weight"], weights[f"{name}.bias"]
    edge = kernels.shape[-1]
    height, width = x.shape[1:]
    padded = np.pad(x, ((0, 0), (edge // 2,) * 2, (edge // 2,) * 2))
    patches = np.concatenate(
        [
            padded[:, row : row + height : stride, column : column + width : stride]
            for row in range(edge)
            for column in range(edge)
        ]
    )
    flat = kernels.transpose(0, 2, 3, 1).reshape(len(kernels), -1)
    result = flat @ patches.reshape(len(patches), -1) + bias[:, None]
    return np.asarray(result.reshape(len(kernels), *patches.shape[1:]), np.float32)


def _halve(x: Float32Array) -> Float32Array:
    """Return the largest of every 2 x 2 values of x (C, h, w)."""
    rows = np.maximum(x[:, ::2], x[:, 1::2])
    return np.maximum(rows[:, :, ::2], rows[:, :, 1::2])


def _relu(x: Float32Array) -> Float32Array:
    return np.maximum(x, 0)
