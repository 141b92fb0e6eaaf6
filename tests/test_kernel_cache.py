"""Laws of the compiled functions that a wheel brings along."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

from hairkit.kernel_cache import PORTABLE_FEATURES, PORTABLE_PROCESSOR

KERNELS = """
from hairkit.parallel import compiled, compiled_with

@compiled
def square(x: float) -> float:
    return x * x

@compiled_with(fastmath=True)
def norm(x: float, y: float) -> float:
    return (square(x) + square(y)) ** 0.5
"""
PROGRAM = """
import sys
from pathlib import Path
from numba.core import event
from hairkit import kernel_cache, parallel

kernel_cache.SHIPPED = Path(sys.argv[1])
what = sys.argv[2]
if what == "ship":
    parallel.KernelCache = kernel_cache.ShippingCache
if what == "old processor":
    kernel_cache.PORTABLE_INSTRUCTIONS += ("an-instruction-that-no-processor-has",)

if what == "next version":
    kernel_cache.__version__ = "999"

class Count(event.Listener):
    compiled = 0

    def on_start(self, event):
        Count.compiled += 1

    def on_end(self, event):
        pass

with event.install_listener("numba:compile", Count()):
    import shipped_example
    print(shipped_example.norm(3.0, 4.0), Count.compiled)
"""


def run(place: Path, what: str, **settings: str) -> tuple[float, int]:
    """Return what the example computes in a process with an empty cache, and its compilations."""
    paths = os.pathsep.join([str(place), os.environ.get("PYTHONPATH", "")])
    cache = str(place / f"cache of {what}")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(place / "shipped"), what],
        env={**os.environ, "PYTHONPATH": paths, "NUMBA_CACHE_DIR": cache, **settings},
        capture_output=True,
        text=True,
        check=True,
    )
    value, compilations = done.stdout.split()
    return float(value), int(compilations)


@pytest.mark.skipif(platform.machine() != "x86_64", reason="wheels hold kernels for x86-64 alone")
def test_what_a_wheel_brings_is_not_compiled(tmp_path: Path) -> None:
    """The first run finds the shipped functions; others, and updates, compile anew."""
    (tmp_path / "shipped_example.py").write_text(KERNELS)
    portable = {"NUMBA_CPU_NAME": PORTABLE_PROCESSOR, "NUMBA_CPU_FEATURES": PORTABLE_FEATURES}
    value, compiled = run(tmp_path, "ship", **portable)
    assert value == 5.0
    assert compiled > 0
    assert run(tmp_path, "first run") == (5.0, 0)
    assert run(tmp_path, "old processor") == (5.0, compiled)
    assert run(tmp_path, "next version") == (5.0, compiled)
    (tmp_path / "shipped_example.py").write_text(KERNELS + "\n# a newer version\n")
    assert run(tmp_path, "updated") == (5.0, compiled)
