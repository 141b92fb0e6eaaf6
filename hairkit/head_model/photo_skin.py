"""The skin of a head taken from the photos: an albedo map with the person's face.

Every photo is projected on the fitted head. A texel takes its colour from the views that see it,
weighted by the cosine under which they do; hair, what stands before the head, the outline of the
person and blown-out pixels do not count. Exposure and white balance of the views are evened by one
gain a channel, least squares over the texels that two views share. Views are blended in two bands
(Burt and Adelson 1983): coarse colours in their gradients, details directly, both from the view
that sees the texel best, so that seams neither show nor blur.

The light of the photos is taken out of the seen skin (`hairkit.head_model.delighting`). What then
differs from the face in colour, such as strands that masks miss, the edge of their shadow and
collars, counts as unseen, and so do brows and mouth beside what the best view of the face shows of
them. What is unseen is taken from its mirror image where the texture coordinates are symmetric,
then from the head's own skin in the mean tone of the seen.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, UInt8Array
from hairkit.cameras.depth_raster import depth_behind, head_depth, mesh_depth
from hairkit.head_model.delighting import find_shading
from hairkit.head_model.exposures import FLOOR, even_exposures
from hairkit.head_model.eye_colours import find_eye_colours, mark_beside_eyes
from hairkit.head_model.eyes import has_default_eyes, paint_over
from hairkit.head_model.gradient_blend import join_gradients, smallest_window, smooth_seen
from hairkit.head_model.skin_tones import LEAST, extend_tones, like_skin
from hairkit.parallel import thread_count
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.head import JAW_LANDMARKS, Head
from hairkit.types.mask import PERSON, Mask
from hairkit.types.scene import Scene
from hairkit.types.skin import SkinMaps, Texture

SIZE = 2048
"""Edge of the albedo map, texels: 0.25 mm on the face."""
COARSE = 512
"""Edge of the maps in which places, visibility and weights are found, texels."""
STRIP = 128
"""Rows of the albedo map that are worked on at a time: a whole map of colours takes 50 MB."""
LEAST_FACING, WHOLE_FACING = 0.15, 0.8
"""Cosines of the angle of view up to which a texel is not taken, and from which wholly."""
HIDDEN = 0.004
"""Metres behind the first surface from which a texel is hidden."""
MARGIN, HAIR_MARGIN = 0.004, 0.008
"""Metres of skin beside the outline and beside hair that are left out: masks and cameras are not
exact, and fine strands and their shadow lie beside the mask."""
SHARPNESS = 8
"""Power of the weights from which details are taken: nearly the best view alone."""
WELL, WELL_FEATURES = 0.3, 0.12
"""Weights from which one view shows the face alone, and its features."""
BLOWN, BLOWN_FADE = 250.0, 6.0
"""Levels of 255 from which a pixel has lost its colour, and over which its weight fades."""
LEAST_SHARE = 0.01
"""Share of a texel's best view below which another view's photo is not looked up."""
LEAST_SEEN = 0.08
"""Weight of all views together from which a texel counts as seen."""
FILL_FADE = 8.0
"""Sigma over which seen skin fades into filled skin, texels of the coarse maps: 8 mm."""
LARGEST_FACE = 0.1
"""Share of the texture's edge over which a face may reach."""
MIRRORED = 0.01
"""Metres that mirrored texels may be apart on heads whose texture coordinates are symmetric."""
FEATURE = 0.014
"""Metres from landmarks of brows, nose, eyes and mouth within which colours may be any."""
SURE_SKIN = 4
"""Power of the likeness to skin by which its tone is averaged: half the spread of one photo's."""
AROUND = 3.0
"""Sigma within which skin lies among skin, texels of the coarse maps."""
LEAST_LIKE, WHOLLY_LIKE = 0.3, 0.7
"""Likeness to skin up to which a texel is filled in, and from which it is kept."""
STEP = 4
"""Texels between those at which exposures are measured."""


class _Surface(NamedTuple):
    """The head's surface over its texture coordinates."""

    places: Float32Array
    """(C, C, 3) metres."""
    normals: Float32Array
    """(C, C, 3)."""
    known: BoolArray
    """(C, C) texels that the head covers."""


