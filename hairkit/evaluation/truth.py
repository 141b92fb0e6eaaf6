"""The truth folder of a capture: cameras, strands, visibility, head, orientation pictures."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.errors import FormatError, InputError
from hairkit.evaluation.depth_map import Surface, first_surface
from hairkit.evaluation.scores import Samples, sample_strands
from hairkit.io.capture_reader import photo_files
from hairkit.io.mesh_text import read_obj
from hairkit.io.photos import read_photo
from hairkit.storage import read_bytes, read_npz
from hairkit.types.camera import Camera
from hairkit.types.head import Capsules, Head
from hairkit.types.scene import read_cameras
from hairkit.types.strands import Strands


@dataclass(frozen=True, eq=False)
class Truth:
    """Ground truth of a rendered capture; for scoring only."""

    folder: Path
    """The capture's `truth` folder."""
    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    strands: Strands
    visible: UInt8Array
    """(P,) nonzero where some camera saw that point of `strands`."""
    head: Head
    """The true mesh; its scalp, texture coordinates and joints are not known and mean nothing."""

    @cached_property
    def samples(self) -> Samples:
        """Samples of the true strands, marked where a camera saw them."""
        return sample_strands(self.strands, marked=self.visible, name="true")

    @cached_property
    def surfaces(self) -> tuple[Surface, ...]:
        """First visible surface of every view: true strands and head, seen by the true cameras."""
        points = self.samples.points
        return tuple(first_surface(camera, points, self.head) for camera in self.cameras)

    def orientation(self, view: int) -> UInt8Array:
        """Return (H, W) strand angles of a view: 1..255 for [0, pi), 0 where there is no hair."""
        return _picture(self.folder / "orientation", view)

    def hair_mask(self, view: int) -> UInt8Array:
        """Return (H, W) true labels of a view: 255 hair, 128 the rest of the person, 0 neither."""
        return _picture(self.folder.parent / "masks", view)

    def photos(self) -> list[UInt8Array] | None:
        """Return the photos (H, W, 3) RGB, in the order of the views; None where there are none."""
        folder = self.folder.parent / "photos"
        files = photo_files(folder) if folder.is_dir() else []
        if len(files) != len(self.names):
            return None
        return [read_photo(file)[0] for file in files]


def read_truth(folder: str | os.PathLike[str]) -> Truth:
    """Read a truth folder, or the one inside a capture folder.

    Raises `InputError` naming what is missing, `FormatError` for files that cannot be read.
    """
    base = Path(folder)
    if not (base / "truth.json").exists() and (base / "truth" / "truth.json").exists():
        base = base / "truth"
    for name in ("truth.json", "strands.npz", "head.obj"):
        if not (base / name).is_file():
            raise InputError(
                f"{base}: no {name}; give the truth folder of a capture "
                "(truth.json, strands.npz, head.obj)"
            )
    names, cameras = read_cameras(base / "truth.json")
    strands, visible = _read_strands(base / "strands.npz")
    return Truth(base, names, cameras, strands, visible, _read_head(base / "head.obj"))


def _read_strands(path: Path) -> tuple[Strands, UInt8Array]:
    arrays = read_npz(path)
    try:
        strands = Strands(arrays["points"], arrays["offsets"])
        visible = (arrays["visible"] != 0).astype(np.uint8)
    except (KeyError, InputError) as error:
        raise FormatError(f"{path}: not true strands ({error})") from error
    if visible.shape != (len(strands.points),):
        raise FormatError(f"{path}: visible has shape {visible.shape}, expected one value a point")
    return strands, visible


def _read_head(path: Path) -> Head:
    mesh = read_obj(path)
    points, triangles = mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32)
    blank = np.zeros((len(points), 2), np.float32)
    none = np.zeros((0, 3), np.float32)
    capsules = Capsules(none, none, none[:, :2])
    everywhere = np.ones(len(points), np.float32)
    return Head(points, triangles, blank, everywhere, None, np.zeros((3, 3), np.float32), capsules)


def _picture(folder: Path, view: int) -> UInt8Array:
    files = sorted(folder.glob("*.png"))
    if view >= len(files):
        raise InputError(f"{folder}: no picture for view {view}; found {len(files)} .png files")
    data = np.frombuffer(read_bytes(files[view]), np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if len(data) else None
    if image is None:
        raise FormatError(f"{files[view]}: not a readable picture")
    return np.asarray(image, np.uint8)
