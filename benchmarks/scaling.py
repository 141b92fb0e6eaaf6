"""Measure how time and memory of a reconstruction grow with photos, pixels, cells and guides.

hairkit synth straight --views 36 --seed 3 --size 1080x1440 -o turn/
python benchmarks/scaling.py turn/ -o docs/images/growth.png

All runs are of one capture, and those of fewer photos take every second, third or fourth of it, so
that nothing else changes. Each is a process of its own, with compiled kernels, by turns. Seconds
are the processor's, the least of all rounds; memory is the peak of the process. The exponent of all
is the slope between the two largest sizes in logarithms; that of what grows is p of the best
c + b n^p through all seconds, c at least 0.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import nnls

from hairkit.arrays import UInt8Array
from hairkit.storage import read_npz

PHOTOS, GUIDES = 9, 600
"""Photos and guides of the runs in which something else changes."""
STEPS = {
    "photos": (3, 9, 18, 36),
    "pixels": (360, 720, 1020, 1440),
    "file pixels": (1440, 2000, 2880, 4000),
    "cells": (6.0, 4.8, 3.8, 3.0, 2.4),
    "guides": (600, 5_000, 20_000, 50_000, 100_000),
}
"""Photos, longest edges in pixels that photos are scaled down to, and that their files have, edges
of a cell in millimetres, and guides."""
EXPONENTS = np.arange(0.3, 3.001, 0.01)
"""Exponents that are tried."""
INK, PAPER, GRID = (60, 60, 60), (255, 255, 255), (225, 225, 225)
COLOURS = ((180, 100, 30), (60, 140, 40), (150, 140, 20), (40, 60, 200), (150, 60, 140))
"""Blue, green, red of a picture's parts, of 255."""
PANEL, MARGIN = (260, 220), 46
"""Pixels of the width and height of a curve's field, and around it."""
SECONDS, LOG_SECONDS = (1, 3, 10, 30, 100), 2.2
"""Lines of a field, and the logarithm of the seconds at its upper edge."""


class Run(NamedTuple):
    """What one size cost."""

    size: float
    """Photos, pixels of a photo, cells of the hull's grid, or guides."""
    seconds: float
    """Processor seconds of the process and those it started."""
    megabytes: float
    """Most memory that the process held."""


def main() -> int:
    """Print a table of each kind of size, and draw their curves."""
    args = _arguments()
    print("| what grows | size | processor s | memory, MB | exponent of all | of what grows |")
    print("|---|---|---|---|---|---|")
    curves: dict[str, list[Run]] = {}
    for kind in args.only:
        found: list[list[Run]] = [[] for _ in STEPS[kind]]
        for _, (runs, step) in itertools.product(
            range(args.rounds), zip(found, STEPS[kind], strict=True)
        ):
            runs.append(measure(args.capture, kind, step))
        curves[kind] = [min(runs, key=lambda run: run.seconds) for runs in found]
        *smaller, largest = curves[kind]
        for run in smaller:
            print(_row(kind, run) + "  |  |")
        slope = np.log(largest.seconds / smaller[-1].seconds) / np.log(
            largest.size / smaller[-1].size
        )
        print(_row(kind, largest) + f" {slope:.2f} | {exponent(curves[kind]):.2f} |")
        sys.stdout.flush()
    if args.output is not None:
        cv2.imwrite(str(args.output), draw(curves))
    return 0


def _row(kind: str, run: Run) -> str:
    return f"| {kind} | {run.size:,.0f} | {run.seconds:.1f} | {run.megabytes:.0f} |"


def measure(capture: Path, kind: str, step: float) -> Run:
    """Return what a reconstruction costs in which one size is another one."""
    photos = int(step) if kind == "photos" else PHOTOS
    words = ["--guides", str(step if kind == "guides" else GUIDES)]
    if kind == "pixels":
        words += ["--max-edge", str(step)]
    if kind == "cells":
        words += ["--set", f"visual_hull.voxel_size={step / 1e3}"]
    with tempfile.TemporaryDirectory() as place:
        given, out = Path(place, "given"), Path(place, "out")
        choose_photos(capture, given, photos)
        if kind == "file pixels":
            enlarge_photos(given, int(step))
        seconds, megabytes = run_apart([str(given), "-o", str(out), *words, "--quiet"])
        size = _pixels(given, step) if "pixels" in kind else step
        if kind == "cells":
            size = _cells(out)
    return Run(size, seconds, megabytes)