class _Seen(NamedTuple):
    """One photo on the head."""

    weight: Float32Array
    """(C, C)."""
    column: Float32Array
    """(C, C) pixels of the photo, for `cv2.remap`."""
    row: Float32Array
    """(C, C)."""
    coarse: UInt8Array
    """(C, C, 3) the photo's colours."""


def photograph_skin(capture: Capture, scene: Scene, masks: Sequence[Mask]) -> SkinMaps:
    """Return the maps of the scene's fitted head, with an albedo taken from the photos."""
    photos = [view.image for view in capture.views]
    surface = _unwrap(scene.head)
    project = partial(_project, surface, scene.head)
    with ThreadPoolExecutor(thread_count()) as pool:
        views = list(pool.map(project, scene.cameras, photos, masks))
    features = _features(scene.head, surface)
    views = _skin_alone(views, features)
    gains = even_exposures(
        [view.coarse[::STEP, ::STEP] for view in views],
        [view.weight[::STEP, ::STEP] for view in views],
    )
    symmetric = _is_symmetric(surface)
    views = _one_face(views, features, symmetric)
    blended, seen = _blend(views, photos, gains)
    del views  # as much memory as the map itself
    blended = _delight(blended, seen, surface, features)
    seen = _certain(blended, seen, features)
    if symmetric:
        blended, seen = _mirror(blended, seen)
    pixels = _fill(blended, seen, surface, features, _own_skin(scene.head))
    maps = scene.head.maps or SkinMaps()
    if has_default_eyes(scene.head):
        pixels = paint_over(pixels, *find_eye_colours(capture.views, gains))
    return SkinMaps(Texture.encode(pixels, lossless=False), maps.roughness, maps.normal, maps.bump)


def _skin_alone(views: Sequence[_Seen], features: BoolArray) -> list[_Seen]:
    """Return the views without what has not the colour of skin beside eyes, nose and mouth: collars
    on the neck, strands and their shadow on the temples."""
    kept = []
    for view in views:
        skin = np.where(features, 1, like_skin(view.coarse, view.weight))
        kept.append(view._replace(weight=(view.weight * skin).astype(np.float32)))
    return kept


def _one_face(views: Sequence[_Seen], features: BoolArray, symmetric: bool) -> list[_Seen]:
    """Return the views with the face of the one that sees its features best, where it sees them or
    their mirror image: cameras are off by millimetres, and two views would give two mouths."""
    face = max(views, key=lambda view: float((view.weight * features).sum()))
    known = np.maximum(face.weight, face.weight[:, ::-1] * (features & symmetric))
    others = np.clip(1 - known / np.where(features, WELL_FEATURES, WELL), 0, 1).astype(np.float32)
    return [v if v is face else v._replace(weight=v.weight * others) for v in views]


def _features(head: Head, surface: _Surface) -> BoolArray:
    """Return (C, C) texels near landmarks of brows, nose, eyes and mouth; above the neck without
    landmarks."""
    if head.landmark_vertices is None:
        return np.asarray(surface.places[..., 1] >= head.joints[1, 1])
    inner = head.vertices[head.landmark_vertices[JAW_LANDMARKS:]]
    low, high = inner.min(axis=0) - FEATURE, inner.max(axis=0) + FEATURE
    near = ((surface.places > low) & (surface.places < high)).all(axis=-1)
    near[near] = np.isfinite(
        cKDTree(inner).query(surface.places[near], distance_upper_bound=FEATURE)[0]
    )
    return np.asarray(near)


def _delight(
    blended: Float32Array, seen: Float32Array, surface: _Surface, features: BoolArray
) -> Float32Array:
    """Return the colours (S, S, 3), in their place, without the light of the photos."""
    coarse = _shrink(blended, COARSE)
    shading = find_shading(coarse, seen * like_skin(coarse, seen, features), surface.normals)
    for rows in _strips():
        blended[rows] /= _enlarge_rows(shading, rows)
    return blended


