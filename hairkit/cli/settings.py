"""`--set` of the verbs that read a groom and use it: whose option is meant."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from hairkit.errors import OptionError
from hairkit.pipeline.open_groom import groom_path, plugin_for

Settings = dict[str, dict[str, object]]
"""Values by option, by plugin."""


def add_setting(add: Callable[..., Any]) -> None:
    """Add `--set` by a parser's `add_argument`."""
    what = "option=V of simulator or file format"
    add("--set", action="append", default=[], metavar="X=V", help=what)


def importer_of(manager: Any, path: Path) -> str | None:
    """Return the plugin that reads a groom's file, None for hairkit's own."""
    path = groom_path(path)
    return None if path.suffix == ".npz" else str(plugin_for(manager, "import_groom", path))


def split_settings(manager: Any, user: str, importer: str | None, texts: Iterable[str]) -> Settings:
    """Return what `--set` says, by plugin.

    Parameters
    ----------
    manager
        The plugins.
    user
        The plugin that takes the groom: a simulator, or `none`.
    importer
        The plugin that reads its file, if any.
    texts
        `option=value` or `plugin.option=value`. A bare option is the user's, or the importer's
        where only that one has it.

    Raises
    ------
    OptionError
        A text is none of that form.
    """
    settings: Settings = {}
    for text in texts:
        target, equals, value = (part.strip() for part in text.partition("="))
        plugin, dot, option = target.rpartition(".")
        if not equals or not option or (dot and not plugin):
            raise OptionError(f"--set {text}: expected option=value or plugin.option=value")
        if not plugin:
            read = option in _names(manager, importer) and option not in _names(manager, user)
            plugin = str(importer) if read else user
        settings.setdefault(plugin, {})[option] = value
    return settings


def _names(manager: Any, plugin: str | None) -> set[str]:
    if plugin is None or plugin == "none":
        return set()
    return {info.name for info in manager.info(plugin).options}
