"""Simulation of guides: the contract of simulators, how the head moves, and point caches.

The methods are plugins: `manager.call("make_simulator", "pbd", groom=groom)` returns a `Simulator`.
"""

from __future__ import annotations

from hairkit.simulate.motion import HeadMotion, Shake, read_motion, shaken, still
from hairkit.simulate.running import Weather, run
from hairkit.simulate.simulator import Grab, Measures, Simulator, Surroundings

__all__ = [
    "Grab",
    "HeadMotion",
    "Measures",
    "Shake",
    "Simulator",
    "Surroundings",
    "Weather",
    "read_motion",
    "run",
    "shaken",
    "still",
]
