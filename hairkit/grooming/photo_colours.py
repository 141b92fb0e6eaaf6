"""Colours of hair from the photos: of root and tip, and of dyed streaks, tips and halves.

Brightness is that of the pixels in the masks, hue that of points of the strands that photos show:
what masks take for hair beside the strands, and skin that shows between them, gives it none.

Light and shade change how bright hair is by a factor of four and more, but its hue hardly: on seven
captures of long hair of one colour the logarithms of red, green and blue, less that of their luma,
are within 0.32 of the head's for 99 % of what is seen; on cropped hair, through which skin shows,
within 0.69. So only hair of another hue is taken for dyed, and there alone its brightness counts
too; bleached or grey hair of the same hue is not told from hair in the light. Hues are medians over
the photos that see a place, and over its neighbours.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array
from hairkit.cameras.depth_raster import HEAD_TOLERANCE, depth_behind, head_depth, point_depth
from hairkit.colour import linear_from_srgb
from hairkit.grooming.prepare_export import point_colours
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.mask import Mask
from hairkit.types.strands import Strands

TIP_SHADE = 0.45
"""How bright tips are in photos over hair of the same colour near the crown, in linear light: 0.27
to 0.65 in eight path-traced captures."""
LIGHT = 0.67
"""How bright hair is drawn under the light at its camera, over its colour, in linear light. With it
the mean luma of hair drawn by its own cameras is 0.93 to 1.15 of the photos' on ten captures, of
straight hair more than of waves, whose locks shade each other; 1.6 where coils become straight."""
DEPTH = 0.87
"""Power of the channels of a colour, over their mean, with which hair is drawn as colourful as it
was photographed: the film curve of pictures deepens dark colours. On ten captures chroma is 0.97 of
the photos' in the mean, and 0.09 off on a scale of logarithms."""
DARKEST = 1e-4
"""Least brightness that is divided by."""
_EDGE_PX, _MOST_PIXELS = 4, 20_000
HEIGHT = 240
"""Of the pictures in pixels."""
MEASURED, STATIONS = 600, 8
"""Guides whose colours are measured at most, and places on each."""
STEP, RADIUS, BEHIND = 0.003, 0.004, 0.008
"""Distance between the points of guides that hide others, the radius of what hides, and how far
behind it hair is still seen, metres."""
SPREAD, RIM = 0.003, 5
"""Sigma over which photos are averaged, metres, and pixels of a square that hair's edge lacks."""
NEIGHBOURS = 12
"""Places whose median a place has."""
FROM, WHOLLY = 0.25, 0.45
"""Differences of hue from which brightness is the hair's own, and wholly."""
TELLING, LEAST = 0.4, 0.08
"""The least share of the places with such a difference on a head with dyed hair; cropped hair, of
which skin shows, has 0.05, undyed captures of long hair 0.01."""
_log = logging.getLogger("hairkit")
_LUMA = np.array([0.2126, 0.7152, 0.0722])


def measure_colour(views: Sequence[View], masks: Sequence[Mask]) -> HairMaterial:
    """Return a material with which hair is drawn as bright as it was photographed.

    All are of sRGB values. The colour near the crown is the median of the upper third of the hair's
    pixels of every view, near the tips of the lower third, which the sheen hardly moves. How much
    darker tips are tells little of their colour, since they hang in the shade: half of the
    difference to what is usual, on a scale of logarithms, is taken for the tips' own. Both together
    are then made as bright as the mean of all pixels, less the `LIGHT`, and paler by `DEPTH`.
    `with_hues` gives it the hues along the strands.
    """
    crowns, tips, every = [], [], []
    for view, mask in zip(views, masks, strict=True):
        pixels = _hair_pixels(view, mask)
        third = len(pixels) // 3
        crowns.append(pixels[: third + 1])
        tips.append(pixels[-third - 1 :])
        every.append(pixels)
    root, tip = (linear_from_srgb(np.median(np.concatenate(p), axis=0)) for p in (crowns, tips))
    whole = linear_from_srgb(np.concatenate(every).mean(axis=0))
    crown, end = max(float(root.mean()), DARKEST), max(float(tip.mean()), DARKEST)
    tip = tip * min(np.sqrt(crown / (end * TIP_SHADE)), max(crown / end, 1.0))
    own = float(whole.mean()) / LIGHT / max(float(root.mean() + tip.mean()) / 2, DARKEST)
    root, tip = (np.minimum(own * _paler(colour), 1.0) for colour in (root, tip))
    return HairMaterial(root.astype(np.float32), tip.astype(np.float32))


def _paler(colour: Float64Array) -> Float64Array:
    """Return a colour (3,) as bright as another, which pictures deepen to that."""
    mean = max(float(colour.mean()), DARKEST)
    pale = np.maximum(colour / mean, DARKEST) ** DEPTH
    return np.asarray(pale * mean / pale.mean())


