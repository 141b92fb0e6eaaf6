"""Plugins by name: found by entry point or loaded from a file, each guarded, called one at a time.

Installing a plugin never changes a result by itself: a stage runs only on the plugin that the
recipe names. A broken plugin is kept on record with its distribution and reason; the rest goes on.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import inspect
import logging
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pluggy

from hairkit import hookspecs
from hairkit.errors import HairkitError, OptionError, PluginError
from hairkit.io.file_format import FileFormat
from hairkit.options import OptionInfo, describe, make_options, unknown_name
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull, OrientationField

ENTRY_POINT_GROUP = "hairkit"
DISABLE_AUTOLOAD = "HAIRKIT_DISABLE_PLUGIN_AUTOLOAD"
"""Environment variable: when it is set, only the plugins that ship with hairkit are loaded."""

RESULT_TYPES: dict[str, type | None] = {
    "segment": Mask,
    "estimate_scene": Scene,
    "fit_head": Scene,
    "orient": OrientationMap,
    "build_hull": Hull,
    "solve_field": OrientationField,
    "track": Strands,
    "enhance_texture": None,
    "make_simulator": None,
    "export_groom": bool,
    "import_groom": Groom,
}
"""What a plugin must return for each stage hook; None where the contract leaves the type open."""

STAGES = tuple(RESULT_TYPES)

_log = logging.getLogger("hairkit")


@dataclass(frozen=True)
class PluginInfo:
    """What is known about one plugin, working or broken."""

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
    suffixes: tuple[str, ...] = ()
    """File name endings that it reads or writes, from the module's `FORMAT`: `(".apx",)`."""
    format: FileFormat | None = None
    """What its file format carries, from the module's `FORMAT`."""
    broken: str | None = None
    """Why the plugin cannot be used, or None."""

    @property
    def origin(self) -> str:
        """Distribution and version in words: `hairkit 0.1.0`."""
        return f"{self.distribution} {self.version}".strip()


