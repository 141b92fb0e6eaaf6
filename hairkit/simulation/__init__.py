"""Simulation of guides: the contract of simulators, how the head moves, and point caches.

The methods are plugins: `manager.call("make_simulator", "pbd", groom=groom)` returns a `Simulator`.
"""

from __future__ import annotations

from hairkit.simulation.motion import HeadMotion, Shake, add_shakes, read_motion, static_motion
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
    "add_shakes",
    "read_motion",
    "run",
    "static_motion",
]
