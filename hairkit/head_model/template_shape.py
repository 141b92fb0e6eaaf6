"""The shape of an average adult head from a few tables of lengths: profile curves and bumps.

The head is a stack of tilted, closed level curves, one for each polar angle from the crown (0) to
the middle of the neck's cut (180 degrees). Three profiles carry them: the front and the back of the
median plane, and the line of greatest breadth; between those a level curve is a superellipse
quarter. Eyes, nose, lips, jaw and ears are then added as smooth displacements. All lengths in this
file are millimetres in the head frame (x subject's left, y up, z forward, origin at the head's
centre); they are proportions of an average adult, scaled to a head breadth of 155 mm.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array

# Polar angle, front (y, z), side (x, y, z), back (y, z), exponents of the front and back quarters.
_LEVELS = np.array(
    [
        # angle  front        side               back         exponents
        [0.0, 70.0, -9.0, 0.0, 70.0, -9.0, 70.0, -9.0, 2.00, 2.00],
        [25.0, 61.8, 36.0, 34.3, 61.8, -10.0, 61.8, -47.6, 2.00, 2.05],
        [45.0, 45.0, 64.7, 57.5, 45.0, -11.0, 45.0, -69.5, 2.00, 2.15],
        [65.0, 21.0, 83.2, 72.2, 21.0, -11.0, 21.0, -83.9, 2.08, 2.17],
        [82.0, -3.0, 90.5, 77.0, -3.0, -11.0, -3.0, -90.2, 2.20, 2.16],
        [90.0, -15.0, 91.3, 77.5, -15.0, -10.0, -15.0, -91.0, 2.26, 2.15],
        [98.0, -34.0, 90.7, 76.0, -31.0, -8.0, -28.0, -90.2, 2.33, 2.18],
        [108.0, -58.0, 88.5, 73.0, -51.0, 1.0, -45.0, -87.3, 2.42, 2.23],
        [118.0, -82.0, 90.5, 69.0, -71.0, 9.0, -62.0, -81.8, 2.40, 2.15],
        [128.0, -105.0, 92.0, 64.8, -90.0, 13.0, -78.0, -74.0, 2.24, 2.02],
        [136.0, -123.0, 91.5, 60.2, -104.0, 8.5, -92.0, -68.0, 2.02, 1.94],
        [142.0, -138.0, 89.0, 55.0, -115.0, -1.0, -104.0, -64.3, 1.80, 1.92],
        [146.5, -146.0, 77.5, 53.2, -123.0, -7.0, -113.0, -62.3, 1.72, 1.92],
        [151.0, -148.7, 62.5, 52.7, -131.0, -11.0, -122.0, -61.5, 1.68, 1.95],
        [155.0, -153.5, 48.0, 52.8, -141.0, -12.0, -136.0, -62.0, 1.68, 2.05],
        [160.0, -174.0, 39.0, 54.0, -162.0, -13.0, -160.0, -65.0, 1.72, 2.20],
        [165.0, -203.0, 32.5, 57.0, -195.0, -14.0, -194.0, -69.5, 1.80, 2.20],
        [169.0, -228.0, 30.5, 61.0, -226.0, -15.0, -226.0, -73.0, 1.90, 2.20],
        [172.0, -245.0, 30.0, 63.0, -245.0, -15.0, -245.0, -75.0, 2.00, 2.20],
        [174.0, -250.0, 23.0, 54.0, -250.0, -16.0, -250.0, -66.0, 2.00, 2.20],
        [177.0, -250.0, 1.0, 27.0, -250.0, -18.0, -250.0, -42.0, 2.00, 2.10],
        [180.0, -250.0, -18.0, 0.0, -250.0, -18.0, -250.0, -18.0, 2.00, 2.00],
    ]
)

# Height, how far the ridge of the nose stands out of the face, and its half width.
_NOSE = np.array(
    [
        [-20.0, 0.0, 8.0],
        [-26.0, 1.0, 8.0],
        [-35.0, 4.0, 7.0],
        [-45.0, 11.7, 7.0],
        [-55.0, 19.5, 7.5],
        [-62.0, 25.5, 8.5],
        [-67.0, 27.0, 9.5],
        [-72.0, 24.0, 10.0],
        [-77.0, 15.5, 9.5],
        [-82.0, 8.7, 9.0],
        [-87.0, 4.5, 8.0],
        [-95.0, 0.0, 7.0],
    ]
)

# Centre (x, y, z), reach (x, y, z), displacement (x, y, z); those beside the middle are mirrored.
_BUMPS = np.array(
    [
        [31.0, -37.5, 82.0, 14.5, 8.0, 30.0, 0.0, 0.0, -14.0],  # eye sockets
        [31.0, -36.5, 84.0, 8.5, 6.0, 30.0, 0.0, 0.0, 9.5],  # eyeballs under their lids
        [15.5, -37.0, 88.0, 5.0, 8.0, 30.0, 0.0, 0.0, -5.5],  # inner corners of the eyes
        [44.0, -36.0, 74.0, 5.0, 5.0, 30.0, 0.0, 0.0, -1.5],  # outer corners of the eyes
        [33.0, -14.0, 88.0, 17.0, 6.0, 30.0, 0.0, 0.0, 4.0],  # brow ridges
        [0.0, -13.0, 92.0, 10.0, 9.0, 30.0, 0.0, 0.0, 1.7],  # glabella
        [50.0, -58.0, 66.0, 13.0, 10.0, 25.0, 0.5, 0.0, 1.8],  # cheekbones
        [24.0, -56.0, 84.0, 8.0, 9.0, 30.0, 0.0, 0.0, -2.5],  # beside the nose
        [38.0, -74.0, 78.0, 13.0, 13.0, 25.0, 0.0, 0.0, -5.0],  # cheeks below the eyes
        [66.0, -24.0, 42.0, 14.0, 24.0, 20.0, -1.5, 0.0, -1.5],  # temples
        [27.0, -96.0, 80.0, 10.0, 16.0, 25.0, 0.0, 0.0, -2.0],  # beside the mouth
        [14.0, -75.0, 92.0, 4.5, 4.5, 25.0, 1.5, 0.0, 7.0],  # wings of the nose
        [20.5, -76.0, 88.0, 4.0, 7.0, 25.0, 0.0, 0.0, -2.0],  # beside the wings
        [5.5, -79.0, 96.0, 3.0, 2.5, 25.0, 0.0, 0.0, -1.0],  # nostrils
        [0.0, -96.0, 93.0, 13.0, 4.2, 25.0, 0.0, 0.0, 10.5],  # upper lip
        [0.0, -108.5, 93.0, 12.0, 4.2, 25.0, 0.0, 0.0, 8.5],  # lower lip
        [0.0, -102.3, 93.0, 14.0, 2.3, 25.0, 0.0, 0.0, -5.0],  # between the lips
        [0.0, -89.0, 93.0, 3.2, 5.0, 25.0, 0.0, 0.0, -1.2],  # philtrum
        [0.0, -119.0, 92.0, 15.0, 4.5, 25.0, 0.0, 0.0, -2.0],  # below the lower lip
        [0.0, -134.0, 90.0, 13.0, 9.0, 25.0, 0.0, 0.0, 2.5],  # chin
    ]
)

EAR_CENTRE = np.array([-58.0, -10.0])
"""Height and depth of the middle of the ear, mm."""
_EAR_TILT = np.radians(12.0)
"""Rotation of the ear's long axis backwards."""
_EAR_HALF = np.array([27.0, 16.0])
"""Half height and half depth of the ear, mm; the shape below is in units of them."""
_LOBE = 0.45
"""By which the ear gets narrower per half height below its middle."""
_EAR_EDGE, _EAR_FADE = 1.3, 0.55
"""Half heights from the middle at which the ear ends, and over which it rises to the full lift."""
_BOWL_CENTRE, _BOWL_REACH = (-0.1, 0.15), (0.45, 0.4)
"""Up and forward in half heights and half depths: middle and Gaussian sigma of the hollow."""
_EAR_LIFT, _EAR_FORWARD, _BOWL_DEPTH, _EAR_BACK = 12.0, 9.0, 9.0, 5.0
"""Millimetres that the ear stands off the head, less per half depth forward, less in the hollow,
and that it is pulled back."""
_SIDE = 40.0
"""Millimetres from the median plane beyond which a point is at the side of the head."""
_FACE = 40.0
"""Millimetres in front of the origin beyond which a point is on the face and its nose."""
_NOSE_EXPONENT = 2.2
"""Of exp(-|x / half width|^e), the nose's cross-section: a little flatter than a Gaussian."""

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
"""Width of the hairline's transition, mm."""
_AXIS_DEPTH, _LEAST_RADIUS = 10.0, 20.0
"""Millimetres behind the origin of the hairline's axis, and the least distance from it at which the
hairline's slope is measured."""