class Manager:
    """The plugins of this process."""

    def __init__(self) -> None:
        self._pluggy = pluggy.PluginManager(hookspecs.PROJECT)
        self._pluggy.add_hookspecs(hookspecs)
        self._infos: dict[str, PluginInfo] = {}
        self._clashes: list[PluginInfo] = []

    @classmethod
    def loaded(
        cls, plugin_files: Sequence[str | os.PathLike[str]] = (), *, autoload: bool = True
    ) -> Manager:
        """Return a manager on which `load` was called."""
        manager = cls()
        manager.load(plugin_files, autoload=autoload)
        return manager

    def load(
        self, plugin_files: Sequence[str | os.PathLike[str]] = (), *, autoload: bool = True
    ) -> None:
        """Load installed plugins, then plugin files.

        Parameters
        ----------
        plugin_files
            Python files that are plugins; a plugin has the name of its file.
        autoload
            False, or the environment variable `HAIRKIT_DISABLE_PLUGIN_AUTOLOAD`: of the installed
            plugins take only those that ship with hairkit.

        Raises
        ------
        PluginError
            A plugin file cannot be used. Broken installed plugins are only recorded.
        """
        own_only = not autoload or bool(os.environ.get(DISABLE_AUTOLOAD))
        for distribution, version, entry in _entry_points():
            if distribution == hookspecs.PROJECT or not own_only:
                self._load_entry_point(entry, distribution, version)
        for file in plugin_files:
            self._load_file(Path(file))

    def register(
        self, plugin: object, name: str, distribution: str = "this program", version: str = ""
    ) -> None:
        """Add a plugin object; raises `PluginError` when it breaks the contract."""
        if name in self._infos:
            taken = self._infos[name].origin
            raise PluginError(f"a plugin named {name!r} is already loaded from {taken}; rename one")
        info = _inspect(plugin, name, distribution, version)
        try:
            self._pluggy.register(plugin, name)
            self._check_hooks(plugin)
        except (pluggy.PluginValidationError, PluginError) as error:
            self._pluggy.unregister(name=name)
            raise PluginError(_one_line(error)) from error
        hooks = tuple(caller.name for caller in self._pluggy.get_hookcallers(plugin) or ())
        stages = tuple(stage for stage in STAGES if stage in hooks)
        others = tuple(sorted(set(hooks) - set(STAGES)))
        self._infos[name] = replace(info, stages=stages, notifications=others)

    def plugins(self) -> tuple[PluginInfo, ...]:
        """Return all plugins by name, the broken ones too."""
        every = [*self._infos.values(), *self._clashes]
        return tuple(sorted(every, key=lambda info: (info.name, info.distribution)))

    def names(self, stage: str) -> tuple[str, ...]:
        """Return the names of the working plugins that implement a stage, sorted."""
        return tuple(sorted(i.name for i in self._infos.values() if stage in i.stages))

    def info(self, name: str) -> PluginInfo:
        """Return what is known about a plugin; raises `PluginError` when none has that name."""
        if name not in self._infos:
            raise PluginError(unknown_name("plugin", name, sorted(self._infos)))
        return self._infos[name]

    def implementer(self, stage: str, name: str) -> PluginInfo:
        """Return the working plugin `name` that implements `stage`, or raise `PluginError`."""
        info = self._infos.get(name)
        if info is not None and info.broken:
            raise PluginError(f"plugin {name!r} of {info.origin} is broken: {info.broken}")
        if info is None or stage not in info.stages:
            installed = ", ".join(self.names(stage)) or "none"
            raise PluginError(
                f"no plugin named {name!r} implements {stage!r}; installed: {installed}"
            )
        return info

    def options(self, name: str, values: Mapping[str, object], where: str = "") -> Any:
        """Return the plugin's `Options` with `values` checked; None when it has no options.

        Raises `OptionError`, its text starting with `where` (the plugin's name by default).
        """
        kind = getattr(self._pluggy.get_plugin(name), "Options", None)
        if kind is not None:
            return make_options(kind, values, where or name)
        if values:
            raise OptionError(f"{where or name}: no option {next(iter(values))!r}; it has none")
        return None

    def call(self, stage: str, plugin: str, options: Any = None, **arguments: Any) -> Any:
        """Run one stage on one plugin and return its result.

        Parameters
        ----------
        stage
            Name of a stage hook: `orient`.
        plugin
            Name of the plugin; no other plugin is called.
        options
            The plugin's `Options`, or a mapping of option values, or None for the defaults.
        arguments
            The hook's other arguments, all of them.

        Raises
        ------
        PluginError
            The plugin is missing, does not implement the stage, fails or returns the wrong type.
        OptionError
            An option value is refused.
        """
        result = self._call(stage, plugin, options, arguments)
        if result is None:
            raise PluginError(
                f"plugin {plugin!r} of {self.info(plugin).origin} returned nothing from {stage!r}"
                + _about(arguments)
            )
        return result

    def call_first(
        self, stage: str, choices: Sequence[tuple[str, Any]], **arguments: Any
    ) -> tuple[str, Any]:
        """Try (plugin, options) pairs in order; return the first plugin with a result, and it."""
        for plugin, options in choices:
            result = self._call(stage, plugin, options, arguments)
            if result is not None:
                return plugin, result
        tried = ", ".join(plugin for plugin, _ in choices) or "none"
        raise PluginError(
            f"no plugin has an answer for {stage!r}{_about(arguments)}; tried: {tried}"
        )

    def notify(self, hook: str, **arguments: Any) -> None:
        """Call a notification on all plugins; one that raises is only logged, as a warning."""
        for info in self._infos.values():
            if hook in info.notifications:
                try:
                    self._caller(hook, info.name)(**arguments)
                except Exception as error:  # whatever a listener does, the run goes on
                    _log.warning("%s", _failure(info, hook, error))

    def _call(self, stage: str, plugin: str, options: Any, arguments: dict[str, Any]) -> Any:
        info = self.implementer(stage, plugin)
        if options is None or isinstance(options, Mapping):
            options = self.options(plugin, options or {})
        try:
            result = self._caller(stage, plugin)(**arguments, options=options)
        except HairkitError:
            raise
        except Exception as error:
            raise PluginError(_failure(info, stage, error)) from error
        wanted = RESULT_TYPES[stage]
        if result is not None and wanted is not None and not isinstance(result, wanted):
            raise PluginError(
                f"plugin {plugin!r} of {info.origin} returned {type(result).__name__} from"
                f" {stage!r}, expected {wanted.__name__}"
            )
        return result

    def _caller(self, hook: str, plugin: str) -> pluggy.HookCaller:
        chosen = self._pluggy.get_plugin(plugin)
        others = [other for other in self._pluggy.get_plugins() if other is not chosen]
        return self._pluggy.subset_hook_caller(hook, others)

    def _check_hooks(self, plugin: object) -> None:
        known = [*STAGES, *_notifications()]
        callers = self._pluggy.get_hookcallers(plugin) or []
        for caller in callers:
            if not caller.has_spec():
                raise PluginError(unknown_name("hook", caller.name, known))
        if not callers:
            raise PluginError("it implements no hook; mark its function with @hairkit.hookimpl")

    def _load_entry_point(
        self, entry: importlib.metadata.EntryPoint, distribution: str, version: str
    ) -> None:
        try:
            self.register(entry.load(), entry.name, distribution, version)
        except (Exception, SystemExit) as error:  # a plugin may do anything while it is imported
            reason = str(error) if isinstance(error, HairkitError) else _named(error)
            broken = PluginInfo(entry.name, distribution, version, broken=_one_line(reason))
            if entry.name in self._infos:
                self._clashes.append(broken)
            else:
                self._infos[entry.name] = broken

    def _load_file(self, path: Path) -> None:
        if not path.is_file():
            raise PluginError(f"--plugin {path}: no such file")
        try:
            self.register(_import_file(path), path.stem, str(path))
        except (Exception, SystemExit) as error:
            reason = str(error) if isinstance(error, HairkitError) else _named(error)
            raise PluginError(f"--plugin {path}: {_one_line(reason)}") from error


