"""Strand orientation from a structure tensor: the direction in which brightness changes least.

The structure tensor (Bigun and Granlund 1987) is the mean of g g^T over a window, g the gradient.
Strands are long and thin, so brightness changes across them: the strand is the eigenvector of the
smaller eigenvalue, and (l1 - l2) / (l1 + l2) tells how sure that is.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.capture import View
from hairkit.filtering import blur, fill_beyond, luminance, picture_scale
from hairkit.hookspecs import hookimpl
from hairkit.mask import Mask
from hairkit.options import option
from hairkit.orientation import OrientationMap, wrap_angle
from hairkit.stored import BoolArray, Float32Array


@dataclass(frozen=True)
class Options:
    """Settings of the structure tensor; lengths hold for pictures 1080 pixels high."""

    gradient_sigma: float = option(
        2.0, low=0.3, high=10.0, doc="Gaussian under the gradient.", unit="px"
    )
    window_sigma: float = option(
        12.0, low=1.0, high=60.0, doc="Gaussian window of the tensor.", unit="px"
    )


@hookimpl
def orient(view: View, mask: Mask, options: Options) -> OrientationMap:
    """Return the strand's angle and the tensor's coherence at every hair pixel."""
    scale = picture_scale(view.height)
    hair = mask.hair
    grey = fill_beyond(luminance(view.image), hair, options.window_sigma * scale)
    angle, coherence = _tensor_orientation(
        grey, hair, options.gradient_sigma * scale, options.window_sigma * scale
    )
    return OrientationMap(
        np.where(hair, angle, 0).astype(np.float32),
        np.where(hair, coherence, 0).astype(np.float32),
    )


def _tensor_orientation(
    grey: Float32Array, hair: BoolArray, gradient_sigma: float, window_sigma: float
) -> tuple[Float32Array, Float32Array]:
    """Return strand angle and coherence of the tensor whose gradients lie on hair."""
    smooth = blur(grey, gradient_sigma)
    across_x = cv2.Scharr(smooth, cv2.CV_32F, 1, 0) * hair
    across_y = cv2.Scharr(smooth, cv2.CV_32F, 0, 1) * hair
    real = blur(across_x * across_x - across_y * across_y, window_sigma)
    imaginary = blur(2 * across_x * across_y, window_sigma)
    energy = blur(across_x * across_x + across_y * across_y, window_sigma)
    angle = wrap_angle(0.5 * np.arctan2(imaginary, real) + np.pi / 2)
    return angle, np.minimum(np.hypot(real, imaginary) / np.maximum(energy, 1e-9), 1)
