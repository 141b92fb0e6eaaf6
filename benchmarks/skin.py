"""How like the photos the head's skin is, seen by the cameras that took them.

python benchmarks/skin.py captures/

Fits the head of every capture and takes its skin from the photos, then draws the albedo as it is,
without light, at the input cameras. Compared are pixels above the neck where the head is seen and
the mask shows neither hair nor background, 4 mm from both, without the eyes. "Evened" gives each
view the gain a channel that suits it best, as exposures differ; "relit" the light from all sides
that does, a polynomial of second degree in the normal for each channel. "Uneven" are the standard
deviations of brightness (green) and of red over green on the whole head beside eyes, nose and
mouth, which light, shadow and painted strands raise. Prints a Markdown table: PSNR in decibels,
unevenness in per cent, and seconds of the processor for the skin.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from captures_argument import NO_CAPTURES, add_captures
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float64Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.head_model.delighting import GAMMA, harmonics
from hairkit.head_model.exposures import FLOOR
from hairkit.head_model.eye_colours import mark_beside_eyes
from hairkit.head_model.photo_skin import FEATURE, photograph_skin
from hairkit.head_model.scalp import bind
from hairkit.hookspecs import hookimpl
from hairkit.io.capture_reader import read_capture
from hairkit.manager import Manager
from hairkit.pipeline.head_alone import photograph_head
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.head import JAW_LANDMARKS, Head
from hairkit.types.mask import PERSON, Mask
from hairkit.types.scene import Scene
from hairkit.types.skin import Texture

MARGIN = 0.004
"""Metres from hair and background within which pixels are not compared."""
HEIGHT = 360
"""Rows of the pictures that are compared."""
BLUR = 0.002
"""Metres over which the map is smoothed before its unevenness is measured: grain does not count."""
LEAST_PIXELS = 200
"""Views that show fewer pixels of skin are left out."""


class Listener:
    """Keeps what the stages made."""

    def __init__(self) -> None:
        self.made: dict[str, Any] = {}

    @hookimpl
    def stage_finished(self, stage: str, result: Any) -> None:
        """Keep the last result."""
        self.made[stage] = result


def main() -> int:
    """Run every capture and print its row."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    captures = parser.parse_args().captures
    if captures is None:
        print(NO_CAPTURES)
        return 0
    print("| capture | PSNR | evened | relit | worst relit | uneven: brightness | red | skin, s |")
    print("|---|---|---|---|---|---|---|---|")
    rows = []
    for folder in sorted(path.parent for path in captures.glob("*/photos")):
        rows.append(figures(folder))
        print(row(folder.name, rows[-1]), flush=True)
    print(row("mean", np.mean(rows, axis=0)))
    return 0


def row(name: str, values: Float64Array) -> str:
    """Return a row of the table."""
    return f"| {name} | " + " | ".join(f"{value:.1f}" for value in values) + " |"


def figures(folder: Path) -> Float64Array:
    """Return mean PSNR as it is, evened and relit, the worst view's, unevenness, and seconds."""
    capture, scene, masks = fit(folder)
    photograph_skin(capture, scene, masks)  # compiles its kernels
    began = time.process_time()
    maps = photograph_skin(capture, scene, masks)
    seconds = time.process_time() - began
    assert maps.albedo is not None
    scores = []
    for view, camera, mask in zip(capture.views, scene.cameras, masks, strict=True):
        small = camera.resized(round(HEIGHT * camera.width / camera.height), HEIGHT)
        size = small.width, small.height
        photo = cv2.resize(view.image, size, interpolation=cv2.INTER_AREA).astype(np.float64)
        skin = _skin(scene.head, small, mask)
        if skin.sum() < LEAST_PIXELS:
            continue
        drawn, normals = _draw(scene.head, small, skin, maps.albedo.sample)
        wanted = photo[skin]
        gain = (drawn * wanted).sum(axis=0) / (drawn**2).sum(axis=0)
        lit = _relight(drawn, normals, wanted)
        scores.append([_psnr(drawn, wanted), _psnr(drawn * gain, wanted), _psnr(lit, wanted)])
    mean = np.mean(scores, axis=0)
    return np.array([*mean, np.min(scores, axis=0)[2], *uneven(scene.head, maps.albedo), seconds])


