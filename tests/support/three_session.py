"""What three.js and three-vrm, as their authors publish them, make of a file, run by Node."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from blender_session import PROJECT

CLIENTS = PROJECT / ".clients"
PROGRAM = PROJECT / "tests" / "clients" / "in_three" / "frames.mjs"


@dataclass(frozen=True)
class Seen:
    """What the program tells."""

    frames: dict[str, npt.NDArray[np.float32]]
    """Each object's vertices (T, V, 3) in the world."""
    vrm: dict[str, Any]


def seen(node: str, path: Path, times: Any) -> Seen:
    """Return what three.js makes of a file."""
    out = path.with_suffix(".f32")
    words = [node, str(PROGRAM), str(CLIENTS), str(path), str(out), *(f"{t:.9g}" for t in times)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    told = json.loads(done.stdout.splitlines()[-1])
    counts = [count for _, count in told["objects"]]
    places = np.fromfile(out, "<f4").reshape(len(times), sum(counts), 3)
    parts = np.split(places, np.cumsum(counts)[:-1], axis=1)
    names = [name for name, _ in told["objects"]]
    return Seen(dict(zip(names, parts, strict=True)), told.get("vrm", {}))
