"""The law of memory that a process keeps."""

from __future__ import annotations

import platform
import subprocess
import sys

import pytest

PROGRAM = """
import resource
import threading

import numpy as np

from hairkit.memory import keep_freed_memory

keep_freed_memory()
faults = [0]
def fill():
    for _ in range(20):
        np.ones(2_000_000)
        faults.append(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
thread = threading.Thread(target=fill)
thread.start()
thread.join()
fill()
print(faults[-1] - faults[5])
def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1])
large = np.ones(16_000_000)
with_it = resident()
del large
print(with_it - resident())
"""
PAGES = 16_000_000 // 4096
"""Of one array."""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="settings of glibc")
def test_the_pages_of_a_freed_array_are_those_of_the_next() -> None:
    """Thirty-five arrays on two threads touch fewer new pages than one has; large ones go."""
    words = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    touched, returned = map(int, done.stdout.split())
    assert touched < PAGES / 4
    assert returned >= 8 * PAGES  # one of 128 MB
