"""Recipes: which plugin does each stage, with which options, written as TOML.

fit = false                          # leave a stage out
[segment]
plugin = ["mask_files", "grabcut"]   # the first that has an answer wins
[segment.grabcut]                    # options of one plugin of several
scale = 0.5
[orient]
plugin = "gabor"
angles = 64                          # options of the only plugin
[export]
for = ["unreal", "web"]              # beside its plugins: all files of an engine
[plugins.matte]                      # a plugin that runs in an environment of its own
command = ["/opt/nets/bin/python", "matte.py"]

What a recipe does not say is as in the recipe `default`: a stage without a table, and the plugin of
a table that only has options.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.resources
import logging
import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar, cast

from hairkit.errors import HairkitError, InputError, OptionError, PluginError
from hairkit.grooming.engine_files import ENGINES
from hairkit.manager import Manager, PluginInfo
from hairkit.manager.command_plugin import PluginCommand, read_command
from hairkit.nets.model_folder import missing_models
from hairkit.options import split_setting, unknown_name
from hairkit.pipeline.module_digest import module_digest
from hairkit.pipeline.plugin_lock import check_lock, read_lock
from hairkit.remote import is_url, read_bytes
from hairkit.stages import EXPORT, OF_TABLE, RENAMED, Stage

_ENGINES = "for"
"""Key of the table `export` with the engines for which files are written, too."""
_Result = TypeVar("_Result")
_log = logging.getLogger("hairkit")


@dataclass(frozen=True)
class Choice:
    """One plugin with the option values that the recipe gives it."""

    plugin: str
    options: Mapping[str, object]
    file: str = ""
    """Where an export goes in the results' folder; empty for `groom` with the plugin's ending."""


@dataclass(frozen=True)
class Selection:
    """The plugins that a recipe names for one stage."""

    table: str
    """Name of the recipe's table: `scene`."""
    choices: tuple[Choice, ...]
    """One plugin, or several in order where the stage takes several."""

    @property
    def hook(self) -> str:
        """Name of the stage hook: `estimate_scene`."""
        return OF_TABLE[self.table].hook


@dataclass(frozen=True)
class Recipe:
    """The stages from photos to files, in order."""

    name: str
    source: str
    """Origin of the recipe, for error messages."""
    description: str
    stages: tuple[Selection, ...]
    commands: tuple[PluginCommand, ...] = ()
    """Plugins that run in environments of their own."""
    lock: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """Versions of plugins with which it may be run; others are not checked."""

    @property
    def choices(self) -> tuple[Choice, ...]:
        """The plugins of all stages, in the order in which they run."""
        return tuple(choice for stage in self.stages for choice in stage.choices)

    def stage(self, table: str) -> Selection | None:
        """Return the plugins of a table, or None when the recipe leaves the stage out."""
        return next((stage for stage in self.stages if stage.table == table), None)

    def has(self, stage: Stage[Any]) -> bool:
        """Return whether plugins are named for a stage."""
        return self.stage(stage.table) is not None

    def ask(self, manager: Manager, stage: Stage[_Result], **arguments: Any) -> _Result:
        """Return what the first plugin of a stage that has an answer makes.

        Parameters
        ----------
        manager
            The plugins.
        stage
            A stage with a hook.
        arguments
            Those of the hook but `options`.

        Raises
        ------
        InputError
            The recipe leaves out a stage that has no `absent` result.
        PluginError
            A plugin fails, or none has an answer.
        """
        selection = self.stage(stage.table)
        if selection is None and stage.absent is not None:
            return stage.absent()
        if selection is None:
            raise InputError(f"recipe {self.name} has no stage {stage.table!r}")
        choices = [(choice.plugin, choice.options) for choice in selection.choices]
        found: Any
        if stage.absent is not None:
            found = manager.find_first(stage.hook, choices, **arguments)
            return cast(_Result, found[1]) if found is not None else stage.absent()
        if len(choices) == 1:
            found = manager.call(stage.hook, *choices[0], **arguments)
        else:
            found = manager.call_first(stage.hook, choices, **arguments)[1]
        return cast(_Result, found)

    def only(self, *kept: Stage[Any]) -> Recipe:
        """Return the recipe with some stages, for those who need none of the others' plugins."""
        tables = {stage.table for stage in kept}
        stages = tuple(stage for stage in self.stages if stage.table in tables)
        names = {choice.plugin for stage in stages for choice in stage.choices}
        commands = tuple(command for command in self.commands if command.name in names)
        lock = {name: version for name, version in self.lock.items() if name in names}
        return replace(self, stages=stages, commands=commands, lock=lock)

    def with_set(self, assignments: Sequence[str]) -> Recipe:
        """Return the recipe changed by `plugin.option=value` or `stage=plugin` texts.

        `fit=none` and `export=none` leave the stage out.

        >>> recipe = load_recipe("default").with_set(["orient=gabor", "gabor.angles=64"])
        >>> recipe.stage("orient").choices[0].options["angles"]
        '64'
        """
        recipe = self
        for text in assignments:
            plugin, name, value = split_setting(text)
            if plugin:
                recipe = recipe._with_option(plugin, name, value, text)
            else:
                recipe = recipe._with_plugins(name, value, text)
        return replace(recipe, source=f"{self.source} with --set") if assignments else self

    def check(self, manager: Manager) -> None:
        """Start the plugins that are commands, check every plugin and option.

        Compares versions with the lock. Raises `PluginError` or `OptionError` naming the place.
        """
        for command in self.commands:
            try:
                manager.add_command(command)
            except PluginError as error:
                raise PluginError(f"{self.source}: [plugins.{command.name}]: {error}") from error
        for stage in self.stages:
            for choice in stage.choices:
                where = f"{self.source}: [{stage.table}]"
                try:
                    manager.implementer(stage.hook, choice.plugin)
                except HairkitError as error:
                    raise type(error)(f"{where}: {error}") from error
                manager.options(choice.plugin, choice.options, f"{where} {choice.plugin}")
        check_lock(self.lock, manager, self.source)

    def _with_option(self, plugin: str, name: str, value: str, text: str) -> Recipe:
        used = [choice.plugin for choice in self.choices]
        if plugin not in used:
            reason = unknown_name("plugin", plugin, used)
            raise OptionError(f"--set {text}: recipe {self.name} uses {reason}")
        return self._map(
            lambda choice: (
                replace(choice, options=MappingProxyType({**choice.options, name: value}))
                if choice.plugin == plugin
                else choice
            )
        )

    def _with_plugins(self, table: str, value: str, text: str) -> Recipe:
        table = new_table(table, f"--set {text}")
        if table not in OF_TABLE:
            reason = unknown_name("stage", table, OF_TABLE)
            raise OptionError(
                f"--set {text}: expected plugin.option=value or stage=plugin; {reason}"
            )
        names = [name.strip() for name in value.split(",") if name.strip()]
        kept = {stage.table: stage for stage in self.stages}
        if names == ["none"] and not OF_TABLE[table].needed:
            kept.pop(table, None)
        else:
            kept[table] = _stage(table, {"plugin": names}, f"--set {text}")
        return replace(self, stages=tuple(kept[name] for name in OF_TABLE if name in kept))

    def _map(self, change: Any) -> Recipe:
        stages = tuple(
            replace(stage, choices=tuple(change(choice) for choice in stage.choices))
            for stage in self.stages
        )
        return replace(self, stages=stages)