def _hair_pixels(view: View, mask: Mask) -> Float64Array:
    """Return sRGB (N, 3) in [0, 1] of hair away from its edge, from the picture's top down."""
    hair = mask.hair.astype(np.uint8)
    inner = cv2.erode(hair, np.ones((2 * _EDGE_PX + 1, 2 * _EDGE_PX + 1), np.uint8))
    row, column = np.nonzero(inner if inner.any() else hair)
    every = -(-len(row) // _MOST_PIXELS)
    return np.asarray(view.image[row[::every], column[::every]] / 255, np.float64)


def with_hues(
    groom: Groom, views: Sequence[View], masks: Sequence[Mask], cameras: Sequence[Camera]
) -> Groom:
    """Return the groom in the hues that the photos show along its strands, as bright as before.

    The material has the medians over the inner and the outer halves of the strands. Hair of several
    hues has a colour at every point; one photo does not tell them from coloured light.

    Parameters
    ----------
    groom
        Strands on the head, with a material that is as bright as the photos.
    views, masks, cameras
        The photos, where hair is on them, and their cameras.
    """
    strands, material = groom.strands, groom.material
    some = strands.select(np.arange(0, len(strands), -(-len(strands) // MEASURED)))
    places = some.resampled(STATIONS).points
    fine = some.resampled_by_length(STEP).points
    logs = np.stack(
        [
            _measure(groom, places, fine, view, mask, camera)
            for view, mask, camera in zip(views, masks, cameras, strict=True)
        ]
    )
    seen = np.asarray(np.isfinite(logs[..., 0]).any(axis=0))
    if seen.sum() < NEIGHBOURS:
        return groom
    found = np.nanmedian(logs[:, seen], axis=0)
    outer = (np.flatnonzero(seen) % STATIONS) >= STATIONS // 2
    root, tip = (
        _tinted(colour, _hue(np.median(found[part] if part.any() else found, axis=0)))
        for colour, part in ((material.root_colour, ~outer), (material.tip_colour, outer))
    )
    groom = replace(groom, material=replace(material, root_colour=root, tip_colour=tip))
    tree = cKDTree(places[seen])
    hue = _hue(_smooth(tree, found, places[seen]))
    away = np.abs(hue - np.median(hue, axis=0)).max(axis=1)
    if len(views) == 1 or (away > TELLING).mean() < LEAST:
        return groom
    _log.warning("the hair has several hues: it is dyed, or masks take something else for hair")
    return replace(groom, strands=replace(strands, colours=_dyed(groom, tree, found)))


def _tinted(colour: Float32Array, hue: Float64Array) -> Float32Array:
    """Return a colour (3,) as bright as another, in a hue (3,)."""
    tint = np.exp(DEPTH * hue)
    return np.asarray(np.minimum(tint * colour.mean() / tint.mean(), 1), np.float32)


def _measure(
    groom: Groom, places: Float32Array, fine: Float32Array, view: View, mask: Mask, camera: Camera
) -> Float64Array:
    """Return logarithms (N, 3) of the colours that a photo shows at places, NaN where it does not.

    Their brightness is 0 in the median: photos are exposed as they like.

    `fine` (M, 3) are points of the guides that hide what is behind them.
    """
    small = camera.resized(round(HEIGHT * camera.width / camera.height), HEIGHT)
    size = small.width, small.height
    photo = cv2.resize(view.image, size, interpolation=cv2.INTER_AREA) / 255
    whole = cv2.resize(mask.hair.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    hair = cv2.erode(whole, np.ones((RIM, RIM), np.uint8)).astype(np.float64)
    sigma = SPREAD * small.pixels_per_metre
    light = cv2.GaussianBlur(linear_from_srgb(photo) * hair[..., None], (0, 0), sigma)
    mean = light / np.maximum(cv2.GaussianBlur(hair, (0, 0), sigma), DARKEST)[..., None]
    front = np.minimum(
        point_depth(small, fine, RADIUS), head_depth(groom.head, small) + HEAD_TOLERANCE
    )
    pixels = np.nan_to_num(np.floor(small.project(places)), nan=-1)
    inside = np.asarray(((pixels >= 0) & (pixels < size)).all(axis=1))
    column, row = np.where(inside[:, None], pixels, 0).astype(np.int64).T
    seen = inside & (hair[row, column] > 0)
    seen &= depth_behind(small, front.astype(np.float32), places) < BEHIND
    logs = np.log(np.maximum(mean[row, column], DARKEST))
    exposure = np.median(logs[seen] @ _LUMA) if seen.any() else 0.0
    return np.asarray(np.where(seen[:, None], logs - exposure, np.nan))


def _smooth(tree: cKDTree, found: Float64Array, places: Float32Array) -> Float64Array:
    """Return the medians (N, 3) of what was found at the nearest places of a tree."""
    return np.asarray(np.median(found[tree.query(places, NEIGHBOURS)[1]], axis=1))


def _hue(logs: Float64Array) -> Float64Array:
    """Return logarithms of colours (..., 3) less that of their luma."""
    return np.asarray(logs - (logs @ _LUMA)[..., None])


def _dyed(groom: Groom, tree: cKDTree, found: Float64Array) -> Float32Array:
    """Return colours (P, 3) of the hue that was found at each point.

    They are as bright as the material has them there. Where the hue is unusual they are brighter or
    darker by half of what others on the same share of their length are not: the rest may be light.
    """
    strands = groom.strands
    logs = _smooth(tree, found, strands.resampled(STATIONS).points)
    hue = _hue(logs)
    away = np.abs(hue - np.median(hue, axis=0)).max(axis=1, keepdims=True)
    luma = (logs @ _LUMA).reshape(-1, STATIONS)
    other = np.clip((away - FROM) / (WHOLLY - FROM), 0, 0.5) * (
        luma - np.median(luma, axis=0)
    ).reshape(-1, 1)
    own = _at_points(strands, DEPTH * hue + other)
    bright = point_colours(groom) @ _LUMA
    return np.asarray(np.clip(bright[:, None] * np.exp(own), 0, 1), np.float32)


def _at_points(strands: Strands, values: Float64Array) -> Float64Array:
    """Return values (P, 3) at the points of strands, of those (S STATIONS, 3) at even places."""
    arc = strands.arc_lengths() / np.repeat(strands.lengths(), strands.counts)
    place = np.clip(arc, 0, 1) * (STATIONS - 1)
    first = np.minimum(place.astype(np.int64), STATIONS - 2)
    row, t = STATIONS * strands.strand_of_point + first, (place - first)[:, None]
    return np.asarray(values[row] * (1 - t) + values[row + 1] * t)
