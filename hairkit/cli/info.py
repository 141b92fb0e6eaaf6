"""`hairkit info FILE`: print what a groom, capture, scene, simulation or head contains."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.reader_settings import add_reader_arguments, reader_settings
from hairkit.cli.settings import split_settings
from hairkit.errors import FormatError, InputError, one_line
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache, is_cache_file

DESCRIPTION = """\
Example: hairkit info out/groom.npz

Print what a file contains: a groom (.npz or what an import plugin reads; --scale, --up and --set
give what bare strands do not define), a simulation (.npz), a scene.json, a head (.obj, .ply, .glb),
an avatar (.vrm), hair cards (.glb, .vrm, .obj), or a capture: a folder, a video, a URL, or what
else the recipe's stage `capture` takes. Lengths are in metres."""

_OWN = (".npz", ".json")
"""Files that need no libraries to be known."""
_AVATAR = ".vrm"
_HEADS = (".obj", ".ply", ".glb", _AVATAR)
_CARDS = (".glb", ".gltf", ".vrm", ".obj")


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("file", metavar="FILE", help="a file, or a capture")
    add("--recipe", metavar="R", help="FILE is a capture that this recipe takes")
    add("--head-units", default="m", metavar="U", help="units of a head file (default m)")
    add("--head-scalp", metavar="NAME", help="its scalp: a group, a mask picture, or transfer")
    add_reader_arguments(add)
    add_shared(add, "--set", "--json")


def run(args: argparse.Namespace) -> int:
    """Print what the file contains."""
    facts = _capture(args) if _is_capture(args) else _facts(Path(args.file), args)
    print(json.dumps(facts, indent=1) if args.json else "\n".join(_lines(facts)))
    return 0


def _is_capture(args: argparse.Namespace) -> bool:
    from hairkit.remote import is_url

    if args.recipe is not None or is_url(args.file) or Path(args.file).is_dir():
        return True
    if Path(args.file).suffix.lower() in _OWN:
        return False
    from hairkit.io.video import is_video

    return is_video(Path(args.file))


def _facts(path: Path, args: argparse.Namespace) -> dict[str, Any]:
    if not path.exists():
        raise InputError(f"{path}: no such file")
    if path.suffix == ".json":
        return _scene(path)
    if is_cache_file(path):
        return _simulation(PointCache.load(path))
    if path.name.lower().endswith(_CARDS) and (cards := _cards(path)) is not None:
        return cards
    if path.suffix.lower() not in _HEADS:
        return _groom(path, args)
    try:
        if path.suffix.lower() != _AVATAR:
            return _groom(path, args)
    except FormatError:  # no strands in it, so it is a head
        pass
    from hairkit.io.head_reader import TRANSFER, read_bare_head, read_head

    bare = read_bare_head(path, args.head_units, args.head_scalp)
    if bare.scalp is None and args.head_scalp != TRANSFER:
        facts = {"vertices": len(bare.vertices), "faces": len(bare.faces), "scalp_vertices": 0}
        return {"kind": "head", **facts, "bounds_m": _bounds(bare.vertices.astype(np.float32))}
    return {"kind": "head", **_head(read_head(path, args.head_units, args.head_scalp))}


def _cards(path: Path) -> dict[str, Any] | None:
    from hairkit.io.card_file import read_card_file

    found = read_card_file(path)
    if found is None:
        return None
    triangles = {name: {"triangles": count} for name, count in found.triangles.items()}
    return {"kind": "cards", "levels": triangles, "bones": found.bones, "springs": found.springs}


def _simulation(cache: PointCache) -> dict[str, Any]:
    traces = np.trace(cache.head_from_rest[:, :3, :3], axis1=1, axis2=2)
    turns = np.degrees(np.arccos(np.clip((traces - 1) / 2, -1, 1)))
    return {
        "kind": "simulation",
        "frames": len(cache),
        "points": cache.points.shape[1],
        "frames_per_second": round(cache.frames_per_second, 3),
        "seconds": _range(cache.times),
        "bounds_m": _bounds(cache.points.reshape(-1, 3)),
        "largest_head_turn_deg": round(float(turns.max()), 2),
    }


