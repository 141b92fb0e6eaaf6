"""Whether dyed hair is found in photos, and nowhere else.

Photos of captures are recoloured by the true strands: tips from 0.6 of their length on pink, or
strands whose roots lie from 2 to 6 cm left of the middle blue. The table says, for each capture and
as photographed too, whether hair is taken for dyed, and how far the hues of the points that photos
show are off (mean, logarithms of red, green and blue less their luma) with and without.

    python benchmarks/dyed_hair.py CAPTURES --results RESULTS

RESULTS holds a folder of `hairkit reconstruct` for each capture, by the capture's name. Without
them hues are looked for along true strands by true cameras.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from captures_argument import NO_CAPTURES, add_captures
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, UInt8Array
from hairkit.cameras.depth_raster import depth_behind, head_depth, point_depth
from hairkit.colour import linear_from_srgb, srgb_from_linear
from hairkit.evaluation.prediction import read_prediction
from hairkit.evaluation.truth import Truth, read_truth
from hairkit.grooming.photo_colours import measure_colour, with_hues
from hairkit.grooming.prepare_export import point_colours
from hairkit.head_model.scalp import bind
from hairkit.types.camera import Camera
from hairkit.types.capture import View
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask

PINK, BLUE = np.log([2.5, 0.6, 1.4]), np.log([0.5, 0.9, 3.0])
STEP, RADIUS, BEHIND = 0.003, 0.004, 0.006
HEIGHT, BLUR = 540, 1.2
GUIDES = 600
"""Of the true strands at most, where there is no result."""
LEAST = 1e-6
LUMA = np.array([0.2126, 0.7152, 0.0722])

Dye = Callable[[Float64Array, Float64Array], Float64Array]


def pink_tips(share: Float64Array, roots: Float64Array) -> Float64Array:
    """Return the logarithms (P, 3) of a factor for shares of the length (P,)."""
    return np.clip((share - 0.6) / 0.1, 0, 1)[:, None] * PINK


def blue_streak(share: Float64Array, roots: Float64Array) -> Float64Array:
    """Return the same for roots (P, 3), metres."""
    return ((roots[:, 0] > 0.02) & (roots[:, 0] < 0.06))[:, None] * BLUE


DYES: dict[str, Dye | None] = {"as it is": None, "pink tips": pink_tips, "blue streak": blue_streak}


def main() -> None:
    """Print a line for each capture and dye."""
    parser = argparse.ArgumentParser(prog="dyed_hair.py", description=__doc__)
    add_captures(parser)
    parser.add_argument("--results", type=Path, help="folder of results")
    args = parser.parse_args()
    if args.captures is None:
        print(NO_CAPTURES)
        return
    print("| capture | hair | found | off | off with one ramp |\n|---|---|---|---|---|")
    for capture in sorted(path.parent for path in args.captures.glob("*/truth")):
        if args.results is not None and not (args.results / capture.name).is_dir():
            continue
        for name, dye in DYES.items():
            found, off, without = judge(args.results, capture, dye)
            print(f"| {capture.name} | {name} | {found} | {off:.2f} | {without:.2f} |")


def judge(results: Path | None, capture: Path, dye: Dye | None) -> tuple[bool, float, float]:
    """Return whether dye was found, and how far hues are off with and without what was found."""
    truth = read_truth(capture / "truth")
    cameras, groom = truth.cameras, _true_groom(truth)
    if results is not None:
        shown = read_prediction(results / capture.name).in_order_of(truth)
        cameras, groom = shown.cameras, shown.groom
    masks = [Mask(truth.hair_mask(k), True) for k in range(len(cameras))]
    photos = truth.photos() or []
    if dye is not None:
        photos = [
            recolour(truth, *each, dye) for each in zip(truth.cameras, photos, masks, strict=True)
        ]
    views = [View(str(k), 0.0, photo) for k, photo in enumerate(photos)]
    groom = replace(groom, material=measure_colour(views, masks))
    groom = with_hues(groom, views, masks, cameras)
    colours = groom.strands.colours
    plain = point_colours(replace(groom, strands=replace(groom.strands, colours=None)))
    share, roots, places = _true(truth)
    seen = _seen(groom, cameras)
    near = cKDTree(places).query(groom.strands.points[seen])[1]
    change = (dye or blue_streak)(share, roots)[near] * (dye is not None)
    had = plain if colours is None else colours
    return colours is not None, off(had[seen], change), off(plain[seen], change)


def _true_groom(truth: Truth) -> Groom:
    """Return the true head with some true strands."""
    every = -(-len(truth.strands) // GUIDES)
    strands = truth.strands.select(np.arange(0, len(truth.strands), every))
    return Groom(strands, truth.head, *bind(strands.roots, truth.head))


def _seen(groom: Groom, cameras: Sequence[Camera]) -> BoolArray:
    """Return which points (P,) of the groom a camera sees."""
    points, found = groom.strands.points, np.zeros(len(groom.strands.points), bool)
    fine = groom.strands.resampled_by_length(STEP).points
    for camera in cameras:
        small = camera.resized(round(HEIGHT * camera.width / camera.height), HEIGHT)
        front = np.minimum(point_depth(small, fine, RADIUS), head_depth(groom.head, small) + STEP)
        found |= depth_behind(small, front.astype(np.float32), points) < BEHIND
    return found


def off(colours: Float32Array, change: Float64Array) -> float:
    """Return the mean distance of hues from the true ones, up to one shift of all."""
    logs = np.log(colours + LEAST)
    hue = (logs - logs @ LUMA[:, None]) - (change - change @ LUMA[:, None])
    return float(np.abs(hue - np.median(hue, axis=0)).max(axis=1).mean())


def recolour(truth: Truth, camera: Camera, photo: UInt8Array, mask: Mask, dye: Dye) -> UInt8Array:
    """Return a photo whose hair is multiplied by the dye of the true strand that is seen there."""
    small = camera.resized(round(HEIGHT * camera.width / camera.height), HEIGHT)
    share, roots, places = _true(truth)
    front = np.minimum(point_depth(small, places, RADIUS), head_depth(truth.head, small))
    seen = depth_behind(small, front.astype(np.float32), places) < BEHIND
    column, row = np.floor(small.project(places[seen])).astype(int).T
    total = np.zeros((small.height, small.width, 4))
    np.add.at(total, (row, column), np.c_[dye(share, roots)[seen], np.ones(len(row))])
    total = cv2.GaussianBlur(total, (0, 0), BLUR)
    change = total[..., :3] / np.maximum(total[..., 3:], 1e-3)
    whole = cv2.resize(change, photo.shape[1::-1]) * (mask.labels == mask.labels.max())[..., None]
    linear = linear_from_srgb(photo / 255) * np.exp(whole)
    return np.rint(255 * srgb_from_linear(np.clip(linear, 0, 1))).astype(np.uint8)


def _true(truth: Truth) -> tuple[Float64Array, Float64Array, np.ndarray]:
    """Return shares of the length, roots and places of points of the true strands."""
    fine = truth.strands.resampled_by_length(STEP)
    share = fine.arc_lengths() / np.repeat(fine.lengths(), fine.counts)
    return share, np.repeat(fine.roots, fine.counts, axis=0), fine.points


if __name__ == "__main__":
    main()