def _entry_points() -> list[tuple[str, str, importlib.metadata.EntryPoint]]:
    """Return entry points with the name and version of their distributions, hairkit's own first
    so that nobody can take their names."""
    entries = importlib.metadata.entry_points(group=ENTRY_POINT_GROUP)
    # a distribution parses its metadata whenever it is asked, and one may have many plugins
    distributions = {id(entry.dist): entry.dist for entry in entries}
    origins = {key: _origin(found) for key, found in distributions.items()}
    found = [(*origins[id(entry.dist)], entry) for entry in entries]
    return sorted(found, key=lambda f: (f[0] != hookspecs.PROJECT, f[0], f[2].name))


def _origin(distribution: importlib.metadata.Distribution | None) -> tuple[str, str]:
    if distribution is None:
        return "unknown distribution", ""
    return distribution.name, distribution.version


def _import_file(path: Path) -> ModuleType:
    name = f"hairkit_plugin_file_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise PluginError("not a Python file; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their annotations up here
    spec.loader.exec_module(module)
    return module


def _inspect(plugin: object, name: str, distribution: str, version: str) -> PluginInfo:
    options: tuple[OptionInfo, ...] = ()
    kind = getattr(plugin, "Options", None)
    if kind is not None:
        parameters = getattr(kind, "__dataclass_params__", None)
        if parameters is None or not parameters.frozen:
            raise PluginError("its Options is not a frozen dataclass")
        options = describe(kind)
    summary = " ".join((inspect.getdoc(plugin) or "").partition("\n\n")[0].split())
    file = getattr(plugin, "__file__", None)
    form = getattr(plugin, "FORMAT", None)
    if form is not None and not isinstance(form, FileFormat):
        raise PluginError("its FORMAT is not a hairkit.io.file_format.FileFormat")
    return PluginInfo(
        name,
        distribution,
        version,
        summary,
        options=options,
        source=Path(file) if file else None,
        module=getattr(plugin, "__module__", getattr(plugin, "__name__", "")),
        suffixes=form.suffixes if form else tuple(getattr(plugin, "SUFFIXES", ())),
        format=form,
    )


def _notifications() -> list[str]:
    return [
        name
        for name, value in vars(hookspecs).items()
        if hasattr(value, f"{hookspecs.PROJECT}_spec") and name not in STAGES
    ]


def _failure(info: PluginInfo, hook: str, error: BaseException) -> str:
    return f"plugin {info.name!r} of {info.origin} failed in {hook!r}: {_one_line(_named(error))}"


def _about(arguments: Mapping[str, Any]) -> str:
    view = arguments.get("view")
    return f" of view {view.name!r}" if view is not None else ""


def _named(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _one_line(text: object) -> str:
    return " ".join(str(text).split())
