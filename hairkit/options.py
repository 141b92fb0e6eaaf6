"""Options of plugins: one declaration serves recipes, `--set`, help texts and sliders.

>>> @dataclasses.dataclass(frozen=True)
... class Options:
...     angles: int = option(32, low=2, high=256, doc="Number of filter directions.")
>>> make_options(Options, {"angles": "64"}, "gabor")
Options(angles=64)
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hairkit.errors import OptionError

_T = typing.TypeVar("_T")
_TRUE, _FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")
_WORDS: dict[Any, str] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "text",
    Path: "a path",
}


@dataclasses.dataclass(frozen=True)
class OptionInfo:
    """Name, type, bounds and meaning of one option of a plugin."""

    name: str
    type: Any
    """The field's type: bool, int, float, str, Path, a tuple of these, or one of these or None."""
    default: Any
    low: float | None
    """Smallest allowed number (of every item, for a tuple)."""
    high: float | None
    """Largest allowed number (of every item, for a tuple)."""
    choices: tuple[Any, ...] | None
    doc: str
    unit: str | None

    @property
    def optional(self) -> bool:
        """True when the value may be None."""
        return type(None) in typing.get_args(self.type)

    @property
    def wanted(self) -> str:
        """The allowed values in words: `a whole number from 3 to 31 (px)`."""
        words = _words(self.type)
        if self.choices is not None:
            words = "one of " + ", ".join(str(choice) for choice in self.choices)
        if self.low is not None and self.high is not None:
            words += f" from {self.low} to {self.high}"
        elif self.low is not None:
            words += f" of at least {self.low}"
        elif self.high is not None:
            words += f" of at most {self.high}"
        return words + (f" ({self.unit})" if self.unit else "")


def option(
    default: Any,
    *,
    low: float | None = None,
    high: float | None = None,
    choices: Sequence[Any] | None = None,
    doc: str,
    unit: str | None = None,
) -> Any:
    """Return a dataclass field with bounds, choices, unit and documentation.

    Parameters
    ----------
    default
        Value if neither recipe nor user sets it.
    low, high
        Smallest and largest allowed number, both included; for a tuple, of every item.
    choices
        The only values allowed.
    doc
        One sentence for the user.
    unit
        Unit of the value, such as `px` or `m`; None for pure numbers.
    """
    allowed = None if choices is None else tuple(choices)
    return dataclasses.field(
        default=default,
        metadata={"low": low, "high": high, "choices": allowed, "doc": doc, "unit": unit},
    )


def describe(kind: type[Any]) -> tuple[OptionInfo, ...]:
    """Return the options of the dataclass `kind`, in order of declaration."""
    hints = typing.get_type_hints(kind)
    infos = []
    for field in dataclasses.fields(kind):
        known = field.metadata
        hint, choices = hints[field.name], known.get("choices")
        if typing.get_origin(hint) is typing.Literal:
            choices = choices or typing.get_args(hint)
            hint = type(choices[0])
        infos.append(
            OptionInfo(
                field.name,
                hint,
                field.default,
                known.get("low"),
                known.get("high"),
                choices,
                known.get("doc", ""),
                known.get("unit"),
            )
        )
    return tuple(infos)


def make_options(kind: type[_T], values: Mapping[str, object], where: str) -> _T:
    """Return an instance of the dataclass `kind` with `values` checked and converted.

    Parameters
    ----------
    kind
        A plugin's `Options` class.
    values
        Option values by name, from TOML or as text from the command line.
    where
        Prefix of error messages: `gabor`.

    Raises
    ------
    OptionError
        An option is unknown, has the wrong type, is out of bounds or not among the choices.
    """
    infos = {info.name: info for info in describe(kind)}
    checked = {}
    for name, value in values.items():
        if name not in infos:
            raise OptionError(f"{where}: {unknown_name('option', name, infos)}")
        checked[name] = _check(infos[name], value, where)
    return kind(**checked)


