"""Transfer landmarks to neighbouring views by template matching (normalised cross-correlation).

A patch around a landmark is drawn as the neighbour would see it (through the plane that touches
the head there) and looked up in the neighbour near the expected place by normalised correlation.
Only matches with one clear peak count.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.cameras.landmark_equations import Sights
from hairkit.imaging.masked_filters import picture_scale
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.head import JAW_LANDMARKS, LANDMARKS, Head

FACING = 0.3
"""Cosine below which a landmark turns too far away from a camera to be matched."""
NEIGHBOUR = 0.5
"""Least cosine between the axes of views that are matched: 60 degrees."""
SMALLEST_PATCH = 3
"""Least half edge of a patch, and least reach of the search, pixels."""


@dataclass(frozen=True)
class PatchSettings:
    """Sizes in pixels of pictures 1080 high."""

    half: float = 12.0
    """Half the edge of a patch."""
    search: float = 36.0
    """Search radius around the expected place."""
    blur: float = 1.5
    correlation: float = 0.8
    """Least correlation of a match."""
    lead: float = 0.06
    """Least margin of a match over the next best one."""
    noise: float = 3.0
    """Standard deviation of a match."""


def transfer_landmarks(
    capture: Capture,
    cameras: tuple[Camera, ...],
    head: Head,
    landmarks: Float64Array,
    settings: PatchSettings,
) -> Sights:
    """Return landmarks found in views without, from the nearest view that has them.

    `landmarks` (68, 3) are their places as far as known; `head` gives the normals there.
    """
    seen = [index for index, view in enumerate(capture.views) if view.landmarks is not None]
    rows: list[tuple[int, int, float, float, float]] = []
    if head.landmark_vertices is not None and seen:
        normals = head.normals()[head.landmark_vertices]
        pixel = picture_scale(capture.views[0].height)
        for index in range(len(cameras)):
            source = max(seen, key=lambda other: _facing(cameras, other, index))
            if index in seen or _facing(cameras, source, index) < NEIGHBOUR:
                continue
            pair = _Pair(capture, cameras, source, index, settings, pixel)
            for point in range(JAW_LANDMARKS, LANDMARKS):
                found = pair.find(point, landmarks[point], normals[point])
                if found is not None:
                    rows.append((index, point, found[0], found[1], settings.noise * pixel))
    return Sights.of_rows(rows)


def _facing(cameras: tuple[Camera, ...], first: int, second: int) -> float:
    return float(cameras[first].forward @ cameras[second].forward)


class _Pair:
    """A view with landmarks and its neighbour without."""

    def __init__(
        self,
        capture: Capture,
        cameras: tuple[Camera, ...],
        source: int,
        target: int,
        settings: PatchSettings,
        pixel: float,
    ) -> None:
        self.source, self.target = cameras[source], cameras[target]
        self.landmarks = capture.views[source].landmarks
        self.from_image = _smooth_grey(capture.views[source].image, settings.blur * pixel)
        self.to_image = _smooth_grey(capture.views[target].image, settings.blur * pixel)
        self.half = max(SMALLEST_PATCH, round(settings.half * pixel))
        self.search = max(SMALLEST_PATCH, round(settings.search * pixel))
        self.settings = settings

    def find(
        self, point: int, place: Float64Array, normal: Float64Array
    ) -> tuple[float, float] | None:
        """Return the pixel of a landmark in the neighbour, or None without a clear match."""
        for camera in (self.source, self.target):
            if -(normal @ camera.view_direction(place)) < FACING:
                return None
        middle = np.floor(self.target.project(place)) + 0.5
        reach = self.half + self.search
        left, top = (np.floor(middle) - reach).astype(int)
        edge = 2 * reach + 1
        height, width = self.to_image.shape
        if left < 0 or top < 0 or left + edge > width or top + edge > height:
            return None
        patch = self._warp_patch(point, place, normal)
        window = self.to_image[top : top + edge, left : left + edge]
        score = cv2.matchTemplate(window, patch, cv2.TM_CCOEFF_NORMED)
        _, best, _, (x, y) = cv2.minMaxLoc(score)
        cv2.circle(score, (x, y), max(2, 2 * self.half // 3), -1.0, -1)
        if not (best >= self.settings.correlation and best - score.max() >= self.settings.lead):
            return None
        return float(middle[0] + x - self.search), float(middle[1] + y - self.search)

    def _warp_patch(self, point: int, place: Float64Array, normal: Float64Array) -> Float32Array:
        """Return the landmark's patch as the neighbour sees it, in its pixels."""
        assert self.landmarks is not None
        exact = self.target.project(place)
        steps = np.arange(-self.half, self.half + 1)
        pixels = np.stack(np.meshgrid(exact[0] + steps, exact[1] + steps), axis=-1)
        origin, direction = self.target.rays(pixels)
        length = ((place - origin) @ normal) / (direction @ normal)
        seen = self.source.project(origin + direction * length[..., None])
        seen = seen + self.landmarks[point] - self.source.project(place) - 0.5
        patch = cv2.remap(
            self.from_image,
            seen[..., 0].astype(np.float32),
            seen[..., 1].astype(np.float32),
            cv2.INTER_LINEAR,
        )
        return np.asarray(patch, np.float32)


def _smooth_grey(image: UInt8Array, blur: float) -> Float32Array:
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(grey, (0, 0), blur), np.float32)
