"""Write pictures: PNG files, numbered PNG sequences, MP4."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.errors import InputError
from hairkit.imaging.picture_file import write_picture

FRAMES_PER_SECOND = 30


def free_name(path: Path) -> Path:
    """Return the path, or the first of `name_1`, `name_2`, ... that does not exist."""
    number, free = 0, path
    while free.exists():
        number += 1
        free = path.with_stem(f"{path.stem}_{number}")
    return free


class Recorder:
    """Records pictures one after the other; `close` ends the recording."""

    def __init__(self, path: Path) -> None:
        """Record into `path`: an .mp4 file, or a folder for `0000.png`, `0001.png`, ..."""
        self.path = path
        self.count = 0
        self._video: cv2.VideoWriter | None = None
        self._size = (0, 0)
        if path.suffix and path.suffix.lower() != ".mp4":
            raise InputError(
                f"{path}: cannot record to {path.suffix!r}, expected an .mp4 file or a folder"
            )
        self._is_video = path.suffix.lower() == ".mp4"
        if not self._is_video:
            path.mkdir(parents=True, exist_ok=True)

    def add(self, picture: UInt8Array) -> None:
        """Add a picture (H, W, 3) RGB; videos scale it to the size of the first one."""
        if self._is_video:
            self._add_to_video(picture)
        else:
            write_picture(self.path / f"{self.count:04d}.png", picture, durable=False)
        self.count += 1

    def close(self) -> None:
        """Finish the video file."""
        if self._video is not None:
            self._video.release()
            self._video = None

    def _add_to_video(self, picture: UInt8Array) -> None:
        even = picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]
        size = (even.shape[1], even.shape[0])
        if self._video is None:
            code = cv2.VideoWriter.fourcc(*"mp4v")
            self._video = cv2.VideoWriter(str(self.path), code, FRAMES_PER_SECOND, size)
            self._size = size
            if not self._video.isOpened():
                raise InputError(
                    f"{self.path}: this build of OpenCV cannot write MP4; record into a folder"
                )
        if size != self._size:
            even = np.asarray(cv2.resize(even, self._size, interpolation=cv2.INTER_AREA), np.uint8)
        self._video.write(np.ascontiguousarray(even[..., ::-1]))
