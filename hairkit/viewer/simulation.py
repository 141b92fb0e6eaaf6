"""The simulator behind the preview: a plugin by name, tuned by its own options, or none at all."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.options import OptionInfo, unknown_name
from hairkit.simulation.simulator import Measures, Simulator, Surroundings
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

PREFERRED = "pbd"
STILL = "none"


class StillHair:
    """Hair that goes rigidly with the head: what is shown when no simulator is there."""

    def __init__(self, groom: Groom) -> None:
        self._strands = groom.strands
        self._time = 0.0
        self._points = groom.strands.points

    @property
    def strands(self) -> Strands:
        """The guides at rest."""
        return self._strands

    @property
    def options(self) -> Any:
        """There are none."""
        return None

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self._time

    @property
    def points(self) -> Float32Array:
        """(P, 3) present positions."""
        return self._points

    def advance(self, seconds: float, surroundings: Surroundings) -> None:
        """Go with the head."""
        self._time += seconds
        self._move(surroundings.head_from_rest)

    def reset(self, head_from_rest: npt.ArrayLike | None = None) -> None:
        """Go to the head."""
        self._time = 0.0
        self._move(np.eye(4) if head_from_rest is None else np.asarray(head_from_rest))

    def retune(self, options: Any) -> None:
        """Take no notice: there are no options."""

    def measure(self) -> Measures:
        """Return that nothing moves."""
        return Measures(0.0, 0.0, 0.0)

    def _move(self, matrix: npt.NDArray[np.float64]) -> None:
        moved = self._strands.points @ matrix[:3, :3].T + matrix[:3, 3]
        self._points = moved.astype(np.float32)


def preferred(manager: Manager) -> str:
    """Return the simulator that is taken when none is named."""
    names = manager.names("make_simulator")
    return PREFERRED if PREFERRED in names else (names[0] if names else STILL)


class Tuned:
    """A simulator with the values of its plugin's options."""

    def __init__(self, manager: Manager, groom: Groom, plugin: str | None = None) -> None:
        """Make the simulator `plugin`; by default `pbd`, else the first one, else `none`."""
        names = manager.names("make_simulator")
        plugin = preferred(manager) if plugin is None else plugin
        if plugin not in (*names, STILL):
            raise InputError(unknown_name("simulator", plugin, [*names, STILL]))
        self._manager = manager
        self.plugin = plugin
        self.values: dict[str, Any] = {}
        """Options that differ from their defaults."""
        self.simulator: Simulator = (
            StillHair(groom)
            if plugin == STILL
            else manager.call("make_simulator", plugin, None, groom=groom)
        )

    @property
    def infos(self) -> tuple[OptionInfo, ...]:
        """The options of the plugin."""
        return () if self.plugin == STILL else self._manager.info(self.plugin).options

    def value(self, name: str) -> Any:
        """Return the present value of an option."""
        value = self.values.get(name, self._info(name).default)
        return getattr(self.simulator.options, name) if value is None else value

    def set(self, name: str, value: object) -> None:
        """Change one option, from now on; `OptionError` when the value is refused."""
        info = self._info(name)
        options = self._manager.options(self.plugin, {**self.values, name: value})
        checked = getattr(options, name)
        self.values.pop(name, None)
        if checked != info.default:
            self.values[name] = checked
        self.simulator.retune(options)

    def replace(self, values: dict[str, object]) -> None:
        """Take these values, and the defaults of all others."""
        options = self._manager.options(self.plugin, values)
        self.values = {name: getattr(options, name) for name in values}
        self.simulator.retune(options)

    def nudged(self, name: str, steps: int) -> Any:
        """Return an option's next value: a twentieth of its range, the next choice, the other."""
        info, value = self._info(name), self.value(name)
        if info.choices:
            place = info.choices.index(value) + steps
            return info.choices[place % len(info.choices)]
        if isinstance(value, bool):
            return not value
        if isinstance(value, int):
            return int(_within(info, value + steps))
        if isinstance(value, float):
            return float(_within(info, value + steps * _stride(info, value)))
        return value

    def _info(self, name: str) -> OptionInfo:
        for info in self.infos:
            if info.name == name:
                return info
        raise InputError(unknown_name("option", name, [info.name for info in self.infos]))


def _stride(info: OptionInfo, value: float) -> float:
    if info.low is not None and info.high is not None and info.high <= 100 * max(abs(value), 1e-9):
        return (info.high - info.low) / 20
    return 0.1 * max(abs(value), 1e-3)


def _within(info: OptionInfo, value: float) -> float:
    low = -np.inf if info.low is None else info.low
    high = np.inf if info.high is None else info.high
    return float(np.clip(value, low, high))
