"""The head warped to the photos by a 3D thin-plate spline with kernel |r| (Bookstein 1989).

Landmarks, intersected from the refined cameras, pull the landmarks of the head; points on the
cranium, where there are no landmarks, are held softly. Then points that project outside a
silhouette are pushed inside, those of the scalp a little deeper, since hair lies outside the head.
Where no hair covers the outline (bald crowns, shaved sides), the rim of the cranium is brought
onto it; other outlines of skin do not bend the head: with estimated cameras that made faces worse
(1.9 mm instead of 0.8). Each correction is a smooth spline again, so the scalp stays smooth.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import map_coordinates

from hairkit import Camera, Capture, Head, Mask, Scene, hookimpl
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.cameras.landmark_equations import STEEP, steepness
from hairkit.cameras.outlines import Outlines
from hairkit.cameras.similarity import triangulate
from hairkit.head_model.cranium import LEAST_SHARE, RIM, Cranium
from hairkit.head_model.spread_vertices import spread_vertices
from hairkit.head_model.thin_plate_spline import ThinPlateSpline
from hairkit.options import option
from hairkit.types.head import BROWS, JAW_LANDMARKS, LANDMARKS

SMOOTHING, ANCHOR_SMOOTHING = 0.02, 1.0
"""Metres: how far landmarks may be missed for a smoother bend, and the cranium's points, which hold
still."""
ANCHORS, CONTROLS = 60, 240
"""Points that hold the cranium, and points that silhouettes push."""
JAW_LOOSENESS = 3.0
"""Factor of the smoothing at the jaw's landmarks, which detectors place less surely."""
OUTLINE_POINTS = 20
"""Points a silhouette that the outlines keep; only their distance fields are read here."""
LEAST_SLOPE = 0.3
"""Metres outwards in a picture for a metre along a normal: normals that run along the outline do
not say how far to push."""
SLOPE_STEP = 0.002
"""Metres along a normal over which that slope is measured."""
LARGEST_PUSH = 0.008
"""Metres: what sticks out farther is a wrong camera or mask rather than a big head."""
SKULL = 0.09
"""Radius of the cranium, metres: its rim stands out farther than points near the rim."""
FAR = 100.0
"""Metres: from there views are orthographic."""
LARGEST_PULL, ON_OUTLINE = 0.03, 0.002
"""Metres: a bare outline farther off is not that of the cranium; and how near to it counts as on
it."""


@dataclass(frozen=True)
class Options:
    """Settings of the bend."""

    margin: float = option(
        0.002, low=0, high=0.02, doc="How far the scalp stays inside silhouettes.", unit="m"
    )
    rounds: int = option(
        2, low=0, high=10, doc="Rounds of silhouette pushes; 0 for landmarks only."
    )


@hookimpl
def fit_head(capture: Capture, masks: tuple[Mask, ...], scene: Scene, options: Options) -> Scene:
    """Bend the scene's head to the landmarks and into the silhouettes."""
    head = _bend_to_landmarks(capture, scene, options)
    if options.rounds and all(mask.person_known for mask in masks):
        outlines = Outlines.of(masks, count=OUTLINE_POINTS)
        above = head.vertices[:, 1] > head.joints[1, 1]  # the neck
        controls = spread_vertices(head, np.flatnonzero(above), CONTROLS)
        cranium = Cranium.of(head, masks, outlines.scale)
        for _ in range(options.rounds):
            head = _bend_to_outlines(head, scene.cameras, outlines, controls, cranium, options)
    return replace(scene, head=head)


def _bend_to_landmarks(capture: Capture, scene: Scene, options: Options) -> Head:
    head = scene.head
    seen = [view.landmarks is not None for view in capture.views]
    if not any(seen) or head.landmark_vertices is None:
        return head
    pixels = np.stack([view.landmarks for view in capture.views if view.landmarks is not None])
    cameras = [camera for camera, has in zip(scene.cameras, seen, strict=True) if has]
    less = (1 + STEEP * steepness(capture.views)[seen]) ** -2.0
    source = head.vertices[head.landmark_vertices].astype(np.float64)
    points = triangulate(cameras, pixels, np.repeat(less[:, None], LANDMARKS, axis=1), source)
    # scalp behind the ears' plane, of which the landmarks know nothing
    behind = head.vertices[:, 2] < np.median(head.vertices[:, 2])
    held = spread_vertices(head, np.flatnonzero((head.scalp > 0.5) & behind), ANCHORS)
    anchors = head.vertices[held].astype(np.float64)
    loose = np.where(np.arange(LANDMARKS) < JAW_LANDMARKS, JAW_LOOSENESS, 1.0) * SMOOTHING
    smoothing = np.concatenate([loose, np.full(len(anchors), ANCHOR_SMOOTHING)])
    places = np.concatenate([source, anchors])
    moves = np.concatenate([points - source, np.zeros_like(anchors)])
    return _warp(head, places, moves, smoothing)