def fill_options(options: _T, **values: float) -> _T:
    """Return options with those that are None replaced by `values`, clamped to their bounds."""
    known = {info.name: info for info in describe(type(options))}
    filled = {}
    for name, value in values.items():
        if getattr(options, name) is None:
            low, high = known[name].low, known[name].high
            value = value if low is None else max(value, low)
            filled[name] = value if high is None else min(value, high)
    return dataclasses.replace(options, **filled)  # type: ignore[type-var]


def split_setting(text: str) -> tuple[str, str, str]:
    """Return plugin, option and value of a `--set` text; the plugin is empty for a bare option.

    Raises `OptionError` for a text of another form.

    >>> split_setting("gabor.angles=64")
    ('gabor', 'angles', '64')
    """
    target, equals, value = (part.strip() for part in text.partition("="))
    plugin, dot, option = target.rpartition(".")
    if not equals or not option or bool(dot) != bool(plugin):
        raise OptionError(f"--set {text}: expected plugin.option=value")
    return plugin, option, value


def unknown_name(thing: str, name: str, known: typing.Iterable[str]) -> str:
    """Return `no option 'x', did you mean 'y'?; valid: y, z` for error messages."""
    names = list(known)
    close = difflib.get_close_matches(name, names, 1)
    hint = f" (did you mean {close[0]!r}?)" if close else ""
    return f"no {thing} {name!r}{hint}; valid: {', '.join(names) or 'none'}"


def _check(info: OptionInfo, value: object, where: str) -> Any:
    refused = OptionError(f"{where}: option {info.name} is {value!r}, expected {info.wanted}")
    if info.optional and (value is None or (value in ("", "none") and not _holds(info.type, str))):
        return None
    try:
        converted = _convert(_without_none(info.type), value)
    except (TypeError, ValueError) as error:
        raise refused from error
    if info.choices is not None and converted not in info.choices:
        raise refused
    for item in converted if isinstance(converted, tuple) else (converted,):
        if isinstance(item, (int, float)) and not _in_bounds(item, info):
            raise refused
    return converted


def _in_bounds(number: float, info: OptionInfo) -> bool:
    return (
        math.isfinite(number)
        and (info.low is None or number >= info.low)
        and (info.high is None or number <= info.high)
    )


def _convert(kind: Any, value: Any) -> Any:
    """Convert a TOML value or a text to `kind`; raises `ValueError` if it cannot be."""
    if typing.get_origin(kind) is tuple:
        return _convert_tuple(typing.get_args(kind), value)
    if isinstance(value, kind) and not (kind is int and isinstance(value, bool)):
        return value
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, str):
        raise ValueError(f"{value!r} is of another type")
    if kind is bool:
        if value.lower() not in _TRUE + _FALSE:
            raise ValueError(f"{value!r} is neither true nor false")
        return value.lower() in _TRUE
    return kind(value)


def _convert_tuple(kinds: tuple[Any, ...], value: Any) -> tuple[Any, ...]:
    items = value.strip("()[] ").split(",") if isinstance(value, str) else value
    if not isinstance(items, (list, tuple)):
        raise ValueError(f"{value!r} is not a list")
    items = [item for item in items if item != ""]
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        kinds = (kinds[0],) * len(items)
    if len(kinds) != len(items):
        raise ValueError(f"{value!r} has {len(items)} items")
    return tuple(
        _convert(kind, item.strip() if isinstance(item, str) else item)
        for kind, item in zip(kinds, items, strict=True)
    )


def _without_none(kind: Any) -> Any:
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return next(part for part in typing.get_args(kind) if part is not types.NoneType)
    return kind


def _holds(kind: Any, wanted: type) -> bool:
    return kind is wanted or wanted in typing.get_args(kind)


def _words(kind: Any) -> str:
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return f"{_words(_without_none(kind))} or none"
    if typing.get_origin(kind) is tuple:
        parts = typing.get_args(kind)
        if len(parts) == 2 and parts[1] is Ellipsis:
            return f"a list, each {_words(parts[0])}"
        return f"a list of {len(parts)}, each {_words(parts[0])}"
    return _WORDS.get(kind, str(kind))
