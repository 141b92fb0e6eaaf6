"""Make a set of training pictures, as the hair network sees them, from captures with truth.

python -m training.hair_network.compose captures/ -o sets/11.npz --count 1200 --seed 11
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.random import Generator

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.imaging.hair_features import GRID, HairFeatures, hair_features
from hairkit.manager import Manager
from hairkit.types.capture import View
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

from .composer import Composite, compose
from .renders import read_renders

_LIKELY_FACE = 0.8
"""Least presence of a face whose landmarks are used, as in the plugin `auto_matte`."""


def main() -> None:
    """Write features, shares of the labels and names of `count` pictures to one file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "captures", type=Path, help="folder; captures with truth/ below it are read"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="file (.npz)")
    parser.add_argument("--count", type=int, default=1200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--leave-out", nargs="*", default=[], metavar="CAPTURE")
    parser.add_argument("--pictures", type=Path, help="folder for the pictures themselves")
    arguments = parser.parse_args()
    renders = [
        render
        for render in read_renders(arguments.captures)
        if not set(Path(render.name).parts) & set(arguments.leave_out)
    ]
    if not renders:
        parser.error(f"{arguments.captures}: no captures with truth/truth.json")
    rng, manager = np.random.default_rng(arguments.seed), Manager.loaded()
    values, shares = [], []
    for index in range(arguments.count):
        composite = compose(renders, rng)
        features = observe(rng, composite, manager)
        values.append(features.values.astype(np.float16))
        shares.append(np.rint(255 * label_shares(composite.labels, features.size)).astype(np.uint8))
        if arguments.pictures:
            _write_picture(arguments.pictures / f"{index:05d}.jpg", composite)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(arguments.output, features=np.stack(values), shares=np.stack(shares))
    print(f"{len(values)} pictures of {len(renders)} renders in {arguments.output}")


def observe(rng: Generator, composite: Composite, manager: Manager) -> HairFeatures:
    """Return the features, with the person and the face that the plugins find, now and then not."""
    view = View("composite", 0.0, composite.image)
    person, landmarks, chance = None, None, rng.random()
    if chance < 0.12:  # as exact as another model might be
        known = (composite.labels != BACKGROUND).astype(np.float32)
        person = np.asarray(cv2.GaussianBlur(known, (0, 0), rng.uniform(3, 12)), np.float32)
    elif chance < 0.92:
        found = manager.call("segment_person", "selfie", view=view)
        person = None if found is None else found.alpha.astype(np.float32) / np.float32(255)
    if rng.random() < 0.55:
        face = manager.call("detect_landmarks", "face_mesh", view=view)
        if face is not None and face.presence > _LIKELY_FACE:
            landmarks = face.landmarks
    return hair_features(composite.image, person, landmarks)


def label_shares(labels: UInt8Array, size: tuple[int, int]) -> Float32Array:
    """Return (3, GRID, GRID) shares of hair, person and background in each cell, 0 outside."""
    shares = np.zeros((3, GRID, GRID), np.float32)
    for share, label in zip(shares, (HAIR, PERSON, BACKGROUND), strict=True):
        area = (labels == label).astype(np.float32)
        share[: size[1], : size[0]] = cv2.resize(area, size, interpolation=cv2.INTER_AREA)
    return shares


def _write_picture(path: Path, composite: Composite) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    labels = np.repeat(composite.labels[..., None], 3, axis=2)
    cv2.imwrite(str(path), np.hstack([composite.image[..., ::-1], labels]))


if __name__ == "__main__":
    main()
