"""The lock of a recipe: which versions of its plugins it was made with, and is run with.

[lock]
gabor = "hairkit 0.2.0"
matte = "1.2 code 3f0eed1b2c4d"

A recipe with this table is refused where another version is installed. Plugins that it does not
name are not looked at.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

from hairkit.errors import InputError, PluginError
from hairkit.manager import Manager, PluginInfo
from hairkit.pipeline.module_digest import module_digest

DIGEST_LETTERS = 12
"""Letters of a digest that stand in a lock, as many as git shows of a commit."""


def locked_version(info: PluginInfo) -> str:
    """Return what a lock says of a plugin: its distribution and version, else a digest of its code.

    Commands and plugin files belong to no distribution that pip knows.
    """
    if info.command is None and info.version:
        return info.origin
    code = info.digest or module_digest(info.module)
    return f"{info.version} code {code[:DIGEST_LETTERS]}".strip()


def lock_of(plugins: Iterable[str], manager: Manager) -> str:
    """Return the table `[lock]` for the plugins of a recipe, to be put at its end."""
    names = sorted(set(plugins))
    lines = [f"{name} = {json.dumps(locked_version(manager.info(name)))}" for name in names]
    return "\n".join(["[lock]", *lines])


def read_lock(content: object, source: str) -> Mapping[str, str]:
    """Return the versions in a recipe's table; raises `InputError` for anything else."""
    if not isinstance(content, dict) or not all(isinstance(v, str) for v in content.values()):
        raise InputError(f"{source}: lock: expected a table of plugins and their versions")
    return content


def check_lock(lock: Mapping[str, str], manager: Manager, source: str) -> None:
    """Raise `PluginError` naming the first plugin of another version than the lock's."""
    for name, wanted in lock.items():
        found = locked_version(manager.info(name))
        if found != wanted:
            raise PluginError(
                f"{source}: [lock] {name}: {found} is installed, the recipe was locked to {wanted};"
                f" install that, or lock it again: hairkit plugins --lock RECIPE"
            )
