"""Measure the waves and curls of the hair in the brightness of the photos.

Strands of wavy and curly hair are helices: the near half of each coil is bright, the far half dark,
along all locks that hang side by side. The 2D orientation does not show curls: for a helix whose
slope is 1.5 the mean doubled angle is 0, whatever its axis. So all is taken from power spectra of
the brightness, summed over views; hair hangs, and the axis is taken as vertical.

* The pitch is the first peak of the autocorrelation along the axis.
* The slope `2 pi radius / pitch` follows from how the power is spread over directions, from its
  second and fourth angular moments, and a model of the near half of a helix.

Where all hair turns one way, the near halves of its helices slant to one side, the same in every
view. The mean of the orientation maps shows that slant; it tells the handedness, and
`remove_slant` subtracts it before views are fused, because hair does not grow in that direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from scipy import fft, ndimage

from hairkit.arrays import Float32Array, Float64Array
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.volume import ScalpDistance
from hairkit.types.waves import Waves

RESOLUTION = 1500.0
"""Pixels per metre of the pictures that are measured; photos 540 px high still resolve curls."""
HALF_HEAD = 0.09
"""Metres from the middle of the head to the hair that a camera sees."""
STEEPEST_VIEW = 30.0
"""Degrees of elevation above which a view does not see hair hang upright."""
CONTRAST_SCALE = 0.014
"""Gaussian over which brightness is brought to equal mean and contrast, metres."""
BLUR_STEP = 4
"""Pixels that are averaged to one before that Gaussian, which is five times as wide."""
LEAST_CONTRAST = 1.0
"""Grey levels added to the standard deviation."""
PITCH_PATCH, PITCH_STEP, PITCH_FILLED = (0.128, 0.064), 0.02, 0.85
"""Height, width and spacing of the patches for the autocorrelation, metres; their least share of
hair."""
SHORTEST_PITCH, LONGEST_PITCH, SMALLEST_LAG = 0.008, 0.105, 0.002
"""Metres. Below the smallest lag there is the noise of pixels."""
LEAST_CORRELATION = 0.1
"""Autocorrelation at the smallest lag, relative to lag 0, below which the picture is noise."""
PROFILE_BLUR, PROFILE_HALF_WIDTH = 0.0015, 0.001
"""Metres along and across the axis over which the autocorrelation is averaged."""
FIRST_PEAK = 0.6
"""The pitch is the first peak of this share of the largest prominence."""
LEAST_PROMINENCE = 0.08
"""Of a peak over the trough before it, relative to the smallest lag: straight hair has up to 0.03,
wavy and curly hair 0.24 to 0.31."""
SLOPE_PATCH, SLOPE_STEP = (0.036, 0.036), 0.012
"""Height, width and spacing of the patches, wholly hair, for the spectrum, metres."""
BAND = (150.0, 350.0)
"""Cycles per metre: 3 to 7 mm, coarser than the lattice of pixels, finer than locks."""
FEWEST_PATCHES, FEWEST_EACH = 12, 4
"""Patches of all views below which nothing is measured, and of each where they are one or two."""
FEWEST_OF_A_VIEW = 2
"""Patches of one view that tell a pitch of its own."""
SAME_PITCH, LEAST_AGREEMENT = 0.15, 0.6
"""Relative difference up to which a view shows the pitch of all, and the share of the views with a
pitch of their own that must. 0.71 on curls, 1.0 on waves; 0.5 and 0.33 on the straight hair of two
photographed persons."""
LEAST_TURNS = 2.0
"""Turns below which hair has no waves. Straight short hair of two photographed persons was 1.03 and
1.15 of what was taken for a pitch long; wavy and curly hair of the captures is 3.3 to 4.4."""
WIDEST = 0.02
"""Metres: radius from which what repeats is no curl. Tied hair, all of which runs along its tail,
was measured as 42 mm wide; hot rollers make curls of 15 to 20 mm."""
EVEN = 0.08
"""Angular moments of hair that runs in all directions alike: 21 of 24 portraits of kinky hair have
at most 0.06, straight hair has 0.2 and more. Half of the views at least must show enough of it."""
LINE_BLUR, LOCK_BLUR, SIDE_BY_SIDE = 0.0008, 0.005, 0.5
"""Gaussians before the gradient of brightness and over its tensor, metres, and the coherence from
which strands run side by side: 0.14 to 0.28 on four heads of coils, 0.64 to 0.86 on ten portraits
of long hair."""
SURE_PROMINENCE, WIDEST_CURL = 0.14, 0.045
"""Of the pitch of such hair: its least prominence, and its longest, metres, where it is curls; less
than that, or longer, is chance."""
COILS, SHORTEST_COILS = Waves(0.004, 0.011), 0.05
"""Of tight coils, metres: no photo of a head resolves them (type 4 hair has radii of 2 to 5 mm);
and their least length: 24 of 25 portraits have 0.056 and more, noisy ones of short cuts less."""
AXIS_SCATTER = 0.18
"""Radians by which axes scatter about the vertical; as much again for each unit of slope."""
LINE_SHARE, LINE_SPREAD = 0.45, 0.5
"""Usual share of the power that is lines, not noise, and the spread of its logarithm."""
MOMENT_ERROR, MODEL_ERROR = 0.012, 0.1
"""Statistical error of a moment over eight views, and relative error of the model."""
LEAST_SLOPE, LARGEST_SLOPE = 0.4, 0.7
"""Slope of the slightest waves, and of those whose strands run side by side, where no pitch is
seen: what else slants are locks."""
USUAL_RADIUS, LEAST_UNSEEN = 0.0055, 0.1
"""Metres: of waves of one or two photos whose pitch is not seen, beside a face (those of three
captures have 6.2 to 6.9 mm), and the least length of such hair: short hair is often uneven."""
SURE_SLANT = 2.5
"""Standard errors by which the views' mean slant must differ from 0."""
_SLOPES = np.linspace(0.02, 4.0, 200)
_SHARES = np.exp(np.linspace(np.log(0.04), 0.0, 120))
_ANGLES, _RADII = 180, 12
"""Samples of the polar spectrum."""


