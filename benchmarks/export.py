"""Time the export of large grooms, beside Blender's exporters where those can write the format.

python benchmarks/export.py --strands 100000 --points 32

Each format is written in a process of its own. Wall and CPU seconds (of all threads; on a busy
machine they mean more) are the best of the rounds; memory is the peak above what the groom itself
takes. `raw` is the time to write as many bytes in the same way: whole, synced to the disk, renamed.
Blender writes the same strands, as hair curves to .abc and .usdc and as a mesh of edges to the
others, with the Python that `make test-clients` installs, or with --blender.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hairkit.cli.export import plugin_for
from hairkit.errors import InputError
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.memory import keep_freed_memory
from hairkit.storage import write_bytes
from hairkit.types.groom import Groom
from hairkit.types.head import Roots
from hairkit.types.strands import Strands

SETTINGS: dict[str, dict[str, object]] = {
    ".abc": {},
    ".abc bare": {"attributes": False},
    ".usdc": {},
    ".usdc bare": {"attributes": False, "head_mesh": False},
    ".glb": {"hair": "none"},
    ".hair": {},
    ".tfx": {},
    ".data": {},
    ".ply": {},
}
"""Formats measured, and the options of each: the lines of .glb alone; bare is points and widths
without what only a groom has, which is what Blender writes."""
IN_BLENDER = (".abc", ".usdc", ".glb", ".ply")
GUIDES = 600
LENGTH = 0.25
MEGABYTE = 1e6


@dataclass(frozen=True)
class Measured:
    """One file that was written."""

    ending: str
    seconds: float
    processor: float
    raw_seconds: float
    peak_bytes: int
    file_bytes: int


def main() -> int:
    """Measure and print."""
    args = _arguments()
    if args.child:
        return _child(args.child, Path(args.folder), args.rounds)
    endings = args.formats.split(",")
    unknown = [ending for ending in endings if ending not in SETTINGS]
    if unknown:
        print(f"no format {unknown[0]!r}; known: {', '.join(SETTINGS)}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(dir=args.folder) as folder:
        groom = combed(args.strands, args.points)
        groom.save(Path(folder) / "groom.npz")
        blender = _blender(args, groom, Path(folder), endings)
        print(_heading(args), flush=True)
        for ending in endings:
            print(
                _row(_measured(ending, folder, args.rounds), blender.get(ending.split()[0])),
                flush=True,
            )
    return 0


def combed(count: int, points: int, seed: int = 0) -> Groom:
    """Return strands of `points` points combed back over the default head, with all that a groom
    can say of strands: tapered widths, root uv, two groups, and up to 600 guides.
    """
    head, rng = default_head(), np.random.default_rng(seed)
    roots: Roots = sample_roots(head, count, seed)
    share = np.linspace(0.0, 1.0, points, dtype=np.float32)[None, :, None]
    length = rng.uniform(0.6, 1.0, (count, 1, 1)).astype(np.float32) * LENGTH
    fall = np.array([0.0, -0.8, -0.4], np.float32)
    wave = 0.004 * np.sin(9 * share + rng.uniform(0, 6, (count, 1, 3)).astype(np.float32))
    outward = roots.normals[:, None] * share * (1 - 0.5 * share)
    places = roots.positions[:, None] + length * (outward + fall * share**2) + wave * share
    widths = np.broadcast_to(8e-5 * (1 - 0.6 * share[..., 0]), (count, points))
    strands = Strands(
        places.reshape(-1, 3),
        np.arange(count + 1) * points,
        widths.ravel(),
        roots.uv,
        np.arange(count) % 2,
        np.arange(count) < GUIDES,
    )
    return Groom(strands, head, roots.triangle, roots.barycentric)


def _measured(ending: str, folder: str, rounds: int) -> Measured:
    words = ["--child", ending, "--folder", folder, "--rounds", str(rounds)]
    done = subprocess.run(
        [sys.executable, __file__, *words], stdout=subprocess.PIPE, text=True, check=True
    )
    return Measured(**json.loads(done.stdout.splitlines()[-1]))


def _child(ending: str, folder: Path, rounds: int) -> int:
    """Write the groom in the folder, with memory as the command line has it; print what it took."""
    keep_freed_memory()
    manager = Manager.loaded(autoload=False)
    groom = Groom.load(folder / "groom.npz")
    path = folder / f"hair{ending.split()[0]}"
    name = plugin_for(manager, "export_groom", path)
    options = manager.options(name, SETTINGS[ending])
    held = _held_bytes()
    _forget_peak()
    write = functools.partial(manager.call, "export_groom", name, options, groom=groom, path=path)
    seconds, processor = _best(write, rounds, path)
    peak = _peak_bytes() - held
    data = path.read_bytes()
    raw = _best(lambda: write_bytes(folder / "raw", data), rounds, folder / "raw")[0]
    print(json.dumps(vars(Measured(ending, seconds, processor, raw, peak, len(data)))))
    return 0


def _best(job: Callable[[], object], rounds: int, path: Path) -> tuple[float, float]:
    """Return the least wall and processor seconds of the rounds; `path` is not there before any."""
    took = []
    for _ in range(rounds):
        path.unlink(missing_ok=True)
        wall, processor = time.perf_counter(), time.process_time()
        job()
        took.append((time.perf_counter() - wall, time.process_time() - processor))
    return min(wall for wall, _ in took), min(processor for _, processor in took)


def _forget_peak() -> None:
    """Let the peak of the memory begin anew: reading the groom took more than writing does."""
    with contextlib.suppress(OSError):  # where there is no such file the peak is of all
        Path("/proc/self/clear_refs").write_text("5")


def _peak_bytes() -> int:
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def _held_bytes() -> int:
    """Return the memory that the process holds now; where nothing tells, its peak so far."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    return pages * os.sysconf("SC_PAGE_SIZE")


