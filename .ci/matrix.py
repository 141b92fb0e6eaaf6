"""Run tests on several versions of Python, NumPy and OpenCV, and print a Markdown table.

    python .ci/matrix.py                             # a quick subset of the tests, all combinations
    python .ci/matrix.py --all                       # all tests
    python .ci/matrix.py --only 3.13 --opencv 5      # some of the combinations
    python .ci/matrix.py -- -x -n 2                  # with options of pytest

Each combination gets a virtual environment of its own in .matrix/, deleted when its tests are done.
What cannot be installed here is named in the table with the reason: no interpreter, no wheel, or
packages that exclude each other. The exit code is 1 when a test failed.
"""

from __future__ import annotations

import argparse
import itertools
import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

PROJECT = Path(__file__).parents[1]
FOLDER = PROJECT / ".matrix"
PYTHONS = ("3.11", "3.13")
NUMPYS = {"1.26": "numpy==1.26.*", "newest": "numpy>=2,<3"}
OPENCVS = {"4.11": "==4.11.*", "4": ">=4.12,<5", "5": ">=5,<6"}
OPENCV = "opencv-python-headless"
QUICK = ("tests/types", "tests/io", "tests/imaging", "tests/cameras", "tests/field")


@dataclass(frozen=True)
class Combination:
    """Versions asked for: a Python, and keys of `NUMPYS` and `OPENCVS`."""

    python: str
    numpy: str
    opencv: str

    @property
    def constraints(self) -> str:
        """The text of pip's constraints file."""
        return f"{NUMPYS[self.numpy]}\n{OPENCV}{OPENCVS[self.opencv]}\n"


@dataclass(frozen=True)
class Row:
    """One line of the table: versions as installed, or as asked for, and what came of it."""

    python: str
    numpy: str
    opencv: str
    result: str
    failed: bool = False


def main() -> int:
    """Run the combinations and print the table."""
    args = _arguments()
    tests = ["tests", "--ignore", "tests/clients"] if args.all else list(QUICK)
    failed = False
    print("| Python | NumPy | OpenCV | result |\n|---|---|---|---|", flush=True)
    for names in itertools.product(args.only, args.numpy, args.opencv):
        row = _run(Combination(*names), [*tests, *args.pytest])
        print(f"| {row.python} | {row.numpy} | {row.opencv} | {row.result} |", flush=True)
        failed = failed or row.failed
    return int(failed)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--all", action="store_true", help="run all tests, not the quick subset")
    add("--only", nargs="+", default=PYTHONS, metavar="PYTHON", help="versions of Python")
    add("--numpy", nargs="+", default=tuple(NUMPYS), choices=tuple(NUMPYS))
    add("--opencv", nargs="+", default=tuple(OPENCVS), choices=tuple(OPENCVS))
    add("pytest", nargs="*", metavar="WORD", help="arguments of pytest, after --")
    return parser.parse_args()


def _run(combination: Combination, tests: list[str]) -> Row:
    """Install a combination, run tests in it, and remove it again."""
    asked = (combination.python, combination.numpy, combination.opencv)
    interpreter = _interpreter(combination.python)
    if interpreter is None:
        return Row(*asked, "not available: no interpreter")
    folder = FOLDER / "-".join(asked)
    try:
        subprocess.run([interpreter, "-m", "venv", "--clear", folder], check=True)
        reason = _install(folder, combination)
        return Row(*asked, f"not available: {reason}") if reason else _test(folder, tests)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _interpreter(version: str) -> str | None:
    """Return a Python of a version: on the PATH, or of pyenv."""
    found = shutil.which(f"python{version}")
    pyenv = sorted(Path("~/.pyenv/versions").expanduser().glob(f"{version}.*/bin/python"))
    candidates = [found] if found else []
    for candidate in [*candidates, *map(str, pyenv)]:
        check = f"import sys, venv; sys.exit('%d.%d' % sys.version_info[:2] != '{version}')"
        if subprocess.run([candidate, "-c", check], capture_output=True).returncode == 0:
            return candidate
    return None


def _install(folder: Path, combination: Combination) -> str:
    """Install hairkit with its test tools; return why that is not possible, or nothing."""
    constraints = folder / "constraints.txt"
    constraints.write_text(combination.constraints)
    pip = [str(folder / "bin" / "python"), "-m", "pip", "install", "--disable-pip-version-check"]
    wheels = ["--only-binary", f"numpy,scipy,numba,llvmlite,usd-core,{OPENCV}"]
    words = ["--quiet", *wheels, "--constraint", str(constraints), "-e", ".[test]"]
    done = subprocess.run([*pip, *words], cwd=PROJECT, capture_output=True, text=True)
    return "" if done.returncode == 0 else _reason(done.stderr)


def _reason(errors: str) -> str:
    """Return pip's complaint in a few words."""
    missing = re.search(r"No matching distribution found for ([^\s;]+)", errors)
    absent = re.search(r"no matching distributions available.*?:\s+(\S+)", errors, re.DOTALL)
    if missing or absent:
        return f"no wheel of {(missing or absent or [''])[1]} for this Python"
    conflicts = re.findall(r"^ +(\S+) \S+ depends on (numpy\S*)", errors, re.MULTILINE)
    wanting = [f"{package} needs {numpy}" for package, numpy in conflicts if package == OPENCV]
    return wanting[0] if wanting else (errors.strip().splitlines() or ["pip failed"])[-1]


def _test(folder: Path, tests: list[str]) -> Row:
    """Run tests in an environment; its kernels are compiled and kept in its own folder."""
    python = str(folder / "bin" / "python")
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kernels")}
    probe = "import sys, numpy, cv2; print('%d.%d.%d' % sys.version_info[:3], numpy.__version__,"
    shown = subprocess.run(
        [python, "-c", f"{probe} cv2.__version__)"], capture_output=True, text=True, check=True
    )
    began = time.monotonic()
    words = ["-m", "pytest", "-q", "--tb=short", "-p", "no:cacheprovider", *tests]
    done = subprocess.run(
        [python, *words], cwd=PROJECT, env=environment, capture_output=True, text=True
    )
    seconds = time.monotonic() - began
    if done.returncode:
        print(done.stdout[-6000:], done.stderr[-2000:], file=sys.stderr)
    summary = (done.stdout.strip().splitlines() or ["pytest did not start"])[-1]
    counts = re.sub(r" in [\d.]+s.*$", "", summary.strip("= "))
    return Row(*shown.stdout.split(), f"{counts}, {seconds:.0f} s", done.returncode != 0)


if __name__ == "__main__":
    sys.exit(main())