def measure_waves(
    capture: Capture,
    orientations: Sequence[OrientationMap],
    masks: Sequence[Mask],
    cameras: Sequence[Camera],
    scalp_distance: ScalpDistance | None = None,
) -> Waves:
    """Return the radius, pitch and slant of the waves that all views show together.

    The cameras see the head at the origin; orientations, masks and cameras are in the capture's
    order. Hair shorter than two turns, by `scalp_distance`, has no waves, and neither has hair
    whose views show different pitches: what repeats in its pictures is something else, such as the
    shading of a cut. Of one or two views that show no pitch, the slope and `USUAL_RADIUS` give it.
    """
    scaled = [
        _scale(view, mask, camera)
        for view, mask, camera in zip(capture.views, masks, cameras, strict=True)
    ]
    views = [_normalise(*view) for view in scaled if view is not None]
    fewest = min(FEWEST_PATCHES, FEWEST_EACH * len(cameras))
    beside = _run_side_by_side(views)
    length = np.inf if scalp_distance is None else scalp_distance.hair_length
    pitch, prominence = _measure_pitch(views, fewest)
    curls = prominence >= SURE_PROMINENCE and pitch <= WIDEST_CURL
    if length >= SHORTEST_COILS and not (beside or curls) and _are_even(views, fewest):
        return COILS  # too tight to be seen one by one
    seen = prominence >= LEAST_PROMINENCE
    moments = _angular_moments(views, fewest) if seen or fewest < FEWEST_PATCHES else None
    slope = _fit_slope(*moments) if moments and (seen or not _is_even(moments)) else 0.0
    slope = min(slope, LARGEST_SLOPE) if beside and not seen else slope
    pitch = pitch if seen else 2 * np.pi * USUAL_RADIUS / max(slope, LEAST_SLOPE)
    radius = slope * pitch / (2 * np.pi)
    least = LEAST_TURNS * pitch if seen else max(LEAST_TURNS * pitch, LEAST_UNSEEN)
    if slope < LEAST_SLOPE or radius > WIDEST or length < least:
        return Waves()
    return Waves(radius, pitch, _measure_slant(orientations, masks))


def _are_even(views: Sequence[tuple[Float32Array, Float32Array]], fewest: int) -> bool:
    """Return whether hair of most views, half at least, runs in all directions alike."""
    told = [_is_even(found) for view in views if (found := _angular_moments([view], fewest))]
    return 2 * len(told) >= len(views) and sum(told) > LEAST_AGREEMENT * len(told)


