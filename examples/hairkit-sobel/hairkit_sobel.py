"""Strand orientation across the gradient of brightness (Sobel and Feldman 1968)."""

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit import Mask, OrientationMap, View, hookimpl
from hairkit.options import option
from hairkit.types.orientation import wrap_angle


@dataclass(frozen=True)
class Options:
    """Settings of the gradient."""

    sigma: float = option(2.0, low=0.5, high=20.0, doc="Blur before the gradient.", unit="px")


@hookimpl
def orient(view: View, mask: Mask, options: Options) -> OrientationMap:
    """Return the angle across the gradient, as sure as the gradient is strong."""
    grey = cv2.cvtColor(view.image, cv2.COLOR_RGB2GRAY).astype(np.float32)
    grey = cv2.GaussianBlur(grey, (0, 0), options.sigma)
    across_x, across_y = cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)
    strength = np.hypot(across_x, across_y) * mask.hair
    angle = np.arctan2(across_y, across_x) + np.pi / 2
    return OrientationMap(wrap_angle(angle), strength / max(float(strength.max()), 1e-6))
