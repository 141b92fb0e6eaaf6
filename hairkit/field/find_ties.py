"""Ties, found where the hull narrows behind the scalp and where the hair of all views converges.

Two signs, measured apart. The hull: hair that is farther than `OFF_SCALP` from the scalp, along
ways through the hair, hangs together with the rest through a neck of a few square centimetres;
loose hair joins the head along its whole hairline. The photos: on the scalp the 2D orientations
of all views point at one place. Loose hair does that too, at its whorl on the crown, so both
places must agree. The bundle behind the neck becomes a tube of elliptic sections.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.field.scalp_sight import ScalpSight, find_convergence, scalp_places, see_scalp
from hairkit.field.wisps import find_wisps
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.tie import LooseHair, Tail, Tie, TiedHair
from hairkit.types.volume import Hull, ScalpDistance

OFF_SCALP = 0.025
"""Distance in metres from the scalp behind which a neck is looked for; at 0.02 the ghosts of a
hull from unsure masks are twice as wide, at 0.04 buns are lost."""
LEAST_VOLUME = 4e-5
"""Cubic metres of a bundle: a ponytail has 3e-4, stray wisps of loose hair up to 3e-5."""
WIDEST_NECK = 6e-3
"""Square metres of the neck from which nothing is tied: 2.3e-3 at a ponytail, 2.4e-2 and more at
loose hair."""
LEAST_CONVERGENCE, FULL_CONVERGENCE = 0.5, 0.9
"""Mean cosine of twice the angle between the hair and the way to the tie, from which it is tied
at all and for sure: 0.94 at a ponytail, 0 in the mean of all places."""
FARTHEST_APART = 0.05
"""Metres between the neck of the hull and the place where directions converge, at most."""
LEAST_FRINGE, SHORTEST_FRINGE = 4e-6, 0.045
"""Cubic metres of loose hair, and its way from the scalp in metres, that make a fringe: edges of
masks leave parts of up to 1.8e-6 and 0.034 below the hairline."""
TIE_SEARCH = 0.045
"""Metres about the neck in which cells nearer to the scalp belong to the bundle, not to the ghosts
beside it."""
STEP = 0.005
"""Metres between the sections of a bundle."""
DEEPEST = 4
"""Power of a cell's depth in the bundle by which it pulls the centre of its section: ghosts of the
hull are thin."""
FLATTEST = 1.5
"""Ratio of the axes of a section, at most: views that see a bundle from one side leave corners."""
REACH_OF_SECTION = 1.6
"""Cells within this many inscribed radii of the centre belong to a section."""
SMOOTH_SECTIONS = 2.0
"""Standard deviation of the smoothing along a bundle, in sections."""
RIM = 0.0025
"""Metres by which the hull's bundle is thicker than the hair: half a cell and the masks' slack."""
PINHOLE_CELLS = 3
"""Half width in cells of the holes that are closed in a bundle before its depth is measured."""
THINNEST = 0.003
"""Least radius of a bundle, metres."""
BUN = 2.5
"""Length of a bundle over its width below which it is a bun."""
BRAIDED = np.radians(25.0)
"""Mean angle between the hair of a tail and its spine from which it is a braid: 11 and 16 degrees
on ponytails, 30 to 45 in a braid of three."""
ACROSS = np.array([(u, v) for u in (-0.6, 0.0, 0.6) for v in (-0.6, 0.0, 0.6)])
"""Places in a section, in its half diameters, at which the pictures are read."""
PROBE = 0.002
"""Metres of the step along the spine whose picture is its angle."""


def measure_ties(
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    cameras: Sequence[Camera],
    head: Head,
    hull: Hull,
    scalp_distance: ScalpDistance,
) -> TiedHair:
    """Return the bundles that leave the scalp through a neck at which all directions point."""
    bundles = find_bundles(hull, scalp_distance)
    if not bundles:
        return TiedHair()
    sight = see_scalp(masks, orientations, cameras, head)
    places, _ = scalp_places(head)
    bases = places[cKDTree(places).query([bundle.centre for bundle in bundles])[1]]
    nearest = cKDTree(bases).query(sight.places)[1]
    tails, tied = [], []
    for number, bundle in enumerate(bundles):
        own = ScalpSight(*(column[nearest == number] for column in sight))
        where, score = find_convergence(own, head)
        apart = float(np.linalg.norm(where - bases[number]))
        sureness = min(
            1 - bundle.neck / WIDEST_NECK,
            (score - LEAST_CONVERGENCE) / (FULL_CONVERGENCE - LEAST_CONVERGENCE),
            1 - apart / FARTHEST_APART,
        )
        tail = _tail_of(bundle, hull, scalp_distance, min(sureness, 1.0)) if sureness > 0 else None
        if tail is not None:
            tails.append(_with_braid(tail, masks, orientations, cameras, head))
            tied.append(bundle)
    if not tails:
        return TiedHair()
    fringe = find_fringe(head, hull, scalp_distance, tied)
    return TiedHair(tuple(tails), fringe + find_wisps(masks, cameras, head, hull))


def _with_braid(
    tail: Tail,
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    cameras: Sequence[Camera],
    head: Head,
) -> Tail:
    """Return the tail, named a braid where its hair crosses its spine in the pictures."""
    spine, spokes = tail.spine.astype(np.float64), tail.spokes.astype(np.float64)
    crossing = measure_crossing(spine, spokes, masks, orientations, cameras, head)
    if tail.tie.kind != "tail" or crossing < BRAIDED:
        return tail
    return replace(tail, tie=replace(tail.tie, kind="braid"), crossing=crossing)


def find_fringe(
    head: Head, hull: Hull, scalp_distance: ScalpDistance, bundles: Sequence[Bundle]
) -> tuple[LooseHair, ...]:
    """Return the dense hair that hangs over bare skin, pinholes in it closed."""
    cells = hull.dense & (scalp_distance.values > 0)
    for bundle in bundles:
        cells &= ~bundle.cells
    nearest = cKDTree(head.vertices).query(hull.grid.centres_of(cells))[1]
    hanging = np.zeros(hull.grid.shape, bool)
    hanging[cells] = head.scalp[nearest] <= 0.5
    hanging |= _without_pinholes(hanging) & (hull.head_distance > 0)
    closed = replace(hull, dense=hull.dense | hanging, loose=hull.loose | hanging)
    way = measure_scalp_distance(head, closed).values
    parts, count = ndimage.label(hanging, np.ones((3, 3, 3)))
    found = []
    for part in (parts == number for number in range(1, count + 1)):
        volume = int(part.sum()) * hull.grid.spacing**3
        if volume >= LEAST_FRINGE and way[part].max() >= SHORTEST_FRINGE:
            rows = np.column_stack([hull.grid.centres_of(part), way[part]])
            share = (part & hull.dense).sum() / hull.dense.sum()
            found.append(LooseHair(rows.astype(np.float32), float(share)))
    return tuple(found)


class Bundle(NamedTuple):
    """Hair behind a neck of the hull."""

    cells: BoolArray
    """(X, Y, Z) dense cells farther than `OFF_SCALP` from the scalp."""
    centre: Float64Array
    """(3,) of the neck, metres."""
    neck: float
    """Area of the neck, square metres."""


def find_bundles(hull: Hull, scalp_distance: ScalpDistance) -> tuple[Bundle, ...]:
    """Return the parts of the hair off the scalp that have a narrow neck, the largest first."""
    spacing = hull.grid.spacing
    parts, _ = ndimage.label(hull.dense & (scalp_distance.values >= OFF_SCALP))
    sizes = np.bincount(parts.ravel())
    sizes[0] = 0
    found = []
    for part in np.argsort(-sizes):
        if sizes[part] * spacing**3 < LEAST_VOLUME:
            break
        cells = parts == part
        slab = cells & (scalp_distance.values < OFF_SCALP + 2 * spacing)
        area = float(slab.sum()) * spacing**2 / 2
        if slab.any() and area < WIDEST_NECK:
            centre = hull.grid.centres_of(slab).mean(axis=0, dtype=np.float64)
            found.append(Bundle(cells, centre, area))
    return tuple(found)


def _tail_of(
    bundle: Bundle, hull: Hull, scalp_distance: ScalpDistance, sureness: float
) -> Tail | None:
    """Return the bundle as a tube from its thinnest place near the scalp to its end."""
    cells = _with_root(bundle, hull, scalp_distance)
    cells = _without_pinholes(cells) & (scalp_distance.values > 0)
    points = hull.grid.centres_of(cells).astype(np.float64)
    depth = ndimage.distance_transform_edt(cells)[cells] * hull.grid.spacing
    along = scalp_distance.values[cells]
    sections = _cut_sections(points, depth, along)
    if len(sections.centres) < 4:
        return None
    spine, spokes = _smooth_tube(sections)
    area = np.linalg.norm(np.cross(spokes[:, 0], spokes[:, 1]), axis=1)
    widest = int(np.argmax(area))
    tie = int(np.argmin(area[: widest + 1]))
    spine, spokes, area = spine[tie:], spokes[tie:], area[tie:]
    if len(spine) < 2:
        return None
    share = np.ones(len(spine))
    share[widest - tie :] = np.minimum.accumulate(area[widest - tie :] / area.max())
    radius = float(np.sqrt(area[0]))
    length = STEP * (len(spine) - 1)
    kind = "tail" if length > BUN * 2 * float(np.sqrt(area.max())) else "bun"
    axis = spine[1] - spine[0]
    axis /= np.linalg.norm(axis)
    ring = Tie(spine[0].astype(np.float32), axis.astype(np.float32), radius, kind)
    columns = [value.astype(np.float32) for value in (spine, spokes, share)]
    return Tail(ring, sureness, columns[0], columns[1], columns[2])


def _with_root(bundle: Bundle, hull: Hull, scalp_distance: ScalpDistance) -> BoolArray:
    """Return the bundle with the cells between it and the scalp, about the neck."""
    centres = hull.grid.centres_of(hull.dense)
    near = np.zeros(hull.grid.shape, bool)
    near[hull.dense] = np.linalg.norm(centres - bundle.centre, axis=1) < TIE_SEARCH
    return bundle.cells | (near & (scalp_distance.values > 0))


def _without_pinholes(cells: BoolArray) -> BoolArray:
    """Return the cells with the holes that gaps between strands drill through a bundle closed."""
    room = np.pad(cells, PINHOLE_CELLS)
    closed = ndimage.binary_closing(room, iterations=PINHOLE_CELLS)
    inner = slice(PINHOLE_CELLS, -PINHOLE_CELLS)
    return np.asarray(closed[inner, inner, inner], bool)


class Sections(NamedTuple):
    """Cross-sections of a bundle, in the order of their way from the scalp."""

    centres: Float64Array
    """(M, 3) metres."""
    spreads: Float64Array
    """(M, 3, 3) squared half axes of the section, as a tensor."""
    inscribed: Float64Array
    """(M,) radius of the largest ball, metres."""


def _cut_sections(points: Float64Array, depth: Float64Array, along: Float32Array) -> Sections:
    """Return sections of cells (N, 3) of depths (N,), by their ways (N,) from the scalp."""
    number = (along / STEP).astype(np.int64)
    centres, spreads, inscribed = [], [], []
    for section in np.unique(number):
        own = number == section
        place, deep = points[own], depth[own]
        weight = deep**DEEPEST
        centre = (weight[:, None] * place).sum(axis=0) / weight.sum()
        radius = max(float(deep.max()) - RIM, THINNEST)
        off = place - centre
        away = np.linalg.norm(off, axis=1)
        off = off[away < max(REACH_OF_SECTION * max(radius, STEP), away.min() + STEP)]
        centres.append(centre)
        spreads.append(4 * off.T @ off / len(off))
        inscribed.append(radius)
    return Sections(np.array(centres), np.array(spreads), np.array(inscribed))


def _smooth_tube(sections: Sections) -> tuple[Float64Array, Float64Array]:
    """Return centres (M, 3) evenly `STEP` apart and spokes (M, 2, 3) of the sections."""
    smooth = [
        ndimage.gaussian_filter1d(v, SMOOTH_SECTIONS, axis=0, mode="nearest") for v in sections
    ]
    arc = np.append(0, np.cumsum(np.linalg.norm(np.diff(smooth[0], axis=0), axis=1)))
    at = np.arange(0, arc[-1], STEP)
    centres, spreads, inscribed = (
        np.stack(
            [np.interp(at, arc, column) for column in value.reshape(len(arc), -1).T], axis=1
        ).reshape(len(at), *value.shape[1:])
        for value in smooth
    )
    tangent = np.gradient(centres, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    first, second = transport_frames(tangent)
    spokes = np.empty((len(at), 2, 3))
    for k in range(len(at)):
        frame = np.stack([first[k], second[k]])
        squares, axes = np.linalg.eigh(frame @ spreads[k] @ frame.T)
        half = np.clip(np.sqrt(np.maximum(squares, 0)), inscribed[k], FLATTEST * inscribed[k])
        spokes[k] = (axes * half) @ axes.T @ frame
    return centres, spokes


def transport_frames(tangent: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return two unit normals (M, 3) of unit tangents (M, 3) that do not twist (Bishop 1975)."""
    normal = np.empty_like(tangent)
    side = np.eye(3)[np.argmin(np.abs(tangent[0]))]
    for k, along in enumerate(tangent):
        side = side - (side @ along) * along
        side = side / max(float(np.linalg.norm(side)), 1e-9)
        normal[k] = side
    return normal, np.cross(tangent, normal)


