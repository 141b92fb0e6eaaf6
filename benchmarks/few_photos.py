"""Print what one, two, three and eight photos of rendered heads give: photos alone.

python benchmarks/few_photos.py captures/ --photos 1 2 3 8

One is the front, two are the front and 45 degrees to the subject's left, three add the left side.
The groom is moved into the truth's frame by the landmarks of its fitted head, since one camera
fixes no scale. F is in per cent. The visible part is what the cameras of the photos see: true
samples within 3 mm of the first surface of one of them, and predicted samples at most that far
behind it; hair behind clothes, which the truth has no mesh of, is left out of both by the true
masks. Lengths are over the true ones.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest import mock

import cv2
import numpy as np
import numpy.typing as npt
from captures_argument import NO_CAPTURES, add_captures

from hairkit.cameras.depth_raster import head_depth
from hairkit.cameras.similarity import fit_similarity
from hairkit.errors import InputError
from hairkit.evaluation import Truth, read_truth
from hairkit.evaluation.depth_map import (
    HAIR_FOOTPRINT_PX,
    Surface,
    first_surface,
    near_some_surface,
)
from hairkit.evaluation.scores import OUTER_DEPTH, sample_hits, sample_strands, scores_of_hits
from hairkit.field import hair_depth
from hairkit.head_model.template import default_head
from hairkit.imaging.unet import read_weights
from hairkit.io.capture_reader import TURN, photo_files
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.stages import EXPORT
from hairkit.types.groom import Groom
from hairkit.types.head import JAW_LANDMARKS

GUIDES = 8000
"""Strands of a head."""
PHOTOS = {1: ["front"], 2: ["front", "front-left"], 3: ["front", "front-left", "left"]}
"""Views by the number of photos; other numbers take the whole turn."""
TRUE_HAIR = 255
"""Label of hair in a true mask."""
COLUMNS = ("visible 4/40", "visible 3/30", "all 4/40", "all 3/30", "length", "processor s")


def main() -> None:
    """Print a row for each head and number of photos, and the means of each number."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--photos", type=int, nargs="+", default=[1, 2, 3, 8])
    parser.add_argument(
        "--weights", type=Path, help="folder of `training.hair_depth.train --folds`: each head by "
        "the network that was trained without it",
    )  # fmt: skip
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    print(f"| head | photos | {' | '.join(COLUMNS)} |")
    print("|---|---|" + "---|" * len(COLUMNS))
    for count in arguments.photos:
        rows = []
        for folder in sorted(path.parent for path in Path(arguments.captures).glob("*/truth")):
            try:
                with _spared(folder.name, arguments.weights):
                    rows.append(_figures(folder, PHOTOS.get(count, list(TURN))))
            except InputError as error:
                print(f"| {folder.name} | {count} | refused: {error} |", flush=True)
                continue
            print(_row(folder.name, count, rows[-1]), flush=True)
        if rows:
            print(_row("mean", count, np.mean(rows, axis=0).tolist()), flush=True)


@contextmanager
def _spared(head: str, folder: Path | None) -> Iterator[None]:
    """Let the network of depths be the one that was trained without a head."""
    if folder is None:
        yield
        return
    weights = read_weights(folder / f"hair_depth-without-{head.split('_')[0]}.npz")
    with mock.patch.object(hair_depth, "shipped_weights", return_value=weights):
        yield


def _row(name: str, count: int, figures: Sequence[float]) -> str:
    cells = [f"{value:.1f}" for value in figures]
    cells[4] = f"{figures[4]:.2f}"
    return f"| {name} | {count} | {' | '.join(cells)} |"


def _figures(folder: Path, views: list[str]) -> list[float]:
    """Reconstruct a head from some views, whose photos get names that tell nothing; score it."""
    truth = read_truth(folder)
    files = photo_files(folder / "photos")
    recipe = load_recipe("default")
    recipe = replace(recipe, stages=tuple(s for s in recipe.stages if s.table != EXPORT.table))
    with tempfile.TemporaryDirectory() as made:
        photos = Path(made) / "photos"
        photos.mkdir()
        for view in views:
            index = truth.names.index(view)
            shutil.copy(files[index], photos / f"IMG_{index:04d}{files[index].suffix}")
        began = time.process_time()
        options = {"guides": GUIDES, "sheet": False, "keep_work": False}
        groom = reconstruct(photos, Path(made) / "out", recipe, **options)
        return [*_scores(groom, truth, views), time.process_time() - began]


def _landmarks(truth: Truth) -> npt.NDArray[np.float64]:
    """Return the true landmarks (68, 3), metres; the template's on heads of `hairkit synth`."""
    said = json.loads((truth.folder / "truth.json").read_text()).get("landmarks3d")
    if said is None:
        return truth.head.vertices[default_head().landmark_vertices].astype(np.float64)
    return np.array(said["xyz"] if isinstance(said, dict) else said, np.float64)


def _scores(groom: Groom, truth: Truth, views: list[str]) -> list[float]:
    """Return F of the visible part and of all hair at 4 mm and 3 mm, and the length's ratio."""
    marks = _landmarks(truth)[JAW_LANDMARKS:]
    own = groom.head.vertices[groom.head.landmark_vertices].astype(np.float64)[JAW_LANDMARKS:]
    moved = fit_similarity(own, marks, np.ones(len(marks))).apply(groom.strands.points)
    strands = replace(groom.strands, points=moved.astype(np.float32))
    surfaces = [_surface(truth, truth.names.index(view)) for view in views]
    seen = near_some_surface(truth.samples.points, surfaces, OUTER_DEPTH)
    true = replace(truth.samples, marked=seen)
    hits = sample_hits(sample_strands(strands), true, surfaces=surfaces, visible=True)
    found = scores_of_hits(*hits)
    assert found.outer is not None
    scores = [found.outer[2], found.outer[1], found.all[2], found.all[1]]
    length = strands.lengths().mean() / truth.strands.lengths().mean()
    return [*(100 * score.f for score in scores), float(length)]


def _surface(truth: Truth, view: int) -> Surface:
    """Return the first surface that a view sees, with nothing to be seen in pixels of clothes."""
    camera, labels = truth.cameras[view], truth.hair_mask(view)
    near = np.ones((HAIR_FOOTPRINT_PX, HAIR_FOOTPRINT_PX), np.uint8)
    hair = cv2.dilate((labels == TRUE_HAIR).astype(np.uint8), near) > 0
    clothes = (labels > 0) & ~hair & ~np.isfinite(head_depth(truth.head, camera))
    surface = first_surface(camera, truth.samples.points, truth.head)
    return replace(surface, depth=np.where(clothes, -np.inf, surface.depth).astype(np.float32))


if __name__ == "__main__":
    main()
