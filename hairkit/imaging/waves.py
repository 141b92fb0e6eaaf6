"""Measure the waves of the hair in the orientation maps of the photos.

Strands of wavy hair are helices, and neighbours differ in phase. Eight photos cannot resolve them
one by one, but they show three numbers. Along the average direction the angle oscillates, so its
autocorrelation has a minimum at half a turn, which gives the pitch. The near half of a helix slants
to one side, the same in every view, by `tan(slant) = 4 radius / pitch` on average (the mean of a
cosine over its half turn is 2 / pi). Where all hair turns one way, the slant gives radius and
handedness; `remove_slant` subtracts it before views are fused, because hair does not grow in that
direction. Where hair turns both ways the slants cancel, and the rms of the oscillation gives the
radius.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.parallel import compiled
from hairkit.types.camera import Camera
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.waves import Waves

HEIGHT = 540
"""Waves are measured on maps of this height, where they still span tens of pixels."""
LEAST_WEIGHT = 0.05
"""Lines end where the map's weight falls to this."""
HIGH_PASS = 12.5
"""Gaussian in pixels of such a map that separates the average direction from the swing."""
LONGEST_LAG, LINE_LENGTH, LINES = 55, 120, 500
"""Pixels of the autocorrelation and of the lines it is taken on; lines a view."""
SHORTEST_LAG = 5
"""Half turns of fewer pixels are noise."""
TROUGH = -0.09
"""Autocorrelation below which there are waves; straight hair has -0.03, noise 0."""
SWING_LOSS = 1.6
"""Orientation maps average strands that are out of step; the swing they keep is smaller by about
this."""
STEEPEST = 0.8
"""Radians: larger swings and slants are errors, and their tangents would make huge waves."""
SURE_LINE = 0.3
"""Weight of the map where lines start."""
SURE_SLANT = 2.5
"""Standard errors by which the views' mean slant must differ from 0."""


def measure_waves(
    orientations: Sequence[OrientationMap], masks: Sequence[Mask], cameras: Sequence[Camera]
) -> Waves:
    """Measure pitch, radius and slant of the waves in all views together."""
    correlation = np.zeros(LONGEST_LAG)
    squares, slants, metres = [], [], []
    for found, mask, camera in zip(orientations, masks, cameras, strict=True):
        swing, total = _swing(found, mask)
        correlation += total
        squares.append(swing)
        slants.append(_mean_slant(found, mask))
        distance = 1.0 if camera.model == "orthographic" else float(camera.depth(np.zeros(3)))
        metres.append(found.angle.shape[0] / HEIGHT * distance / camera.focal)
    if correlation[0] <= 0:
        return Waves()
    trough = int(np.argmin(correlation))
    if (
        correlation[trough] > TROUGH * correlation[0]
        or not SHORTEST_LAG <= trough < LONGEST_LAG - 1
    ):
        return Waves()
    pitch = 2 * trough * float(np.median(metres))
    mean, error = np.mean(slants), np.std(slants) / np.sqrt(len(slants))
    slant = float(mean) if abs(mean) > SURE_SLANT * error else 0.0
    swing_rms = SWING_LOSS * float(np.sqrt(np.mean(squares)))
    from_swing = pitch * np.sqrt(2) * np.tan(min(swing_rms, STEEPEST)) / (2 * np.pi)
    from_slant = pitch * np.tan(min(abs(slant), STEEPEST)) / 4
    return Waves(float(max(from_swing, from_slant)), pitch, slant)


def remove_slant(found: OrientationMap, waves: Waves) -> OrientationMap:
    """Return the map without the slant of the helices' near halves."""
    if waves.slant == 0:
        return found
    return OrientationMap(wrap_angle(found.angle - waves.slant), found.confidence)


def _swing(found: OrientationMap, mask: Mask) -> tuple[float, Float64Array]:
    """Return the mean square of the angle's swing, radians squared, and its autocorrelation."""
    size = (round(found.angle.shape[1] * HEIGHT / found.angle.shape[0]), HEIGHT)
    inside = cv2.resize(mask.hair.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    inside = cv2.erode(inside, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (7, 7)))
    weight = cv2.resize(found.confidence, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    weight = weight * inside
    vector = np.stack([np.cos(2 * found.angle), np.sin(2 * found.angle)], axis=-1)
    vector = cv2.resize(vector, size, interpolation=cv2.INTER_AREA) * weight[..., None]
    smooth = cv2.GaussianBlur(vector, (0, 0), HIGH_PASS)
    average = (0.5 * np.arctan2(smooth[..., 1], smooth[..., 0])).astype(np.float32)
    angle = 0.5 * np.arctan2(vector[..., 1], vector[..., 0])
    swing = np.mod(angle - average + np.pi / 2, np.pi) - np.pi / 2
    rows, columns = np.nonzero(weight > SURE_LINE)
    if not len(rows):
        return 0.0, np.zeros(LONGEST_LAG)
    pick = np.linspace(0, len(rows) - 1, LINES).astype(np.int64)
    starts = np.stack([columns[pick], rows[pick]], axis=1).astype(np.float64)
    total, count = _autocorrelation(average, swing, weight, starts, LINE_LENGTH, LONGEST_LAG)
    mean = total / np.maximum(count, 1)
    return float(mean[0]), np.where(count > LINES, mean, 0)


@compiled
def _autocorrelation(
    average: Float32Array,
    swing: Float32Array,
    weight: Float32Array,
    starts: Float64Array,
    length: int,
    lags: int,
) -> tuple[Float64Array, Float64Array]:
    """Sum swing[i] * swing[i + lag] along lines that follow `average`; and the number of terms."""
    height, width = swing.shape
    total, count = np.zeros(lags), np.zeros(lags)
    line = np.empty(length)
    for s in range(len(starts)):
        x, y = starts[s, 0], starts[s, 1]
        dx, dy = 0.0, 1.0
        n = 0
        while n < length:
            ix, iy = int(x), int(y)
            if ix < 0 or iy < 0 or ix >= width or iy >= height or weight[iy, ix] <= LEAST_WEIGHT:
                break
            line[n] = swing[iy, ix]
            n += 1
            c, d = np.cos(average[iy, ix]), np.sin(average[iy, ix])
            if c * dx + d * dy < 0:
                c, d = -c, -d
            dx, dy = c, d
            x += dx
            y += dy
        for lag in range(min(lags, n)):
            for i in range(n - lag):
                total[lag] += line[i] * line[i + lag]
            count[lag] += n - lag
    return total, count


def _mean_slant(found: OrientationMap, mask: Mask) -> float:
    """Return the mean angle off the vertical, radians, positive from +y towards -x."""
    weight = found.confidence * mask.hair
    turned = 2 * (found.angle - np.float32(np.pi / 2))
    return 0.5 * float(np.arctan2((weight * np.sin(turned)).sum(), (weight * np.cos(turned)).sum()))