def _run_side_by_side(views: Sequence[tuple[Float32Array, Float32Array]]) -> bool:
    """Return whether strands nearby run one way in half of the hair, as those of curls do not."""
    found = [np.zeros(1)]
    for picture, hair in views:
        lines = cv2.GaussianBlur(picture, (0, 0), LINE_BLUR * RESOLUTION)
        x, y = cv2.Sobel(lines, cv2.CV_32F, 1, 0), cv2.Sobel(lines, cv2.CV_32F, 0, 1)
        inside = cv2.erode(hair, np.ones((round(LOCK_BLUR * RESOLUTION),) * 2, np.uint8))
        parts = np.dstack([x * x - y * y, 2 * x * y, x * x + y * y]) * inside[..., None]
        tensor = cv2.GaussianBlur(parts, (0, 0), LOCK_BLUR * RESOLUTION)[inside > 0]
        found.append(np.hypot(tensor[:, 0], tensor[:, 1]) / np.maximum(tensor[:, 2], 1e-6))
    return bool(np.median(np.concatenate(found)) > SIDE_BY_SIDE)


def _is_even(moments: tuple[float, float]) -> bool:
    """Return whether lines run in all directions alike, as those of coils and of noise do."""
    return max(map(abs, moments)) <= EVEN


def _measure_slant(orientations: Sequence[OrientationMap], masks: Sequence[Mask]) -> float:
    """Return the views' mean slant, radians; 0 unless it is the same in all of them."""
    slants = [_mean_slant(found, mask) for found, mask in zip(orientations, masks, strict=True)]
    mean, error = np.mean(slants), np.std(slants) / np.sqrt(len(slants))
    return float(mean) if abs(mean) > SURE_SLANT * error else 0.0


def _scale(view: View, mask: Mask, camera: Camera) -> tuple[Float32Array, Float32Array] | None:
    """Return a picture and its hair at `RESOLUTION` on the hair's surface; None from above."""
    if abs(np.degrees(np.arcsin(camera.view_direction(np.zeros(3))[1]))) > STEEPEST_VIEW:
        return None
    distance = 1.0
    if camera.model == "perspective":
        distance = max(float(camera.depth(np.zeros(3))) - HALF_HEAD, HALF_HEAD)
    factor = RESOLUTION * distance / camera.focal
    size = (max(1, round(view.width * factor)), max(1, round(view.height * factor)))
    way = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    image = cv2.cvtColor(view.image, cv2.COLOR_RGB2GRAY).astype(np.float32)
    grey = cv2.resize(image, size, interpolation=way).astype(np.float32)
    hair = cv2.resize(mask.hair.astype(np.float32), size, interpolation=cv2.INTER_NEAREST)
    return grey, np.asarray(hair, np.float32)


