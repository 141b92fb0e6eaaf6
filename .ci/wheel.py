"""Build a wheel for this Python that holds compiled kernels, and prove that its first run has none.

python .ci/wheel.py dist

Kernels are compiled for any x86-64 processor of the last ten years (`hairkit.kernel_cache`) by
running what people run first: a reconstruction from photos alone and with masks, both simulators, a
picture and the viewer. Then the sample is reconstructed by the wheel in an empty folder, without a
cache. The exit code is 1 where that compiled anything.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

from hairkit.kernel_cache import PORTABLE_FEATURES, PORTABLE_PROCESSOR

HOUSE = Path(__file__).resolve().parents[1]
SHIPPED = HOUSE / "hairkit" / "shipped_kernels"
SAMPLE = HOUSE / "hairkit" / "sample"
PLATFORM = "manylinux2014_x86_64"
"""Compiled kernels call nothing but Numba's runtime and libm, so any glibc will do."""
STEPS = """
[[steps]]
do = "wind"
on = true
[[steps]]
do = "run"
seconds = 0.1
"""
"""What the viewer does."""
SHIP = """
import sys
from hairkit import kernel_cache, parallel

parallel.KernelCache = kernel_cache.ShippingCache
from hairkit.cli import main
sys.exit(main(sys.argv[1:]))
"""
"""Runs a command of hairkit, whose compiled functions go into the shipped folder."""
COUNT = """
import sys
from numba.core import event

class Count(event.Listener):
    compiled = 0

    def on_start(self, event):
        Count.compiled += 1

    def on_end(self, event):
        pass

with event.install_listener("numba:compile", Count()):
    from hairkit.cli import main
    code = main(sys.argv[1:])
print(f"{Count.compiled} compilations", file=sys.stderr)
sys.exit(code or (1 if Count.compiled else 0))
"""
"""Runs a command of hairkit and fails where it compiled anything."""


def main() -> int:
    """Compile, build, try."""
    target = Path(sys.argv[1]).resolve()
    target.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(SHIPPED, ignore_errors=True)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        try:
            _compile(place)
            wheel = _build(place, target)
        finally:
            shutil.rmtree(SHIPPED, ignore_errors=True)
        shutil.rmtree(HOUSE / "build" / "lib", ignore_errors=True)
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
        return _try(wheel, place)


def commands(place: Path, out: Path) -> list[list[str]]:
    """Return the commands that a newcomer tries."""
    script, photos = str(place / "steps.toml"), str(place / "photos")
    groom, short = str(out / "masks" / "groom.npz"), ["--frames", "3"]
    return [
        ["reconstruct", str(SAMPLE), "-o", str(out / "masks"), "--guides", "200"],
        ["reconstruct", photos, "-o", str(out / "photos"), "--guides", "200"],
        ["simulate", groom, "-o", str(out / "pbd.npz"), *short],
        ["simulate", groom, "-o", str(out / "helix.npz"), "--using", "super_helix", *short],
        ["render", groom, "-o", str(out / "hair.png")],
        ["view", groom, "--headless", "--script", script, "--out", str(out)],
    ]


def _compile(place: Path) -> None:
    shutil.copytree(SAMPLE / "photos", place / "photos")
    (place / "steps.toml").write_text(STEPS)
    portable = {
        "NUMBA_CPU_NAME": PORTABLE_PROCESSOR,
        "NUMBA_CPU_FEATURES": PORTABLE_FEATURES,
        "NUMBA_CACHE_DIR": str(place / "cache"),
    }
    for command in commands(place, place / "made"):
        print("compiling what this needs: hairkit", *command, flush=True)
        _run([sys.executable, "-c", SHIP, *command], portable)


def _build(place: Path, target: Path) -> Path:
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    _run([*pip, "wheel", "--quiet", "--no-deps", str(HOUSE), "-w", str(place / "wheel")], {})
    [plain] = (place / "wheel").glob("*.whl")
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    tags = ["--python-tag", python, "--abi-tag", python, "--platform-tag", PLATFORM]
    _run([sys.executable, "-m", "wheel", "tags", "--remove", *tags, str(plain)], {})
    [tagged] = (place / "wheel").glob("*.whl")
    return Path(shutil.copy(tagged, target / tagged.name))


def _try(wheel: Path, place: Path) -> int:
    """Return 0 when the wheel's first runs compile nothing."""
    site = place / "site"
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    _run([*pip, "--no-deps", "--target", str(site), str(wheel)], {})
    alone = {"PYTHONPATH": str(site), "NUMBA_CACHE_DIR": str(place / "empty")}
    found = 0
    for command in commands(place, place / "tried"):
        done = subprocess.run(
            [sys.executable, "-c", COUNT, *command], env={**os.environ, **alone}, cwd=place
        )
        print("hairkit", *command, "->", done.returncode, flush=True)
        found |= done.returncode != 0
    return int(found)


def _run(command: list[str], settings: Mapping[str, str]) -> None:
    subprocess.run(command, env={**os.environ, **settings}, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
