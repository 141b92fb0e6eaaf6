"""Pictures as PNG and JPEG files."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.errors import InputError
from hairkit.storage import write_bytes


def encode_picture(picture: UInt8Array, kind: str = ".png", level: int | None = None) -> bytes:
    """Return a grey, RGB or RGBA picture (H, W[, 3 or 4]) as a file.

    `level` is the quality of a JPEG, 0 to 100, or the compression of a PNG, 0 to 9; OpenCV's if
    None.
    """
    if picture.ndim == 3:
        picture = np.ascontiguousarray(picture[..., [2, 1, 0, 3][: picture.shape[2]]])
    flag = cv2.IMWRITE_PNG_COMPRESSION if kind == ".png" else cv2.IMWRITE_JPEG_QUALITY
    done, data = cv2.imencode(kind, picture, [] if level is None else [flag, level])
    if not done:
        raise InputError(f"a picture of {picture.shape[:2]} cannot be encoded as {kind}")
    return data.tobytes()


def write_picture(
    path: str | os.PathLike[str],
    picture: UInt8Array,
    level: int | None = None,
    *,
    durable: bool = True,
) -> None:
    """Write a picture as PNG or JPEG, as the name says, atomically; see `encode_picture`."""
    kind = Path(path).suffix.lower()
    if kind not in (".png", ".jpg", ".jpeg"):
        raise InputError(f"{path}: pictures are written as .png or .jpg")
    write_bytes(path, encode_picture(picture, kind, level), durable=durable)
