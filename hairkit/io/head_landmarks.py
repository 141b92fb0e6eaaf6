"""Landmarks beside a mesh of a head, as vertices or points."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.errors import FormatError
from hairkit.storage import read_text

_MAX_LANDMARK_BYTES = 2**20


def read_landmarks(file: Path, count: int) -> Float64Array | None:
    """Return the landmarks beside a mesh of `count` vertices, in NAME.landmarks.json.

    They are (68,) numbers of vertices, or (68, 3) points in the file's unit and axes; None where
    there is no such file. Raises `FormatError`, which names it, where it holds anything else.
    """
    path = file.with_name(f"{file.stem}.landmarks.json")
    if not os.path.lexists(path):
        return None
    text = read_text(path, _MAX_LANDMARK_BYTES)
    try:
        data = json.loads(text)
        values = np.array(data["landmarks"] if isinstance(data, dict) else data, np.float64)
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise FormatError(f"{path}: not a JSON list of 68 landmarks ({error})") from error
    if values.shape not in ((68,), (68, 3)) or not np.isfinite(values).all():
        raise FormatError(f"{path}: expected 68 vertex numbers or 68 points, all finite")
    if values.ndim == 1 and ((values % 1 != 0).any() or values.min() < 0 or values.max() >= count):
        raise FormatError(f"{path}: a landmark names a vertex the head does not have")
    return values
