"""The skin of the default head, painted by code: brows, lashes, lips, cheeks, ears, and eyeballs.

`python -m hairkit.head_model.template_skin OUT.jpg` paints the picture that the package ships.
Each texel is a point of the head's surface, and colours are laid over each other where that point
is near a feature. All lengths are millimetres in the head frame, the right half mirrored, as in
`template_shape`; colours are sRGB. They are plausible values of light skin, chosen by eye.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import resources

import numpy as np

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.head_model.eyes import LOWER_LID, UPPER_LID, paint_over
from hairkit.head_model.template_shape import EAR_CENTRE, head_surface
from hairkit.types.skin import SkinMaps, Texture

SIZE = 1024
"""Edge of the shipped picture, pixels: 0.5 mm on the face."""
SHIPPED = "template_skin.jpg"
QUALITY = 90
"""Of the JPEG file, of 100."""
_BLOCK = 64
"""Rows that are painted at a time, to bound memory."""

_Colour = Float64Array
_Layer = tuple[_Colour, Float64Array]
_SKIN = np.array([196, 150, 125], np.float64)
_BLUSH = np.array([188, 114, 96], np.float64)
_LIP = np.array([158, 88, 82], np.float64)
_MOUTH = np.array([92, 44, 42], np.float64)
_SHADE = np.array([150, 104, 86], np.float64)
_HAIR = np.array([62, 43, 32], np.float64)
_LASH = np.array([32, 22, 18], np.float64)
_TEAR = np.array([196, 122, 112], np.float64)

_Curve = list[tuple[float, float]]
_BROW_TOP: _Curve = [(12, -9.5), (22, -6.6), (36, -5.2), (47, -9.1), (57, -18)]
_BROW_FOOT: _Curve = [(12, -16), (22, -15.2), (36, -12.6), (47, -14), (57, -19)]
_LIP_TOP: _Curve = [(0, -95), (5, -93.2), (10, -95), (16, -97.8), (24, -102.6)]
_LIP_LINE: _Curve = [(0, -102.2), (10, -102.2), (20, -103), (24, -103.2)]
_LIP_FOOT: _Curve = [(0, -112), (9, -111.3), (16, -108.8), (24, -103.8)]

_Line = tuple[_Colour, float, _Curve, float, float, float]
_BLOBS = [  # colour, cover in the middle, middle (x, y, z), reach (x, y, z)
    (_BLUSH, 0.42, (42, -64, 75), (17, 14, 25)),  # cheeks
    (_BLUSH, 0.40, (0, -70, 112), (11, 11, 12)),  # tip of the nose
    (_BLUSH, 0.25, (0, -134, 90), (14, 9, 20)),  # chin
    (_BLUSH, 0.45, (86, EAR_CENTRE[0], EAR_CENTRE[1]), (6, 22, 15)),  # ears
    (_SHADE, 0.34, (29, -43.5, 80), (13, 3.2, 25)),  # below the eyes
    (_SHADE, 0.30, (19, -33, 80), (7, 8, 25)),  # beside the root of the nose
    (_SHADE, 0.25, (0, -115.5, 90), (11, 2.5, 25)),  # below the lower lip
    (_MOUTH, 0.80, (6.3, -81, 96), (2.4, 1.2, 12)),  # nostrils
]
_REGIONS = [  # colour, cover, upper and lower rim, millimetres over which each fades
    (_LIP, 0.85, _LIP_TOP, _LIP_LINE, 1.6, 0.8),
    (_LIP, 0.75, _LIP_LINE, _LIP_FOOT, 0.8, 2.4),
]
_LINES: list[_Line] = [  # colour, cover, curve, lift, half widths inside and outside
    (_MOUTH, 0.85, _LIP_LINE, 0.0, 0.9, 0.7),
    (_SHADE, 0.55, UPPER_LID, 3.6, 1.0, 1.1),  # crease of the lid
]
_LASHES: list[_Line] = [
    (_LASH, 0.95, UPPER_LID, 0.3, 0.7, 1.6),
    (_LASH, 0.40, LOWER_LID, -0.3, 0.3, 0.6),
]
_LIDS_FADE = 0.8
"""Millimetres over which the lids' edges fade into what is between them."""
_BROW_COVER, _BROW_FADE, _BROW_GAPS = 0.95, 2.0, 0.2
"""Of the brow: its cover, millimetres over which its rims fade, cover lost between its hairs."""
_BROW_SLANT = np.array([[2.2, -0.11], [0.9, 0.45], [0.0, 0.0]])
"""From a point to coordinates across and along the brow's hairs; these are longer than thick."""
_CURVE_ENDS = 1.5
"""Millimetres over which what follows a curve fades at its ends."""
_GRAIN = [(9.0, 0.05), (2.3, 0.03)]
"""Periods in mm of the skin's mottling, and the cover of shade that each adds."""
_GRAIN_COVER = 0.06
"""Mean cover of shade."""
_HAIR_PERIOD = 1.6
"""Period of the brow's hairs, mm, before the slant."""
_WAVES, _PERIODS_MEAN = 12, 2.2
"""Plane waves of a noise, and what their mean period is divided by."""
_FACE, _FACE_FADE = 30.0, 10.0
"""Millimetres in front of the origin beyond which a point is on the face, and from which wholly."""
_RNG_GRAIN, _RNG_BROW = 1, 7
"""Seeds of the two noises."""


