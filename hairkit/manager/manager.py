"""The plugins of this process: by name, called one at a time.

Installing a plugin never changes a result by itself: a stage runs only on the plugin that the
recipe names. A broken plugin is kept on record with its distribution and reason; the rest goes on.
"""

from __future__ import annotations

import importlib.metadata
import logging
import os
import threading
from collections.abc import Collection, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pluggy

from hairkit import hookspecs
from hairkit.errors import DataError, HairkitError, OptionError, PluginError, one_line
from hairkit.manager.command_plugin import CommandPlugin, PluginCommand
from hairkit.manager.guard import describe_error, guard_hook, quiet_stdout, subject
from hairkit.manager.loading import (
    DISABLE_AUTOLOAD,
    PluginInfo,
    entry_points,
    import_file,
    inspect_plugin,
)
from hairkit.manager.manifest import Manifest, find_manifests
from hairkit.manager.results import Call, check_result
from hairkit.options import make_options, unknown_name
from hairkit.stages import EXPORT, renamed
from hairkit.types.finding import Finding
from hairkit.types.groom import Groom

_log = logging.getLogger("hairkit")


class Manager:
    """The plugins of this process."""

    def __init__(self) -> None:
        self._pluggy = pluggy.PluginManager(hookspecs.PROJECT)
        self._pluggy.add_hookspecs(hookspecs)
        self._infos: dict[str, PluginInfo] = {}
        self._clashes: list[PluginInfo] = []
        self._asleep: dict[str, Manifest] = {}
        self._waking = threading.RLock()

    @classmethod
    def loaded(
        cls,
        plugin_files: Sequence[str | os.PathLike[str]] = (),
        *,
        autoload: bool = True,
        only: Collection[str] | None = None,
    ) -> Manager:
        """Return the installed plugins, those of `HAIRKIT_PLUGIN_PATH`, and those of files.

        Parameters
        ----------
        plugin_files
            Python files that are plugins; a plugin has the name of its file.
        autoload
            False, or the environment variable `HAIRKIT_DISABLE_PLUGIN_AUTOLOAD`: of the installed
            plugins take only those that ship with hairkit.
        only
            Names of the installed plugins that are needed, since importing all takes a second; None
            for all.

        Raises
        ------
        PluginError
            A plugin file cannot be used. Broken installed plugins are only recorded.
        """
        manager, own_only = cls(), not autoload or bool(os.environ.get(DISABLE_AUTOLOAD))
        for distribution, version, entry in entry_points():
            wanted = only is None or entry.name in only
            if wanted and (distribution == hookspecs.PROJECT or not own_only):
                manager._load_entry_point(entry, distribution, version)
        for manifest in () if own_only else find_manifests():
            manager._add_manifest(manifest)
        for file in plugin_files:
            manager._load_file(Path(file))
        return manager

    def register(
        self, plugin: object, name: str, distribution: str = "this program", version: str = ""
    ) -> None:
        """Add a plugin object; raises `PluginError` when it breaks the contract."""
        if name in self._infos:
            taken = self._infos[name].origin
            raise PluginError(f"a plugin named {name!r} is already loaded from {taken}; rename one")
        try:
            info = inspect_plugin(plugin, name, distribution, version)
            self._pluggy.register(plugin, name)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a plugin may do anything while it is looked at
            if self._pluggy.has_plugin(name):
                self._pluggy.unregister(name=name)
            raise PluginError(_reason(error)) from error
        self._infos[name] = info

    def add_command(self, command: PluginCommand) -> None:
        """Start a plugin in an environment of its own and add it, unless it was added before.

        Raises `PluginError` when it cannot be started or breaks the contract, or when another
        plugin has its name.
        """
        name = command.name
        info = self._infos.get(name)
        if info is not None and info.command == command:
            return
        if info is not None and info.command is not None:
            del self._infos[name]
            old: Any = self._pluggy.unregister(name=name)
            old.close()
        try:
            plugin = CommandPlugin(command)
            self.register(plugin, name, command.line, plugin.version)
        except PluginError as error:
            raise PluginError(f"plugin {name!r}, {command.line}: {error}") from error
        self._infos[name] = replace(self._infos[name], command=command, digest=plugin.digest)

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
        self._wake(name)
        info = self._infos.get(name)
        if info is not None and info.broken:
            raise PluginError(f"{info} is broken: {info.broken}")
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
        self._wake(name)
        kind, place = getattr(self._pluggy.get_plugin(name), "Options", None), where or name
        if kind is None and values:
            raise OptionError(f"{place}: no option {next(iter(values))!r}; it has none")
        if kind is None:
            return None
        try:
            return make_options(kind, values, place)
        except OptionError as error:
            raise OptionError(f"{error}{renamed(name)}") from error
        except ValueError as error:  # its __post_init__ refuses values that do not go together
            raise OptionError(f"{place}: {one_line(error)}") from error
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise OptionError(f"{place}: its Options failed: {describe_error(error)}") from error

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
                f"{self.info(plugin)} returned nothing from {stage!r}{subject(arguments)}"
            )
        return result

    def call_first(
        self, stage: str, choices: Sequence[tuple[str, Any]], **arguments: Any
    ) -> tuple[str, Any]:
        """Try (plugin, options) pairs in order; return the first plugin with a result, and it.

        Raises `PluginError` when none has one.
        """
        found = self.find_first(stage, choices, **arguments)
        if found is not None:
            return found
        tried = ", ".join(plugin for plugin, _ in choices) or "none"
        raise PluginError(
            f"no plugin has an answer for {stage!r}{subject(arguments)}; tried: {tried}"
        )

    def find_first(
        self, stage: str, choices: Sequence[tuple[str, Any]], **arguments: Any
    ) -> tuple[str, Any] | None:
        """Return what `call_first` does; None when no plugin has a result."""
        for plugin, options in choices:
            result = self._call(stage, plugin, options, arguments)
            if result is not None:
                return plugin, result
        return None

    def notify(self, hook: str, **arguments: Any) -> None:
        """Call a notification on all plugins; one that raises is only logged, as a warning."""
        for info in self._infos.values():
            if hook in info.notifications:
                try:
                    with quiet_stdout():
                        self._caller(hook, info.name)(**arguments)
                except KeyboardInterrupt:
                    raise
                except BaseException as error:  # whatever a listener does, the run goes on
                    _log.warning("%s failed in %r: %s", info, hook, describe_error(error))

    def findings(self, groom: Groom, path: Path, target: str) -> list[Finding]:
        """Return what the `validate_groom` of all plugins finds, in the order of their names.

        Raises `PluginError` when one fails, or returns anything but findings.
        """
        hook, arguments = "validate_groom", {"groom": groom, "path": path, "target": target}
        found: list[Finding] = []
        for info in sorted(self._infos.values(), key=lambda info: info.name):
            if hook not in info.notifications:
                continue
            with guard_hook(str(info), hook, arguments):
                for answer in self._caller(hook, info.name)(**arguments):
                    if not all(isinstance(finding, Finding) for finding in answer):
                        raise DataError("returned no list of findings")
                    found += answer
        return found

    def guard(self, stage: str, plugin: str) -> AbstractContextManager[None]:
        """Return a context in which errors name the plugin: for what its simulator does later."""
        return guard_hook(str(self.info(plugin)), stage, {})

    def _call(self, stage: str, plugin: str, options: Any, arguments: dict[str, Any]) -> Any:
        info = self.implementer(stage, plugin)
        if options is None or isinstance(options, Mapping):
            options = self.options(plugin, options or {})
        call = Call.of(arguments)
        try:
            with guard_hook(str(info), stage, arguments):
                result = self._caller(stage, plugin)(**arguments, options=options)
                if result is not None:
                    check_result(stage, result, call)
        except BaseException:
            if stage == EXPORT.hook:
                call.remove_half_file()
            raise
        return result

    def _caller(self, hook: str, plugin: str) -> pluggy.HookCaller:
        chosen = self._pluggy.get_plugin(plugin)
        others = [other for other in self._pluggy.get_plugins() if other is not chosen]
        return self._pluggy.subset_hook_caller(hook, others)

    def _load_entry_point(
        self, entry: importlib.metadata.EntryPoint, distribution: str, version: str
    ) -> None:
        try:
            with quiet_stdout():
                self.register(entry.load(), entry.name, distribution, version)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a plugin may do anything while it is imported
            broken = PluginInfo(entry.name, distribution, version, broken=_reason(error))
            if entry.name in self._infos:
                self._clashes.append(broken)
            else:
                self._infos[entry.name] = broken

    def _add_manifest(self, manifest: Manifest) -> None:
        """Note a plugin that is described by a file; its code is loaded when it is first used."""
        info = PluginInfo(
            manifest.name, str(manifest.path), manifest.version, manifest.summary,
            manifest.stages, options=manifest.options, broken=manifest.broken,
        )  # fmt: skip
        if manifest.name in self._infos:
            taken = self._infos[manifest.name].origin
            reason = f"a plugin named {manifest.name!r} is already loaded from {taken}; rename one"
            self._clashes.append(replace(info, broken=manifest.broken or reason))
            return
        self._infos[manifest.name] = info
        if manifest.broken is None:
            self._asleep[manifest.name] = manifest

    def _wake(self, name: str) -> None:
        """Load a plugin that was only described so far; one that is not as described is broken."""
        with self._waking:
            manifest = self._asleep.pop(name, None)
            if manifest is None:
                return
            described = self._infos.pop(name)
            try:
                with quiet_stdout():
                    if manifest.command is not None:
                        self.add_command(manifest.command)
                    elif manifest.module is not None:
                        module = import_file(manifest.module)
                        self.register(module, name, described.distribution, manifest.version)
                missing = set(described.stages) - set(self._infos[name].stages)
                if missing:
                    self._infos.pop(name)
                    self._pluggy.unregister(name=name)
                    raise PluginError(f"its code has no {', '.join(sorted(missing))}")
            except KeyboardInterrupt:
                raise
            except BaseException as error:  # a plugin may do anything while it is imported
                self._infos[name] = replace(described, broken=_reason(error))

    def _load_file(self, path: Path) -> None:
        if not path.is_file():
            raise PluginError(f"--plugin {path}: no such file")
        try:
            with quiet_stdout():
                self.register(import_file(path), path.stem, str(path))
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise PluginError(f"--plugin {path}: {_reason(error)}") from error


def _reason(error: BaseException) -> str:
    return one_line(error) if isinstance(error, HairkitError) else describe_error(error)
