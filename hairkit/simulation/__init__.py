"""Simulation of guides: the contract of simulators, how the head moves, and point caches.

The methods are plugins: `manager.call("make_simulator", "pbd", groom=groom)` returns a `Simulator`.
"""

from __future__ import annotations

from hairkit.simulation.motion import HeadMotion, Shake, read_motion, shaken, still
from hairkit.simulation.running import Weather, run
from hairkit.simulation.simulator import Grab, Measures, Simulator, Surroundings

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
