"""Plugins in folders that several machines share, described by files that are read without running.

`HAIRKIT_PLUGIN_PATH` names folders. Each folder in them with a `hairkit.toml` is a plugin:

name = "studio_matte"
version = "1.2"
summary = "Hair by the studio's network."
hookspec = "1.5"                       # version of the hooks that it was written for
hooks = ["segment"]
module = "studio_matte.py"             # or command = ["/opt/nets/bin/python", "matte.py"]
[options.level]                        # as `hairkit.worker.option` describes it
default = 60.0
low = 0
high = 255
doc = "Grey level below which is hair."

Its code is imported, or started, when a recipe or a command first uses it.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hairkit.child_process import shortened
from hairkit.errors import HairkitError, PluginError
from hairkit.hookspecs import HOOKSPEC_VERSION
from hairkit.manager.command_plugin import PluginCommand, options_of, read_command
from hairkit.options import OptionInfo, describe, unknown_name
from hairkit.stages import OF_HOOK
from hairkit.storage import read_bytes

PLUGIN_PATH = "HAIRKIT_PLUGIN_PATH"
"""Environment variable: folders of plugins, separated as those of `PATH`."""
MANIFEST = "hairkit.toml"
"""Name of the file that describes a plugin."""
LARGEST = 2**20
"""Bytes of a manifest."""
KEYS = ("name", "version", "summary", "hookspec", "hooks", "module", "options")
COMMAND_KEYS = ("command", "seconds", "start_seconds", "memory_gib", "processes", "environment")


@dataclass(frozen=True)
class Manifest:
    """What is known of a plugin before any of its code runs."""

    name: str
    path: Path
    version: str = ""
    summary: str = ""
    stages: tuple[str, ...] = ()
    options: tuple[OptionInfo, ...] = ()
    module: Path | None = None
    """Python file that is the plugin; None for a command."""
    command: PluginCommand | None = None
    broken: str | None = None


def find_manifests() -> Iterator[Manifest]:
    """Yield the plugins in the folders of `HAIRKIT_PLUGIN_PATH`, by folder and name."""
    for text in filter(None, os.environ.get(PLUGIN_PATH, "").split(os.pathsep)):
        folder = Path(text)
        if not folder.is_dir():
            yield Manifest(text, folder, broken=f"{PLUGIN_PATH} names {text}, which is no folder")
            continue
        for path in sorted(folder.glob(f"*/{MANIFEST}")):
            yield read_manifest(path)


def read_manifest(path: Path) -> Manifest:
    """Return the description of a plugin; what is wrong with it is `broken`."""
    name = path.parent.name
    try:
        document = tomllib.loads(read_bytes(path, LARGEST).decode())
        name = str(document.get("name", name))
        return _manifest(path, document)
    except (HairkitError, OSError, ValueError, TypeError, AttributeError, LookupError) as error:
        return Manifest(name, path, broken=shortened(f"{path}: {error}"))


def check_hookspec(version: object) -> None:
    """Raise `PluginError` unless a plugin for these hooks, "1.5" or (1, 5), works with ours.

    Hooks of our major version only gained arguments and companions, so what was written for an
    older minor version works; one for a newer minor version may ask for what is not there.
    """
    own = ".".join(map(str, HOOKSPEC_VERSION))
    parts = version.split(".") if isinstance(version, str) else version
    try:
        major, minor = (int(part) for part in parts)  # type: ignore[attr-defined]
    except (TypeError, ValueError) as error:
        raise PluginError(f"its hookspec is {version!r}, expected {own!r} or older") from error
    if major != HOOKSPEC_VERSION[0]:
        cure = "update the plugin" if major < HOOKSPEC_VERSION[0] else "update hairkit"
        raise PluginError(f"it is for hooks of version {major}.{minor}, these are {own}; {cure}")
    if minor > HOOKSPEC_VERSION[1]:
        raise PluginError(
            f"it needs hooks of version {major}.{minor}, these are {own}; update hairkit"
        )


def _manifest(path: Path, document: Mapping[str, Any]) -> Manifest:
    for key in document:
        if key not in KEYS + COMMAND_KEYS:
            raise PluginError(unknown_name("key", key, KEYS + COMMAND_KEYS))
    for key in ("name", "hookspec", "hooks"):
        if key not in document:
            raise PluginError(f"has no {key}")
    check_hookspec(document["hookspec"])
    hooks = document["hooks"]
    for hook in hooks if isinstance(hooks, list) else [hooks]:
        if hook not in OF_HOOK:
            raise PluginError(unknown_name("hook", str(hook), OF_HOOK))
    if ("module" in document) == ("command" in document):
        raise PluginError("has a module or a command, expected one of both")
    name = document["name"]
    given = {key: value for key, value in document.items() if key in COMMAND_KEYS}
    command = read_command(name, given, str(path.parent)) if "command" in given else None
    module = None if command is not None else path.parent / document["module"]
    if module is not None and not module.is_file():
        raise PluginError(f"names the module {module.name}, which is not there")
    options = document.get("options", {})
    described = {k: {"kind": type(v["default"]).__name__, **v} for k, v in options.items()}
    return Manifest(
        name,
        path,
        str(document.get("version", "")),
        str(document.get("summary", "")),
        tuple(stage for stage in OF_HOOK if stage in hooks),
        describe(options_of(described)) if described else (),
        module,
        command,
    )
