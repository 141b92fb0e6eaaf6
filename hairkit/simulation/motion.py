"""Head motion: keyframes with shakes on top, as a rigid motion at any time."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array, freeze
from hairkit.errors import FormatError, InputError
from hairkit.simulation import quaternion
from hairkit.storage import read_text
from hairkit.types.head import Head

AXES = {"pitch": (1.0, 0.0, 0.0), "yaw": (0.0, 1.0, 0.0), "roll": (0.0, 0.0, 1.0)}
"""Rotation axes of nod, turn and tilt, head frame."""
EASE = 0.25
"""Ease-in and ease-out time of a shake, seconds, which avoids a jerk at its start."""
RIGID_TOLERANCE = 1e-3
"""Largest deviation of R R^T from the identity in a key."""
_LARGEST_FILE = 64 * 2**20
"""Bytes."""


@dataclass(frozen=True)
class Shake:
    """A sinusoidal rotation of the head about its pivot."""

    axis: str
    """A name of `AXES`."""
    degrees: float
    """Amplitude."""
    hertz: float
    """Frequency."""
    until: float | None = None
    """Time at which it has stopped, seconds; None: never."""


@dataclass(frozen=True, eq=False)
class HeadMotion:
    """The rigid motion of the head since rest: interpolated keyframes and shakes."""

    times: Float64Array
    """(K,) ascending times of the keyframes, seconds."""
    keys: Float64Array
    """(K, 4, 4) `head_from_rest` at these times."""
    shakes: tuple[Shake, ...] = ()
    pivot: Float64Array | None = None
    """(3,) centre of the shakes, head frame; None: the origin."""

    def __post_init__(self) -> None:
        times = freeze(self, "times", np.float64, (None,), "motion times")
        if not len(times) or (np.diff(times) <= 0).any():
            raise InputError(
                f"{len(times)} keys of a head motion, expected one or more at ascending times"
            )
        keys = freeze(self, "keys", np.float64, (len(times), 4, 4), "motion keys")
        turn = keys[:, :3, :3]
        off = np.abs(np.einsum("kij,klj->kil", turn, turn) - np.eye(3)).max(initial=0.0)
        if (
            off > RIGID_TOLERANCE
            or (np.linalg.det(turn) < 0).any()
            or (keys[:, 3] != [0, 0, 0, 1]).any()
        ):
            raise InputError(
                f"keys of a head motion are not rigid: error {off:.3g}, expected at most"
                f" {RIGID_TOLERANCE:g};"
                " remove scale and shear"
            )
        freeze(self, "pivot", np.float64, (3,), "motion pivot")

    def __call__(self, time: float) -> Float64Array:
        """Return `head_from_rest` (4, 4) at `time`; constant outside the times of the keys."""
        motion = self._interpolate_keys(time)
        if not self.shakes:
            return motion
        return motion @ self._shake_transform(time)

    @property
    def end(self) -> float:
        """Time of the last key, seconds."""
        return float(self.times[-1])

    def _interpolate_keys(self, time: float) -> Float64Array:
        """Interpolate rotations and translations by a non-uniform Catmull-Rom spline."""
        if len(self.times) == 1 or time <= self.times[0]:
            return np.array(self.keys[0])
        if time >= self.times[-1]:
            return np.array(self.keys[-1])
        mixed = self._spline(time)
        motion = np.eye(4)
        motion[:3, :3] = quaternion.to_matrix(quaternion.normalize(mixed[:4]))
        motion[:3, 3] = mixed[4:]
        return motion

    @cached_property
    def _spline(self) -> Any:
        """Quaternion and place (7,) of the head at a time."""
        from scipy.interpolate import CubicHermiteSpline  # slow to load

        turns = _align_signs(quaternion.from_matrix(self.keys[:, :3, :3]))
        values = np.concatenate([turns, self.keys[:, :3, 3]], axis=1)
        key = np.arange(len(values))
        low, high = np.maximum(key - 1, 0), np.minimum(key + 1, key[-1])
        slopes = (values[high] - values[low]) / (self.times[high] - self.times[low])[:, None]
        return CubicHermiteSpline(self.times, values, slopes)

    def _shake_transform(self, time: float) -> Float64Array:
        turns = []
        for shake in self.shakes:
            angle = np.radians(shake.degrees) * np.sin(2 * np.pi * shake.hertz * time)
            turns.append((shake.axis, float(angle * _ease_in_out(time, shake.until))))
        return turn_about(np.zeros(3) if self.pivot is None else self.pivot, *turns)


def turn_about(pivot: Float64Array, *turns: tuple[str, float]) -> Float64Array:
    """Return the rotation (4, 4) by angles, radians, about axes through a point (3,), last first.

    Yaw turns to the subject's left, pitch nods down, roll tilts to the right shoulder.
    """
    motion = np.eye(4)
    for axis, angle in turns:
        motion[:3, :3] = motion[:3, :3] @ quaternion.to_matrix(
            quaternion.from_axis(AXES[axis], angle)
        )
    motion[:3, 3] = pivot - motion[:3, :3] @ pivot
    return motion


def static_motion() -> HeadMotion:
    """Return the motion of a head that does not move."""
    return HeadMotion(np.zeros(1), np.eye(4)[None])


def add_shakes(
    texts: Sequence[str], head: Head | None = None, base: HeadMotion | None = None
) -> HeadMotion:
    """Return `base`, or a head at rest, with shakes added.

    Parameters
    ----------
    texts
        `yaw:20:1.5` is yaw (or pitch, roll) by 20 degrees to each side, 1.5 times a second;
        `yaw:20:1.5:2` stops after 2 seconds.
    head
        The shakes rotate about its neck joint; None: about the origin.
    base
        Motion to add them to; None: the head rests.

    Raises
    ------
    InputError
        A text does not have that form.
    """
    start = base if base is not None else static_motion()
    pivot = None if head is None else head.joints[1].astype(np.float64)
    return HeadMotion(start.times, start.keys, tuple(_parse_shake(text) for text in texts), pivot)


def read_motion(path: Path) -> HeadMotion:
    """Read a head motion: a `.json` file, or a `.glb` or `.gltf` file with an animated head.

    JSON: `{"times": [0, 0.5], "head_from_rest": [[16 numbers, row by row], ...]}`, or keys
    `{"frames": [{"time": 0, "turn_deg": [pitch, yaw, roll], "move": [x, y, z]}, ...]}`.

    Raises
    ------
    FormatError
        The content is not a head motion.
    InputError
        The file does not exist or has another suffix.
    """
    if path.suffix.lower() in (".glb", ".gltf"):
        from hairkit.io.glb_motion import read_head_motion

        times, keys = read_head_motion(path)
        return HeadMotion(times, keys)
    if path.suffix.lower() != ".json":
        raise InputError(
            f"{path}: a head motion with suffix {path.suffix!r}; expected .json, .glb or .gltf"
        )
    return _read_json(path)


def _read_json(path: Path) -> HeadMotion:
    text = read_text(path, _LARGEST_FILE)
    try:
        found = json.loads(text)
        if "frames" in found:
            frames = found["frames"]
            times = np.array([float(frame["time"]) for frame in frames])
            keys = np.stack([_parse_key(frame) for frame in frames])
        else:
            times = np.array(found["times"], np.float64)
            keys = np.array(found["head_from_rest"], np.float64).reshape(len(times), 4, 4)
        return HeadMotion(times, keys)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise FormatError(f"{path}: {error}") from error
        what = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise FormatError(f"{path}: not a head motion ({what})") from error


def _parse_key(frame: dict[str, object]) -> Float64Array:
    """Return a key: rotation by pitch, then roll, then yaw, then translation."""
    pitch, yaw, roll = np.radians(np.array(frame.get("turn_deg", (0, 0, 0)), np.float64))
    key = turn_about(np.zeros(3), ("yaw", yaw), ("roll", roll), ("pitch", pitch))
    key[:3, 3] = np.array(frame.get("move", (0, 0, 0)), np.float64)
    return key


def _parse_shake(text: str) -> Shake:
    names = "|".join(AXES)
    number = r"[-+]?\d*\.?\d+"
    match = re.fullmatch(rf"({names}):({number}):({number})(?::({number}))?", text.strip())
    if not match or not 0 <= float(match[3]) <= 100:
        raise InputError(
            f"shake {text!r}, expected AXIS:DEGREES:HERTZ[:SECONDS] with {', '.join(AXES)},"
            " as yaw:20:1.5"
        )
    until = None if match[4] is None else float(match[4])
    return Shake(match[1], float(match[2]), float(match[3]), until)


def _ease_in_out(time: float, until: float | None) -> float:
    def ramp(share: float) -> float:
        t = min(max(share, 0.0), 1.0)
        return t * t * (3 - 2 * t)

    return ramp(time / EASE) * (1.0 if until is None else ramp((until - time) / EASE))


def _align_signs(turns: Float64Array) -> Float64Array:
    """Choose the signs of quaternions so that neighbours are close."""
    sign = np.sign((turns[1:] * turns[:-1]).sum(axis=1))
    sign[sign == 0] = 1.0
    return np.asarray(turns * np.concatenate([[1.0], np.cumprod(sign)])[:, None])
