"""Names of keys, as the table of actions uses them, from GLFW key codes."""

from __future__ import annotations

from typing import Any

SHIFT, CONTROL = 0x1, 0x2
"""GLFW's modifier bits."""
SPECIAL = (
    "SPACE",
    "PERIOD",
    "LEFT_BRACKET",
    "RIGHT_BRACKET",
    "EQUAL",
    "MINUS",
    "KP_ADD",
    "KP_SUBTRACT",
    "TAB",
    "HOME",
    "ESCAPE",
    "LEFT",
    "RIGHT",
    "UP",
    "DOWN",
    "PAGE_UP",
    "PAGE_DOWN",
    *[f"F{number}" for number in range(1, 13)],
)


def key_name(glfw: Any, key: int, mods: int) -> str | None:
    """Return the name of a pressed key, as `W`, `N1`, `CTRL_S`, `SHIFT_S`; None for others."""
    name = _names(glfw).get(key)
    if name is None:
        return None
    if mods & CONTROL:
        return f"CTRL_{name}"
    return f"SHIFT_{name}" if mods & SHIFT and (name == "TAB" or len(name) == 1) else name


def _names(glfw: Any) -> dict[int, str]:
    names = {getattr(glfw, f"KEY_{name}"): name for name in SPECIAL}
    names |= {getattr(glfw, f"KEY_{chr(code)}"): chr(code) for code in range(65, 91)}
    for digit in range(10):
        names[getattr(glfw, f"KEY_{digit}")] = f"N{digit}"
        names[getattr(glfw, f"KEY_KP_{digit}")] = f"N{digit}"
    return names
