"""Photos turned upright and cropped to the head, at the resolution of the files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.io.photos import read_photo
from hairkit.types.capture import View

LEAST_EDGE = 720
"""Parts of photos are enlarged to this long edge in pixels, if the photo has it: later stages
follow strands of a few pixels."""


def frame_view(view: View, quarter_turns: int, frame: Sequence[int], head: Float64Array) -> View:
    """Return a view of a part of its photo, upright.

    The longer side of the picture has at most as many pixels as that of the view.

    Parameters
    ----------
    view
        A whole photo.
    quarter_turns
        Clockwise, which bring it upright.
    frame
        Left, top, right and bottom edge of the part, pixels of the upright photo on disk.
    head
        (2,) the middle of the head there.

    Raises
    ------
    InputError
        The photo cannot be read again.
    """
    upright = view.turned(quarter_turns)
    left, top, right, bottom = map(int, frame)
    if (left, top, right, bottom) == upright.frame:
        return upright
    picture = _whole_photo(upright)
    scale = upright.photo_size[0] / picture.shape[1]
    first, last, above, below = (round(edge / scale) for edge in (left, right, top, bottom))
    part = picture[above:below, first:last]
    most, edge = max(view.width, view.height), max(part.shape)
    factor = min(max(edge, LEAST_EDGE), most) / edge
    size = [max(1, round(factor * length)) for length in part.shape[1::-1]]
    how = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    image = np.asarray(cv2.resize(part, size, interpolation=how), np.uint8)
    found = replace(
        upright, image=image, cropped=(left, top, right, bottom), face=None, person=None,
        head=(float(head[0]), float(head[1])),
    )  # fmt: skip
    focal, points = upright.focal_px, upright.landmarks
    return replace(
        found,
        focal_px=None if focal is None else focal * upright.scale / found.scale,
        landmarks=None if points is None else found.from_photo(upright.to_photo(points)),
    )


def on_photo(
    picture: npt.NDArray[Any], frame: npt.ArrayLike, size: tuple[int, int]
) -> npt.NDArray[Any]:
    """Return what lies in a part of an upright photo as a picture of all of it, 0 elsewhere.

    Parameters
    ----------
    picture
        (h, w, ...) any values; the nearest are taken.
    frame
        Left, top, right and bottom edge of the part, pixels of the photo.
    size
        Width and height of the photo.
    """
    left, top, right, bottom = np.asarray(frame, np.int64).tolist()
    whole = np.zeros((size[1], size[0], *picture.shape[2:]), picture.dtype)
    fitting: Any = cv2.resize(
        picture, (right - left, bottom - top), interpolation=cv2.INTER_NEAREST
    )
    whole[top:bottom, left:right] = fitting
    return whole


def _whole_photo(view: View) -> UInt8Array:
    """Return the upright photo with all pixels of its file; those of the view without a file."""
    if view.photo_path is None or view.scale <= 1 or not view.photo_path.is_file():
        return view.image
    return np.rot90(read_photo(view.photo_path)[0], -view.quarter_turns)