def template_maps() -> SkinMaps:
    """Return the maps of the default head, whose picture ships with the package."""
    data = resources.files("hairkit.head_model").joinpath(SHIPPED).read_bytes()
    return SkinMaps(Texture(np.frombuffer(data, np.uint8)))


def paint_skin(size: int = SIZE) -> UInt8Array:
    """Return the albedo (size, size, 3), sRGB, over the default head's texture coordinates."""
    rows = [_paint_rows(first, min(first + _BLOCK, size), size) for first in range(0, size, _BLOCK)]
    return paint_over(np.concatenate(rows))


def _paint_rows(first: int, stop: int, size: int) -> UInt8Array:
    """Rows of the picture; texels outside the head's disc are those of its rim."""
    row, column = np.mgrid[first:stop, 0:size]
    across, up = (column + 0.5) / size - 0.5, 0.5 - (row + 0.5) / size
    polar = np.minimum(2 * np.pi * np.hypot(across, up), np.pi)
    azimuth = np.arctan2(across, -up)
    points = 1e3 * head_surface(polar.ravel(), azimuth.ravel())
    colour = np.tile(_SKIN, (len(points), 1))
    for paint, cover in _layers(points):
        colour += np.clip(cover, 0, 1)[:, None] * (paint - colour)
    shape = (stop - first, size, 3)
    return np.rint(np.clip(colour, 0, 255)).astype(np.uint8).reshape(shape)


def _layers(points: Float64Array) -> Iterator[_Layer]:
    """Yield colours and how much of each covers the points (N,), from below to above."""
    right = np.abs(points[:, 0])
    place = np.stack([right, points[:, 1], points[:, 2]], axis=1)
    face = _ramp(points[:, 2] - _FACE, _FACE_FADE)
    noises = (
        share * _noise(points, period, _RNG_GRAIN + number)
        for number, (period, share) in enumerate(_GRAIN)
    )
    yield _SHADE, np.sum([*noises], axis=0) + _GRAIN_COVER
    for colour, cover, middle, reach in _BLOBS:
        away = (place - np.array(middle)) / np.array(reach)
        yield colour, cover * np.exp(-0.5 * (away**2).sum(axis=1))
    for colour, cover, upper, lower, fade, lower_fade in _REGIONS:
        yield colour, cover * face * _between(place, upper, lower, fade, lower_fade)
    for line in _LINES:
        yield _along(place, face, line)
    brow = _between(place, _BROW_TOP, _BROW_FOOT, _BROW_FADE, _BROW_FADE)
    hairs = 1 - _BROW_GAPS * (1 - _noise(place @ _BROW_SLANT, _HAIR_PERIOD, _RNG_BROW))
    yield _HAIR, _BROW_COVER * face * brow * hairs
    yield from _eye(place, face)


def _eye(place: Float64Array, face: Float64Array) -> Iterator[_Layer]:
    """Yield what is between the lids, beside and behind the eyeball, and lashes."""
    yield _TEAR, face * _between(place, UPPER_LID, LOWER_LID, _LIDS_FADE, _LIDS_FADE)
    for line in _LASHES:
        yield _along(place, face, line)


def _between(
    place: Float64Array, upper: _Curve, lower: _Curve, fade: float, lower_fade: float
) -> Float64Array:
    """Return 1 between two curves, 0 outside of them and beyond their ends."""
    x, y = place[:, 0], place[:, 1]
    top, foot = (np.interp(x, *np.transpose(curve)) for curve in (upper, lower))
    return _ends(x, upper) * _ramp(top - y, fade) * _ramp(y - foot, lower_fade)


def _along(place: Float64Array, within: Float64Array, line: _Line) -> _Layer:
    """Return a line along a curve, Gaussian across it."""
    colour, cover, curve, lift, inner, outer = line
    x, y = place[:, 0], place[:, 1]
    share = np.clip((x - curve[0][0]) / (curve[-1][0] - curve[0][0]), 0, 1)
    off = (y - lift - np.interp(x, *np.transpose(curve))) / (inner + share * (outer - inner))
    return colour, cover * within * _ends(x, curve) * np.exp(-(off**2))


def _ends(x: Float64Array, curve: _Curve) -> Float64Array:
    """Return 1 within a curve's ends, fading to 0 beyond them; curves from 0 on have one end."""
    first, last = curve[0][0], curve[-1][0]
    inner = _ramp(x - first + 0.5 * _CURVE_ENDS, _CURVE_ENDS) if first else np.ones_like(x)
    return inner * _ramp(last + 0.5 * _CURVE_ENDS - x, _CURVE_ENDS)


def _ramp(inside: Float64Array, width: float) -> Float64Array:
    """Return 0 outside, 1 from `width` inside on, smooth in between."""
    t = np.clip(inside / width, 0, 1)
    return t * t * (3 - 2 * t)


def _noise(points: Float64Array, period: float, seed: int) -> Float64Array:
    """Return smooth noise (N,) of about -1 to 1 that changes over `period` mm."""
    generator = np.random.default_rng(seed)
    spread = 2 * np.pi / (_PERIODS_MEAN * period)
    turns = generator.normal(0, spread, (points.shape[1], _WAVES))
    phase = generator.uniform(0, 2 * np.pi, _WAVES)
    return np.asarray(np.cos(points @ turns + phase).sum(axis=1) / np.sqrt(_WAVES))


if __name__ == "__main__":
    import cv2

    cv2.imwrite(sys.argv[1], paint_skin()[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
