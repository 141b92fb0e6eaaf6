"""Whether every dependency has wheels for Windows and macOS, where hairkit has not been run.

    python .ci/resolve.py

pip chooses versions for each system and Python and installs nothing. One line each; exit code 1
where a dependency, of the core or of an extra that users install, has no wheel. Macs with Intel
processors are left out: alembic3d has no wheels for them.
"""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).parents[1]
SYSTEMS = ("win_amd64", "macosx_14_0_arm64")
PYTHONS = ("3.11", "3.12", "3.13")
INSTALL = ["install", "--quiet", "--dry-run", "--ignore-installed", "--only-binary=:all:"]
NOWHERE = str(PROJECT / "build" / "nowhere")
"""A folder that pip wants for packages of another system, and does not make."""


def requirements() -> dict[str, list[str]]:
    """Return what the core and each extra for users need, by name."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    used = [name for name in extras if name not in ("all", "test", "dev", "docs")]
    return {"core": project["dependencies"], **{name: extras[name] for name in used}}


def lacks(system: str, python: str, wanted: list[str]) -> str:
    """Return pip's reason why something cannot be installed there; empty where all can."""
    there = ["--platform", system, "--python-version", python, "--target", NOWHERE]
    command = [sys.executable, "-m", "pip", *INSTALL, *there, *wanted]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    said = [line for line in done.stderr.splitlines() if line.startswith("ERROR: ")]
    return said[-1].removeprefix("ERROR: ") if done.returncode and said else ""


def main() -> int:
    """Print a line for each system, Python and part, and return the exit code."""
    missing = 0
    for system in SYSTEMS:
        for python in PYTHONS:
            for name, wanted in requirements().items():
                reason = lacks(system, python, wanted)
                missing += bool(reason)
                print(f"{system:20} {python:6} {name:8} {reason or 'ok'}", flush=True)
    return int(missing > 0)


if __name__ == "__main__":
    sys.exit(main())
