"""Ways in which captures, and grooms made of them, are spoiled; what `health` tells of them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from hairkit import Mask, OrientationMap, View, hookimpl
from hairkit.grooming.wind_waves import add_waves
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands
from hairkit.types.waves import Waves

SHUFFLE_SEED = 3
"""Of the permutation of the photos of `shuffled`."""
SHIFT = 0.08
"""Share of the width by which every other mask of `masks_shifted` is moved."""
WRONG_STEP_DEG = 25.0
"""Step between the azimuths of `wrong_azimuths`, whose true steps are 45 degrees."""
KEPT, PIECES = 0.6, 40
"""Share of the strands that `cut` keeps, and the pieces into which it divides them."""
CURLS = Waves(0.005, 0.025)
"""Of `curled`."""
TURN_DEG = 45.0
"""By which `turned` turns strands on the scalp."""


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

    def bare(self) -> Files:
        """Return the photos without masks and landmarks."""
        return Files(self.photos, [None] * len(self.photos), {}, self.toml)


def _names(photo: Path) -> tuple[str, ...]:
    return photo.stem, photo.stem.split("_", 1)[-1]


def photos_alone(own: Files, other: Files, folder: Path) -> Path:
    """Nothing is spoiled, and nothing is given but photos."""
    return own.bare().write(folder)


def with_masks(own: Files, other: Files, folder: Path) -> Path:
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


def straightened(own: Files, other: Files, folder: Path) -> Path:
    """Curls are said to be none."""
    toml = f"{own.toml}[hair]\ncurl_radius_mm = 0\n"
    return replace(own.bare(), toml=toml).write(folder)


@hookimpl
def orient(view: View, mask: Mask) -> OrientationMap:
    """Answer that all hair is level, as the plugin `nonsense`."""
    return OrientationMap(np.zeros(mask.labels.shape, np.float32), mask.hair.astype(np.float32))


def cut(groom: Groom) -> Groom:
    """Strands end early."""
    count = round(KEPT * PIECES) + 1
    points = groom.strands.resampled(PIECES + 1).points.reshape(-1, PIECES + 1, 3)[:, :count]
    offsets = np.arange(len(points) + 1) * count
    return replace(groom, strands=Strands(points.reshape(-1, 3), offsets))


def curled(groom: Groom) -> Groom:
    """Straight hair has curls."""
    material = replace(groom.material, curl_radius=CURLS.radius, curl_pitch=CURLS.pitch)
    return replace(groom, strands=add_waves(groom.strands, CURLS), material=material)


def turned(groom: Groom) -> Groom:
    """Every strand is turned on the scalp about its root."""
    points, offsets = groom.strands.points, groom.strands.offsets
    roots = np.repeat(points[offsets[:-1]], np.diff(offsets), axis=0)
    axes = roots - groom.head.vertices.mean(axis=0)
    axes *= np.radians(TURN_DEG) / np.linalg.norm(axes, axis=1, keepdims=True)
    moved = roots + Rotation.from_rotvec(axes).apply(points - roots)
    return replace(groom, strands=Strands(moved.astype(np.float32), offsets))


@dataclass(frozen=True)
class Way:
    """How a run is spoiled."""

    spoil: Callable[[Files, Files, Path], Path]
    settings: tuple[str, ...] = ()
    """What its recipe has, as for `--set`."""
    curly: bool = False
    """Whether it needs hair that came out in curls."""


BELIEVED = ("turn=none",)
"""Order and azimuths are not checked, so that the figures are those of wrong input."""
RUNS = {
    "photos alone": Way(photos_alone),
    "with masks": Way(with_masks, BELIEVED),
    "shuffled": Way(shuffled, BELIEVED),
    "every other photo of another head": Way(two_heads, BELIEVED),
    "masks moved": Way(masks_shifted, BELIEVED),
    "the face in the masks": Way(masks_of_the_head, BELIEVED),
    "wrong azimuths": Way(wrong_azimuths, BELIEVED),
    "an orienter that answers nonsense": Way(photos_alone, ("orient=nonsense",)),
    "curls straightened": Way(straightened, curly=True),
}
"""Ways to spoil what a run gets; the first two spoil nothing."""
GROOMS = {"cut to 0.6": cut, "turned by 45 degrees": turned, "curled": curled}
"""Ways to spoil the guides of a run with photos alone; the last one is for straight hair."""