def uneven(head: Head, albedo: Texture) -> Float64Array:
    """Return the standard deviations (2,), per cent, of green and of red over green."""
    assert head.landmark_vertices is not None
    inner = head.vertices[head.landmark_vertices[JAW_LANDMARKS:]]
    skin = cKDTree(inner).query(head.vertices)[0] > FEATURE + BLUR
    skin &= head.vertices[:, 1] > head.joints[0, 1] + BLUR
    skin[head.eye_vertices] = False
    blurred = cv2.GaussianBlur(albedo.pixels, (0, 0), 1000 * BLUR * len(albedo.pixels) / 512)
    smooth = Texture.encode(np.asarray(blurred, np.uint8))
    red, green = np.log(255 * smooth.sample(head.uv[skin])[:, :2] + FLOOR).T
    return np.asarray(100 * np.array([green.std(), (red - green).std()]), np.float64)


def fit(folder: Path) -> tuple[Capture, Scene, tuple[Mask, ...]]:
    """Return the views in the turn's order, cameras with the fitted head, and masks."""
    manager, listener = Manager.loaded([]), Listener()
    manager.register(listener, "skin_benchmark")
    capture = read_capture(folder)
    scene = photograph_head(capture, manager=manager)
    made = listener.made
    capture = capture.arranged(made["find_turn"])
    masks = made["segment"]
    if "refine_masks" in made:
        refined = made["refine_masks"].views
        pairs = zip(capture.views, masks, refined, strict=True)
        masks = tuple(given if view.mask_path else mended for view, given, mended in pairs)
    return capture, scene, masks


def _skin(head: Head, camera: Camera, mask: Mask) -> BoolArray:
    """Return (H, W) pixels that are compared."""
    size = camera.width, camera.height
    person = cv2.resize(
        (mask.labels == PERSON).astype(np.uint8), size, interpolation=cv2.INTER_AREA
    )
    metre = camera.focal / float(camera.depth(np.zeros(3)))
    if camera.model == "orthographic":
        metre = camera.focal
    away = cv2.distanceTransform(person, cv2.DIST_L2, cv2.DIST_MASK_3)
    depth = head_depth(head, camera)
    seen = np.isfinite(depth) & (away > MARGIN * metre) & (mark_beside_eyes(head, camera) > 0)
    row, column = np.nonzero(seen)
    places = camera.unproject(np.column_stack([column, row]) + 0.5, depth[seen])
    seen[row, column] = places[:, 1] > head.joints[1, 1]
    return np.asarray(seen)


def _draw(
    head: Head, camera: Camera, skin: BoolArray, sample: Any
) -> tuple[Float64Array, Float64Array]:
    """Return (N, 3) the albedo at pixels, 0 to 255, and (N, 3) normals."""
    row, column = np.nonzero(skin)
    depth = head_depth(head, camera)[skin]
    places = camera.unproject(np.column_stack([column, row]) + 0.5, depth)
    face, weights = bind(places, head)
    uv = (head.uv[head.faces[face]] * weights[..., None]).sum(axis=1)
    normals = (head.normals()[head.faces[face]] * weights[..., None]).sum(axis=1)
    return np.asarray(255 * sample(uv), np.float64), normals


def _relight(drawn: Float64Array, normals: Float64Array, wanted: Float64Array) -> Float64Array:
    """Return the albedo in the smooth light that makes it most like the photo."""
    basis = harmonics(normals)
    linear, photo = (drawn / 255) ** GAMMA, (wanted / 255) ** GAMMA
    lit = [
        albedo * (basis @ np.linalg.lstsq(basis * albedo[:, None], seen, rcond=None)[0])
        for albedo, seen in zip(linear.T, photo.T, strict=True)
    ]
    return np.asarray(255 * np.maximum(np.stack(lit, axis=1), 0) ** (1 / GAMMA))


def _psnr(drawn: Float64Array, wanted: Float64Array) -> float:
    return float(10 * np.log10(255**2 / np.maximum(((drawn - wanted) ** 2).mean(), 1e-9)))


if __name__ == "__main__":
    sys.exit(main())
