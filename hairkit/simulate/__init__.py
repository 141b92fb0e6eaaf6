"""Simulation of guides: the contract of simulators, how the head moves, and point caches.

The methods are plugins: `manager.call("make_simulator", "pbd", groom=groom)` returns a `Simulator`.
"""

from __future__ import annotations

from hairkit.simulate.contract import Grab, Measures, Simulator, Surroundings

__all__ = ["Grab", "Measures", "Simulator", "Surroundings"]
