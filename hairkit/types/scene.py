"""The solved set-up of a capture: one camera a view and the head fitted to the photos."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hairkit.arrays import Float32Array, UInt8Array, freeze
from hairkit.errors import DataError, FormatError
from hairkit.storage import Stored, read_text, write_text
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.preview import PHOTO_HEIGHT, Previewed, draw_view, row

WHOLE_TURN, ONE_SIDE_DEG = 3, 200.0
"""Fewest views that go around a head, and the largest step between them from which they do not."""


@dataclass(frozen=True, eq=False)
class Scene(Previewed, Stored):
    """Cameras in view order and the fitted head, all in the head frame."""

    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    head: Head
    residual_px: float | None = None
    """Root mean square misfit of the cameras in working pixels; None when never measured."""
    points: Float32Array | None = None
    """(P, 3) points of the person's skin that photos show, metres; None when none were found."""

    def __post_init__(self) -> None:
        if len(self.names) != len(self.cameras) or not self.cameras:
            raise DataError(
                f"scene has {len(self.cameras)} cameras for {len(self.names)} view names"
            )
        freeze(self, "points", np.float32, (None, 3), "scene points")

    def __repr__(self) -> str:
        misfit = "" if self.residual_px is None else f", residual {self.residual_px:.2f} px"
        head = len(self.head.vertices)
        return f"Scene({len(self.cameras)} cameras, head of {head} vertices{misfit})"

    @property
    def one_sided(self) -> bool:
        """Whether the views leave more than half of the head unseen: one, two, or all of a side."""
        around = np.sort([camera.azimuth_deg % 360.0 for camera in self.cameras])
        steps = np.diff(around, append=around[0] + 360.0)
        return len(self.cameras) < WHOLE_TURN or bool(steps.max() > ONE_SIDE_DEG)

    def resized(self, sizes: Sequence[tuple[int, int]]) -> Self:
        """Return the scene with cameras for pictures of other sizes (width, height)."""
        pairs = zip(self.cameras, sizes, strict=True)
        return replace(self, cameras=tuple(camera.resized(*size) for camera, size in pairs))

    def preview(self) -> UInt8Array | None:
        """Return the head as the cameras see it, side by side, (H, W, 3) uint8 RGB."""
        small = (
            camera.resized(round(camera.width * PHOTO_HEIGHT / camera.height), PHOTO_HEIGHT)
            for camera in self.cameras
        )
        return row([draw_view(camera, self.head) for camera in small], PHOTO_HEIGHT)

    def write_json(
        self, path: str | os.PathLike[str], photos: Sequence[str | None] | None = None
    ) -> None:
        """Write cameras and head joints as JSON, cameras in the form of `truth.json`.

        `photos` are the file names of the views' photos, None for those that have no file.
        """
        named = zip(self.names, photos or [None] * len(self.names), self.cameras, strict=True)
        views = [
            camera.to_json(name) | ({} if photo is None else {"photo": photo})
            for name, photo, camera in named
        ]
        joints = dict(zip(("root", "neck", "head"), self.head.joints.tolist(), strict=True))
        document = {
            "units": "metres",
            "views": views,
            "head": {"joints": joints},
            "residual_px": self.residual_px,
        }
        write_text(path, json.dumps(document, indent=1) + "\n")


def read_cameras(path: str | os.PathLike[str]) -> tuple[tuple[str, ...], tuple[Camera, ...]]:
    """Read view names and cameras from a `scene.json` or a capture's `truth.json`."""
    try:
        views = json.loads(read_text(path))["views"]
        names = tuple(str(view.get("name", index)) for index, view in enumerate(views))
        return names, tuple(Camera.from_json(view) for view in views)
    except (json.JSONDecodeError, KeyError, TypeError, AttributeError) as error:
        raise FormatError(f"{path}: no cameras could be read ({error})") from error