def load_recipe(name: str | os.PathLike[str]) -> Recipe:
    """Read a recipe that ships, by name, or a `.toml` file by path or URL; raises `InputError`."""
    text = os.fspath(name)
    if text in recipe_names():
        return parse_recipe(_read_shipped(text), text, f"recipe {text}")
    path = Path(text)
    if is_url(text):
        return parse_recipe(read_bytes(text), path.stem, text)
    if path.suffix != ".toml" and not path.exists():
        reason = unknown_name("recipe", text, recipe_names())
        raise InputError(f"{reason}, or the path of a .toml file")
    return parse_recipe(read_bytes(path), path.stem, text, path.absolute().parent)


def recipe_names() -> tuple[str, ...]:
    """Return the names of the recipes that ship with hairkit."""
    folder = importlib.resources.files("hairkit") / "recipes"
    names = (entry.name for entry in folder.iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


def parse_recipe(data: bytes, name: str, source: str, folder: Path | None = None) -> Recipe:
    """Read a recipe from TOML; plugins and options are checked later, by `Recipe.check`.

    Commands of plugins start in `folder`.
    """
    document = _document(data, source)
    commands = _commands(document.pop("plugins", {}), source, folder)
    lock = read_lock(document.pop("lock", {}), source)
    description = document.pop("description", "")
    for key in [*document]:
        now = new_table(key, source)
        if now != key and now in document:
            raise InputError(f"{source}: {key} is the old name of {now}; write [{now}] alone")
        document[now] = document.pop(key)
    for key in document:
        if key not in OF_TABLE:
            raise InputError(f"{source}: {key}: {unknown_name('stage', key, OF_TABLE)}")
    tables = {**_default_tables(), **document}
    for key, content in document.items():
        if content is False and not OF_TABLE[key].needed:
            del tables[key]
        elif isinstance(content, dict) and "plugin" not in content:
            tables[key] = {**_default_tables().get(key, {}), **content}
    stages = tuple(_stage(key, tables[key], source) for key in OF_TABLE if key in tables)
    return Recipe(name, source, str(description), stages, commands, lock)


@functools.cache
def new_table(name: str, source: str) -> str:
    """Return what a table is called now; warn, once for each place, of one that is renamed."""
    now = RENAMED.get(name, name)
    if now == name or now not in OF_TABLE:
        return name
    _log.warning(
        "%s: the stage %s is called %s since 0.3; its old name goes in 0.4", source, name, now
    )
    return now


def _commands(content: object, source: str, folder: Path | None) -> tuple[PluginCommand, ...]:
    """Return the plugins that run in environments of their own."""
    commands = []
    for name, values in content.items() if isinstance(content, dict) else [("", content)]:
        if not isinstance(values, dict):
            raise InputError(f"{source}: plugins.{name}: expected a table [plugins.NAME]")
        try:
            commands.append(read_command(name, values, None if folder is None else str(folder)))
        except OptionError as error:
            raise OptionError(f"{source}: [plugins.{name}]: {error}") from error
    return tuple(commands)


def _document(data: bytes, source: str) -> dict[str, Any]:
    try:
        return tomllib.loads(data.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"{source}: not a TOML file: {error}") from error


@functools.cache
def _default_tables() -> Mapping[str, Any]:
    """Return the tables of the recipe that others differ from."""
    document = _document(_read_shipped("default"), "recipe default")
    return {key: content for key, content in document.items() if key in OF_TABLE}


def _read_shipped(name: str) -> bytes:
    return (importlib.resources.files("hairkit") / "recipes" / f"{name}.toml").read_bytes()


def stage_digest(manager: Manager, stage: Selection) -> str:
    """Return a hex digest of plugins, versions and options: equal digests, equal behaviour.

    Options are taken with their defaults filled in; files that an option names, and those in a
    folder that it names, count with their content. A plugin counts with its distribution, with
    every module that it imports and with the networks that it finds installed.
    """
    digest = hashlib.sha256(stage.hook.encode())
    for choice in stage.choices:
        options = manager.options(choice.plugin, choice.options)
        info = manager.info(choice.plugin)
        code = plugin_code(info)
        digest.update(f"\n{choice.plugin} {info.origin} {code}".encode())
        digest.update(f"\nwithout {missing_models(info.models)}".encode())
        for field in dataclasses.fields(options) if options is not None else ():
            value = getattr(options, field.name)
            digest.update(f"\n{field.name}={value!r}".encode())
            for file in _files_of(value):
                digest.update(f"\n{file.name} ".encode())
                digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def plugin_code(info: PluginInfo) -> str:
    """Return a hex digest of a plugin's code: of its module, and of its command where it is one."""
    return module_digest(info.module) + info.digest


def _files_of(value: Any) -> list[Path]:
    """Return the file that an option names, or the files in the folder that it names, sorted."""
    if not isinstance(value, Path):
        return []
    inside = sorted(value.iterdir()) if value.is_dir() else [value]
    return [path for path in inside if path.is_file()]


def missing_networks(recipe: Recipe, manager: Manager) -> dict[str, tuple[str, ...]]:
    """Return the networks that plugins of a recipe would use but that are not installed."""
    missing = {c.plugin: missing_models(manager.info(c.plugin).models) for c in recipe.choices}
    return {plugin: names for plugin, names in missing.items() if names}


def _stage(table: str, content: object, source: str) -> Selection:
    if not isinstance(content, dict):
        also = "" if OF_TABLE[table].needed else f", or {table} = false to leave the stage out"
        raise InputError(f"{source}: {table} is {content!r}, expected a table [{table}]{also}")
    named = content.get("plugin")
    names = [named] if isinstance(named, str) else named
    if not isinstance(names, list) or not all(isinstance(n, str) and n for n in names):
        raise InputError(f"{source}: {table}.plugin is {named!r}, expected a plugin's name")
    if len(set(names)) != len(names):
        raise InputError(f"{source}: {table}.plugin names a plugin twice")
    engines = _engine_choices(content.get(_ENGINES, []), source) if table == EXPORT.table else ()
    if not names or (len(names) > 1 and not OF_TABLE[table].several):
        raise InputError(f"{source}: {table}.plugin names {len(names)} plugins, expected one")
    options = {key: v for key, v in content.items() if key not in ("plugin", _ENGINES)}
    choices = tuple(_choice(name, options, len(names) == 1) for name in names)
    if options:
        key = next(iter(options))
        reason = f"options of several plugins stand in [{table}.PLUGIN]; PLUGIN is one of"
        raise InputError(f"{source}: {table}.{key}: {reason}: {', '.join(names)}")
    return Selection(table, choices + engines)


def _engine_choices(engines: Any, source: str) -> tuple[Choice, ...]:
    """Return the exports of one or several engines, each engine's into a folder of its name."""
    names = [str(name) for name in (engines if isinstance(engines, list) else [engines])]
    wrong = next((name for name in names if name not in ENGINES), None)
    if wrong is not None:
        raise InputError(f"{source}: export.{_ENGINES}: {unknown_name('engine', wrong, ENGINES)}")
    return tuple(
        Choice(file.plugin, MappingProxyType(dict(file.options)), f"{engine}/{file.name}")
        for engine in dict.fromkeys(names)
        for file in ENGINES[engine]
    )


def _choice(name: str, options: dict[str, Any], alone: bool) -> Choice:
    """Take the options of one plugin out of the stage's table."""
    values = dict(options.pop(name)) if isinstance(options.get(name), dict) else {}
    if alone:
        values |= options
        options.clear()
    return Choice(name, MappingProxyType(values))