def _groom(path: Path, args: argparse.Namespace) -> dict[str, Any]:
    chosen = (args.plugin, args.reader, args.set, args.scale, args.up, args.head)
    own = path.suffix == ".npz" and not any(chosen)
    groom = Groom.load(path) if own else _imported(path, args)
    strands = groom.strands
    guides = len(strands) if strands.guide is None else int(np.count_nonzero(strands.guide))
    lengths, counts = strands.lengths(), strands.counts
    look = groom.material
    return {
        "kind": "groom",
        "strands": len(strands),
        "guides": guides,
        "points": len(strands.points),
        "points_per_strand": _range(counts),
        "length_m": _range(lengths),
        "mean_length_m": round(float(lengths.mean()), 4) if len(lengths) else None,
        "bounds_m": _bounds(strands.points),
        "width_m": look.width,
        "has": [
            name
            for name in ("widths", "root_uv", "group", "guide", "colours")
            if getattr(strands, name) is not None
        ],
        "root_colour": [round(float(c), 4) for c in look.root_colour],
        "tip_colour": [round(float(c), 4) for c in look.tip_colour],
        "head": _head(groom.head),
    }


def _imported(path: Path, args: argparse.Namespace) -> Groom:
    """Return the groom that a plugin reads; only then all plugins are loaded."""
    from hairkit.manager import Manager
    from hairkit.pipeline.open_groom import load_groom, plugin_for

    manager = Manager.loaded(args.plugin)
    reader = args.reader or plugin_for(manager, "import_groom", path)
    given = split_settings(manager, {"reader": reader}, args.set)["reader"]
    settings = reader_settings(manager, reader, args) | given
    return load_groom(manager, path, settings, reader)


def _scene(path: Path) -> dict[str, Any]:
    from hairkit.types.scene import read_cameras

    names, cameras = read_cameras(path)
    views = {
        name: {
            "model": camera.model,
            "size_px": f"{camera.width} x {camera.height}",
            "focal": round(camera.focal, 1),
            "azimuth_deg": round(camera.azimuth_deg, 2),
            "elevation_deg": round(camera.elevation_deg, 2),
            "distance_m": round(float(np.linalg.norm(camera.position)), 4),
        }
        for name, camera in zip(names, cameras, strict=True)
    }
    return {"kind": "scene", "views": views}


def _capture(args: argparse.Namespace) -> dict[str, Any]:
    from hairkit.manager import Manager
    from hairkit.pipeline.recipe import load_recipe
    from hairkit.pipeline.take_capture import take_capture
    from hairkit.stages import CAPTURE

    recipe = load_recipe(args.recipe or "default").only(CAPTURE)
    needed = [choice.plugin for choice in recipe.choices]
    capture = take_capture(args.file, recipe, Manager.loaded(args.plugin, only=needed))
    views = {
        view.name: {
            "photo": view.photo_path.name if view.photo_path is not None else "",
            "size_px": f"{view.photo_size[0]} x {view.photo_size[1]}",
            "azimuth_deg": view.azimuth_deg,
            "focal_px": None if view.focal_px is None else round(view.focal_px, 1),
            "mask": view.mask_path is not None,
            "strokes": view.strokes_path is not None,
            "landmarks": view.landmarks is not None,
        }
        for view in capture.views
    }
    cameras = "orthographic" if capture.orthographic else "perspective"
    return {"kind": "capture", "cameras": cameras, "views": views}


def _head(head: Any) -> dict[str, Any]:
    return {
        "vertices": len(head.vertices),
        "faces": len(head.faces),
        "scalp_vertices": int(np.count_nonzero(head.scalp > 0.5)),
        "landmarks": head.landmark_vertices is not None,
        "capsules": len(head.capsules.radius),
        "bounds_m": _bounds(head.vertices),
    }


def _range(values: Any, digits: int = 4) -> dict[str, float]:
    if not len(values):
        return {}
    least, most = values.min().item(), values.max().item()
    return {"least": round(least, digits), "most": round(most, digits)}


def _bounds(points: Float32Array) -> list[list[float]]:
    if not len(points):
        return []
    return [[round(float(v), 4) for v in corner] for corner in (points.min(0), points.max(0))]


def _lines(facts: dict[str, Any], indent: str = "") -> list[str]:
    """Return `name: value` lines; tables within tables are indented, flat ones are one line."""
    lines = []
    for name, value in facts.items():
        if not isinstance(value, dict):
            lines.append(f"{indent}{name}: {_format_value(value)}")
        elif any(isinstance(item, dict) for item in value.values()):
            lines += [f"{indent}{one_line(name)}:", *_lines(value, indent + "  ")]
        else:
            inner = ", ".join(f"{key} {_format_value(item)}" for key, item in value.items())
            lines.append(f"{indent}{name}: {inner}")
    return lines


def _format_value(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list) and value and isinstance(value[0], list):
        return " to ".join(_format_value(item) for item in value)
    if isinstance(value, list):
        return f"({', '.join(str(item) for item in value)})"
    return "unknown" if value is None else one_line(value)
