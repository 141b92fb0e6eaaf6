"""Results of a reconstruction, read from its folder for scoring."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from hairkit.errors import InputError
from hairkit.evaluation.truth import Truth
from hairkit.storage import Stored, from_arrays, read_npz
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask, Masks
from hairkit.types.orientation import OrientationMap
from hairkit.types.scene import read_cameras

GROOM, SCENE, WORK = "groom.npz", "scene.json", "work"
"""Names in the folder that `hairkit reconstruct` writes."""

_Kind = TypeVar("_Kind", bound=Stored)


@dataclass(frozen=True, eq=False)
class Prediction:
    """A groom and the cameras that it was made with, in one frame of its own."""

    groom: Groom
    names: tuple[str, ...]
    """Names of the views, one a camera."""
    cameras: tuple[Camera, ...]
    orientations: tuple[OrientationMap, ...] | None = None
    """2D orientation of every view, or None when the work folder does not hold it."""
    masks: tuple[Mask, ...] | None = None
    """Labels of every view, or None when the work folder does not hold them."""

    def in_order_of(self, truth: Truth) -> Prediction:
        """Return the prediction with its views in the truth's order, by name where names agree."""
        if len(self.cameras) != len(truth.cameras):
            raise InputError(
                f"the prediction has {len(self.cameras)} views, the truth {len(truth.cameras)}: "
                "give the truth of the same capture"
            )
        if sorted(self.names) != sorted(truth.names) or len(set(self.names)) < len(self.names):
            return self
        order = [self.names.index(name) for name in truth.names]
        return Prediction(
            self.groom,
            truth.names,
            tuple(self.cameras[i] for i in order),
            None if self.orientations is None else tuple(self.orientations[i] for i in order),
            None if self.masks is None else tuple(self.masks[i] for i in order),
        )


def read_prediction(
    path: str | os.PathLike[str], scene: str | os.PathLike[str] | None = None
) -> Prediction:
    """Read a reconstruction's folder, or a groom file that has its `scene.json` beside it.

    Parameters
    ----------
    path
        The folder `hairkit reconstruct -o` wrote, or a groom's `.npz`.
    scene
        Cameras from elsewhere: a `scene.json`, or a `truth.json` for a groom in the truth's frame.

    Raises
    ------
    InputError
        Naming the file that is missing.
    """
    groom_path = Path(path) / GROOM if Path(path).is_dir() else Path(path)
    if not groom_path.is_file():
        raise InputError(f"{groom_path}: no such groom; give the folder that reconstruct wrote")
    scene_path = groom_path.parent / SCENE if scene is None else Path(scene)
    if not scene_path.is_file():
        raise InputError(
            f"{scene_path}: no such file; a groom is scored with the cameras it was made with, "
            "name them with --scene"
        )
    names, cameras = read_cameras(scene_path)
    folder = groom_path.parent
    return Prediction(
        Groom.load(groom_path),
        names,
        cameras,
        _stage_results(folder, "orient", names, OrientationMap),
        _masks(folder, names),
    )


def _masks(folder: Path, names: Sequence[str]) -> tuple[Mask, ...] | None:
    """Return the masks that the groom was made with: refined ones where there are any."""
    path = folder / WORK / "refine.npz"
    if path.is_file():
        return from_arrays(Masks, read_npz(path), str(path)).views
    return _stage_results(folder, "segment", names, Mask)


def _stage_results(
    folder: Path, stage: str, names: Sequence[str], kind: type[_Kind]
) -> tuple[_Kind, ...] | None:
    """Read what a stage found in every view, or None where a view is not there."""
    paths = [folder / WORK / f"{stage}-{_file_name(name)}.npz" for name in names]
    if not all(path.is_file() for path in paths):
        return None
    return tuple(from_arrays(kind, read_npz(path), str(path)) for path in paths)


def _file_name(view: str) -> str:
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in view)
