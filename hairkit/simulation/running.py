"""Run a simulator without a window and record its frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.compilation import announce_compilation
from hairkit.errors import DataError, DivergedError, InputError
from hairkit.parallel import one_blas_thread
from hairkit.progress import Progress, Silent
from hairkit.simulation.motion import HeadMotion
from hairkit.simulation.simulator import Simulator, Surroundings
from hairkit.system import physical_bytes
from hairkit.types.point_cache import PointCache

LONGEST = 0.01
"""Largest stretch of hair that a recording may keep for a second."""
STAGE = "simulate"
"""Name of the progress bar."""


@dataclass(frozen=True, eq=False)
class Weather:
    """Constant wind and gravity of a run."""

    wind: Float64Array = field(default_factory=lambda: np.zeros(3))
    """(3,) mean velocity, world, metres per second."""
    turbulence: float = 0.0
    """RMS speed of gusts over the mean speed."""
    gravity: Float64Array | None = None
    """(3,) world, metres per second squared; None: the groom's."""


@one_blas_thread()
def run(
    simulator: Simulator,
    motion: HeadMotion,
    frames: int,
    frames_per_second: float = 60.0,
    *,
    weather: Weather | None = None,
    warm_up: float = 0.0,
    progress: Progress | None = None,
) -> PointCache:
    """Return `frames` frames of the simulator's points; without warm-up the first is at rest.

    Parameters
    ----------
    simulator
        The simulator; it is reset first.
    motion
        Motion of the head; frame i is at time `warm_up + i / frames_per_second`.
    frames, frames_per_second
        Number and rate; the simulator divides the time between two frames into substeps.
    weather
        Wind and gravity; None: no wind, the groom's gravity.
    warm_up
        Seconds simulated before the first frame and not recorded.
    progress
        Notified of each frame.

    Raises
    ------
    DataError
        There are not as many points as in `simulator.strands`.
    DivergedError
        A point is not finite, or hair is stretched by more than `LONGEST` for a second on end.
    InputError
        `frames` or `frames_per_second` is not positive, or the frames do not fit into memory.
    """
    if frames < 1 or not frames_per_second > 0:
        raise InputError(
            f"{frames} frames at {frames_per_second} per second, expected both above 0"
        )
    told, air = progress or Silent(), weather or Weather()
    began = perf_counter()
    before = round(warm_up * frames_per_second)
    told.started(STAGE, before + frames)
    times = np.arange(before + frames) / frames_per_second
    heads = np.empty((frames, 4, 4))
    points, stretched = _allocate_frames(frames, len(simulator.strands.points)), 0
    with announce_compilation(told.message):
        for frame, time in enumerate(times):
            head = motion(float(time))
            _move(simulator, head, 1.0 / frames_per_second if frame else 0.0, air)
            if frame >= before:
                _check_points(simulator.points, points.shape[1:], float(time))
                stretched = _check_stretch(simulator, stretched, frames_per_second, float(time))
                points[frame - before], heads[frame - before] = simulator.points, head
            told.stepped(STAGE)
    told.finished(STAGE, perf_counter() - began, False)
    return PointCache(points, times[:frames], heads)


def _move(simulator: Simulator, head: Float64Array, seconds: float, air: Weather) -> None:
    """Go on to a head (4, 4) by `seconds`; by none, begin at rest on it."""
    if not seconds:
        simulator.reset(head)
        return
    around = Surroundings(head, air.wind, air.turbulence, air.gravity)
    simulator.advance(seconds, around)


def _allocate_frames(frames: int, points: int) -> Float32Array:
    """Allocate all frames; raises `InputError` if they do not fit into memory."""
    size, memory = frames * points * 12, physical_bytes()
    if size > memory:
        raise InputError(
            f"{frames} frames of {points} points take {size / 2**30:.0f} GiB of memory, expected at"
            f" most {memory / 2**30:.0f}; record fewer frames"
        )
    return np.empty((frames, points, 3), np.float32)


def _check_points(points: Float32Array, shape: tuple[int, ...], time: float) -> None:
    if np.shape(points) != shape:
        raise DataError(f"points has shape {np.shape(points)} at {time:.3f} s, expected {shape}")
    if not np.isfinite(points).all():
        raise DivergedError(
            f"the simulation diverged at {time:.3f} s; use more substeps or less stiffness"
        )


def _check_stretch(simulator: Simulator, stretched: int, rate: float, time: float) -> int:
    """Return how many frames on end hair is stretched; raises `DivergedError` after a second."""
    if simulator.measure().stretch <= LONGEST:
        return 0
    if stretched >= rate:
        raise DivergedError(
            f"hair is stretched by more than {100 * LONGEST:g} % at {time:.3f} s and does not come"
            " back; use more substeps or less stiffness"
        )
    return stretched + 1
