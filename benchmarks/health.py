"""Print the health figures of captures as they are and of the same captures spoiled.

python benchmarks/health.py captures/ -o out/

The thresholds of `hairkit.pipeline.health` are chosen from this table.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from captures_argument import NO_CAPTURES, add_captures

from hairkit.errors import HairkitError
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.progress import Silent

GUIDES = 600

SHUFFLE_SEED = 3
"""Of the permutation of the photos of `shuffled`."""
SHIFT = 0.08
"""Share of the width by which every other mask of `masks_shifted` is moved."""
WRONG_STEP_DEG = 25.0
"""Step between the azimuths of `wrong_azimuths`, whose true steps are 45 degrees."""


@dataclass(frozen=True)
class Files:
    """The files of a capture, one entry a view in the order of the turn."""

    photos: list[Path]
    masks: list[Path | None]
    landmarks: dict[int, Any]
    """68 points by the number of the view."""
    toml: str = ""

    @classmethod
    def of(cls, folder: Path) -> Files:
        """Return the files of a capture's folder."""
        photos = sorted((folder / "photos").iterdir())
        masks = [folder / "masks" / f"{photo.stem}.png" for photo in photos]
        stems = {name: index for index, photo in enumerate(photos) for name in _names(photo)}
        path = folder / "landmarks.json"
        points = json.loads(path.read_text())["views"] if path.is_file() else {}
        landmarks = {stems[name]: value for name, value in points.items()}
        toml = folder / "capture.toml"
        return cls(
            photos,
            [mask if mask.is_file() else None for mask in masks],
            landmarks,
            toml.read_text() if toml.is_file() else "",
        )

    def write(self, folder: Path) -> Path:
        """Write a capture whose files are named `0`, `1`, ... in the order of the turn."""
        shutil.rmtree(folder, ignore_errors=True)
        for name in ("photos", "masks"):
            (folder / name).mkdir(parents=True)
        for index, (photo, mask) in enumerate(zip(self.photos, self.masks, strict=True)):
            shutil.copyfile(photo, folder / "photos" / f"{index}{photo.suffix}")
            if mask is not None:
                shutil.copyfile(mask, folder / "masks" / f"{index}.png")
        views = {str(index): points for index, points in self.landmarks.items()}
        if views:
            (folder / "landmarks.json").write_text(json.dumps({"views": views}))
        if self.toml:
            (folder / "capture.toml").write_text(self.toml)
        return folder

    def picked(self, order: list[int]) -> Files:
        """Return the views in another order, each with its mask and landmarks."""
        landmarks = {
            new: self.landmarks[old] for new, old in enumerate(order) if old in self.landmarks
        }
        photos, masks = ([each[i] for i in order] for each in (self.photos, self.masks))
        return Files(photos, masks, landmarks, self.toml)


def _names(photo: Path) -> tuple[str, ...]:
    return photo.stem, photo.stem.split("_", 1)[-1]


def as_they_are(own: Files, other: Files, folder: Path) -> Path:
    """Nothing is spoiled."""
    return own.write(folder)


def shuffled(own: Files, other: Files, folder: Path) -> Path:
    """The photos are in no order."""
    order = np.random.default_rng(SHUFFLE_SEED).permutation(len(own.photos)).tolist()
    return own.picked(order).write(folder)


def two_heads(own: Files, other: Files, folder: Path) -> Path:
    """Every other photo shows another head."""
    parts = [own if index % 2 == 0 else other for index in range(len(own.photos))]
    landmarks = {i: part.landmarks[i] for i, part in enumerate(parts) if i in part.landmarks}
    photos = [part.photos[i] for i, part in enumerate(parts)]
    masks = [part.masks[i] for i, part in enumerate(parts)]
    return Files(photos, masks, landmarks, own.toml).write(folder)


def masks_shifted(own: Files, other: Files, folder: Path) -> Path:
    """Every other mask is moved sideways."""
    written = own.write(folder)
    for path in sorted((written / "masks").iterdir())[::2]:
        labels: Any = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(path), np.roll(labels, round(SHIFT * labels.shape[1]), axis=1))
    return written


def masks_of_the_head(own: Files, other: Files, folder: Path) -> Path:
    """The face is marked as hair, as simple segmentation does with beards and bald heads."""
    written = own.write(folder)
    for path in sorted((written / "masks").iterdir()):
        labels: Any = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        rows = np.flatnonzero((labels != 0).any(axis=1))
        chin = rows[0] + (rows[-1] - rows[0]) // 2
        labels[:chin][labels[:chin] != 0] = 255
        cv2.imwrite(str(path), labels)
    return written


def wrong_azimuths(own: Files, other: Files, folder: Path) -> Path:
    """The views are said to be 25 degrees apart."""
    tables = "".join(
        f'[[views]]\nname = "view {i}"\nphoto = "{i}{photo.suffix}"\n'
        f"azimuth_deg = {WRONG_STEP_DEG * i}\n"
        for i, photo in enumerate(own.photos)
    )
    return Files(own.photos, own.masks, own.landmarks, own.toml + tables).write(folder)


WAYS: dict[str, Callable[[Files, Files, Path], Path]] = {
    function.__name__: function
    for function in (
        as_they_are, shuffled, two_heads, masks_shifted, masks_of_the_head, wrong_azimuths,
    )
}  # fmt: skip
"""How captures are spoiled, by the name in the table."""


def main() -> None:
    """Reconstruct every capture as it is and spoiled in every way, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("-o", "--out", type=Path, default=Path("health-out"))
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS))
    parser.add_argument("--recipe", default="default")
    parser.add_argument("--plugin", action="append", default=[], metavar="FILE")
    parser.add_argument("--guides", type=int, default=GUIDES)
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    manager = Manager.loaded(arguments.plugin)
    # the photos are believed, so that the figures are those of wrong input, not of its refusal
    recipe = load_recipe(arguments.recipe).with_set(["export=none", "turn=none"])
    folders = sorted(path.parent for path in arguments.captures.glob("*/masks"))
    headed = False
    for way in arguments.ways:
        for index, folder in enumerate(folders):
            own, other = Files.of(folder), Files.of(folders[(index + 1) % len(folders)])
            capture = WAYS[way](own, other, arguments.out / way / folder.name / "capture")
            out = capture.parent / "out"
            try:
                reconstruct(
                    capture, out, recipe, manager,
                    guides=arguments.guides, sheet=False, progress=Silent(),
                )  # fmt: skip
            except HairkitError as error:
                print(f"{way} {folder.name}: refused: {error}")
                continue
            figures = read_record(out / RECORD).health
            if not headed:
                names = " | ".join(f"{figure.stage}: {figure.name}" for figure in figures)
                print(f"| capture | {names} |")
                print(f"|---{'|---' * len(figures)}|")
                headed = True
            cells = " | ".join(f"{f.value:.{f.digits}f} {f.light}" for f in figures)
            print(f"| {way} {folder.name} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
