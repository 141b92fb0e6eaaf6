"""The simulator of the viewer: a plugin and its option values, or hair that moves rigidly."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.options import OptionInfo, unknown_name
from hairkit.simulation.simulator import Measures, Simulator, Surroundings
from hairkit.types.groom import Groom

PREFERRED = "rods"
"""Plugin used if none is named."""
NO_SIMULATOR = "none"
"""Name that stands for no simulation."""
OPTION_STEPS = 20
"""Steps from the lowest to the highest value of an option."""
RELATIVE_STEP = 0.1
"""Step of an option without a useful range, as a share of its value."""


class RigidHair:
    """Hair that moves rigidly with the head, for viewing without a simulator."""

    options = None

    def __init__(self, groom: Groom) -> None:
        self.strands = groom.strands
        self.reset()

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Move the hair with the head."""
        self.time += seconds
        self._move(surroundings.head_from_rest)

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Move the hair to the head; set the time to 0."""
        self.time = 0.0
        self._move(np.eye(4) if head_from_rest is None else np.asarray(head_from_rest))

    def retune(self, options: Any) -> None:
        """Do nothing: there are no options."""

    def measure(self) -> Measures:
        """Return zeros: rigid hair has no strain."""
        return Measures(0.0, 0.0, 0.0)

    def _move(self, matrix: npt.NDArray[np.float64]) -> None:
        moved = self.strands.points @ matrix[:3, :3].T + matrix[:3, 3]
        self.points: Float32Array = moved.astype(np.float32)


def default_simulator(manager: Manager) -> str:
    """Return the name of the simulator used if none is named."""
    names = manager.names("make_simulator")
    return PREFERRED if PREFERRED in names else (names[0] if names else NO_SIMULATOR)


class TunableSimulator:
    """A simulator whose options can be changed while it runs."""

    def __init__(self, manager: Manager, groom: Groom, plugin: str | None = None) -> None:
        """Make the simulator `plugin`; None: `rods`, or the first installed one, or `none`."""
        names = manager.names("make_simulator")
        plugin = default_simulator(manager) if plugin is None else plugin
        if plugin not in (*names, NO_SIMULATOR):
            raise InputError(unknown_name("simulator", plugin, [*names, NO_SIMULATOR]))
        self._manager, self._groom = manager, groom
        self.plugin = plugin
        self.values: dict[str, Any] = {}
        """Values of the options that differ from their defaults."""

    @cached_property
    def simulator(self) -> Simulator:
        """The simulator, made when it is first asked for."""
        if self.plugin == NO_SIMULATOR:
            return RigidHair(self._groom)
        made: Simulator = self._manager.call("make_simulator", self.plugin, None, groom=self._groom)
        return made

    @property
    def points(self) -> Float32Array:
        """(P, 3) present positions, world, metres: those at rest until there is a simulator."""
        return self.simulator.points if "simulator" in vars(self) else self._groom.strands.points

    @property
    def infos(self) -> tuple[OptionInfo, ...]:
        """The options of the plugin."""
        return () if self.plugin == NO_SIMULATOR else self._manager.info(self.plugin).options

    def value(self, name: str) -> Any:
        """Return the present value of an option."""
        value = self.values.get(name, self._info(name).default)
        return getattr(self.simulator.options, name) if value is None else value

    def set(self, name: str, value: object) -> None:
        """Change one option; raises `OptionError` if the value is invalid."""
        info = self._info(name)
        options = self._manager.options(self.plugin, {**self.values, name: value})
        checked = getattr(options, name)
        self.values.pop(name, None)
        if checked != info.default:
            self.values[name] = checked
        self.simulator.retune(options)

    def replace(self, values: dict[str, object]) -> None:
        """Set these options, and all others to their defaults."""
        options = self._manager.options(self.plugin, values)
        self.values = {name: getattr(options, name) for name in values}
        self.simulator.retune(options)

    def step_option(self, name: str, steps: int) -> Any:
        """Return an option's value some steps on."""
        return step_value(self._info(name), self.value(name), steps)

    def _info(self, name: str) -> OptionInfo:
        for info in self.infos:
            if info.name == name:
                return info
        raise InputError(unknown_name("option", name, [info.name for info in self.infos]))


def step_value(info: OptionInfo, value: Any, steps: int) -> Any:
    """Return an option's value some steps on: of its range, its choices, or on and off."""
    if info.choices:
        return info.choices[(info.choices.index(value) + steps) % len(info.choices)]
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return int(_clamp(info, value + steps))
    if isinstance(value, float):
        return float(_clamp(info, value + steps * _step_size(info, value)))
    return value


def _step_size(info: OptionInfo, value: float) -> float:
    if info.low is not None and info.high is not None and info.high <= 100 * max(abs(value), 1e-9):
        return (info.high - info.low) / OPTION_STEPS
    return RELATIVE_STEP * max(abs(value), 1e-3)


def _clamp(info: OptionInfo, value: float) -> float:
    low = -np.inf if info.low is None else info.low
    high = np.inf if info.high is None else info.high
    return float(np.clip(value, low, high))
