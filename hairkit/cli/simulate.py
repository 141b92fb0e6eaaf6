"""`hairkit simulate GROOM -o cache.npz`: simulate the guides without a window."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.cli.arguments import Add, add_shared, check_range
from hairkit.cli.settings import importer_of, split_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError

if TYPE_CHECKING:
    from hairkit.manager import Manager
    from hairkit.types.groom import Groom

DESCRIPTION = """\
Example: hairkit simulate out/groom.npz -o cache.npz --shake yaw:20:1.5 --wind 3,0,1

Simulate a groom's guides and write a point cache (.npz), or a file with the animation in it, by the
exporter of its ending: -o hair.abc, .usdc, .glb. The captured hair is at rest at the start.
--guides N chooses N guides from full hair first; all its other strands move with them.
Shakes are AXIS:DEGREES:HERTZ[:SECONDS] with yaw, pitch or roll; several go together. Wind is where
the air goes to: +X the subject's left, +Y up, +Z out of the face."""

SIMULATOR = "rods"
FRAMES, RATE = 120, 60.0
"""Frames written by default, and their number a second: two seconds."""
MOST_FRAMES = 100_000
LOWEST_RATE, HIGHEST_RATE = 0.1, 10_000
"""Frames a second."""
LONGEST_WARM_UP = 3600
"""Seconds."""
STRONGEST_WIND = 200
"""Metres per second along an axis; the strongest storms have about 100."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("groom", metavar="GROOM", type=Path, help="groom.npz, or a file that a plugin imports")
    add("-o", "--out", required=True, type=Path, metavar="FILE", help="cache.npz, or hair.abc, ...")
    add("--guides", type=int, metavar="N", help="choose N guides from full hair (the groom's own)")
    add("--frames", type=int, default=FRAMES, metavar="N", help=f"frames to write ({FRAMES})")
    add("--fps", type=float, default=RATE, metavar="N", help=f"frames per second ({RATE:g})")
    add("--warm-up", type=float, default=0.0, metavar="S", help="seconds before the first frame")
    add("--shake", action="append", default=[], metavar="A:D:H", help="as yaw:20:1.5")
    add("--motion", type=Path, metavar="FILE", help="head motion: .json, or an animated .glb")
    add("--wind", default="0,0,0", metavar="X,Y,Z", help="metres per second (0,0,0)")
    add("--turbulence", type=float, default=0.0, metavar="T", help="gusts over the wind (0)")
    add("--gravity", type=float, metavar="G", help="m/s^2 downwards; the groom's by default")
    add("--preset", metavar="NAME", help="options saved by hairkit view beside the groom")
    add("--using", metavar="NAME", help=f"simulator plugin ({SIMULATOR}, or the preset's)")
    add_shared(add, "--set", "--plugin", "--quiet", "--steps", "--json")


def run(args: argparse.Namespace) -> int:
    """Simulate, write the cache or the animated file, and print its name."""
    try:
        return _run(args)
    except KeyboardInterrupt as error:
        raise KeyboardInterrupt(f"{args.out} was not written") from error


def _run(args: argparse.Namespace) -> int:
    from hairkit.api import export
    from hairkit.manager import Manager
    from hairkit.progress import progress_for
    from hairkit.simulation import Weather, add_shakes, read_motion, static_motion
    from hairkit.simulation import run as simulated

    _check(args)
    manager = Manager.loaded(args.plugin)
    using, kept = _preset(args)
    manager.implementer("make_simulator", using)
    importer, exporter = importer_of(manager, args.groom), _exporter(manager, args.out)
    plugins = {"reader": importer, "simulator": using, "writer": exporter}
    settings = split_settings(manager, plugins, args.set)
    options = manager.options(using, kept | settings["simulator"])
    if exporter is not None:
        manager.options(exporter, settings["writer"])  # refused before the simulation, not after
    down = None if args.gravity is None else np.array([0.0, -args.gravity, 0.0])
    weather = Weather(_vector("--wind", args.wind), args.turbulence, down)
    groom = _groom(args, manager, settings["reader"])
    motion = static_motion() if args.motion is None else read_motion(args.motion)
    motion = add_shakes(args.shake, groom.head, motion)
    simulator = manager.call("make_simulator", using, options, groom=groom)
    with (
        progress_for(sys.stderr, quiet=args.quiet, steps=args.steps) as progress,
        manager.guard("make_simulator", using),
    ):
        cache = simulated(
            simulator, motion, args.frames, args.fps,
            weather=weather, warm_up=args.warm_up, progress=progress,
        )  # fmt: skip
        stretch = simulator.measure().stretch
    if exporter is None:
        cache.save(args.out)
    else:
        export(groom, args.out, cache=cache, plugin=exporter, manager=manager, **settings["writer"])
    _tell(args, len(cache), len(simulator.strands), float(stretch))
    return 0


def _tell(args: argparse.Namespace, frames: int, guides: int, stretch: float) -> None:
    """Print what was written."""
    what = f"{frames} frames of {guides} guides, stretch {100 * stretch:.2f} % at the end"
    print(f"{args.out.name}: {what}", file=sys.stderr)
    print_written(args, args.out, frames=frames, guides=guides, stretch=stretch)


def _groom(args: argparse.Namespace, manager: Manager, settings: Mapping[str, object]) -> Groom:
    """Return the guides that are simulated, on their head."""
    from hairkit.grooming.decimate import decimate
    from hairkit.pipeline.open_groom import load_groom

    groom = load_groom(manager, args.groom, settings)
    if not len(groom.strands):
        raise InputError(f"{args.groom}: holds no strands, so there is nothing to simulate")
    return groom if args.guides is None else decimate(groom, args.guides)


def _check(args: argparse.Namespace) -> None:
    check_range("--frames", args.frames, 1, MOST_FRAMES)
    check_range("--fps", args.fps, LOWEST_RATE, HIGHEST_RATE, "frames per second")
    check_range("--warm-up", args.warm_up, 0, LONGEST_WARM_UP, "seconds")
    check_range("--turbulence", args.turbulence, 0, 10, "times the wind")
    check_range("--gravity", args.gravity, -1000, 1000, "metres per second squared")
    check_target(args.out)


def _vector(name: str, text: str) -> Float64Array:
    try:
        vector = np.array([float(part) for part in text.split(",")])
    except ValueError:
        vector = np.zeros(0)
    if (
        vector.shape != (3,)
        or not np.isfinite(vector).all()
        or np.abs(vector).max() > STRONGEST_WIND
    ):
        raise InputError(f"{name} is {text!r}, expected X,Y,Z up to {STRONGEST_WIND}, as 3,0,1")
    return vector


def _preset(args: argparse.Namespace) -> tuple[str, dict[str, object]]:
    """Return the simulator, and its options saved by `hairkit view`."""
    from hairkit.pipeline.open_groom import groom_path
    from hairkit.viewer.actions.presets import presets_path, read_preset

    if args.preset is None:
        return args.using or SIMULATOR, {}
    preset = read_preset(presets_path(groom_path(args.groom)), args.preset)
    plugin = str(preset.get("simulator", SIMULATOR))
    if args.using not in (None, plugin):
        raise InputError(f"--preset {args.preset} is of {plugin}, not of --using {args.using}")
    return plugin, dict(preset.get("options", {}))


def _exporter(manager: Any, path: Path) -> str | None:
    """Return the plugin that writes the animated file, None for a point cache."""
    from hairkit.pipeline.open_groom import plugin_for

    if path.suffix.lower() == ".npz":
        return None
    exporter = plugin_for(manager, "export_groom", path)
    if not _can_animate(manager, exporter):
        able = [name for name in manager.names("export_groom") if _can_animate(manager, name)]
        endings = sorted({ending for name in able for ending in manager.info(name).suffixes})
        raise InputError(
            f"{path}: {exporter} writes no animation; write a cache .npz, or {', '.join(endings)}"
        )
    return exporter


def _can_animate(manager: Any, exporter: str) -> bool:
    return "cache" in {info.name for info in manager.info(exporter).options}
