"""Write a picture as PNG or JPEG."""

from __future__ import annotations

import os
from pathlib import Path

import cv2

from hairkit.arrays import UInt8Array
from hairkit.errors import InputError
from hairkit.storage import write_bytes


def write_picture(path: str | os.PathLike[str], picture: UInt8Array) -> None:
    """Write a picture (H, W, 3) RGB as PNG or JPEG, as the name says, atomically."""
    kind = Path(path).suffix.lower()
    if kind not in (".png", ".jpg", ".jpeg"):
        raise InputError(f"{path}: pictures are written as .png or .jpg")
    done, data = cv2.imencode(kind, picture[..., ::-1])
    if not done:
        raise InputError(f"{path}: the picture of {picture.shape[:2]} cannot be encoded")
    write_bytes(path, data.tobytes())
