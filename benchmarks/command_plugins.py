"""What a plugin in a process of its own costs: seconds of a call above those of the same code here.

A plugin that does nothing is called on a photo of one megapixel, in this process and through
`hairkit.worker`. `segment` gets the photo (3 MB) and returns a mask (1 MB); `orient` gets photo and
mask and returns angles and confidences (8 MB).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from hairkit import Mask, OrientationMap, View, hookimpl
from hairkit.manager import Manager
from hairkit.manager.command_plugin import PluginCommand

SIZE = (1156, 866)
"""Rows and columns of the photo: one megapixel, of the shape that phones take upright."""
CALLS = 30
"""Timed calls of each; the first call of a process is not counted."""
PLUGIN = """
import numpy as np
from hairkit.worker import serve

def segment(view):
    return {"labels": np.full(view.image.shape[:2], 255, np.uint8), "person_known": False}

def orient(view, mask):
    ones = np.ones(mask.labels.shape, np.float32)
    return {"angle": ones, "confidence": ones}

serve(segment, orient)
"""


@hookimpl
def segment(view: View) -> Mask:
    """Return hair everywhere."""
    return Mask(np.full(view.image.shape[:2], 255, np.uint8), False)


@hookimpl
def orient(mask: Mask) -> OrientationMap:
    """Return one direction everywhere."""
    ones = np.ones(mask.labels.shape, np.float32)
    return OrientationMap(ones, ones)


def main() -> None:
    """Print one row for each hook."""
    parser = argparse.ArgumentParser(prog="command_plugins.py", description=__doc__)
    parser.parse_args()
    image = np.random.default_rng(0).integers(0, 255, (*SIZE, 3), np.uint8)
    mask = Mask(np.full(SIZE, 255, np.uint8), True)
    manager = Manager()
    manager.register(sys.modules[__name__], "here")
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "plugin.py").write_text(PLUGIN)
        began = time.perf_counter()
        manager.add_command(PluginCommand("there", (sys.executable, "plugin.py"), folder))
        print(f"start of the process: {time.perf_counter() - began:.2f} s\n")
        print("| hook | in this process | in another | difference | fastest difference |")
        print("|---|---|---|---|---|")
        for hook, arguments in (("segment", {}), ("orient", {"mask": mask})):
            given = {"view": View("front", 0.0, image), **arguments}
            here, there = (_times(manager, hook, name, given) for name in ("here", "there"))
            cells = [median(here), median(there), median(there) - median(here)]
            cells.append(min(there) - min(here))
            print(f"| {hook} | {' | '.join(f'{1000 * cell:.1f} ms' for cell in cells)} |")


def _times(manager: Manager, hook: str, plugin: str, given: dict[str, Any]) -> list[float]:
    seconds = []
    for _ in range(CALLS + 1):
        began = time.perf_counter()
        manager.call(hook, plugin, **given)
        seconds.append(time.perf_counter() - began)
    return seconds[1:]


if __name__ == "__main__":
    main()
