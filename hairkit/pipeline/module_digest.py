"""Digests of source code: a cached result is valid as long as the code that made it.

The digest of a module covers its own source and every module that it imports, directly or not,
as far as they belong to hairkit or to the module's own top-level package. It also covers the files
beside these modules that they name: weights, tables, pictures. Imports and names are read from the
source by their form, without running or parsing it. Modules named only in strings
(`importlib.import_module`) are not covered, and neither are the shaders of hairkit: no result that
is kept is drawn.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from hairkit.storage import file_state

FRONT_DOOR = "hairkit"
"""This package loads its names lazily: each stands for the module that defines it."""
_STATEMENT = re.compile(
    r"(?:^|[:;])[ \t]*(?:from[ \t]+(\.*)[ \t]*([\w.]*)[ \t]+import\b[ \t]*(\([^)]*\)|[^#;\n]+)"
    r"|import[ \t]+([^#;\n]+))",
    re.MULTILINE,
)
"""An import: leading dots, module and names, or modules alone. Docstring lines that look like
imports are followed too; that is harmless."""
_FILE_NAME = re.compile(r"""["']([\w-][\w.-]*\.(?!py["'])\w+)["']""")
"""A name with an ending in quotes: that of a file, if there is one beside the module."""
_FOR_TYPES = re.compile(
    r"^([ \t]*)if (?:typing\.)?TYPE_CHECKING:.*\n((?:\1[ \t]+.*(?:\n|$)|[ \t]*\n)*)", re.MULTILINE
)
_COMMENT = re.compile(r"#.*")

Roots = Mapping[str, Path]
"""Folder of a top-level package, or file of a top-level module, by name."""


@dataclass(frozen=True)
class _Import:
    """One imported module, and the names taken out of it (none for `import a.b`)."""

    module: str
    names: tuple[str, ...] = ()
    level: int = 0
    """Leading dots of a relative import."""
    for_types: bool = False
    """True under `if TYPE_CHECKING:`, so it is never executed."""


def module_digest(module: str, roots: Roots | None = None) -> str:
    """Return a hex digest of a module's source and of all that it imports.

    Parameters
    ----------
    module
        Full name: `hairkit.imaging.waves`. A module without a Python source has the digest of
        nothing.
    roots
        Where to look for sources; by default where Python finds hairkit and the module's package.
    """
    # a module of the same name may since lie elsewhere: a plugin file in another folder
    roots = _default_roots(module) if roots is None else roots
    key = (module, *roots.items())
    known = _DIGESTS.get(key)
    if known is not None and known.states == _states(known.files):
        return known.digest
    found = sorted(imported_modules(module, roots).items())
    data = [file for _, path in found for file in _data_beside(path)]
    files = (*(path for _, path in found), *data)
    states = _states(files)
    digest = hashlib.sha256()
    for name, path in found:
        digest.update(f"{name} {_read(path).digest}\n".encode())
    for file in data:
        digest.update(f"{file.name} {_content_digest(file, file_state(file))}\n".encode())
    known = _DIGESTS[key] = _Known(files, states, digest.hexdigest())
    return known.digest


class _Known(NamedTuple):
    """A digest, and the files that it holds for as long as they do not change."""

    files: tuple[Path, ...]
    states: list[_State]
    digest: str


_DIGESTS: dict[tuple[object, ...], _Known] = {}


_State = tuple[int, int, int] | None


def _states(files: Iterable[Path]) -> list[_State]:
    return [file_state(file) for file in files]


def imported_modules(module: str, roots: Roots | None = None) -> dict[str, Path]:
    """Return a module and all that it imports, directly or not, with their source files."""
    known = _default_roots(module) if roots is None else roots
    found: dict[str, Path | None] = {}
    waiting = [*_with_packages(module, known)]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        path = found[name] = _source(name, known)
        if path is not None:
            waiting += _direct_imports(name, path, known)
    return {name: path for name, path in found.items() if path is not None}


def _data_beside(path: Path) -> list[Path]:
    """Return the files beside a module that it names, sorted."""
    return sorted(file for name in _read(path).names if (file := path.with_name(name)).is_file())


@functools.cache
def _content_digest(path: Path, state: _State) -> str:
    """Read a file once; `state` is there to read it again after a change."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _direct_imports(name: str, path: Path, roots: Roots) -> Iterator[str]:
    """Yield the modules that one file imports; several may be named twice."""
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for item in _read(path).imports:
        if item.for_types:
            continue
        base = _absolute(item, package)
        if base == FRONT_DOOR:
            yield from _front_door(item.names, roots)
            continue
        yield from _with_packages(base, roots)
        yield from (f"{base}.{taken}" for taken in item.names)  # submodules; other names have none


