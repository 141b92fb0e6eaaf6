"""Finds and imports plugins, and refuses those that break the contract before they are called."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import inspect
import re
import sys
import types
import typing
from collections.abc import Iterator
from dataclasses import MISSING, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import pluggy

from hairkit import hookspecs
from hairkit.errors import PluginError
from hairkit.io.file_format import FileFormat
from hairkit.manager.command_plugin import PluginCommand
from hairkit.manager.manifest import check_hookspec
from hairkit.nets.known_models import known_model
from hairkit.options import OptionInfo, describe, make_options, unknown_name
from hairkit.stages import OF_HOOK

ENTRY_POINT_GROUP = "hairkit"
DISABLE_AUTOLOAD = "HAIRKIT_DISABLE_PLUGIN_AUTOLOAD"
"""Environment variable: when it is set, only the plugins that ship with hairkit are loaded."""
OPTION_TYPES = (bool, int, float, str, Path)
"""Types of options; tuples of these and any of these or None are options, too."""
NO_PLUGIN = "none"
"""Stands for no plugin in recipes and commands, so that no plugin may be named so."""


@dataclass(frozen=True)
class PluginInfo:
    """Description of one plugin, working or broken."""

    name: str
    distribution: str
    """Name of the installed distribution, or the path of a plugin file."""
    version: str
    """Version of the distribution; empty for a plugin file."""
    summary: str = ""
    """First paragraph of the module's docstring, in one line."""
    stages: tuple[str, ...] = ()
    notifications: tuple[str, ...] = ()
    options: tuple[OptionInfo, ...] = ()
    source: Path | None = None
    """The plugin's Python file, where there is one."""
    module: str = ""
    """Full name of the module that the plugin is, or in which its class is defined."""
    format: FileFormat | None = None
    """File format that it reads or writes, from the module's `FORMAT`."""
    models: tuple[str, ...] = ()
    """Networks that it uses when they are installed, from the module's `MODELS`."""
    command: PluginCommand | None = None
    """How it is started, for a plugin in an environment of its own."""
    digest: str = ""
    """Digest of code that is no module of this Python: that of a command."""
    broken: str | None = None
    """Why the plugin cannot be used, or None."""

    @property
    def origin(self) -> str:
        """Distribution and version in words: `hairkit 0.2.0`."""
        return f"{self.distribution} {self.version}".strip()

    @property
    def suffixes(self) -> tuple[str, ...]:
        """File name endings that it reads or writes: `(".apx",)`."""
        return self.format.suffixes if self.format else ()

    def __str__(self) -> str:
        return f"plugin {self.name!r} of {self.origin}"


def entry_points() -> list[tuple[str, str, importlib.metadata.EntryPoint]]:
    """Return entry points with the name and version of their distributions.

    hairkit's own come first, so that no other plugin can take their names.
    """
    entries = importlib.metadata.entry_points(group=ENTRY_POINT_GROUP)
    # a distribution parses its metadata whenever it is asked, and one may have many plugins
    distributions = {id(entry.dist): entry.dist for entry in entries}
    origins = {key: _origin(found) for key, found in distributions.items()}
    found = [(*origins[id(entry.dist)], entry) for entry in entries]
    return sorted(found, key=lambda f: (f[0] != hookspecs.PROJECT, f[0], f[2].name))