def _certain(blended: Float32Array, seen: Float32Array, features: BoolArray) -> Float32Array:
    """Return the weights (C, C) of texels that have the skin's colour, and around them too, or lie
    at eyes, nose and mouth: not strands, the edge of their shadow, collars."""
    likeness = like_skin(_shrink(blended, COARSE), seen, features)
    within = cv2.GaussianBlur((seen > 0).astype(np.float32), (0, 0), AROUND)
    around = cv2.GaussianBlur(likeness, (0, 0), AROUND) / np.maximum(within, LEAST)
    share = (np.minimum(around, likeness) - LEAST_LIKE) / (WHOLLY_LIKE - LEAST_LIKE)
    return np.asarray(seen * np.where(features, 1, np.clip(share, 0, 1)), np.float32)


def _unwrap(head: Head) -> _Surface:
    """Return the surface over the texture coordinates, drawn as a picture of its coordinates."""
    normals = head.normals()
    layers = [*head.vertices.astype(np.float64).T, *normals.T]
    offset = 2.0 + max(float(np.abs(layer).max()) for layer in layers)
    faces = _whole_in_uv(head)
    pictures = [_over_uv(head.uv, faces, layer + offset) for layer in layers]
    known = np.isfinite(pictures[0])
    values = np.stack([np.where(known, p - np.float32(offset), 0) for p in pictures], axis=-1)
    return _Surface(values[..., :3], values[..., 3:], np.asarray(known))


def _over_uv(uv: Float32Array, faces: Int32Array, values: Float64Array) -> Float32Array:
    """Return (C, C) positive values (V,) of vertices at `uv` (V, 2), interpolated on the faces."""
    looking = np.diag([1.0, -1.0, -1.0, 1.0])  # an orthographic camera above the (u, v) plane
    camera = Camera(looking, COARSE, np.array([0.0, COARSE]), COARSE, COARSE, "orthographic")
    return mesh_depth(np.column_stack([uv, -values]).astype(np.float32), faces, camera)


def _whole_in_uv(head: Head) -> Int32Array:
    """Return the faces (F', 3) that do not reach across the texture, as those at a pole do."""
    faces = head.skin_faces()
    a, b, c = (head.uv[corner] for corner in faces.T)
    longest = np.maximum(np.maximum(np.abs(a - b), np.abs(b - c)), np.abs(c - a)).max(axis=1)
    return np.ascontiguousarray(faces[longest < LARGEST_FACE])


def _project(surface: _Surface, head: Head, camera: Camera, photo: UInt8Array, mask: Mask) -> _Seen:
    sized = camera.resized(photo.shape[1], photo.shape[0])
    weight = _view_weight(surface, head, sized)
    column, row = (np.full(surface.known.shape, -1, np.float32) for _ in range(2))
    # colours are enlarged: the places beside a seen texel count too
    taken = surface.known & (cv2.dilate(weight, np.ones((3, 3), np.uint8)) > 0)
    if not taken.any():
        return _Seen(weight, column, row, np.zeros((*weight.shape, 3), np.uint8))
    pixels = np.nan_to_num(sized.project(surface.places[taken]) - 0.5, nan=-1.0)
    column[taken], row[taken] = pixels.T
    usable = _usable(sized, mask, photo) * mark_beside_eyes(head, sized)
    weight *= cv2.remap(usable, column, row, cv2.INTER_LINEAR)
    coarse = np.asarray(cv2.remap(photo, column, row, cv2.INTER_LINEAR), np.uint8)
    return _Seen(weight, column, row, coarse)


def _view_weight(surface: _Surface, head: Head, camera: Camera) -> Float32Array:
    """Return (C, C) how well the camera sees each texel, 0 where it does not."""
    facing = _facing(surface, camera)
    chosen = surface.known & (facing > LEAST_FACING)
    behind = depth_behind(camera, head_depth(head, camera), surface.places[chosen])
    share = np.clip((facing[chosen] - LEAST_FACING) / (WHOLE_FACING - LEAST_FACING), 0, 1)
    weight = np.zeros(surface.known.shape, np.float32)
    weight[chosen] = np.where(behind < HIDDEN, share**2, 0.0)
    return weight