def _front_door(names: Iterable[str], roots: Roots) -> Iterator[str]:
    """Yield the modules that define names of the front door, or that are these names."""
    path = _source(FRONT_DOOR, roots)
    shown = _read(path).imports if path is not None else ()
    homes = {taken: item.module for item in shown if item.for_types for taken in item.names}
    for name in names:
        yield from _with_packages(homes.get(name, f"{FRONT_DOOR}.{name}"), roots)


def _with_packages(module: str, roots: Roots) -> Iterator[str]:
    """Yield a module and the packages around it, whose `__init__` runs first.

    The front door itself is left out: it only names modules.
    """
    parts = module.split(".")
    names = (".".join(parts[:count]) for count in range(1, len(parts) + 1))
    yield from (name for name in names if name != FRONT_DOOR and parts[0] in roots)


def _absolute(item: _Import, package: str) -> str:
    if not item.level:
        return item.module
    parts = package.split(".")
    parts = parts[: len(parts) - item.level + 1]
    return ".".join([*parts, item.module] if item.module else parts)


def _default_roots(module: str) -> dict[str, Path]:
    tops = {FRONT_DOOR, module.partition(".")[0]}
    return {top: path for top in tops if (path := _place(top)) is not None}


def _place(top: str) -> Path | None:
    """Return the folder of a top-level package, the file of a module, None where there is none."""
    try:
        spec = importlib.util.find_spec(top)
    except ValueError:  # a module without a spec, as `__main__`
        file = getattr(sys.modules.get(top), "__file__", None)
        return Path(file) if file else None
    if spec is None:
        return None
    if spec.submodule_search_locations:
        return Path(next(iter(spec.submodule_search_locations)))
    return Path(spec.origin) if spec.has_location and spec.origin else None


def _source(module: str, roots: Roots) -> Path | None:
    """Return the Python file of a module, None where it has none or belongs to others."""
    top, *inner = module.split(".")
    if top not in roots:
        return None
    base = os.path.join(roots[top], *inner)  # many names are tried: strings are fast
    file = base if base.endswith(".py") else f"{base}.py"
    sources = (os.path.join(base, "__init__.py"), file)
    return next((Path(path) for path in sources if os.path.isfile(path)), None)


@dataclass(frozen=True)
class _Source:
    """Content digest and imports of one file, and what may be names of files in it."""

    digest: str
    imports: tuple[_Import, ...]
    names: frozenset[str]


def _read(path: Path) -> _Source:
    return _parse(path, file_state(path))


@functools.cache
def _parse(path: Path, state: _State) -> _Source:
    """Read a file once; `state` is there to read it again after a change."""
    data = path.read_bytes()
    text = data.decode(errors="replace").replace("\r\n", "\n").replace("\\\n", " ")
    typing = [inner for _, inner in _FOR_TYPES.findall(text)]
    imports = [*_imports(_FOR_TYPES.sub("", text), False), *_imports("".join(typing), True)]
    if any(item.module == FRONT_DOOR and not item.names for item in imports):
        used = re.findall(rf"\b{FRONT_DOOR}\.([A-Za-z]\w*)", text)
        imports.append(_Import(FRONT_DOOR, tuple(dict.fromkeys(used))))
    names = frozenset(_FILE_NAME.findall(text))
    return _Source(hashlib.sha256(data).hexdigest(), tuple(imports), names)


def _imports(text: str, for_types: bool) -> Iterator[_Import]:
    """Yield every import statement of a source, those inside functions and branches too."""
    for dots, module, names, modules in _STATEMENT.findall(text):
        if modules:
            yield from (_Import(name, for_types=for_types) for name in _listed(modules))
        else:
            yield _Import(module, tuple(_listed(names)), len(dots), for_types)


def _listed(names: str) -> Iterator[str]:
    """Yield the names of a list `a, b as c`, with or without brackets."""
    for item in _COMMENT.sub("", names).strip("() \t\n").split(","):
        if words := item.split():
            yield words[0]
