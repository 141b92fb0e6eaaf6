"""Print the overlap of masks with true ones after simulated strokes, the largest error first.

python benchmarks/strokes.py captures/ --tool brush
"""

from __future__ import annotations

import argparse
import json
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from captures_argument import NO_CAPTURES, add_captures
from scipy import sparse
from scipy.sparse import csgraph

from hairkit.manager import Manager
from hairkit.types.capture import View
from hairkit.types.mask import HAIR

STROKES = 3
"""Strokes drawn on a photo."""
ROWS = 360
"""Rows of the outline: below, single hairs decide, which no region has."""
ENOUGH = 0.95
"""Overlap at which somebody would stop drawing."""
THICKNESS = 9.0
"""Of a pen's line in a photo 1080 px high, that of `auto_matte`."""
Mask = npt.NDArray[np.bool_]


@dataclass
class Trial:
    """A photo, its true hair, and what was drawn."""

    view: View
    truth: Mask
    file: Path
    shapes: list[dict[str, Any]]


def main() -> None:
    """Draw strokes on every photo of the captures and print a row for each capture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--tool", choices=("pen", "brush"), default="pen")
    parser.add_argument("--every", type=int, default=1, help="draw on every n-th photo alone")
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    manager = Manager.loaded()
    counts = range(STROKES + 1)
    heads = [f"{count} strokes" for count in counts]
    titles = ["capture", *heads, f"strokes for {ENOUGH}", "pixels", "pixels of a perfect outline"]
    print("| " + " | ".join(titles) + " |")
    print("|---" * len(titles) + "|")
    rows = []
    for folder in sorted(path.parent for path in arguments.captures.glob("*/masks")):
        photos = sorted((folder / "photos").iterdir())[:: arguments.every]
        scores = np.array([_draw(photo, manager, arguments.tool) for photo in photos])
        rows.append(scores)
        _print(folder.name, scores)
    _print("mean", np.concatenate(rows))


def _print(name: str, scores: npt.NDArray[np.float64]) -> None:
    cells = " | ".join(f"{value:.3f}" for value in scores[:, : STROKES + 1].mean(axis=0))
    reached = scores[:, : STROKES + 1] >= ENOUGH
    needed = np.where(reached.any(axis=1), reached.argmax(axis=1), STROKES + 1)
    last = " | ".join(f"{value:.3f}" for value in scores[:, STROKES + 1 :].mean(axis=0))
    print(f"| {name} | {cells} | {needed.mean():.1f} | {last} |", flush=True)


def _draw(photo: Path, manager: Manager, tool: str) -> list[float]:
    """Return the overlap after 0, 1, ... strokes, that of pixels at the end, and the most of it."""
    pixels: Any = cv2.imread(str(photo))
    truth: Any = cv2.imread(str(photo.parents[1] / "masks" / f"{photo.stem}.png"), 0)
    view = View(photo.stem, 0.0, np.ascontiguousarray(pixels[..., ::-1]))
    face = manager.find_first("detect_landmarks", [("face_mesh", None)], view=view)
    person = manager.find_first("segment_person", [("selfie", None)], view=view)
    view = replace(view, face=face and face[1], person=person and person[1])
    with tempfile.TemporaryDirectory() as folder:
        trial = Trial(view, truth == HAIR, Path(folder) / "strokes.json", [])
        found = []
        for count in range(STROKES + 1):
            mask = _segment(trial, manager)
            small, true = _reduce(mask), _reduce(trial.truth)
            found.append(_iou(small, true))
            if count < STROKES and (small != true).any():
                _add_stroke(trial, small, true, tool)
    size = truth.shape[1::-1]
    perfect = cv2.resize(true.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    return [*found, _iou(mask, trial.truth), _iou(perfect, trial.truth)]


def _segment(trial: Trial, manager: Manager) -> Mask:
    view = trial.view
    if trial.shapes:
        document = {
            "flags": {"corrects": True}, "shapes": trial.shapes,
            "imageWidth": view.width, "imageHeight": view.height,
        }  # fmt: skip
        trial.file.write_text(json.dumps(document))
        view = replace(view, strokes_path=trial.file)
    mask: Mask = manager.call("segment", "auto_matte", view=view).hair
    return mask


def _add_stroke(trial: Trial, mask: Mask, truth: Mask, tool: str) -> None:
    """Draw along the middle of the largest region that is wrong."""
    missed, wrong = (_largest(region) for region in (truth & ~mask, mask & ~truth))
    region, label = (missed, "foreground") if missed.sum() >= wrong.sum() else (wrong, "background")
    path, radius = _middle(region)
    scale = trial.view.height / truth.shape[0]
    points = ((path + 0.5) * scale).tolist()
    shape = {"label": label, "shape_type": "linestrip", "points": points}
    if tool == "brush":
        shape["radius"] = max((radius + 2) * scale, THICKNESS)
    trial.shapes.append(shape)


def _largest(region: Mask) -> Mask:
    """Return the largest connected part; what is two pixels wide or less counts last."""
    opened = cv2.morphologyEx(region.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    used = opened if opened.any() else region.astype(np.uint8)
    count, part, facts, _ = cv2.connectedComponentsWithStats(used, connectivity=4)
    if count == 1:
        return np.zeros_like(region)
    largest: Mask = part == 1 + facts[1:, cv2.CC_STAT_AREA].argmax()
    return largest


def _middle(region: Mask) -> tuple[npt.NDArray[Any], float]:
    """Return the longest path (N, 2) along a region's middle, short of its ends, and its radius."""
    inside = np.pad(region, 1).astype(np.uint8)
    depth = np.asarray(cv2.distanceTransform(inside, cv2.DIST_L2, 5))[1:-1, 1:-1]
    rows, columns = np.nonzero(region)
    number = np.full(region.shape, -1)
    number[rows, columns] = np.arange(len(rows))
    first, last, cost = [], [], []
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        y, x = rows + dy, columns + dx
        there = (y < region.shape[0]) & (x >= 0) & (x < region.shape[1])
        there[there] = number[y[there], x[there]] >= 0
        first.append(np.flatnonzero(there))
        last.append(number[y[there], x[there]])
        near = np.minimum(depth[rows[there], columns[there]], depth[y[there], x[there]])
        cost.append(np.hypot(dy, dx) / near**2)
    edges = (np.concatenate(first), np.concatenate(last))
    graph = sparse.coo_matrix((np.concatenate(cost), edges), (len(rows),) * 2).tocsr()
    start = _farthest(graph, int(depth[rows, columns].argmax()))
    node, before = (
        _farthest(graph, start),
        csgraph.dijkstra(graph, False, indices=start, return_predecessors=True)[1],
    )
    path = [node]
    while path[-1] != start and before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    points = np.stack([columns[path], rows[path]], axis=1)
    radius = float(depth[points[:, 1], points[:, 0]].max())
    cut = min(round(radius), (len(points) - 1) // 2)
    kept = points[cut : len(points) - cut]
    return (kept if len(kept) > 1 else np.repeat(kept, 2, axis=0)), radius


def _farthest(graph: Any, start: int) -> int:
    steps = csgraph.dijkstra(graph, False, indices=start, unweighted=True)
    return int(np.where(np.isfinite(steps), steps, -1).argmax())


def _reduce(mask: Mask) -> Mask:
    height = min(ROWS, len(mask))
    size = (max(round(mask.shape[1] * height / len(mask)), 1), height)
    shares = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return np.asarray(shares > 1 / 2)


def _iou(first: Mask, second: Mask) -> float:
    return float((first & second).sum() / max((first | second).sum(), 1))


if __name__ == "__main__":
    main()