def _facing(surface: _Surface, camera: Camera) -> Float32Array:
    """Return (C, C) the cosine under which the camera sees each texel's surface."""
    if camera.model == "orthographic":
        return np.asarray(surface.normals @ -camera.forward.astype(np.float32))
    toward = camera.position.astype(np.float32) - surface.places
    distance = np.sqrt(np.einsum("ijk,ijk->ij", toward, toward))
    return np.asarray(np.einsum("ijk,ijk->ij", surface.normals, toward) / distance, np.float32)


def _usable(camera: Camera, mask: Mask, photo: UInt8Array) -> Float32Array:
    """Return (H, W) 1 on skin and clothes away from hair and outline, where colours are whole."""
    shape = photo.shape[1], photo.shape[0]
    usable = np.ones(photo.shape[:2], np.float32)
    for beside, margin in ((mask.labels == PERSON, MARGIN), (~mask.hair, HAIR_MARGIN)):
        free = cv2.resize(beside.astype(np.uint8), shape, interpolation=cv2.INTER_AREA)
        away = cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_3)
        usable *= np.clip(away / max(margin * camera.pixels_per_metre, 1.0) - 0.5, 0, 1)
    brightest = cv2.max(cv2.max(photo[..., 0], photo[..., 1]), photo[..., 2])
    whole = np.clip((BLOWN - brightest.astype(np.float32)) / BLOWN_FADE, 0, 1)
    return np.asarray(usable * whole, np.float32)


def _blend(
    views: Sequence[_Seen], photos: Sequence[UInt8Array], gains: Float64Array
) -> tuple[Float32Array, Float32Array]:
    """Return (S, S, 3) the blended colours and (C, C) the weight of all views together."""
    total = np.sum([view.weight for view in views], axis=0)
    best = np.maximum(np.max([view.weight for view in views], axis=0), LEAST)
    shares = [(view.weight / best) ** SHARPNESS for view in views]
    shares = [np.where(share < LEAST_SHARE, 0, share) for share in shares]
    share_sum = np.maximum(np.sum(shares, axis=0), LEAST)
    shares = [np.asarray(share / share_sum, np.float32) for share in shares]
    factors = gains.astype(np.float32)
    smooth = [smooth_seen(v.coarse, v.weight, f) for v, f in zip(views, factors, strict=True)]
    mean, taken = (np.zeros((COARSE, COARSE, 3), np.float32) for _ in range(2))
    for low, view, share in zip(smooth, views, shares, strict=True):
        part = smallest_window(view.weight)
        mean[part] += low[part] * view.weight[part][..., None]
        taken[part] += low[part] * share[part][..., None]
    mean = extend_tones(mean / np.maximum(total, LEAST)[..., None], (total > 0).astype(np.float32))
    coarse = join_gradients(mean, smooth, shares) - taken
    del smooth, mean, taken  # half as much memory as the details
    details = np.zeros((SIZE, SIZE, 3), np.float32)
    for view, photo, factor, share in zip(views, photos, factors, shares, strict=True):
        _add_photo(details, view, photo, factor, share)
    for rows in _strips():
        details[rows] += _enlarge_rows(coarse, rows)
    return details, total