def _normalise(grey: Float32Array, hair: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Return the picture with equal mean and contrast all over the hair, 0 outside; and the hair.

    Normalised convolution (Knutsson and Westin 1993) keeps the backdrop out of the averages.
    """

    def blur(values: Float32Array) -> Float32Array:
        size = [max(1, edge // BLUR_STEP) for edge in hair.shape[::-1]]
        small = cv2.resize(values, size, interpolation=cv2.INTER_AREA)
        small = cv2.GaussianBlur(small, (0, 0), CONTRAST_SCALE * RESOLUTION / BLUR_STEP)
        return np.asarray(cv2.resize(small, hair.shape[::-1]), np.float32)

    def average(values: Float32Array) -> Float32Array:
        return np.asarray(blur(values * hair) / known, np.float32)

    known = np.maximum(blur(hair), 1e-3)
    centred = grey - average(grey)
    deviation = np.sqrt(np.maximum(average(centred**2), 0)) + LEAST_CONTRAST
    return np.asarray(centred / deviation * hair, np.float32), hair


def _patches(
    views: Sequence[tuple[Float32Array, Float32Array]],
    shape: tuple[float, float],
    step: float,
    filled: float,
) -> Iterator[tuple[Float32Array, Float32Array]]:
    """Yield patches of pictures and of hair that hold at least a share of hair; metres."""
    height, width, stride = (round(edge * RESOLUTION) for edge in (*shape, step))
    for picture, hair in views:
        sums = np.asarray(cv2.integral(hair))
        sums = sums[height:] - sums[:-height]
        share = (sums[:, width:] - sums[:, :-width]) / (height * width)
        for top, left in stride * np.argwhere(share[::stride, ::stride] >= filled):
            place = np.s_[top : top + height, left : left + width]
            yield picture[place], hair[place]


class _Repeats(NamedTuple):
    """Sums over patches, from which an autocorrelation follows."""

    power: Float64Array
    """(H, W) spectrum of the brightness."""
    window: Float64Array
    """(H, W) spectrum of the hair, which tells how many pixels each lag has."""
    patches: int


def _measure_pitch(
    views: Sequence[tuple[Float32Array, Float32Array]], fewest: int = FEWEST_PATCHES
) -> tuple[float, float]:
    """Return the pitch in metres and its prominence, both 0 where views show no pitch together."""
    found = [_sum_patches(view) for view in views]
    pitch, prominence = _first_peak(_autocorrelation(_together(found), fewest))
    alone = [_first_peak(_autocorrelation(each, FEWEST_OF_A_VIEW)) for each in found]
    told = np.array([own for own, sure in alone if sure >= LEAST_PROMINENCE])
    same = np.abs(told / max(pitch, SHORTEST_PITCH) - 1) <= SAME_PITCH
    return (pitch, prominence) if same.sum() > LEAST_AGREEMENT * len(told) else (0.0, 0.0)


def _together(views: Sequence[_Repeats]) -> _Repeats:
    power, window, patches = zip(*views, strict=True)
    return _Repeats(np.sum(power, axis=0), np.sum(window, axis=0), sum(patches))


def _sum_patches(view: tuple[Float32Array, Float32Array]) -> _Repeats:
    """Return the sums over the patches of a view, padded by the lags that are read."""
    size, width = (round(edge * RESOLUTION) for edge in PITCH_PATCH)
    across = round(PROFILE_HALF_WIDTH * RESOLUTION)
    shape = (2 * size, fft.next_fast_len(width + across, real=True))
    power, window = np.zeros((2, shape[0], shape[1] // 2 + 1))
    count, filled = 0, 0
    for picture, hair in _patches([view], PITCH_PATCH, PITCH_STEP, PITCH_FILLED):
        mean = picture.sum() / max(float(hair.sum()), 1.0)
        power += _power((picture - mean) * hair, shape)
        if hair.all():
            filled += 1  # their windows are alike
        else:
            window += _power(hair, shape)
        count += 1
    if filled:
        window += filled * _power(np.ones((size, width), np.float32), shape)
    return _Repeats(power, window, count)


def _autocorrelation(found: _Repeats, fewest: int) -> Float64Array | None:
    """Return the autocorrelation (N,) along the axis; None of noise and of too little hair."""
    if found.patches < fewest:
        return None
    size, width = (round(edge * RESOLUTION) for edge in PITCH_PATCH)
    across = round(PROFILE_HALF_WIDTH * RESOLUTION)
    shape = (2 * size, fft.next_fast_len(width + across, real=True))
    overlap = np.maximum(fft.irfft2(found.window, shape), 1.0)
    correlation = fft.irfft2(found.power, shape) / overlap
    near = [correlation[:size, column] for column in range(-across, across + 1)]
    sharp = np.mean(near, axis=0)
    if sharp[round(SMALLEST_LAG * RESOLUTION)] < LEAST_CORRELATION * sharp[0]:
        return None
    return np.asarray(ndimage.gaussian_filter1d(sharp, PROFILE_BLUR * RESOLUTION))


def _power(values: Float32Array, shape: tuple[int, int]) -> Float32Array:
    """Return the power spectrum (H, W / 2 + 1) of values padded to (H, W)."""
    spectrum = fft.rfft2(values, shape)
    return np.asarray(spectrum.real**2 + spectrum.imag**2, np.float32)


def _first_peak(profile: Float64Array | None) -> tuple[float, float]:
    """Return lag, metres, and prominence of an autocorrelation's (N,) first high peak, or zeros."""
    if profile is None:
        return 0.0, 0.0
    start = round(SMALLEST_LAG * RESOLUTION)
    lags = np.arange(round(SHORTEST_PITCH * RESOLUTION), round(LONGEST_PITCH * RESOLUTION))
    lags = lags[lags < len(profile) - 1]
    peaks = lags[(profile[lags] >= profile[lags - 1]) & (profile[lags] > profile[lags + 1])]
    if not len(peaks) or profile[start] <= 0:
        return 0.0, 0.0
    trough = np.minimum.accumulate(profile[start:])
    prominence = (profile[peaks] - trough[peaks - start]) / profile[start]
    first = int(np.argmax(prominence >= FIRST_PEAK * prominence.max()))
    at = int(peaks[first])
    before, here, after = profile[at - 1 : at + 2]
    shift = 0.5 * (before - after) / min(before - 2 * here + after, -1e-12)
    return float((at + shift) / RESOLUTION), float(prominence[first])


def _angular_moments(
    views: Sequence[tuple[Float32Array, Float32Array]], fewest: int = FEWEST_PATCHES
) -> tuple[float, float] | None:
    """Return the means of cos 2 phi and cos 4 phi over the power; phi is off the vertical."""
    size, count = round(SLOPE_PATCH[0] * RESOLUTION), 0
    taper = np.outer(np.hanning(size), np.hanning(size))
    power = np.zeros((size, size))
    for picture, _ in _patches(views, SLOPE_PATCH, SLOPE_STEP, 1.0):
        power += np.abs(fft.fft2((picture - picture.mean()) * taper)) ** 2
        count += 1
    if count < fewest:
        return None
    angle = np.arange(_ANGLES) * np.pi / _ANGLES  # of the wave vector, so of the strand off upright
    frequency = np.linspace(*BAND, _RADII)[:, None] * size / RESOLUTION
    place = [size // 2 + frequency * np.sin(angle), size // 2 + frequency * np.cos(angle)]
    polar = ndimage.map_coordinates(fft.fftshift(power), place, order=1)
    strength = (polar * frequency).sum(axis=0)
    second, fourth = ((strength * np.cos(n * angle)).sum() / strength.sum() for n in (2, 4))
    return float(second), float(fourth)


def _fit_slope(second: float, fourth: float) -> float:
    """Return the slope of the helices from the angular moments: a posterior mean."""
    scatter = AXIS_SCATTER**2 * (1 + _SLOPES**2)
    model = helix_moments(_SLOPES) * np.exp(-np.stack([2 * scatter, 8 * scatter]))
    share = _SHARES[:, None]
    cost = (np.log(share / LINE_SHARE) / LINE_SPREAD) ** 2
    for found, wanted in zip((second, fourth), model, strict=True):
        error = np.hypot(MOMENT_ERROR, MODEL_ERROR * abs(found))
        cost = cost + ((found - share * wanted) / error) ** 2
    weight = np.exp(-0.5 * (cost - cost.min())).sum(axis=0)
    return float((weight * _SLOPES).sum() / weight.sum())


def helix_moments(slopes: Float64Array) -> Float64Array:
    """Return the mean of cos 2 phi and of cos 4 phi (2, N) over the near half of helices.

    phi is the drawn strand's angle off the axis: `tan phi = slope cos u` on the half turn u. How
    places count was fitted, with `AXIS_SCATTER`, to photos and true strands of 13 heads of hair of
    11 kinds, slopes 0.36 to 1.6: those that run across the axis count more than by their drawn
    length, and those to the sides, which face the camera less, hardly less.
    """
    turn = (np.arange(360) + 0.5) / 360 * np.pi - np.pi / 2
    slant = np.asarray(slopes)[:, None] * np.cos(turn)
    weight = (1 + slant**2) ** 1.5 * np.cos(turn) ** 0.25
    angle = np.arctan(slant)
    means = [(weight * np.cos(n * angle)).sum(axis=1) / weight.sum(axis=1) for n in (2, 4)]
    return np.stack(means)


def remove_slant(found: OrientationMap, waves: Waves) -> OrientationMap:
    """Return the map without the slant of the helices' near halves."""
    if waves.slant == 0:
        return found
    return OrientationMap(wrap_angle(found.angle - waves.slant), found.confidence)


def _mean_slant(found: OrientationMap, mask: Mask) -> float:
    """Return the mean angle off the vertical, radians, positive from +y towards -x."""
    weight = found.confidence * mask.hair
    turned = 2 * (found.angle - np.float32(np.pi / 2))
    return 0.5 * float(np.arctan2((weight * np.sin(turned)).sum(), (weight * np.cos(turned)).sum()))
