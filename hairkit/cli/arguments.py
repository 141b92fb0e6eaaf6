"""Arguments that several verbs have, in the same words, and checks of their values."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from hairkit.errors import InputError

Add = Callable[..., Any]
"""`add_argument` of a verb's parser."""

GUIDES = 600
"""Roots by default, as of `hairkit.reconstruct`."""
LARGEST = 8192
"""Longest edge of a picture, pixels."""
LARGEST_SEED = 2**63 - 1
_REPEATED: dict[str, Any] = {"action": "append", "default": []}
_FLAG = {"action": "store_true"}
_COUNT = {"type": int, "metavar": "N"}
_SET = _REPEATED | {"metavar": "P.X=V"}
_SHARED: dict[str, dict[str, Any]] = {
    "--guides": _COUNT | {"default": GUIDES, "help": f"guide hairs (default {GUIDES})"},
    "--seed": _COUNT | {"default": 0, "help": "seed of the root positions (default 0)"},
    "--max-edge": {"type": int, "metavar": "PX", "help": "scale larger photos to this edge (1440)"},
    "--set": _SET | {"help": "set an option: plugin.option=V, or option=V where one plugin has it"},
    "--using": {"metavar": "NAME", "help": "export plugin (default: by suffix)"},
    "--plugin": _REPEATED | {"metavar": "FILE", "help": "load a plugin file too"},
    "--quiet": _FLAG | {"help": "print only errors on stderr"},
    "--steps": _FLAG | {"help": "a line for each step, for programs that show them"},
    "--json": _FLAG | {"help": "print the result as JSON"},
}


def add_shared(add: Add, *names: str) -> None:
    """Add arguments of these names."""
    for name in names:
        add(name, **_SHARED[name])


def add_stage_settings(add: Add) -> None:
    """Add `--recipe`, and `--set` of a verb that runs it, where many plugins are used."""
    from hairkit.pipeline.recipe import recipe_names

    recipes = f"{', '.join(recipe_names())} or a .toml file"
    add("--recipe", default="default", metavar="R", help=recipes)
    add("--set", **_SET, help="set an option: plugin.option=V, or a stage's plugin: stage=PLUGIN")


def check_range(name: str, value: float | None, low: float, high: float, unit: str = "") -> None:
    """Raise `InputError` for a value outside a range; None is one that was not given."""
    if value is not None and not low <= value <= high:
        raise InputError(f"{name} is {value}, expected {low} to {high}{unit and f' {unit}'}")


def parse_size(text: str) -> tuple[int, int]:
    """Return width and height of `WIDTHxHEIGHT`."""
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not match or not all(1 <= int(n) <= LARGEST for n in match.groups()):
        raise InputError(f"--size is {text!r}, expected WIDTHxHEIGHT up to {LARGEST}, as 1280x720")
    return int(match[1]), int(match[2])