def _add_photo(
    colours: Float32Array, view: _Seen, photo: UInt8Array, gain: Float32Array, share: Float32Array
) -> None:
    """Add a view's share (C, C) of its photo, times its gain, to the colours (S, S, 3)."""
    times = SIZE // COARSE
    seen = smallest_window(share)[0]
    shares = share[..., None] * gain
    for rows in _strips(times * seen.start, times * seen.stop):
        near = slice(max(rows.start // times - 1, 0), rows.stop // times + 1)
        part = smallest_window(share[near], margin=1)[1]
        if part.start == part.stop:  # hair leaves no skin in these rows
            continue
        column, row, fine = (
            _enlarge_rows(each[:, part], rows) for each in (view.column, view.row, shares)
        )
        pixels = cv2.remap(photo, column, row, cv2.INTER_LINEAR)
        first = times * part.start
        colours[rows, first : first + pixels.shape[1]] += cv2.multiply(
            pixels, fine, dtype=cv2.CV_32F
        )


def _strips(first: int = 0, last: int | None = None) -> Iterator[slice]:
    """Yield slices of up to `STRIP` rows of the map, of those from `first` to `last`."""
    last = SIZE if last is None else last
    for top in range(first, last, STRIP):
        yield slice(top, min(top + STRIP, last))


def _enlarge_rows(picture: Float32Array, rows: slice) -> Float32Array:
    """Return these rows of the map of a picture as high as a coarser map, as if all were enlarged.

    Rows begin and end where those of the picture do.
    """
    times = SIZE // len(picture)
    top, bottom = rows.start // times, rows.stop // times
    first = max(top - 1, 0)
    part = picture[first : bottom + 1]
    larger = cv2.resize(part, None, fx=times, fy=times, interpolation=cv2.INTER_LINEAR)
    return np.asarray(larger[(top - first) * times : (bottom - first) * times], np.float32)


def _shrink(picture: Float32Array, width: int) -> Float32Array:
    size = (width, len(picture) * width // picture.shape[1])
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.float32)


def _is_symmetric(surface: _Surface) -> bool:
    """Return whether the mirrored texel shows the mirrored place of the head."""
    both = surface.known & surface.known[:, ::-1]
    mirrored = surface.places[:, ::-1] * np.array([-1, 1, 1], np.float32)
    apart = np.linalg.norm(surface.places - mirrored, axis=-1)[both]
    return bool(apart.size and np.median(apart) < MIRRORED)


def _mirror(blended: Float32Array, seen: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Return colours, in their place, and weights, completed by those of the other side."""
    other = seen[:, ::-1]
    unseen = seen < LEAST_SEEN
    lacking = np.where(unseen, 1.0, _fade(unseen)) * (other >= LEAST_SEEN)
    share = lacking.astype(np.float32)
    for rows in _strips():
        mirrored = blended[rows, ::-1] - blended[rows]
        mirrored *= _enlarge_rows(share, rows)[..., None]
        blended[rows] += mirrored
    return blended, np.maximum(seen, lacking * other).astype(np.float32)


def _fade(region: BoolArray) -> Float32Array:
    """Return (C, C) 1 in a region, fading to 0 outside of it."""
    blurred = cv2.GaussianBlur(region.astype(np.float32), (0, 0), FILL_FADE)
    return np.asarray(np.clip(2 * blurred, 0, 1), np.float32)


def _own_skin(head: Head) -> UInt8Array:
    """Return (S, S, 3) the head's own albedo; grey without one."""
    if head.maps is None or head.maps.albedo is None:
        return np.full((SIZE, SIZE, 3), 128, np.uint8)
    return np.asarray(cv2.resize(head.maps.albedo.pixels, (SIZE, SIZE)), np.uint8)


def _fill(
    blended: Float32Array,
    seen: Float32Array,
    surface: _Surface,
    features: BoolArray,
    own: UInt8Array,
) -> UInt8Array:
    """Return (S, S, 3) the blended skin, and the head's own in the seen skin's tone elsewhere."""
    taken = (seen >= LEAST_SEEN) & surface.known
    if not taken.any():
        return own
    colours = _shrink(blended, COARSE)
    plain = cv2.resize(own, (COARSE, COARSE), interpolation=cv2.INTER_AREA).astype(np.float32)
    ratio = np.log(np.maximum(colours, 0) + FLOOR) - np.log(plain + FLOOR)
    sure = seen * like_skin(colours, seen, features) ** SURE_SKIN + LEAST
    tone = np.exp(np.average(ratio[taken], axis=0, weights=sure[taken])).astype(np.float32)
    share = 1 - _fade(~taken)
    filled = np.empty_like(own)
    for rows in _strips():
        skin = tone * (own[rows] + np.float32(FLOOR)) - np.float32(FLOOR)
        skin += (blended[rows] - skin) * _enlarge_rows(share, rows)[..., None]
        filled[rows] = np.rint(skin).clip(0, 255)
    return filled
