"""Runs a simulator without a window and keeps its frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from hairkit.errors import HairkitError, InputError
from hairkit.point_cache import PointCache
from hairkit.progress import Progress, Silent
from hairkit.simulate.contract import Simulator, Surroundings
from hairkit.simulate.motion import HeadMotion
from hairkit.stored import Float32Array, Float64Array

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
    HairkitError
        The simulator's points are no longer finite.
    """
    if frames < 1 or not frames_per_second > 0:
        raise InputError(f"{frames} frames at {frames_per_second} a second, expected both above 0")
    told, air = progress or Silent(), weather or Weather()
    began = perf_counter()
    before = round(warm_up * frames_per_second)
    told.started(STAGE, before + frames)
    times = np.arange(before + frames) / frames_per_second
    heads = np.stack([motion(float(time)) for time in times])
    points = np.empty((frames, len(simulator.strands.points), 3), np.float32)
    simulator.reset(heads[0])
    for frame, head in enumerate(heads):
        if frame:
            around = Surroundings(head, air.wind, air.turbulence, air.gravity)
            simulator.advance(1.0 / frames_per_second, around)
        if frame >= before:
            points[frame - before] = simulator.points
            _check(points[frame - before], float(times[frame]))
        told.stepped(STAGE)
    told.finished(STAGE, perf_counter() - began, False)
    return PointCache(points, times[:frames], heads[before:])


def _check(points: Float32Array, time: float) -> None:
    if not np.isfinite(points).all():
        raise HairkitError(
            f"the simulation is not finite at {time:.3f} s; take more substeps or less stiffness"
        )
