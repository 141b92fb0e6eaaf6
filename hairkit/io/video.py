"""A video of a turn as a capture: the sharpest frames at even steps of the turn.

Whoever films turns unevenly, and stops. Frames are therefore spread evenly over the motion in the
picture, summed from frame to frame (optical flow, Farnebaeck 2003), not over time. Around each of
these places the sharpest frame is taken. From where each was filmed, and in which direction the
turn ran, is found later, by the stage `turn`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import median_filter

from hairkit.arrays import Float64Array, Int64Array
from hairkit.child_process import ChildError, Limits, ask_for_arrays
from hairkit.errors import FormatError, InputError
from hairkit.io import video_child
from hairkit.storage import open_file
from hairkit.types.capture import Capture, View

SUFFIXES = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm")
"""Endings of the files that are taken for videos."""
FRAMES = 16
"""Frames taken: one every 22.5 degrees of one turn."""
SMALL_WIDTH = 96
"""Width in pixels of the frames whose motion is measured."""
MOST_SCANNED = 600
"""Frames looked at, at least; of longer videos only every second, third, ... is."""
STILL_PX = 0.05
"""Motion from frame to frame that counts as none: noise and compression, pixels of small frames."""
FARNEBACK: dict[str, Any] = {
    "pyr_scale": 0.5, "levels": 3, "winsize": 9, "iterations": 2, "poly_n": 5, "poly_sigma": 1.1,
    "flags": 0,
}  # fmt: skip
"""Settings of the flow, as OpenCV's documentation advises, its window smaller for small frames."""
STEADY_FRAMES = 5
"""Frames of which the median motion is taken."""
LEAST_MOTION_PX = 30.0
"""Motion of a whole video, pixels of small frames: a head of 30 pixels' breadth that turns once
moves by about 90."""
WINDOW = 0.3
"""Half the way between two places, as its share, in which the sharpest frame is looked for."""
LEAST_READABLE = 0.9
"""Share of the seconds that the file claims which must be there."""
TIME_LIMIT_S = 600.0
"""Seconds to decode a video; 4K decodes at ten frames a second on a slow core."""


def is_video(path: Path) -> bool:
    """Return whether a path is a file with the ending of a video."""
    return path.suffix.lower() in SUFFIXES and path.is_file()


def read_video(path: Path, max_edge: int, count: int = FRAMES) -> Capture:
    """Return the capture of a video: `count` frames, upright by its rotation tag.

    Raises
    ------
    InputError
        The file cannot be decoded, is cut short, too short, or nothing moves in it.
    """
    open_file(path).close()
    found = _decode("scan", path, width=SMALL_WIDTH, most=MOST_SCANNED)
    numbers, claimed, read = found["numbers"], float(found["claimed"]), float(found["read"])
    if read < LEAST_READABLE * claimed:
        raise FormatError(f"{path}: only {read:.1f} of {claimed:.1f} s can be read; save it again")
    if len(numbers) < count:
        raise InputError(f"{path}: {len(numbers)} frames, expected a turn of at least {count}")
    chosen = choose_frames(frame_motion(found["small"]), found["sharp"], count, str(path))
    wanted = numbers[chosen]
    picked = _decode("pick", path, edge=max_edge, numbers=wanted.tolist())
    if len(picked["frames"]) != count:
        raise FormatError(f"{path}: some frames cannot be read twice; save it again")
    width, height = (int(side) for side in picked["size"])
    views = tuple(
        View(
            f"view-{index + 1}",
            360.0 * index / count,
            frame,
            photo_path=path.with_name(f"{path.name}#{number}"),
            photo_size=(width, height),
            named=False,
        )
        for index, (frame, number) in enumerate(zip(picked["frames"], wanted, strict=True))
    )
    return Capture(views, source=path, max_edge=max_edge)


def frame_motion(small: npt.NDArray[np.uint8]) -> Float64Array:
    """Return (N,) the motion summed from the first of grey frames (N, H, W) to each, pixels.

    The motion of a frame is the mean length of its optical flow in the middle half of the picture,
    the median over some frames: the flow between a sharp and a blurred frame is wrong.
    """
    height, width = small.shape[1:]
    rows, columns = slice(height // 6, -height // 3 or None), slice(width // 4, -width // 4 or None)
    moved = np.zeros(len(small))
    for index in range(1, len(small)):
        flow: Any = cv2.calcOpticalFlowFarneback(  # type: ignore[call-overload]
            small[index - 1], small[index], None, **FARNEBACK
        )
        moved[index] = np.linalg.norm(flow[rows, columns], axis=-1).mean()
    steady = median_filter(moved, STEADY_FRAMES)
    return np.cumsum(np.maximum(steady - STILL_PX, 0.0))


def choose_frames(
    motion: Float64Array, sharp: Float64Array, count: int, source: str = "video"
) -> Int64Array:
    """Return (count,) ascending indices of sharp frames at even steps of the summed motion.

    Parameters
    ----------
    motion
        (N,) motion summed from the first frame, pixels.
    sharp
        (N,) sharpness of each frame, larger is better.
    count
        Frames wanted.
    source
        What to name in the error message.

    Raises
    ------
    InputError
        The motion is less than that of a turn, or comes in too few frames.
    """
    if motion[-1] < LEAST_MOTION_PX:
        raise InputError(f"{source}: hardly anything moves in it, expected a turn around a head")
    step = motion[-1] / count
    chosen = []
    for place in (np.arange(count) + 0.5) * step:
        near = np.flatnonzero(np.abs(motion - place) <= WINDOW * step)
        if not len(near):
            near = np.abs(motion - place).argmin(keepdims=True)
        chosen.append(int(near[np.argmax(sharp[near])]))
    if len(set(chosen)) < count:
        raise InputError(f"{source}: the turn is too fast, expected at least {count} frames of it")
    return np.array(chosen)


def _decode(mode: str, path: Path, **values: Any) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays that the process for decoding writes; `FormatError` when it fails."""
    question = {"do": mode, "video": str(path.resolve()), **values}
    try:
        answer, arrays = ask_for_arrays(Path(video_child.__file__), question, Limits(TIME_LIMIT_S))
    except ChildError as error:
        if error.limit:
            raise InputError(f"{path}: its decoder {error}; cut it") from error
        raise FormatError(f"{path}: not a readable video: its decoder {error}") from error
    if "refused" in answer:
        raise FormatError(f"{path}: not a readable video: {answer['refused']}")
    return arrays
