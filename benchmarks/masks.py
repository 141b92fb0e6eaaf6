"""Print the overlap of masks made without help with true ones: captures, or a folder of photos.

python benchmarks/masks.py captures/
python benchmarks/masks.py --photos Original/Testing --masks GT/Testing --every 5
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from captures_argument import NO_CAPTURES, add_captures

from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.types.capture import View
from hairkit.types.mask import HAIR

LONGEST = 900
"""Pixels of a photo's longer side in a folder of photos; captures keep their size."""
FACES, PERSONS = "face_mesh", "selfie"
"""Plugins that see the photo first; without their networks they have no answer."""


def main() -> None:
    """Segment every photo with `auto_matte` and print a row of a table for each capture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--photos", type=Path, help="folder of photos, instead of captures")
    parser.add_argument("--masks", type=Path, help="folder of their masks, .pbm or .png")
    parser.add_argument("--every", type=int, default=1, help="score every n-th photo alone")
    parser.add_argument("--first", type=int, default=0, help="the first photo that is scored")
    parser.add_argument("--no-networks", action="store_true", help="do not look for faces, persons")
    parser.add_argument("--overlays", type=Path, help="folder for pictures of the errors")
    arguments = parser.parse_args()
    if arguments.captures is None and arguments.photos is None:
        print(NO_CAPTURES)
        return
    manager = Manager.loaded()
    print("| photos | number | hair IoU mean | worst | median |")
    print("|---|---|---|---|---|")
    for name, pairs in _sets(arguments).items():
        scores = [
            _score(photo, mask, manager, arguments)
            for photo, mask in pairs[arguments.first :: arguments.every]
        ]
        middle = f"{np.mean(scores):.3f} | {np.min(scores):.3f} | {np.median(scores):.3f}"
        print(f"| {name} | {len(scores)} | {middle} |", flush=True)


def _sets(arguments: argparse.Namespace) -> dict[str, list[tuple[Path, Path]]]:
    """Return pairs of a photo and its mask by the capture's name."""
    if arguments.photos is not None:
        masks = sorted((arguments.masks or arguments.photos).glob("*.p[bn][mg]"))
        photos = sorted(arguments.photos.glob("*.jpg"))
        pairs = [(p, m) for p in photos for m in masks if _stem(m) == _stem(p)]
        return {arguments.photos.name: pairs}
    folders = sorted(path.parent for path in arguments.captures.glob("*/masks"))
    folders += sorted(path.parent for path in arguments.captures.glob("*/above/masks"))
    return {
        str(folder.relative_to(arguments.captures)): [
            (photo, folder / "masks" / f"{photo.stem}.png")
            for photo in sorted((folder / "photos").iterdir())
        ]
        for folder in folders
    }


def _stem(path: Path) -> str:
    """Return a file's name without its ending and what follows the first hyphen."""
    return path.stem.split("-")[0]


def _score(photo: Path, mask: Path, manager: Manager, arguments: argparse.Namespace) -> float:
    pixels: Any = cv2.imread(str(photo))
    truth: Any = cv2.imread(str(mask), cv2.IMREAD_GRAYSCALE)
    if arguments.photos is not None:
        scale = LONGEST / max(pixels.shape[:2])
        how = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
        pixels = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=how)
        truth = cv2.resize(truth, pixels.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    view = View(photo.stem, 0.0, np.ascontiguousarray(pixels[..., ::-1]))
    if not arguments.no_networks:
        face = manager.find_first("detect_landmarks", [(FACES, None)], view=view)
        person = manager.find_first("segment_person", [(PERSONS, None)], view=view)
        view = replace(view, face=face and face[1], person=person and person[1])
    true = truth == HAIR
    try:
        hair = manager.call("segment", "auto_matte", view=view).hair
    except InputError:  # no hair found
        hair = np.zeros_like(true)
    if arguments.overlays:
        picture = (view.image * 0.6).astype(np.uint8)
        picture[hair & ~true], picture[true & ~hair] = (255, 0, 0), (0, 255, 0)
        arguments.overlays.mkdir(parents=True, exist_ok=True)
        name = f"{mask.parents[1].name}_{photo.stem}.png"
        cv2.imwrite(str(arguments.overlays / name), picture[..., ::-1])
    return float((hair & true).sum() / max((hair | true).sum(), 1))


if __name__ == "__main__":
    main()
