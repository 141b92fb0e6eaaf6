"""The process that decodes a video: a damaged file may crash a decoder, and must not end a run.

Asked for a `video`, it writes the arrays to `target`, an .npz file, or answers why it is `refused`.

* `scan`: small grey frames of a `width`, `most` to twice as many, their numbers and sharpness
* `pick`: the frames with these `numbers`, scaled down to the `edge`
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from hairkit import worker


def scan(video: Any, width: int, most: int) -> dict[str, Any]:
    """Return small grey frames (N, H, W), their numbers (N,) and sharpness (N,).

    Sharpness is the variance of the Laplacian (Pech-Pacheco et al. 2000), at four times the width.
    Seconds are compared with those that the file claims, not frames: Matroska has no count of them,
    and their rate may vary. Recordings of browsers claim nothing.
    """
    frames, rate = (video.get(k) for k in (cv2.CAP_PROP_FRAME_COUNT, cv2.CAP_PROP_FPS))
    lasts = 1 / rate if rate > 0 else 0.0
    claimed = max(frames * lasts, 0.0)
    every = max(1, int(frames) // most)
    small: list[Any] = []
    numbers: list[int] = []
    sharp: list[float] = []
    number, read = 0, 0.0
    while video.grab():
        read = max(read, video.get(cv2.CAP_PROP_POS_MSEC) / 1000 + lasts)
        if number % every == 0:
            if len(numbers) == 2 * most:  # longer than it claims
                every *= 2
                for kept in (small, numbers, sharp):
                    del kept[1::2]
            decoded, frame = video.retrieve()
            if not decoded or frame is None:
                break
            grey = cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
            height = max(1, round(grey.shape[0] * width / grey.shape[1]))
            middle = cv2.resize(grey, (4 * width, 4 * height), interpolation=cv2.INTER_AREA)
            small.append(cv2.resize(middle, (width, height), interpolation=cv2.INTER_AREA))
            sharp.append(float(cv2.Laplacian(middle, cv2.CV_32F).var()))
            numbers.append(number)
        number += 1
    return {"claimed": claimed, "read": read, "small": small, "numbers": numbers, "sharp": sharp}


def pick(video: Any, edge: int, numbers: list[int]) -> dict[str, Any]:
    """Return the frames with ascending numbers as RGB (N, H, W, 3), and their size on disk."""
    frames, size = [], (0, 0)
    for number in range(numbers[-1] + 1):
        if not video.grab():
            break
        if number in numbers:
            decoded, frame = video.retrieve()
            if not decoded or frame is None:
                break
            size = frame.shape[1], frame.shape[0]
            scale = min(1.0, edge / max(size))
            fitted = [max(1, round(side * scale)) for side in size]
            frames.append(cv2.resize(frame, fitted, interpolation=cv2.INTER_AREA)[..., ::-1])
    return {"frames": frames, "size": size}


def main() -> None:
    """Answer for both."""
    cv2.setNumThreads(1)
    worker.answer_questions(
        {
            "scan": lambda asked, _: _write(asked, scan, asked["width"], asked["most"]),
            "pick": lambda asked, _: _write(asked, pick, asked["edge"], asked["numbers"]),
        }
    )


def _write(asked: dict[str, Any], find: Callable[..., dict[str, Any]], *rest: Any) -> Any:
    """Write what is found in the video, if OpenCV opens it."""
    video = cv2.VideoCapture(asked["video"])
    video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 1)
    if not video.isOpened():
        return {"refused": "OpenCV cannot open it"}
    arrays: dict[str, Any] = {k: np.asarray(v) for k, v in find(video, *rest).items()}
    np.savez(asked["target"], **arrays)
    return {}


if __name__ == "__main__":
    main()
