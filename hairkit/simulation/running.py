"""Runs a simulator without a window and keeps its frames."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import DataError, InputError
from hairkit.progress import Progress, Silent
from hairkit.simulation.motion import HeadMotion
from hairkit.simulation.simulator import Simulator, Surroundings
from hairkit.types.point_cache import PointCache

STAGE = "simulate"
"""Name of the progress bar."""


@dataclass(frozen=True, eq=False)
class Weather:
    """What acts on the hair besides the head, the same at all times."""

    wind: Float64Array = field(default_factory=lambda: np.zeros(3))
    """(3,) metres per second, world."""
    turbulence: float = 0.0
    """Gusts as a share of the wind."""
    gravity: Float64Array | None = None
    """(3,) metres per second squared; None takes the groom's."""


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
    """Return `frames` frames of the simulator's points; without warm-up the first is the rest.

    Parameters
    ----------
    simulator
        What `make_simulator` made; it is reset first.
    motion
        The head's motion; frame i is at `i / frames_per_second` of it, after the warm-up.
    frames, frames_per_second
        How many and how dense; the method takes as many substeps between as it needs.
    weather
        Wind and gravity; None: still air, the groom's gravity.
    warm_up
        Seconds simulated before the first frame, which are not kept: hair that already moves.
    progress
        Told of every frame.

    Raises
    ------
    DataError
        The simulator's points are no longer finite, or not as many as its strands have.
    """
    if frames < 1 or not frames_per_second > 0:
        raise InputError(f"{frames} frames at {frames_per_second} a second, expected both above 0")
    told, air = progress or Silent(), weather or Weather()
    began = perf_counter()
    before = round(warm_up * frames_per_second)
    told.started(STAGE, before + frames)
    times = np.arange(before + frames) / frames_per_second
    heads = np.empty((frames, 4, 4))
    points = _allocate_frames(frames, len(simulator.strands.points))
    for frame, time in enumerate(times):
        head = motion(float(time))
        if not frame:
            simulator.reset(head)
        else:
            around = Surroundings(head, air.wind, air.turbulence, air.gravity)
            simulator.advance(1.0 / frames_per_second, around)
        if frame >= before:
            _check_points(simulator.points, points.shape[1:], float(time))
            points[frame - before], heads[frame - before] = simulator.points, head
        told.stepped(STAGE)
    told.finished(STAGE, perf_counter() - began, False)
    return PointCache(points, times[:frames], heads)


def _allocate_frames(frames: int, points: int) -> Float32Array:
    """Return room for all frames; says that there is none before hours are spent."""
    size, memory = frames * points * 12, _physical_memory()
    if size > memory:
        raise InputError(
            f"{frames} frames of {points} points take {size / 2**30:.0f} GiB of memory,"
            f" here are {memory / 2**30:.0f}; ask for fewer frames"
        )
    return np.empty((frames, points, 3), np.float32)


def _physical_memory() -> float:
    """Return the bytes of this machine's memory, infinity where it does not tell."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return float("inf")


def _check_points(points: Float32Array, shape: tuple[int, ...], time: float) -> None:
    if np.shape(points) != shape:
        raise DataError(f"points has shape {np.shape(points)} at {time:.3f} s, expected {shape}")
    if not np.isfinite(points).all():
        raise DataError(
            f"the simulation is not finite at {time:.3f} s; take more substeps or less stiffness"
        )
