"""`hairkit view GROOM`: a window in which captured hair moves, or a script without one."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any, NoReturn

from hairkit.cli.arguments import Add, add_shared, check_range, parse_size
from hairkit.cli.written import print_written
from hairkit.errors import InputError

MOST_HAIRS = 200_000
BUDGET_MS = 50
"""Milliseconds a picture may take by default: 20 pictures a second."""
DESCRIPTION = """\
Example: hairkit view out/groom.npz

Show a groom in motion. GROOM is a groom.npz, any file that an import plugin reads, or the folder
that `hairkit reconstruct` wrote. Press H for the keys. With --headless a script does what a user
would do: hairkit view out/ --headless --script steps.toml --out pictures/"""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("groom", metavar="GROOM", type=Path, help="groom.npz, importable file or folder of results")
    add("--capture", metavar="C", help="the photos, to show them in space: a folder, a video, ...")
    add("--simulator", metavar="NAME", help="simulator plugin (rods), or none")
    add("--preset", metavar="NAME", help="simulator options saved beside the groom")
    add("--hairs", type=int, metavar="N", help="strands drawn (10000)")
    add("--size", metavar="WxH", help="pixels (1280x720)")
    add("--budget", type=float, metavar="MS", help=f"milliseconds a picture may take ({BUDGET_MS})")
    add("--headless", action="store_true", help="no window: run --script")
    add("--script", type=Path, metavar="FILE", help="actions to run (TOML)")
    add("--out", type=Path, metavar="FOLDER", help="where a script's pictures go (.)")
    add("--actions", action=_ListActions, nargs=0, help="list the actions of scripts, and exit")
    add_shared(add, "--set", "--plugin", "--json")


class _ListActions(argparse.Action):
    """Prints a line for each action, with its values and their defaults."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from hairkit.viewer.actions.actions import ACTIONS
        from hairkit.viewer.actions.registry import signature

        for action in ACTIONS.values():
            print(signature(action))
            print(f"    {action.doc}")
        parser.exit()


def run(args: argparse.Namespace) -> int:
    """Show the groom until the window is closed, or play the script."""
    from hairkit.parallel import one_blas_thread

    _check(args)
    try:
        with one_blas_thread():
            return _headless(args) if args.headless else _window(args)
    except KeyboardInterrupt as error:
        raise KeyboardInterrupt("what was written so far is kept") from error


def _check(args: argparse.Namespace) -> None:
    """Check the arguments before a window opens."""
    from hairkit.pipeline.open_groom import groom_path

    groom_path(args.groom)
    check_range("--hairs", args.hairs, 0, MOST_HAIRS)


def _window(args: argparse.Namespace) -> int:
    from hairkit.viewer.actions.script import read_script
    from hairkit.viewer.window.splash import AbandonedError
    from hairkit.viewer.window.window import show

    if args.out is not None:
        raise InputError("--out is for --headless; in the window pictures go to this folder")
    script = None if args.script is None else read_script(args.script)
    budget, size = _budget(args), _size(args)
    manager = _manager(args)
    print(f"opening {args.groom}; H in the window shows the keys", file=sys.stderr)
    try:
        show(lambda size: _session(args, manager, size), size, script=script, budget=budget)
    except AbandonedError:  # a thread that compiles cannot be ended, nor is it worth waiting for
        sys.stderr.flush()
        os._exit(0)
    return 0


def _headless(args: argparse.Namespace) -> int:
    from hairkit.rendering.context import renderer
    from hairkit.viewer.actions.script import play, read_script
    from hairkit.viewer.preview import Preview

    if args.script is None:
        raise InputError("--headless needs --script steps.toml; docs/viewer.md shows one")
    script = read_script(args.script)
    if args.hairs is None:
        args.hairs = script.setup.hairs
    size = _size(args) if args.size else script.setup.size
    manager = _manager(args)
    with renderer() as gl:
        print(gl.description, file=sys.stderr)
        preview = Preview(gl, _session(args, manager, size, script.setup.seed))
        play(preview, script, args.out or Path())
        preview.release()
    print_written(args, *preview.written)
    return 0


def _manager(args: argparse.Namespace) -> Any:
    """Return the plugins; raises when none reads groom or photos or a `--set` has another form."""
    from hairkit.cli.settings import importer_of
    from hairkit.manager import Manager
    from hairkit.options import split_setting
    from hairkit.pipeline.open_groom import groom_path
    from hairkit.viewer.layers import PHOTO_EDGE, Layers

    manager = Manager.loaded(args.plugin)
    importer_of(manager, args.groom)
    for text in args.set:
        split_setting(text)
    if args.capture is not None:
        Layers(manager, groom_path(args.groom).parent, args.capture).take_capture(PHOTO_EDGE)
    return manager


def _session(args: argparse.Namespace, manager: Any, size: tuple[int, int], seed: int = 0) -> Any:
    from hairkit.cli.settings import importer_of, split_settings
    from hairkit.pipeline.open_groom import groom_path
    from hairkit.viewer.actions.actions import perform
    from hairkit.viewer.actions.presets import presets_path, read_preset
    from hairkit.viewer.session import HAIRS, Session
    from hairkit.viewer.simulation import NO_SIMULATOR, default_simulator

    simulator = args.simulator
    if args.preset is not None and simulator is None:
        simulator = read_preset(presets_path(groom_path(args.groom)), args.preset).get("simulator")
    user = simulator or default_simulator(manager)
    plugins = {
        "reader": importer_of(manager, args.groom),
        "simulator": None if user == NO_SIMULATOR else user,
    }
    settings = split_settings(manager, plugins, args.set)
    session = Session(
        manager,
        args.groom,
        size=size,
        simulator=simulator,
        hairs=HAIRS if args.hairs is None else args.hairs,
        capture=args.capture,
        seed=seed,
        reading=settings["reader"],
        guides_first=not args.headless,
    )
    if args.preset is not None:
        perform(session, "preset_load", {"name": args.preset})
    for name, value in settings["simulator"].items():
        session.simulation.set(name, value)
    return session


def _size(args: argparse.Namespace) -> tuple[int, int]:
    return parse_size(args.size) if args.size else (1280, 720)


def _budget(args: argparse.Namespace) -> float:
    if args.budget is None:
        return BUDGET_MS / 1e3
    if not args.budget > 0:
        raise InputError(f"--budget is {args.budget}, expected milliseconds above 0")
    return float(args.budget) / 1e3