def measure_crossing(
    spine: Float64Array,
    spokes: Float64Array,
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    cameras: Sequence[Camera],
    head: Head,
) -> float:
    """Return the mean angle between the hair of a tail and its spine, radians, 0 to pi / 2.

    Strands of a plain tail run along it, those of a braid cross it to both sides at one angle.
    The tail is given by its spine (M, 3) and spokes (M, 2, 3). The angle is that whose double has
    the measured mean cosine, weighted by the confidence of the maps; 0 where no view shows hair.
    """
    tangent = np.gradient(spine, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    places = (spine[:, None] + np.einsum("ps,msk->mpk", ACROSS, spokes)).reshape(-1, 3)
    along = np.repeat(tangent, len(ACROSS), axis=0)
    total, weights = 0.0, 0.0
    for mask, found, camera in zip(masks, orientations, cameras, strict=True):
        column, row = np.floor(camera.project(places)).astype(np.int64).T
        height, width = mask.labels.shape
        inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
        pixel = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
        seen = inside & mask.hair[pixel]
        seen &= camera.depth(places) < head_depth(head, camera)[pixel]
        step = camera.project(places + PROBE * along) - camera.project(places)
        off = found.angle[pixel].astype(np.float64) - np.arctan2(step[:, 1], step[:, 0])
        weight = np.where(seen, found.confidence[pixel], 0.0)
        total += float((weight * np.cos(2 * off)).sum())
        weights += float(weight.sum())
    return 0.5 * float(np.arccos(np.clip(total / weights, -1, 1))) if weights else 0.0