def head_surface(polar: Float64Array, azimuth: Float64Array) -> Float64Array:
    """Return the points (N, 3) of the head's surface at two angles (N,), in metres.

    `polar` runs from 0 at the crown to pi in the neck's cut, `azimuth` from 0 in front to pi / 2 at
    the subject's left. The surface is smooth across both poles.
    """
    base = _level_curves(polar, azimuth)
    moved = base + _nose(base) + _displacements(base)
    return (moved + _ears(base)) * 1e-3


def scalp_weight(points: Float64Array) -> Float64Array:
    """Return the scalp weight (N,) at points (N, 3), metres: 1 in hair, 0.5 at the hairline, 0."""
    x, y, z = points.T * 1e3
    azimuth = np.degrees(np.arctan2(np.abs(x), z + _AXIS_DEPTH))
    hairline = _hairline()
    radius = np.maximum(np.hypot(x, z + _AXIS_DEPTH), _LEAST_RADIUS)
    slope = np.degrees(hairline.derivative()(azimuth)) / radius
    beyond = (y - hairline(azimuth)) / np.sqrt(1 + slope**2)
    t = np.clip(0.5 + beyond / _HAIRLINE_FADE, 0, 1)
    return np.asarray(t * t * (3 - 2 * t))


def _level_curves(polar: Float64Array, azimuth: Float64Array) -> Float64Array:
    """Points (N, 3) of the smooth head without features, mm."""
    angle = np.degrees(polar)
    profiles = _profiles()
    front, back, side = profiles(angle), profiles(-angle), profiles(angle)[:, :3]
    ahead = np.cos(azimuth) > 0
    power = np.where(ahead, front[:, 5], back[:, 5])
    cosine, sine = np.abs(np.cos(azimuth)), np.abs(np.sin(azimuth))
    radius = (cosine**power + sine**power) ** (-1 / power)
    along, across = radius * cosine, radius * sine
    end = np.where(ahead[:, None], front[:, 3:5], back[:, 3:5])
    return np.stack(
        [
            side[:, 0] * across * np.sign(np.sin(azimuth)),
            side[:, 1] + (end[:, 0] - side[:, 1]) * along,
            side[:, 2] + (end[:, 1] - side[:, 2]) * along,
        ],
        axis=1,
    )


