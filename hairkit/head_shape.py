"""The shape of an average adult head from a few tables of lengths: profile curves and bumps.

The head is a stack of tilted, closed level curves, one for each polar angle from the crown (0) to
the middle of the neck's cut (180 degrees). Three profiles carry them: the front and the back of the
median plane, and the line of greatest breadth; between those a level curve is a superellipse
quarter. Eyes, nose, lips, jaw and ears are then added as smooth displacements. All lengths in this
file are millimetres in the head frame (x subject's left, y up, z forward, origin at the head's
centre); they are proportions of an average adult, scaled to a head breadth of 155 mm.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from hairkit.stored import Float64Array

# Polar angle, front (y, z), side (x, y, z), back (y, z), exponents of the front and back quarters.
_LEVELS = np.array(
    [
        # angle  front        side               back         exponents
        [0.0, 70.0, -9.0, 0.0, 70.0, -9.0, 70.0, -9.0, 2.00, 2.00],
        [25.0, 62.0, 36.0, 34.5, 62.0, -10.0, 62.0, -48.0, 2.00, 2.05],
        [45.0, 45.0, 64.5, 58.0, 45.0, -11.0, 45.0, -70.0, 2.05, 2.20],
        [65.0, 21.0, 83.0, 72.5, 21.0, -11.0, 21.0, -85.0, 2.10, 2.25],
        [82.0, -3.0, 90.5, 77.2, -3.0, -11.0, -3.0, -91.5, 2.20, 2.25],
        [90.0, -15.0, 91.5, 77.8, -15.0, -10.0, -15.0, -92.3, 2.25, 2.25],
        [98.0, -34.0, 90.5, 76.0, -31.0, -7.0, -28.0, -91.5, 2.40, 2.20],
        [108.0, -58.0, 88.0, 73.3, -51.0, 2.0, -45.0, -88.5, 2.60, 2.10],
        [118.0, -82.0, 91.0, 69.0, -71.0, 9.0, -62.0, -83.0, 2.50, 2.00],
        [128.0, -105.0, 92.5, 65.0, -90.0, 16.0, -78.0, -75.0, 2.30, 2.00],
        [136.0, -123.0, 91.5, 61.5, -104.0, 18.0, -92.0, -67.5, 2.20, 2.00],
        [142.0, -138.0, 89.0, 58.0, -113.0, 15.0, -104.0, -62.5, 2.10, 2.05],
        [146.5, -146.5, 78.0, 56.0, -120.0, 8.0, -113.0, -60.0, 2.10, 2.10],
        [151.0, -149.0, 64.0, 54.5, -127.0, 0.0, -122.0, -58.5, 2.10, 2.20],
        [155.0, -154.0, 51.0, 53.5, -139.0, -5.0, -136.0, -58.0, 2.10, 2.20],
        [160.0, -174.0, 39.5, 54.0, -162.0, -9.0, -160.0, -61.0, 2.10, 2.20],
        [165.0, -203.0, 32.5, 57.0, -195.0, -12.0, -194.0, -66.0, 2.10, 2.20],
        [169.0, -228.0, 30.5, 61.0, -226.0, -14.0, -226.0, -70.0, 2.10, 2.20],
        [172.0, -245.0, 30.0, 63.0, -245.0, -15.0, -245.0, -72.0, 2.10, 2.20],
        [174.0, -250.0, 23.0, 54.0, -250.0, -16.0, -250.0, -64.0, 2.10, 2.20],
        [177.0, -250.0, 1.0, 27.0, -250.0, -18.0, -250.0, -40.0, 2.05, 2.10],
        [180.0, -250.0, -18.0, 0.0, -250.0, -18.0, -250.0, -18.0, 2.00, 2.00],
    ]
)

# Height, how far the ridge of the nose stands out of the face, and its half width.
_NOSE = np.array(
    [
        [-28.0, 0.0, 9.0],
        [-36.0, 1.5, 8.0],
        [-45.0, 9.5, 8.0],
        [-55.0, 18.5, 9.0],
        [-62.0, 24.5, 10.5],
        [-67.0, 26.0, 11.5],
        [-72.0, 22.5, 12.0],
        [-77.0, 14.0, 11.0],
        [-82.0, 7.0, 9.0],
        [-87.0, 4.5, 8.0],
        [-95.0, 0.0, 8.0],
    ]
)

# Centre (x, y, z), reach (x, y, z), displacement (x, y, z); those off the median plane are mirrored.
_BUMPS = np.array(
    [
        [31.0, -38.0, 82.0, 15.0, 9.0, 30.0, 0.0, 0.0, -13.0],  # eye sockets
        [31.0, -37.5, 84.0, 10.0, 7.5, 30.0, 0.0, 0.0, 8.5],  # eyeballs under their lids
        [17.0, -38.0, 88.0, 5.0, 8.0, 30.0, 0.0, 0.0, -5.0],  # inner corners of the eyes
        [30.0, -14.0, 88.0, 17.0, 6.0, 30.0, 0.0, 0.5, 2.5],  # brow ridges
        [0.0, -13.0, 92.0, 12.0, 8.0, 30.0, 0.0, 0.0, 1.5],  # glabella
        [52.0, -56.0, 62.0, 14.0, 10.0, 25.0, 1.0, 0.0, 2.0],  # cheekbones
        [60.0, 5.0, 58.0, 12.0, 22.0, 22.0, -1.0, 0.0, -1.5],  # temples
        [36.0, -92.0, 80.0, 12.0, 14.0, 25.0, 0.0, 0.0, -2.0],  # hollows of the cheeks
        [13.0, -75.0, 92.0, 5.0, 5.0, 25.0, 1.5, 0.0, 6.0],  # wings of the nose
        [0.0, -97.0, 93.0, 15.0, 4.5, 25.0, 0.0, 0.0, 7.0],  # upper lip
        [0.0, -108.5, 93.0, 13.0, 4.5, 25.0, 0.0, 0.0, 5.5],  # lower lip
        [0.0, -102.0, 93.0, 17.0, 2.2, 25.0, 0.0, 0.0, -3.5],  # between the lips
        [0.0, -89.5, 93.0, 3.0, 5.0, 25.0, 0.0, 0.0, -1.0],  # philtrum
        [0.0, -119.0, 92.0, 18.0, 5.0, 25.0, 0.0, 0.0, -1.5],  # below the lower lip
        [0.0, -136.0, 90.0, 14.0, 9.0, 25.0, 0.0, 0.0, 2.0],  # chin
        [60.0, -100.0, -20.0, 25.0, 20.0, 16.0, -6.0, 0.0, 0.0],  # behind the angle of the jaw
    ]
)

EAR_CENTRE = np.array([-58.0, -10.0])
"""Height and depth of the middle of the ear, mm."""
_EAR_TILT = np.radians(12.0)
_EAR_HALF = np.array([27.0, 16.0])

# Azimuth about the vertical through z = -10 mm in degrees, height of the hairline there.
_HAIRLINE = np.array(
    [
        [0.0, 48.0],
        [15.0, 45.0],
        [27.0, 41.0],
        [36.0, 38.5],
        [43.0, 28.0],
        [50.0, 11.0],
        [58.0, -6.0],
        [65.0, -22.0],
        [70.0, -31.0],
        [75.0, -33.0],
        [82.0, -29.0],
        [88.0, -24.0],
        [95.0, -22.0],
        [103.0, -25.0],
        [108.0, -34.0],
        [113.0, -49.0],
        [120.0, -68.0],
        [128.0, -82.0],
        [138.0, -91.0],
        [150.0, -93.0],
        [165.0, -94.5],
        [180.0, -97.0],
    ]
)
_HAIRLINE_FADE = 8.0


def head_surface(polar: Float64Array, azimuth: Float64Array) -> Float64Array:
    """Return the points (N, 3) of the head's surface at two angles (N,), in metres.

    `polar` runs from 0 at the crown to pi in the neck's cut, `azimuth` from 0 in front to pi / 2 at
    the subject's left. The surface is smooth across both poles.
    """
    base = _level_curves(polar, azimuth)
    moved = base + _nose(base) + _displacements(base)
    result: Float64Array = (moved + _ears(base)) * 1e-3
    return result


def scalp_weight(points: Float64Array) -> Float64Array:
    """Return (N,) how surely hair grows at surface points (N, 3), metres: 1, 0.5 at the hairline, 0."""
    x, y, z = points.T * 1e3
    azimuth = np.degrees(np.arctan2(np.abs(x), z + 10.0))
    line = PchipInterpolator(_HAIRLINE[:, 0], _HAIRLINE[:, 1])
    slope = np.degrees(line.derivative()(azimuth)) / np.maximum(np.hypot(x, z + 10.0), 20.0)
    beyond = (y - line(azimuth)) / np.sqrt(1 + slope**2)
    t = np.clip(0.5 + beyond / _HAIRLINE_FADE, 0, 1)
    result: Float64Array = t * t * (3 - 2 * t)
    return result


def _level_curves(polar: Float64Array, azimuth: Float64Array) -> Float64Array:
    """Points (N, 3) of the smooth head without features, mm."""
    angle = np.degrees(polar)
    front, back = _median_profile(angle), _median_profile(-angle)
    side, exponents = _side_profile(angle), CubicSpline(_LEVELS[:, 0], _LEVELS[:, 8:10])(angle)
    cosine, sine = np.cos(azimuth), np.abs(np.sin(azimuth))
    ahead = cosine > 0
    power = np.where(ahead, exponents[:, 0], exponents[:, 1])
    radius = (np.abs(cosine) ** power + sine**power) ** (-1 / power)
    along, across = radius * np.abs(cosine), radius * sine
    end = np.where(ahead[:, None], front, back)
    result: Float64Array = np.stack(
        [
            side[:, 0] * across * np.sign(np.sin(azimuth)),
            side[:, 1] + (end[:, 0] - side[:, 1]) * along,
            side[:, 2] + (end[:, 1] - side[:, 2]) * along,
        ],
        axis=1,
    )
    return result


def _median_profile(angle: Float64Array) -> Float64Array:
    """(y, z) of the closed median curve; the front has positive angles, the back negative ones."""
    angles = np.concatenate([-_LEVELS[:0:-1, 0], _LEVELS[:, 0]])
    knots = np.concatenate([_LEVELS[:0:-1, 6:8], _LEVELS[:, 1:3]])
    result: Float64Array = CubicSpline(angles, knots, bc_type="periodic")(angle)
    return result


def _side_profile(angle: Float64Array) -> Float64Array:
    """(x, y, z) of the line of greatest breadth on the left; x odd, y and z even across the crown."""
    angles = np.concatenate([-_LEVELS[:0:-1, 0], _LEVELS[:, 0]])
    mirrored = _LEVELS[:0:-1, 3:6] * [-1, 1, 1]
    knots = np.concatenate([mirrored, _LEVELS[:, 3:6]])
    result: Float64Array = CubicSpline(angles, knots, bc_type="periodic")(angle)
    return result


def _nose(base: Float64Array) -> Float64Array:
    x, y, z = base.T
    height = PchipInterpolator(_NOSE[:, 0][::-1], _NOSE[::-1, 1:], extrapolate=False)(y)
    height = np.where(np.isnan(height), [0.0, 9.0], height)
    out = np.where(z > 40, height[:, 0], 0) * np.exp(-((np.abs(x) / height[:, 1]) ** 2.2))
    result: Float64Array = np.stack([np.zeros_like(out), np.zeros_like(out), out], axis=1)
    return result


def _displacements(base: Float64Array) -> Float64Array:
    total = np.zeros_like(base)
    for row in _BUMPS:
        for side in (1.0, -1.0) if row[0] else (1.0,):
            mirror = np.array([side, 1.0, 1.0])
            away = (base - row[:3] * mirror) / row[3:6]
            total += np.exp(-0.5 * (away**2).sum(axis=1))[:, None] * row[6:] * mirror
    return total


def _ears(base: Float64Array) -> Float64Array:
    """Each ear a tilted bowl: a rim that stands off to the side and back, hollow in the middle."""
    y, z = base[:, 1] - EAR_CENTRE[0], base[:, 2] - EAR_CENTRE[1]
    up = (np.cos(_EAR_TILT) * y - np.sin(_EAR_TILT) * z) / _EAR_HALF[0]
    forward = (np.sin(_EAR_TILT) * y + np.cos(_EAR_TILT) * z) / _EAR_HALF[1]
    forward = forward * np.where(up < 0, 1 - 0.45 * up, 1.0)  # the lobe is narrower
    distance = np.hypot(up, forward)
    plateau = _smoothstep((1.15 - distance) / 0.4)
    bowl = np.exp(-0.5 * ((up + 0.05) ** 2 + (forward - 0.1) ** 2) / 0.32**2)
    lift = plateau * (10.5 - 8.5 * forward.clip(-1, 1)) - 9.0 * bowl * plateau
    side = np.sign(base[:, 0]) * (np.abs(base[:, 0]) > 40)
    result: Float64Array = np.stack([lift * side, 0 * lift, -0.35 * plateau * 10 * side**2], axis=1)
    return result


def _smoothstep(t: Float64Array) -> Float64Array:
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)
