"""`hairkit texture WORK FILE -o OUT`: textures made finer, filtered, or turned into other maps."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from hairkit.cli.arguments import Add, add_shared
from hairkit.cli.settings import split_settings
from hairkit.cli.written import check_target, print_written
from hairkit.errors import InputError

if TYPE_CHECKING:
    from hairkit.types.skin import Texture
    from hairkit.types.texture_example import TextureExample

DESCRIPTION = """\
Example: hairkit texture sharpen scan.png --example close_up.png -o sharp.png

WORK is one of
  sharpen     give a blurred texture the detail of EXAMPLE, a sharp close-up of the same skin
  filter      do to the texture what was done to EXAMPLE, with the result FILTERED
  by-numbers  paint labels: EXAMPLE are labels too, FILTERED is what they stand for
  bump        make a bump map of an albedo
  normal      make a normal map of a bump map; with --example and --filtered, of an albedo after
              an albedo and its normal map
  tint        change an albedo by maps of --blood and --melanin, of which 128 changes nothing
Pictures are PNG, JPEG, WebP or TIFF; OUT is a .png."""

WORKS = ("sharpen", "filter", "by-numbers", "bump", "normal", "tint")
_READY: dict[str, dict[str, object]] = {
    "sharpen": {"alpha": 0.1},
    "by-numbers": {"colours": True, "remap": False},
    "normal": {"colours": True, "remap": False, "alpha": 0.1},
}
"""Options of `image_analogies` by work. Alpha 0.1 is the best of none, 0.1, 0.2 and 0.4 for skin
(`studies/texture_gallery.py`): sharp skin gains 4 dB over none, normal maps 7 to 9 dB."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("work", metavar="WORK", choices=WORKS, help=", ".join(WORKS))
    add("file", type=Path, metavar="FILE", help="the texture")
    add("-o", "--output", type=Path, required=True, metavar="OUT", help="picture to write")
    add("--example", type=Path, metavar="FILE", help="picture that the work follows")
    add("--filtered", type=Path, metavar="FILE", help="what became of the example")
    add("--using", default="image_analogies", metavar="P", help="plugin: super_resolution")
    add("--depth", type=float, default=4.0, metavar="N", help="of a bump map, pixels (default 4)")
    add("--blood", type=Path, metavar="FILE", help="grey map of blood, for tint")
    add("--melanin", type=Path, metavar="FILE", help="grey map of melanin, for tint")
    add("--difference", type=Path, metavar="FILE", help="write what changed, in false colours")
    add_shared(add, "--set", "--plugin", "--json")


def run(args: argparse.Namespace) -> int:
    """Read, work, write, and print the files' names."""
    from hairkit.imaging.relief import draw_difference
    from hairkit.io.textures import read_texture
    from hairkit.storage import write_bytes
    from hairkit.types.skin import Texture

    outputs = [path for path in (args.output, args.difference) if path is not None]
    for path in outputs:
        if path.suffix.lower() != ".png":
            raise InputError(f"{path}: textures are written as .png")
        check_target(path)
    given = read_texture(args.file)
    made = (
        _tint(args, given) if args.work == "tint" else _relief(args, given) or _enhance(args, given)
    )
    write_bytes(args.output, made.data.tobytes())
    if args.difference is not None:
        drawn = Texture.encode(draw_difference(given.pixels, made.pixels))
        write_bytes(args.difference, drawn.data.tobytes())
    print_written(args, *outputs)
    return 0


def _tint(args: argparse.Namespace, given: Texture) -> Texture:
    """Return the albedo with the blood and the melanin of two maps."""
    from hairkit.imaging.skin_colour import tint_albedo
    from hairkit.io.textures import grey, read_texture
    from hairkit.types.skin import Texture

    if args.blood is None and args.melanin is None:
        raise InputError("tint needs --blood FILE or --melanin FILE")
    paths = args.blood, args.melanin
    blood, melanin = (None if path is None else grey(read_texture(path)) for path in paths)
    return Texture.encode(tint_albedo(given.pixels, blood, melanin))


def _relief(args: argparse.Namespace, given: Texture) -> Texture | None:
    """Return the bump or normal map that needs no example; None for other works."""
    from hairkit.imaging.relief import bump_from_albedo, normal_from_height
    from hairkit.io.textures import grey
    from hairkit.types.skin import Texture

    if args.example is not None or args.work not in ("bump", "normal"):
        return None
    if args.work == "bump":
        return Texture.encode(bump_from_albedo(given.pixels))
    if not 0 < args.depth < max(given.pixels.shape):
        raise InputError(f"--depth {args.depth:g}, expected more than 0, less than the picture")
    return Texture.encode(normal_from_height(grey(given), args.depth))


def _enhance(args: argparse.Namespace, given: Texture) -> Texture:
    """Return what the plugin makes of the texture and the example."""
    from hairkit.manager import Manager

    example = _example(args)
    manager = Manager.loaded(args.plugin)
    manager.implementer("enhance_texture", args.using)
    values = split_settings(manager, {"texture": args.using}, args.set)["texture"]
    ready = _READY.get(args.work, {}) if args.using == "image_analogies" else {}
    result: Texture = manager.call(
        "enhance_texture", args.using, {**ready, **values}, texture=given, example=example
    )
    return result


def _example(args: argparse.Namespace) -> TextureExample:
    """Return the example pair; without `--filtered` the example is the sharp picture itself."""
    from hairkit.io.textures import read_texture
    from hairkit.types.texture_example import TextureExample

    if args.example is None:
        raise InputError(f"{args.work} needs --example FILE")
    if args.filtered is None and args.work != "sharpen":
        raise InputError(f"{args.work} needs --filtered FILE, what became of the example")
    first = read_texture(args.example)
    if args.filtered is None:
        return TextureExample(first)
    return TextureExample(read_texture(args.filtered), first)
