"""Results of a reconstruction, read from its folder for scoring."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from hairkit.arrays import Int64Array
from hairkit.errors import InputError
from hairkit.evaluation.truth import Truth
from hairkit.io.framed_photos import on_photo
from hairkit.pipeline.work_folder import WORK, LastRun
from hairkit.stages import FRAMED, ORIENTED, TURN
from hairkit.storage import from_arrays, to_arrays
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.scene import read_cameras

_Found = TypeVar("_Found", Mask, OrientationMap)
GROOM, SCENE = "groom.npz", "scene.json"
"""Names in the folder that `hairkit reconstruct` writes."""


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
        """Return the prediction with the truth's views, in its order, by name where names agree.

        Views of which the truth says nothing, such as a photo from above, are left out. Raises
        `InputError` where names do not agree and there are more or fewer.
        """
        known = set(truth.names) <= set(self.names) and len(set(self.names)) == len(self.names)
        if not known and len(self.cameras) != len(truth.cameras):
            raise InputError(
                f"the prediction has {len(self.cameras)} views, the truth {len(truth.cameras)}: "
                "give the truth of the same capture"
            )
        if not known:
            return self
        order = [self.names.index(name) for name in truth.names]
        changes: dict[str, Any] = {"names": truth.names}
        for name in ("cameras", "orientations", "masks"):
            if getattr(self, name) is not None:
                changes[name] = tuple(getattr(self, name)[i] for i in order)
        return replace(self, **changes)


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
    last = LastRun(groom_path.parent / WORK)
    maps, masks = last.every(ORIENTED, names), last.masks(names)
    if last.has(FRAMED):
        frames = last.latest(FRAMED).frames
        frames = frames[last.latest(TURN).order] if last.has(TURN) else frames
        maps, masks = _on_photos(maps, frames, cameras), _on_photos(masks, frames, cameras)
    return Prediction(Groom.load(groom_path), names, cameras, maps, masks)


def _on_photos(
    found: tuple[_Found, ...] | None, frames: Int64Array, cameras: Sequence[Camera]
) -> tuple[_Found, ...] | None:
    """Return what was found in parts of photos as pictures of all of them."""
    if found is None or len(found) != len(frames):
        return found
    parts = zip(found, frames, cameras, strict=True)
    return tuple(_on_photo(each, frame, (c.width, c.height)) for each, frame, c in parts)


def _on_photo(found: _Found, frame: Int64Array, size: tuple[int, int]) -> _Found:
    if tuple(frame) == (0, 0, *size):
        return found
    arrays = to_arrays(found)
    pictures = {name: on_photo(a, frame, size) for name, a in arrays.items() if a.ndim > 1}
    return from_arrays(type(found), arrays | pictures, "prediction")
