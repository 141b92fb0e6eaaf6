"""`hairkit render GROOM -o picture.png`: draw a groom on its head."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.cli.arguments import Add, add_shared, check_range, parse_size
from hairkit.cli.settings import importer_of, split_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError
from hairkit.grooming.densify import densify
from hairkit.grooming.guide_weights import guide_mask
from hairkit.imaging.picture_file import write_picture
from hairkit.io.capture_reader import TURN
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import load_groom
from hairkit.rendering import Lights, Solid, draw_views
from hairkit.rendering.framing import framing_cameras
from hairkit.rendering.head import bust_solid
from hairkit.simulation.posing import pose_groom, pose_hair, pose_torso
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.point_cache import read_cache
from hairkit.types.scene import read_cameras
from hairkit.types.skin_look import LOBES, SkinLook
from hairkit.types.strands import Strands

DESCRIPTION = """\
Example: hairkit render out/groom.npz -o front-left.png --camera front-left

Draw a groom on its head, its guides interpolated to full hair. The camera is a name of the turn,
"azimuth,elevation" in degrees, or a view of a scene.json. --turntable 24 writes 24 pictures.
--cache draws a frame of what hairkit simulate wrote."""

HAIRS = 20_000
"""Strands drawn by default."""
MOST_HAIRS = 200_000
MOST_PICTURES = 3600
"""Of a turntable: ten a degree."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("groom", metavar="GROOM", type=Path, help="groom.npz, or a file that a plugin reads")
    add("-o", "--output", type=Path, required=True, metavar="FILE", help="PNG")
    add("--camera", help="front, left, ... or azimuth,elevation (front)")
    add("--scene", type=Path, metavar="FILE", help="scene.json with cameras")
    add("--view", metavar="NAME", help="the view of the scene (its first)")
    add("--hairs", type=int, default=HAIRS, metavar="N", help=f"strands ({HAIRS})")
    add("--size", metavar="WxH", help="pixels (1280x720; the scene's own size)")
    add("--turntable", type=int, metavar="N", help="N pictures all around")
    lobes = f"of the oil on skin: {', '.join(LOBES)}"
    add("--lobe", default=LOBES[0], choices=LOBES, help=lobes)
    add("--seed", type=int, default=0, help="of the interpolated hair (0)")
    add("--cache", type=Path, metavar="FILE", help="simulation of the groom (.npz)")
    add("--frame", type=int, metavar="N", help="its frame, -1 is the last (0)")
    add_shared(add, "--set", "--plugin", "--json")


def run(args: argparse.Namespace) -> int:
    """Draw and print the names of the pictures."""
    check_target(args.output)
    check_range("--hairs", args.hairs, 1, MOST_HAIRS)
    check_range("--turntable", args.turntable, 1, MOST_PICTURES, "pictures")
    groom, hair, below = _hair_and_body(args)
    cameras = _cameras(args, groom.head.vertices, hair)
    paths = _paths(args.output, len(cameras))
    light = Lights.at_camera(cameras[0]) if len(cameras) > 1 else None
    for path, camera in zip(paths, cameras, strict=True):
        [picture] = draw_views(
            hair,
            groom.head,
            [camera],
            material=groom.material,
            lights=light,
            solids=[] if below is None else [below],
            skin=SkinLook(args.lobe),
        )
        write_picture(path, picture)
        print(f"{path.name}: {len(hair)} strands, {camera.width}x{camera.height}", file=sys.stderr)
    print_written(args, *paths, strands=len(hair))
    return 0


def _hair_and_body(args: argparse.Namespace) -> tuple[Groom, Strands, Solid | None]:
    """Return groom, full hair and bust, at the frame of their simulation where one is given."""
    manager = Manager.loaded(args.plugin)
    reader = importer_of(manager, args.groom)
    settings = split_settings(manager, {"reader": reader}, args.set)
    groom = load_groom(manager, args.groom, settings["reader"])
    if args.cache is None and args.frame is not None:
        raise InputError(f"--frame {args.frame} needs --cache with a simulation of the groom")
    hair = densify(groom, args.hairs, args.seed)
    if args.cache is None:
        return groom, hair, bust_solid(groom.head, hair)
    guides = groom.select(guide_mask(groom.strands))
    cache, frame = read_cache(args.cache, guides), args.frame or 0
    moved, posed = pose_hair(groom, hair, cache, frame), pose_groom(groom, cache, frame)
    return posed, moved, bust_solid(groom.head, hair, pose_torso(groom, cache, frame))


def _cameras(args: argparse.Namespace, head: Any, hair: Strands) -> list[Camera]:
    if args.scene is not None:
        if args.camera or args.turntable:
            raise InputError("--scene names its own cameras; leave --camera and --turntable out")
        return [_scene_camera(args.scene, args.view, args.size)]
    if args.view is not None:
        raise InputError(f"--view {args.view} needs --scene scene.json")
    width, height = parse_size(args.size or "1280x720")
    azimuth, elevation = _direction(args.camera or "front")
    count = args.turntable or 1
    turn = (azimuth + 360 * np.arange(count) / count).tolist()
    points = np.concatenate([head, hair.points])
    return framing_cameras(points, [(a, elevation) for a in turn], width, height)


def _scene_camera(path: Path, view: str | None, size: str | None) -> Camera:
    names, cameras = read_cameras(path)
    wanted = names[0] if view is None else view
    if wanted not in names:
        raise InputError(f"{path} has no view {wanted!r}; it has {', '.join(names)}")
    camera = cameras[names.index(wanted)]
    return camera if size is None else camera.fitted(*parse_size(size))


def _direction(text: str) -> tuple[float, float]:
    if text in TURN:
        return TURN[text], 0.0
    parts = text.split(",")
    try:
        azimuth, elevation = (float(part) for part in parts)
    except ValueError as error:
        names = ", ".join(TURN)
        raise InputError(
            f"--camera is {text!r}, expected azimuth,elevation in degrees or one of {names}"
        ) from error
    if not (np.isfinite(azimuth) and abs(elevation) < 90):
        raise InputError(f"--camera is {text!r}, expected an elevation between -90 and 90 degrees")
    return azimuth, elevation


def _paths(output: Path, count: int) -> list[Path]:
    if count == 1:
        return [output]
    digits = len(str(count - 1))
    return [output.with_stem(f"{output.stem}_{i:0{digits}d}") for i in range(count)]
