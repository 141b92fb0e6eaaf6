"""`hairkit doctor`: check what works on this machine and print how to fix the rest."""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import json
import os
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Literal

from hairkit.cli.arguments import Add, add_shared
from hairkit.manager import Manager
from hairkit.manager.guard import describe_error
from hairkit.nets.install import is_intact
from hairkit.nets.known_models import KNOWN_MODELS
from hairkit.nets.model_folder import model_folder
from hairkit.system import gl_cure
from hairkit.version import __version__

DESCRIPTION = """\
Example: hairkit doctor

Check Python, the packages, OpenGL, caches and plugins, and say what to install. The exit code is
0 if hairkit's core works; problems with optional parts are notes."""

_MODULES = {"opencv-python-headless": "cv2"}
"""Distributions whose module has another name."""
_NOT_FOR_USERS = ("all", "test", "docs", "dev")
"""Extras for work on hairkit, and the one that stands for all others."""
_NO_CACHE = "no locator available"
"""Numba's message if it has no folder for compiled code."""


# Each backend gets a process of its own: only one can be loaded in a process, and drivers crash.
_TRY_GL = """
from hairkit.rendering.context import renderer
with renderer() as found:
    found.program("hair_flat", "flat")
    print(found.description)
"""


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    topic: str
    verdict: Literal["ok", "note", "FAIL"]
    text: str


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add_shared(add, "--json")


def run(args: argparse.Namespace) -> int:
    """Print the findings; return 2 if something that hairkit needs is broken."""
    findings = list(examine())
    if args.json:
        print(json.dumps([asdict(finding) for finding in findings], indent=1))
    else:
        for finding in findings:
            print(f"{finding.verdict:<5} {finding.topic:<31} {finding.text}")
    return 2 if any(finding.verdict == "FAIL" for finding in findings) else 0


def examine() -> Iterator[Finding]:
    """Run all checks, one finding each."""
    system = f"{platform.python_version()} at {sys.executable} on {platform.platform()}"
    yield Finding("python", "ok" if sys.version_info >= (3, 11) else "FAIL", system)
    yield Finding("hairkit", "ok", f"{__version__} at {Path(__file__).parents[1]}")
    core, extras = _requirements()
    yield from (_package(name) for name in core)
    yield _opencv_wheels([d.name for d in importlib.metadata.distributions()])
    yield from _graphics()
    yield from (_extra(*each) for each in extras.items() if each[0] not in _NOT_FOR_USERS)
    yield _kernel_cache()
    yield _networks()
    yield from _plugins()


def _requirements() -> tuple[list[str], dict[str, list[str]]]:
    """Return what hairkit needs, and what each of its extras adds, by distribution name."""
    core: list[str] = []
    extras: dict[str, list[str]] = {}
    for line in importlib.metadata.requires("hairkit") or []:
        name = re.split(r"[^\w.-]", line, maxsplit=1)[0]
        extra = re.search(r"extra == ['\"]([\w-]+)['\"]", line)
        (extras.setdefault(extra[1], []) if extra else core).append(name)
    return core, extras


def _package(name: str) -> Finding:
    try:
        module = importlib.import_module(_MODULES.get(name, name.replace("-", "_")))
        version = _version(name, module)
    except Exception as error:  # a broken package may raise anything while it is imported
        return Finding(
            name, "FAIL", f"{describe_error(error)}; pip install --force-reinstall {name}"
        )
    return Finding(name, "ok", version)


def _version(name: str, module: ModuleType) -> str:
    """Return the distribution's version, or its module's: OpenCV comes in several distributions."""
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return f"{module.__version__}, of another distribution"


def _opencv_wheels(installed: list[str]) -> Finding:
    """Check for several OpenCV wheels: they overwrite each other in the folder cv2."""
    wheels = sorted({name.lower() for name in installed if name.lower().startswith("opencv-")})
    if len(wheels) > 1:
        cure = f"pip uninstall -y {' '.join(wheels)} && pip install opencv-python-headless"
        return Finding("opencv wheels", "FAIL", f"several share the folder cv2; {cure}")
    return Finding("opencv wheels", "ok", f"one: {', '.join(wheels) or 'a build without pip'}")


def _graphics() -> Iterator[Finding]:
    shown = {backend: _try_backend(backend) for backend in ("egl", "osmesa")}
    works = any(success for success, _ in shown.values())
    for backend, (success, text) in shown.items():
        if success:
            yield Finding(f"OpenGL by {backend}", "ok", text)
        else:
            yield Finding(
                f"OpenGL by {backend}", "note" if works else "FAIL", f"{text}; {gl_cure()}"
            )


def _try_backend(backend: str) -> tuple[bool, str]:
    try:
        result = subprocess.run(
            [sys.executable, "-c", _TRY_GL],
            env={**os.environ, "HAIRKIT_GL": backend},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False, "no answer within 60 seconds"
    lines = (result.stdout if result.returncode == 0 else result.stderr).strip().splitlines()
    return result.returncode == 0, lines[-1] if lines else f"crashed ({result.returncode})"


def _extra(extra: str, names: list[str]) -> Finding:
    missing = [name for name in names if not _is_installed(name)]
    if missing:
        cure = f'pip install "hairkit[{extra}]"'
        return Finding(f"extra {extra}", "note", f"not there: {', '.join(missing)}; {cure}")
    return Finding(f"extra {extra}", "ok", ", ".join(names))


def _is_installed(name: str) -> bool:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def _kernel_cache() -> Finding:
    """Check whether Numba can cache compiled kernels: beside the sources or in its own folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    beside = Path(__file__).parents[1]
    folders = [Path(named)] if named else [beside, Path.home() / ".cache"]
    for folder in folders:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                return Finding("compiled kernels", "ok", f"cached under {folder}")
        except OSError:
            continue
    cure = "so Numba refuses to compile; set NUMBA_CACHE_DIR to a writable folder"
    return Finding("compiled kernels", "FAIL", f"{folders[0]} cannot be written, {cure}")


def _networks() -> Finding:
    """Check for the networks that plugins use, by hash."""
    missing = [model.name for model in KNOWN_MODELS if not is_intact(model)]
    if missing:
        text = f"not there: {', '.join(missing)}; hairkit models install"
        return Finding("networks", "note", text)
    return Finding("networks", "ok", f"{len(KNOWN_MODELS)} in {model_folder()}")


def _plugins() -> Iterator[Finding]:
    infos = Manager.loaded().plugins()
    working = [info.name for info in infos if not info.broken]
    yield Finding("plugins", "ok" if working else "FAIL", ", ".join(working) or "none works")
    for info in infos:
        if info.broken and _NO_CACHE not in info.broken:  # which `_kernel_cache` says once
            own = info.distribution == "hairkit"
            text = f"{info.broken}; pip install --force-reinstall {info.distribution}"
            yield Finding(f"plugin {info.name}", "FAIL" if own else "note", text)
