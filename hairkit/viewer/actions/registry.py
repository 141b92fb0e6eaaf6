"""The table of actions: how they are registered, checked and performed."""

from __future__ import annotations

import dataclasses
import inspect
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hairkit.errors import InputError
from hairkit.options import make_options, unknown_name
from hairkit.viewer.session import Session

_Do = Callable[..., None]


@dataclass(frozen=True)
class Action:
    """An action of the user."""

    name: str
    do: _Do
    """Function of the session and the values."""
    doc: str
    """One line for the help sheet and the manual."""
    values: type[Any]
    """Dataclass of its values."""
    keys: Mapping[str, Mapping[str, object]]
    """Keys bound to it, and the values that each of them passes."""


ACTIONS: dict[str, Action] = {}
"""All actions by name."""


def perform(session: Session, name: str, values: Mapping[str, object] | None = None) -> None:
    """Perform an action.

    Raises
    ------
    InputError, OptionError
        The action does not exist, a value is unknown, missing or invalid, or the action is not
        possible in this session.
    """
    wanted = check_values(name, values or {})
    ACTIONS[name].do(session, **wanted)


def check_values(name: str, values: Mapping[str, object]) -> dict[str, Any]:
    """Return all values of an action, including defaults; raises as `perform`."""
    if name not in ACTIONS:
        raise InputError(unknown_name("action", name, sorted(ACTIONS)))
    kind = ACTIONS[name].values
    checked = make_options(kind, dict(values), name)
    wanted = {f.name: getattr(checked, f.name) for f in dataclasses.fields(kind)}
    missing = [key for key, value in wanted.items() if value is _MISSING]
    if missing:
        raise InputError(f"{name}: missing value of {', '.join(missing)}")
    return wanted


def signature(action: Action) -> str:
    """Return the signature of an action: `zoom factor: float`, `turn yaw: float = 0.0, ...`."""
    values = []
    for field in dataclasses.fields(action.values):
        kind = field.type.__name__ if isinstance(field.type, type) else str(field.type)
        default = "" if field.default is _MISSING else f" = {field.default!r}"
        values.append(f"{field.name}: {kind}{default}")
    return f"{action.name} {', '.join(values)}".strip()


def bindings() -> dict[str, tuple[str, Mapping[str, object]]]:
    """Return the action and values of each key."""
    return {
        key: (action.name, values)
        for action in ACTIONS.values()
        for key, values in action.keys.items()
    }


_MISSING: Any = inspect.Parameter.empty


def action(**keys: Mapping[str, object]) -> Callable[[_Do], _Do]:
    """Register a function as an action; keys are named as by `keyboard.key_name`."""

    def add(do: _Do) -> _Do:
        hints = typing.get_type_hints(do)
        fields = []
        for name, parameter in list(inspect.signature(do).parameters.items())[1:]:
            fields.append((name, hints[name], dataclasses.field(default=parameter.default)))
        kind = dataclasses.make_dataclass(do.__name__, fields, frozen=True)
        doc = (inspect.getdoc(do) or "").partition("\n")[0]
        ACTIONS[do.__name__] = Action(do.__name__, do, doc, kind, keys)
        return do

    return add
