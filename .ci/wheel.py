"""Build a wheel for this Python that holds compiled kernels, and prove that its first run has none.

python .ci/wheel.py dist

Kernels are compiled for any x86-64 processor of the last ten years (`hairkit.kernel_cache`) by
running what people run first: reconstructions from photos alone, with masks and by every recipe,
all simulators, pictures, the viewer, cards, another head and scores. Then the wheel does the same
in an empty folder, without a cache. The exit code is 1 where that compiled anything, or where a
module with kernels was not run and is not in `NOT_SHIPPED`.
"""

from __future__ import annotations

import os
import re
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
NOT_SHIPPED = frozenset(
    {
        "hairkit.imaging.geodesic",
        "hairkit_plugins.image_analogies.features",
        "hairkit_plugins.image_analogies.search_tree",
        "hairkit_plugins.image_analogies.synthesis",
    }
)
"""Modules of strokes and of textures by example, whose kernels are compiled on first use."""
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
            shipped = {index.parent.name for index in SHIPPED.glob("*/*.nbi")}
            forgotten = modules_with_kernels() - shipped - NOT_SHIPPED
            wheel = _build(place, target)
        finally:
            shutil.rmtree(SHIPPED, ignore_errors=True)
        shutil.rmtree(HOUSE / "build" / "lib", ignore_errors=True)
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
        for module in sorted(forgotten):
            print(f"{module} has kernels that no command above compiles", file=sys.stderr)
        return _try(wheel, place) or int(bool(forgotten))


def modules_with_kernels() -> set[str]:
    """Return the modules that define compiled functions."""
    homes = {"hairkit": HOUSE / "hairkit", "hairkit_plugins": HOUSE / "plugins"}
    return {
        ".".join((package, *path.relative_to(folder).with_suffix("").parts))
        for package, folder in homes.items()
        for path in folder.rglob("*.py")
        if re.search(r"^@compiled", path.read_text(), re.MULTILINE)
    }


def commands(place: Path, out: Path) -> list[list[str]]:
    """Return the commands that a newcomer tries."""
    script, photos = str(HOUSE / ".ci" / "look.toml"), str(place / "photos")
    groom, short = str(out / "masks" / "groom.npz"), ["--frames", "3"]
    few, synth = ["--guides", "200", "--no-sheet"], str(out / "synth")
    recipes = [
        ["reconstruct", str(SAMPLE), "-o", str(out / name), *few, "--recipe", name]
        for name in ("patent", "thesis")
    ]
    return [
        ["reconstruct", str(SAMPLE), "-o", str(out / "masks"), "--guides", "200"],
        ["reconstruct", photos, "-o", str(out / "photos"), "--guides", "200"],
        ["simulate", groom, "-o", str(out / "rods.npz"), *short],
        ["simulate", groom, "-o", str(out / "pbd.npz"), "--using", "pbd", *short],
        ["simulate", groom, "-o", str(out / "helix.npz"), "--using", "super_helix", *short],
        ["render", groom, "-o", str(out / "hair.png")],
        ["view", groom, "--headless", "--script", script, "--out", str(out)],
        *recipes,
        ["wrap", groom, "--head", str(out / "masks" / "groom.glb"), "-o", str(out / "wrap.npz")],
        ["export", groom, "-o", str(out / "cards.glb"), "--using", "cards"],
        ["synth", "short", "-o", synth, "--strands", "2000", "--size", "240x320"],
        ["reconstruct", synth, "-o", str(out / "short"), *few],
        ["evaluate", str(out / "short"), "--truth", f"{synth}/truth"],
    ]


def _compile(place: Path) -> None:
    shutil.copytree(SAMPLE / "photos", place / "photos")
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