def choose_photos(capture: Path, folder: Path, count: int) -> None:
    """Copy every so many photos of a turn, with their masks and all landmarks."""
    photos = sorted((capture / "photos").iterdir())
    if len(photos) % count:
        raise SystemExit(f"{capture} has {len(photos)} photos, wanted a multiple of {count}")
    for part in ("photos", "masks"):
        (folder / part).mkdir(parents=True)
        files = sorted((capture / part).iterdir())
        for path in files[:: len(files) // count]:
            shutil.copy(path, folder / part)
    marks = json.loads((capture / "landmarks.json").read_text())
    names = {path.stem for path in (folder / "photos").iterdir()}
    marks["views"] = {name: view for name, view in marks["views"].items() if name in names}
    (folder / "landmarks.json").write_text(json.dumps(marks))


def enlarge_photos(folder: Path, edge: int) -> None:
    """Scale photos, masks and landmarks so that the files have longest edges of `edge` pixels."""
    scale = 1.0
    for path in (*(folder / "photos").iterdir(), *(folder / "masks").iterdir()):
        picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        scale, drawn = edge / max(picture.shape[:2]), path.parent.name == "masks"
        way = cv2.INTER_NEAREST if drawn else cv2.INTER_CUBIC
        cv2.imwrite(str(path), cv2.resize(picture, None, fx=scale, fy=scale, interpolation=way))
    marks = json.loads((folder / "landmarks.json").read_text())
    views = marks["views"].items()
    marks["views"] = {name: (scale * np.array(points)).tolist() for name, points in views}
    (folder / "landmarks.json").write_text(json.dumps(marks))


def run_apart(words: Sequence[str]) -> tuple[float, float]:
    """Return processor seconds and megabytes of a `hairkit reconstruct` of its own."""
    command = [sys.executable, "-m", "hairkit", "reconstruct", *words]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(command)} failed")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def exponent(runs: Sequence[Run]) -> float:
    """Return p of the best c + b n^p through the seconds, relative errors least, c at least 0."""
    size = np.array([run.size for run in runs])
    seconds = np.array([run.seconds for run in runs])
    errors = []
    for power in EXPONENTS:
        columns = np.stack([np.ones(len(size)), (size / size.max()) ** power], axis=1)
        errors.append(nnls(columns / seconds[:, None], np.ones(len(size)))[1])
    return float(EXPONENTS[int(np.argmin(errors))])


def _pixels(folder: Path, edge: float) -> float:
    """Return the pixels of a photo that is scaled to that longest edge."""
    height, width = cv2.imread(str(next((folder / "photos").iterdir()))).shape[:2]
    scale = min(edge / max(height, width), 1.0)
    return height * width * scale**2


def _cells(out: Path) -> float:
    """Return the cells of a run's grid."""
    hull = read_npz(out / "work" / "hull.npz")
    return float(next(a.size for name, a in hull.items() if name.endswith("dense")))


def draw(curves: Mapping[str, Sequence[Run]]) -> UInt8Array:
    """Return a picture (H, W, 3) of a field a kind: seconds (line) and memory (dots) by size."""
    fields = [_draw_field(kind, runs, k) for k, (kind, runs) in enumerate(curves.items())]
    return np.concatenate(fields, axis=1)


def _draw_field(kind: str, runs: Sequence[Run], number: int) -> UInt8Array:
    """Return the field (H, W, 3) of one kind; both axes are logarithmic."""
    width, height = PANEL
    picture = np.full((height + 2 * MARGIN, width + 2 * MARGIN, 3), PAPER, np.uint8)
    values = np.log10([[run.size, run.seconds, run.megabytes / 100] for run in runs])
    left, right = values[0, 0], values[-1, 0]

    def place(x: float, y: float) -> tuple[int, int]:
        """Return the pixel of a logarithm of a size and of one of seconds."""
        share = (x - left) / (right - left), y / LOG_SECONDS
        return MARGIN + round(share[0] * width), MARGIN + height - round(share[1] * height)

    for seconds in SECONDS:
        at = place(left, np.log10(seconds))
        cv2.line(picture, at, (MARGIN + width, at[1]), GRID, 1)
        _write(picture, f"{seconds} s, {seconds / 10:g} GB", (at[0] + 2, at[1] - 3), 0.3)
    points = [place(row[0], row[1]) for row in values]
    for start, end in itertools.pairwise(points):
        cv2.line(picture, start, end, COLOURS[number], 2, cv2.LINE_AA)
    for row, run in zip(values, runs, strict=True):
        cv2.circle(picture, place(row[0], row[2]), 3, COLOURS[number], -1, cv2.LINE_AA)
        x, _ = place(row[0], 0.0)
        _write(picture, _short(run.size), (x - 14, MARGIN + height + 14), 0.32)
    _write(picture, kind, (MARGIN, MARGIN - 14), 0.45)
    return picture


def _short(size: float) -> str:
    """Return a size in thousands or millions: `97.2k`, `1.56M`."""
    unit, name = (1e6, "M") if size >= 1e6 else (1e3, "k") if size >= 1e3 else (1.0, "")
    return f"{size / unit:.3g}{name}"


def _write(picture: UInt8Array, text: str, at: tuple[int, int], size: float) -> None:
    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, INK, 1, cv2.LINE_AA)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("capture", type=Path, metavar="CAPTURE", help="36 photos with masks and landmarks")
    add("-o", "--output", type=Path, metavar="PNG", help="picture of the curves")
    add("--only", nargs="+", choices=list(STEPS), default=list(STEPS), metavar="KIND")
    add("--rounds", type=int, default=2, metavar="N", help="runs of each size, by turns")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
