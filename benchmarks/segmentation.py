"""Print the overlap of hair and person masks with true ones, and the time of a view.

python benchmarks/segmentation.py captures/ --plugin grabcut
"""

from __future__ import annotations

import argparse
import importlib
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from captures_argument import NO_CAPTURES, add_captures

from hairkit.options import make_options
from hairkit.types.capture import View
from hairkit.types.mask import BACKGROUND, HAIR, Mask

PLUGINS = ("grabcut", "auto_matte")
SIDES = ("front", "front-left", "left", "back-left", "back", "back-right", "right", "front-right")


def main() -> None:
    """Run one plugin over every capture below a folder that has masks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--plugin", choices=PLUGINS, default="grabcut")
    parser.add_argument("--set", action="append", default=[], metavar="OPTION=VALUE")
    parser.add_argument("--overlays", type=Path, help="folder for pictures of the errors")
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    plugin: Any = importlib.import_module(f"hairkit_plugins.{arguments.plugin}")
    chosen = dict(item.split("=", 1) for item in arguments.set)
    options = make_options(plugin.Options, chosen, arguments.plugin)
    print("| capture | hair IoU mean | least | person IoU mean | least | CPU s a view |")
    print("|---|---|---|---|---|---|")
    rows = []
    for folder in sorted(path.parent for path in arguments.captures.glob("*/masks")):
        if arguments.plugin == "grabcut" and not (folder / "strokes").is_dir():
            continue
        scores = np.array([_score(view, plugin, arguments, options) for view in _views(folder)])
        rows.append(scores.mean(axis=0))
        print(_row(folder.name, scores))
    print(_row("mean", np.array(rows)))


def _row(name: str, scores: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    mean, least = scores.mean(axis=0), scores.min(axis=0)
    hair, person = (f"{mean[k]:.3f} | {least[k]:.3f}" for k in (0, 1))
    return f"| {name} | {hair} | {person} | {mean[2]:.2f} |"


def _views(folder: Path) -> list[View]:
    views = []
    for index, photo in enumerate(sorted((folder / "photos").iterdir())):
        strokes = folder / "strokes" / f"{photo.stem}.json"
        pixels: Any = cv2.imread(str(photo))
        image = np.ascontiguousarray(pixels[..., ::-1])
        mask = folder / "masks" / f"{photo.stem}.png"
        side = photo.stem.split("_", 1)[-1]
        name = side if side in SIDES else SIDES[index % 8]
        azimuth = 45.0 * SIDES.index(name)
        views.append(
            View(
                name,
                azimuth,
                image,
                mask_path=mask,
                strokes_path=strokes if strokes.exists() else None,
                photo_path=photo,
            )
        )
    return views


def _score(
    view: View, plugin: Any, arguments: argparse.Namespace, options: Any
) -> tuple[float, float, float]:
    """Return IoU of hair, IoU of the person with hair, and CPU seconds of one view."""
    start = time.process_time()
    mask: Mask = plugin.segment(view=view, options=options)
    seconds = time.process_time() - start
    truth: Any = cv2.imread(str(view.mask_path), cv2.IMREAD_GRAYSCALE)
    if arguments.overlays:
        _write_overlay(arguments, view, mask, truth)
    person = mask.labels != BACKGROUND if mask.person_known else np.zeros(truth.shape, bool)
    return _iou(mask.hair, truth == HAIR), _iou(person, truth != BACKGROUND), seconds


def _iou(first: Any, second: Any) -> float:
    return float((first & second).sum() / max((first | second).sum(), 1))


def _write_overlay(arguments: argparse.Namespace, view: View, mask: Mask, truth: Any) -> None:
    """Draw false hair in red, missed hair in green, a wrong person in blue."""
    picture = (view.image * 0.6).astype(np.uint8)
    picture[(mask.labels != BACKGROUND) != (truth != BACKGROUND)] = (60, 60, 255)
    picture[mask.hair & (truth != HAIR)] = (255, 0, 0)
    picture[~mask.hair & (truth == HAIR)] = (0, 255, 0)
    arguments.overlays.mkdir(parents=True, exist_ok=True)
    capture = Path(str(view.photo_path)).parents[1].name
    name = f"{arguments.plugin}_{capture}_{view.azimuth_deg:03.0f}_{view.name}.png"
    cv2.imwrite(str(arguments.overlays / name), picture[..., ::-1])


if __name__ == "__main__":
    main()
