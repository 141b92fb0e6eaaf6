"""`hairkit plugins [NAME]`: list the plugins by stage, or describe one and its options."""

from __future__ import annotations

import argparse
import json
import tomllib
from dataclasses import asdict

from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.format_table import format_table
from hairkit.errors import InputError
from hairkit.io.file_format import Feature
from hairkit.manager import Manager, PluginInfo
from hairkit.options import OptionInfo
from hairkit.stages import OF_HOOK

DESCRIPTION = """\
Example: hairkit plugins gabor

List the installed plugins by stage, or describe one: its distribution, what it does, and its
options with their defaults and bounds. --check tries it on a made-up head: contract, options,
texts, time, memory, and whether two calls give the same; exit code 2 where something fails.
--lock prints the versions of a recipe's plugins, to be put at its end: it then runs with no others.
--formats prints what each file format carries, as a Markdown table."""
_INFO_KEYS = ("name", "distribution", "version", "summary", "stages", "notifications", "broken")
_OPTION_KEYS = ("name", "default", "wanted", "low", "high", "choices", "unit", "doc")
"""What is told of a plugin and of its options as JSON."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("name", nargs="?", metavar="NAME", help="a plugin, or a stage's hook")
    add("--check", action="store_true", help="try the plugin on a made-up head")
    add("--source", metavar="S", help="with --check, what to ask `capture` for")
    add("--lock", metavar="RECIPE", help="print the recipe's table [lock]")
    add("--formats", action="store_true", help="print the table of file formats")
    add_shared(add, "--plugin", "--json")


def run(args: argparse.Namespace) -> int:
    """Print the list, or one plugin; a broken plugin asked for by name gives exit code 2."""
    manager = Manager.loaded(args.plugin)
    if args.formats:
        forms = [plugin.format for plugin in manager.plugins() if plugin.format is not None]
        cells = {form.title: {part.value: form.state(part) for part in Feature} for form in forms}
        print(json.dumps(cells, indent=1) if args.json else format_table(manager))
        return 0
    if args.lock is not None:
        from hairkit.pipeline.plugin_lock import lock_of
        from hairkit.pipeline.recipe import load_recipe

        recipe = load_recipe(args.lock)
        recipe.check(manager)
        lock = lock_of((choice.plugin for choice in recipe.choices), manager)
        print(json.dumps(tomllib.loads(lock)) if args.json else lock)
        return 0
    if args.check and (args.name is None or args.name in OF_HOOK):
        raise InputError("--check tries one plugin; name it: hairkit plugins gabor --check")
    if args.name is None or args.name in OF_HOOK:
        wanted = [i for i in manager.plugins() if args.name is None or args.name in i.stages]
        print(_as_json(wanted) if args.json else _listing(wanted))
        return 0
    if args.check:
        return _check(manager, args.name, args.source, as_json=args.json)
    info = manager.info(args.name)
    print(_as_json([info]) if args.json else _details(info))
    return 2 if info.broken else 0


def _check(manager: Manager, name: str, source: str | None, *, as_json: bool) -> int:
    """Print what is found about a plugin."""
    from hairkit.manager.plugin_check import check_plugin

    checks = list(check_plugin(manager, name, source))
    if as_json:
        print(json.dumps([asdict(check) for check in checks], indent=1))
    else:
        rows = [(("ok" if c.passed else "FAILS"), c.name, c.said) for c in checks]
        print("\n".join(f"{state:<6} {name:<22} {said}" for state, name, said in rows))
    return 0 if all(check.passed for check in checks) else 2


def _listing(infos: list[PluginInfo]) -> str:
    lines = []
    for stage in OF_HOOK:
        members = [info for info in infos if stage in info.stages]
        if members:
            lines += [stage, *(f"  {_row(info)}" for info in members)]
    listeners = [info for info in infos if not info.stages and not info.broken]
    if listeners:
        lines += ["notifications only", *(f"  {_row(info)}" for info in listeners)]
    broken = [info for info in infos if info.broken]
    if broken:
        lines += ["broken", *(f"  {i.name:<20} {i.origin}: {i.broken}" for i in broken)]
    return "\n".join(lines) or "no plugin"


def _row(info: PluginInfo) -> str:
    return f"{info.name:<20} {info.origin:<16} {info.summary}"


def _details(info: PluginInfo) -> str:
    lines = [f"{info.name}: {info.summary}" if info.summary else info.name, f"from {info.origin}"]
    if info.broken:
        return "\n".join([*lines, f"broken: {info.broken}"])
    lines.append(f"stages: {', '.join(info.stages) or 'none'}")
    if info.models:
        lines.append(f"networks: {', '.join(info.models)}")
    if info.notifications:
        lines.append(f"listens to: {', '.join(info.notifications)}")
    lines.append("options:" if info.options else "no options")
    for option in info.options:
        lines += [
            f"  {option.name} = {_format_default(option)}  ({option.wanted})",
            f"      {option.doc}",
        ]
    if info.options:
        first = info.options[0]
        lines.append(f"set one with --set {info.name}.{first.name}={_format_default(first)}")
    return "\n".join(lines)


def _format_default(option: OptionInfo) -> str:
    if isinstance(option.default, tuple):
        return ",".join(str(item) for item in option.default)
    if isinstance(option.default, bool):
        return str(option.default).lower()
    return "none" if option.default is None else str(option.default)


def _as_json(infos: list[PluginInfo]) -> str:
    entries = [
        {key: getattr(info, key) for key in _INFO_KEYS}
        | {"options": [{key: getattr(each, key) for key in _OPTION_KEYS} for each in info.options]}
        for info in infos
    ]
    return json.dumps(entries, indent=1, default=str)