def _bend_to_outlines(
    head: Head,
    cameras: tuple[Camera, ...],
    outlines: Outlines,
    controls: Int64Array,
    cranium: Cranium,
    options: Options,
) -> Head:
    """Push controls that stick out of a silhouette inwards, along their normals.

    Those of the scalp on the rim, where the outline is bare, go onto it from either side.
    """
    places = head.vertices[controls].astype(np.float64)
    normals = head.normals()[controls].astype(np.float64)
    scalp = head.scalp[controls] > 0.5
    margin = np.where(scalp, options.margin, 0.0)
    rims = _rims(cranium.moved(places, normals), cameras) * (scalp & _above_the_ears(head, places))
    push, pull, total = np.zeros((3, len(places)))
    for view, camera in enumerate(cameras):
        inside, slope = _inside_by(outlines.fields[view], outlines.scale, camera, places, normals)
        known = slope < -LEAST_SLOPE
        steep = np.maximum(-slope, LEAST_SLOPE)
        wanted = np.where(known, (margin - inside) / steep, 0.0)
        push = np.maximum(push, np.minimum(wanted, LARGEST_PUSH))
        bulge = -(RIM**2) * SKULL * np.log(np.maximum(rims[view], LEAST_SHARE))
        way = np.clip((inside - bulge) / steep, -LARGEST_PULL, LARGEST_PULL)
        there = places + way[:, None] * normals
        left, _ = _inside_by(outlines.fields[view], outlines.scale, camera, there, normals)
        bare_there = cranium.bare(np.full(len(places), view), camera.project(there))
        share = np.where(np.abs(left - bulge) < ON_OUTLINE, rims[view] * bare_there, 0.0)
        pull, total = pull + share * way, total + share
    bare = total > LEAST_SHARE
    smoothing = np.where(bare | (push > 0), SMOOTHING, ANCHOR_SMOOTHING)
    move = np.where(bare, pull / np.maximum(total, LEAST_SHARE), -push)
    return _warp(head, places, move[:, None] * normals, smoothing)


def _above_the_ears(head: Head, places: Float64Array) -> BoolArray:
    """Return which places (K, 3) lie above the brows, where no ear covers the cranium's rim."""
    if head.landmark_vertices is None:
        return np.zeros(len(places), np.bool_)
    brows = head.vertices[head.landmark_vertices[BROWS], 1].max()
    return np.asarray(places[:, 1] > brows, np.bool_)


def _rims(cranium: Cranium, cameras: tuple[Camera, ...]) -> Float64Array:
    """Return how much each point of a cranium is on the rim of each view (V, K), from 0 to 1."""
    rotation = np.stack([camera.rotation for camera in cameras])
    translation = np.stack([camera.translation for camera in cameras])
    flat = [camera.model == "orthographic" for camera in cameras]
    translation[flat, 2] += FAR
    view, point, share = cranium.rims((rotation, translation))
    result = np.zeros((len(cameras), len(cranium.points)))
    result[view, point] = share
    return result


def _inside_by(
    field: Float32Array, scale: float, camera: Camera, places: Float64Array, normals: Float64Array
) -> tuple[Float64Array, Float64Array]:
    """Return how far places lie inside the silhouette (metres, infinity off the picture), and its
    slope along normals."""
    metres = camera.focal if camera.model == "orthographic" else camera.focal / camera.depth(places)
    values = []
    for moved in (places, places + SLOPE_STEP * normals):
        place = np.nan_to_num(camera.project(moved)[:, ::-1] * scale - 0.5, nan=-1).T
        values.append(map_coordinates(field, place, float, order=1, cval=np.inf) / metres)
    known = np.isfinite(values[0]) & np.isfinite(values[1])
    slope = np.subtract(values[1], values[0], out=np.zeros(len(places)), where=known) / SLOPE_STEP
    return values[0], slope


def _warp(head: Head, places: Float64Array, moves: Float64Array, smoothing: Float64Array) -> Head:
    """Return the head, its joints and capsules carried along by the spline through `moves` at
    `places`."""
    spline = ThinPlateSpline(places, moves, smoothing)

    def carry(points: Float32Array) -> Float32Array:
        return (points + spline(points.astype(np.float64))).astype(np.float32)

    return head.carried(carry)
