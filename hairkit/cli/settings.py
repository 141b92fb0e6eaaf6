"""`--set` of every verb: options of the plugins that the verb uses."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from hairkit.errors import OptionError
from hairkit.options import split_setting, unknown_name

if TYPE_CHECKING:
    from hairkit.manager import Manager

Settings = dict[str, dict[str, object]]
"""Values by option, by role."""


def importer_of(manager: Manager, path: Path) -> str | None:
    """Return the plugin that reads a groom's file, None for hairkit's own."""
    from hairkit.pipeline.open_groom import groom_path, plugin_for

    path = groom_path(path)
    return None if path.suffix == ".npz" else plugin_for(manager, "import_groom", path)


def split_settings(
    manager: Manager, plugins: Mapping[str, str | None], texts: Iterable[str]
) -> Settings:
    """Return what `--set` says, by role; a role without settings has an empty dict.

    Parameters
    ----------
    manager
        The plugins.
    plugins
        The plugin in each role of the verb: `{"reader": "ply", "simulator": "rods"}`; None where
        the verb does without one.
    texts
        `plugin.option=value`, by the plugin's name or role, or `option=value` for the option of
        the only plugin that has it. A plugin in two roles takes the value in both.

    Raises
    ------
    OptionError
        A text has another form, names a plugin that the verb does not use, or names an option that
        none or several of its plugins have.
    """
    used = {role: plugin for role, plugin in plugins.items() if plugin is not None}
    settings: Settings = {role: {} for role in plugins}
    for text in texts:
        plugin, option, value = split_setting(text)
        for role in _roles(manager, used, plugin, option, text):
            settings[role][option] = value
    return settings


def _roles(
    manager: Manager, used: Mapping[str, str], plugin: str, option: str, text: str
) -> list[str]:
    """Return the roles whose plugin a setting is for."""
    from hairkit.stages import renamed  # not loaded for a verb's help

    if plugin:
        roles = [role for role, name in used.items() if plugin in (name, role)]
        if not roles:
            reason = unknown_name("plugin", plugin, dict.fromkeys(used.values()))
            raise OptionError(f"--set {text}: this command uses {reason}{renamed(plugin)}")
        return roles
    known = {name: [i.name for i in manager.info(name).options] for name in used.values()}
    having = [name for name, options in known.items() if option in options]
    if not having:
        options = dict.fromkeys(o for options in known.values() for o in options)
        reason = unknown_name("option", option, options) + "".join(map(renamed, known))
        raise OptionError(f"--set {text}: {reason}")
    if len(having) > 1:
        choices = " or ".join(f"{name}.{option}" for name in having)
        raise OptionError(f"--set {text}: several plugins have this option; write {choices}")
    return [role for role, name in used.items() if name == having[0]]