def _blender(
    args: argparse.Namespace, groom: Groom, folder: Path, endings: list[str]
) -> dict[str, dict[str, float]]:
    """Return seconds and bytes of Blender's exporters by ending; nothing without Blender."""
    python, wanted = _blender_python(args.blender), [e for e in IN_BLENDER if _asked(e, endings)]
    if python is None or not wanted:
        return {}
    strands = groom.strands
    if strands.widths is None:
        raise InputError("the groom to measure has no widths")
    points = np.stack([strands.points[:, 0], -strands.points[:, 2], strands.points[:, 1]], axis=1)
    arrays = folder / "strands.npz"
    np.savez(arrays, points=points, counts=strands.counts, radius=strands.widths / 2)
    program = Path(__file__).parent / "in_blender" / "export.py"
    words = [str(program), str(arrays), str(folder), str(args.rounds), *wanted]
    done = subprocess.run(
        [str(python), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=True,
        env={**os.environ, "BLENDER_USER_RESOURCES": str(folder)},
    )
    took: dict[str, dict[str, float]] = json.loads(done.stdout.splitlines()[-1])
    return took


def _asked(ending: str, endings: list[str]) -> bool:
    return any(name.split()[0] == ending for name in endings)


def _blender_python(named: str | None) -> Path | None:
    made = Path(__file__).parents[1] / ".clients" / "bpy" / "bin" / "python"
    chosen = Path(named or os.environ.get("HAIRKIT_BPY_PYTHON", made))
    return chosen if chosen.exists() else None


def _heading(args: argparse.Namespace) -> str:
    shape = f"{args.strands} strands x {args.points} points"
    cells = [shape, "s", "processor s", "x raw", "memory MB", "file MB"]
    cells += ["Blender s", "processor s", "file MB", "faster"]
    return "\n".join([_line(cells), "|---" * len(cells) + "|"])


def _row(here: Measured, there: dict[str, float] | None) -> str:
    cells = [
        here.ending,
        f"{here.seconds:.2f}",
        f"{here.processor:.2f}",
        f"{here.seconds / here.raw_seconds:.1f}",
        f"{here.peak_bytes / MEGABYTE:.0f}",
        f"{here.file_bytes / MEGABYTE:.1f}",
    ]
    if there is None:
        return _line([*cells, "-", "-", "-", "-"])
    cells += [f"{there['seconds']:.2f}", f"{there['processor']:.2f}"]
    cells += [f"{there['bytes'] / MEGABYTE:.1f}", f"{there['seconds'] / here.seconds:.1f} x"]
    return _line(cells)


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--strands", type=int, default=100_000)
    add("--points", type=int, default=32, help="points a strand")
    add("--rounds", type=int, default=3, help="the best of so many counts")
    add("--formats", default=",".join(SETTINGS), help="endings, parted by commas")
    add("--folder", default=None, help="where to write; by default the folder for temporary files")
    add("--blender", help="a Python that can `import bpy`")
    add("--child", help=argparse.SUPPRESS)
    return parser.parse_args()


if __name__ == "__main__":
    raise SystemExit(main())