# SciPy's splines take as long to load as NumPy: they are loaded when a head is made.
@cache
def _profiles() -> Any:
    """Side (x, y, z), median (y, z) and exponent over the angle: in front above 0, behind below.

    One closed curve through both poles, so that the surface is smooth there; x is odd.
    """
    from scipy.interpolate import CubicSpline

    front = _LEVELS[:, [3, 4, 5, 1, 2, 8]]
    back = _LEVELS[:0:-1, [3, 4, 5, 6, 7, 9]] * [-1, 1, 1, 1, 1, 1]
    angles = np.concatenate([-_LEVELS[:0:-1, 0], _LEVELS[:, 0]])
    return CubicSpline(angles, np.concatenate([back, front]), bc_type="periodic")


@cache
def _nose_curves() -> Any:
    """Curves of the nose ridge over height: its elevation above the face, and its half width."""
    from scipy.interpolate import PchipInterpolator

    return PchipInterpolator(_NOSE[::-1, 0], _NOSE[::-1, 1:])


@cache
def _hairline() -> Any:
    """The hairline's height over the azimuth."""
    from scipy.interpolate import PchipInterpolator

    return PchipInterpolator(_HAIRLINE[:, 0], _HAIRLINE[:, 1])


def _nose(base: Float64Array) -> Float64Array:
    x, y, z = base.T
    height = _nose_curves()(np.clip(y, _NOSE[-1, 0], _NOSE[0, 0]))
    out = np.where(z > _FACE, height[:, 0], 0)
    out = out * np.exp(-((np.abs(x) / height[:, 1]) ** _NOSE_EXPONENT))
    return np.stack([np.zeros_like(out), np.zeros_like(out), out], axis=1)


def _displacements(base: Float64Array) -> Float64Array:
    x, y, z = np.ascontiguousarray(base.T)
    total = np.zeros((3, len(base)))
    for row in _BUMPS:
        flat = ((y - row[1]) / row[4]) ** 2 + ((z - row[2]) / row[5]) ** 2
        for side in (1.0, -1.0) if row[0] else (1.0,):
            share = np.exp(-0.5 * (((x - side * row[0]) / row[3]) ** 2 + flat))
            for axis in np.flatnonzero(row[6:]):
                total[axis] += (side if axis == 0 else 1.0) * row[6 + axis] * share
    return total.T


def _ears(base: Float64Array) -> Float64Array:
    """Each ear a tilted bowl: a rim that stands off to the side and back, hollow in the middle."""
    y, z = base[:, 1] - EAR_CENTRE[0], base[:, 2] - EAR_CENTRE[1]
    up = (np.cos(_EAR_TILT) * y - np.sin(_EAR_TILT) * z) / _EAR_HALF[0]
    forward = (np.sin(_EAR_TILT) * y + np.cos(_EAR_TILT) * z) / _EAR_HALF[1]
    forward = forward * np.where(up < 0, 1 - _LOBE * up, 1.0)
    distance = np.hypot(up, forward)
    plateau = _smoothstep((_EAR_EDGE - distance) / _EAR_FADE)
    (up0, forward0), (up_reach, forward_reach) = _BOWL_CENTRE, _BOWL_REACH
    away = ((up - up0) / up_reach) ** 2 + ((forward - forward0) / forward_reach) ** 2
    bowl = np.exp(-0.5 * away)
    lift = plateau * (_EAR_LIFT - _EAR_FORWARD * forward.clip(-1, 1) - _BOWL_DEPTH * bowl)
    side = np.sign(base[:, 0]) * (np.abs(base[:, 0]) > _SIDE)
    return np.stack([lift * side, 0 * lift, -_EAR_BACK * plateau * side**2], axis=1)


def _smoothstep(t: Float64Array) -> Float64Array:
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)
