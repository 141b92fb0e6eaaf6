"""Still pictures: the mean of samples that differ by parts of a pixel and by places on the lens."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.types.camera import Camera

SAMPLES, LENS_SAMPLES = 16, 64
"""Samples of a sharp picture, and of one with depth of field, whose blurs are wider."""
_R2 = np.array([0.7548776662466927, 0.5698402909980532])
"""Steps of the R2 sequence, which covers a square evenly (Roberts 2018): powers of the inverse of
the plastic number."""


@dataclass(frozen=True)
class Lens:
    """What depth of field depends on."""

    aperture: float
    """Diameter, metres; 0 is sharp everywhere."""
    focus: float
    """Depth that is sharp, metres."""

    @property
    def samples(self) -> int:
        """Samples that a picture needs."""
        return LENS_SAMPLES if self.aperture > 0 else SAMPLES


def sample_camera(camera: Camera, lens: Lens, sample: int) -> Camera:
    """Return the camera of a sample; what lies at the depth in focus stays at its pixel."""
    flat = camera.model == "orthographic"  # has no lens
    # places on the lens cover its disc evenly (Vogel 1979)
    angle, radius = sample * np.pi * (3 - np.sqrt(5)), np.sqrt((sample + 0.5) / LENS_SAMPLES)
    place = radius * np.array([np.cos(angle), np.sin(angle)])
    x, y = place * (0.0 if flat else lens.aperture / 2)
    matrix = camera.camera_from_head.copy()
    matrix[:2, 3] -= (x, y)
    shift = np.array([x, y]) * camera.focal / lens.focus
    jitter = np.mod(_R2 * (sample + 1), 1.0) - 0.5
    return replace(camera, camera_from_head=matrix, centre=camera.centre + shift + jitter)


class Still:
    """The mean of the samples so far."""

    def __init__(self) -> None:
        self.count = 0
        self._sum = np.zeros(0, np.uint16)

    def clear(self) -> None:
        """Begin another picture."""
        self.count = 0

    def add(self, picture: UInt8Array) -> UInt8Array:
        """Add a sample (H, W, C); return the mean of all, rounded."""
        if self.count == 0:
            self._sum = picture.astype(np.uint16)
        else:
            self._sum += picture
        self.count += 1
        return ((self._sum + self.count // 2) // self.count).astype(np.uint8)
