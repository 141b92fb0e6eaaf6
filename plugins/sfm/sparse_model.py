"""What COLMAP found, as cameras and points; it runs in a process of its own.

pycolmap and OpenCV in one process crash each other: both bring libraries that read pictures.
"""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit import Camera, Mask, View
from hairkit.arrays import Float64Array, Int64Array
from hairkit.child_process import ChildError, Limits, ask_for_arrays
from hairkit.errors import InputError, MissingExtraError
from hairkit.types.mask import BACKGROUND

MISSING = "sfm needs pycolmap, which is not installed: pip install 'hairkit[sfm]'"
USUAL_FOCAL = 1.2
"""Focal length over the longer edge where the photos tell none, as COLMAP has it."""
_PROGRAM = Path(__file__).with_name("colmap_child.py")


@dataclass(frozen=True, eq=False)
class Model:
    """Cameras and points in a frame and a size of their own."""

    cameras: tuple[Camera | None, ...]
    """One a photo, None for those that were not joined."""
    points: Float64Array
    """(P, 3)."""
    sights: Float64Array
    """(S, 4) point, photo, and where it is seen, x and y as shares of the photo's sides."""
    residual_px: float
    """Mean distance between seen and projected points."""

    def reordered(self, order: Int64Array) -> Model:
        """Return the model whose photo k was photo `order[k]`."""
        cameras: list[Camera | None] = [None] * len(order)
        for index, camera in zip(order, self.cameras, strict=True):
            cameras[index] = camera
        sights = self.sights.copy()
        sights[:, 1] = order[sights[:, 1].astype(np.int64)]
        return Model(tuple(cameras), self.points, sights, self.residual_px)


def solve(
    views: Sequence[View], masks: Sequence[Mask], settings: tuple[int, int], seconds: float
) -> Model:
    """Return the model of photos in the order of the turn.

    `settings` are features and neighbours of the plugin's options.

    Raises
    ------
    MissingExtraError
        pycolmap is not installed.
    InputError
        COLMAP joins no photos, ends or takes too long.
    """
    if importlib.util.find_spec("pycolmap") is None:
        raise MissingExtraError(MISSING)
    with tempfile.TemporaryDirectory(prefix="hairkit-sfm-") as folder:
        _write_photos(Path(folder), views, masks)
        task: dict[str, object] = dict(zip(("features", "neighbours"), settings, strict=True))
        focals = [v.focal_px or USUAL_FOCAL * max(v.photo_size) / v.scale for v in views]
        centres = [view.centre.tolist() for view in views]
        known = all(view.focal_px for view in views)
        shared = len({(v.width, v.height, v.frame) for v in views}) == len(set(focals)) == 1
        task |= {"focals": focals, "centres": centres, "known": known, "shared": shared}
        task |= {"do": "solve", "folder": folder}
        try:
            _, found = ask_for_arrays(_PROGRAM, task, Limits(seconds))
        except ChildError as error:
            cure = "; raise sfm.seconds" if error.limit else ""
            raise InputError(f"sfm: COLMAP {error}{cure}") from error
    return _model(found, views)


def _write_photos(folder: Path, views: Sequence[View], masks: Sequence[Mask]) -> None:
    for name in ("photos", "masks"):
        (folder / name).mkdir()
    for i, (view, mask) in enumerate(zip(views, masks, strict=True)):
        person = np.where(mask.labels == BACKGROUND, 0, 255).astype(np.uint8)
        size = (view.width, view.height)
        small = cv2.resize(person, size, interpolation=cv2.INTER_NEAREST)
        cv2.imwrite(str(folder / "photos" / f"{i:04}.png"), view.image[..., ::-1])
        cv2.imwrite(str(folder / "masks" / f"{i:04}.png.png"), small)


def _model(found: Mapping[str, npt.NDArray[Any]], views: Sequence[View]) -> Model:
    cameras: list[Camera | None] = []
    for i, view in enumerate(views):
        if not found["joined"][i]:
            cameras.append(None)
            continue
        matrix = np.eye(4)
        u, _, vt = np.linalg.svd(found["poses"][i][:, :3])
        matrix[:3, :3], matrix[:3, 3] = u @ vt, found["poses"][i][:, 3]
        focal = float(found["focals"][i])
        cameras.append(Camera(matrix, focal, view.centre, view.width, view.height))
    sights = found["sights"].astype(np.float64)
    sizes = np.array([(view.width, view.height) for view in views], np.float64)
    sights[:, 2:] /= sizes[sights[:, 1].astype(np.int64)]
    points = found["points"].astype(np.float64)
    return Model(tuple(cameras), points, sights, float(found["residual_px"]))