def import_file(path: Path) -> ModuleType:
    """Import a plugin file under a name that no other module has."""
    name = f"hairkit_plugin_file_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise PluginError("not a Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their annotations up here
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def inspect_plugin(plugin: object, name: str, distribution: str, version: str) -> PluginInfo:
    """Return what is known about a plugin; raises `PluginError` when it breaks the contract."""
    if not name.replace("-", "_").isidentifier() or name == NO_PLUGIN:
        raise PluginError(f"its name is {name!r}, expected letters, digits, - and _; rename it")
    if hasattr(plugin, "HOOKSPEC"):
        check_hookspec(plugin.HOOKSPEC)
    hash(plugin)  # pluggy keeps plugins in sets
    form = getattr(plugin, "FORMAT", None)
    if form is not None:
        _check_format(form)
    hooks = tuple(_check_hook(hook, function) for hook, function in _hooks(plugin))
    if not hooks:
        raise PluginError("it implements no hook; mark its function with @hairkit.hookimpl")
    file = getattr(plugin, "__file__", None)
    return PluginInfo(
        name,
        distribution,
        version,
        summary=" ".join((inspect.getdoc(plugin) or "").partition("\n\n")[0].split()),
        stages=tuple(stage for stage in OF_HOOK if stage in hooks),
        notifications=tuple(sorted(set(hooks) - set(OF_HOOK))),
        options=_check_options(getattr(plugin, "Options", None)),
        source=Path(file) if file else None,
        module=getattr(plugin, "__module__", getattr(plugin, "__name__", "")),
        format=form,
        models=tuple(known_model(model).name for model in getattr(plugin, "MODELS", ())),
    )


def _origin(distribution: importlib.metadata.Distribution | None) -> tuple[str, str]:
    if distribution is None:
        return "unknown distribution", ""
    return distribution.name, distribution.version


def _hooks(plugin: object) -> Iterator[tuple[str, Any]]:
    """Yield every marked function of a plugin with the name of its hook."""
    reader = pluggy.PluginManager(hookspecs.PROJECT)
    for attribute in dir(plugin):
        marks = reader.parse_hookimpl_opts(plugin, attribute)
        if marks is not None:
            yield marks.get("specname") or attribute, getattr(plugin, attribute)


def _check_hook(hook: str, function: Any) -> str:
    """Return the hook's name; raises `PluginError` for a function that cannot be called as it."""
    specs = {n: f for n, f in vars(hookspecs).items() if hasattr(f, f"{hookspecs.PROJECT}_spec")}
    if hook not in specs:
        raise PluginError(unknown_name("hook", hook, specs))
    if inspect.iscoroutinefunction(function) or inspect.isgeneratorfunction(function):
        raise PluginError(f"{hook} is no plain function; remove async or yield from it")
    known = tuple(inspect.signature(specs[hook]).parameters)
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
            raise PluginError(f"{hook} takes *{name}; name the arguments: {', '.join(known)}")
        if name not in known:
            raise PluginError(f"{hook}: {unknown_name('argument', name, known)}")
        if parameter.default is not parameter.empty or parameter.kind == parameter.KEYWORD_ONLY:
            raise PluginError(
                f"{hook}: argument {name!r} would never be passed; remove its default or the *"
                " before it"
            )
    return hook


def _check_format(form: object) -> None:
    if not isinstance(form, FileFormat):
        raise PluginError("its FORMAT is not a hairkit.io.file_format.FileFormat")
    for suffix in form.suffixes:
        if not isinstance(suffix, str) or not re.fullmatch(r"\.[^\sA-Z]+", suffix):
            raise PluginError(
                f"its FORMAT has the ending {suffix!r}, expected lower case with its dot: '.abc'"
            )


def _check_options(kind: Any) -> tuple[OptionInfo, ...]:
    """Return the options of a plugin; raises `PluginError` when one could never be used."""
    if kind is None:
        return ()
    parameters = getattr(kind, "__dataclass_params__", None)
    if not isinstance(kind, type) or parameters is None or not parameters.frozen:
        raise PluginError("its Options is not a frozen dataclass")
    options = describe(kind)
    for each in options:
        if each.default is MISSING:
            raise PluginError(f"its Options.{each.name} has no default; write option(default, ...)")
        if not _is_option_type(each.type):
            raise PluginError(
                f"its Options.{each.name} is of type {each.type}, expected bool, int, float, str,"
                " Path, tuples of these, or one of these or None"
            )
    make_options(kind, {each.name: each.default for each in options}, "its Options")
    return options


def _is_option_type(kind: Any) -> bool:
    if typing.get_origin(kind) in (tuple, typing.Union, types.UnionType):
        parts = [part for part in typing.get_args(kind) if part not in (type(None), Ellipsis)]
        return all(_is_option_type(part) for part in parts)
    return kind in OPTION_TYPES
