"""Draw one groom by hairkit and, imported as Alembic, by Blender's Cycles, side by side.

python benchmarks/blender_picture.py --groom out/groom.npz -o blender.png

Left is hairkit's picture, right Blender's: the same strands, camera, key and rim light. Without
Blender (`make test-clients` installs it) or a groom, the program says so and does nothing.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.cli.render import parse_size
from hairkit.grooming.prepare_export import dense_groom
from hairkit.imaging.picture_file import write_picture
from hairkit.manager import Manager
from hairkit.rendering import Lights, draw
from hairkit.rendering.framing import framing_cameras
from hairkit.rendering.picture import backdrop, display_width
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom

MADE = Path(__file__).parents[1] / ".clients" / "bpy" / "bin" / "python"
SUN = np.pi
"""W/m2 of Blender's sun that match a light of 1: under it a white surface appears white."""


def main() -> int:
    """Draw both and write them side by side."""
    args = _arguments()
    python = Path(args.blender or os.environ.get("HAIRKIT_BPY_PYTHON", MADE))
    if not python.exists() or not args.groom.exists():
        print("no Blender or no groom; see python benchmarks/blender_picture.py --help")
        return 0
    groom = dense_groom(Groom.load(args.groom), args.hairs)
    width, height = parse_size(args.size)
    points = np.concatenate([groom.strands.points, groom.head.vertices])
    azimuth, elevation = (float(part) for part in args.camera.split(","))
    camera = framing_cameras(points, [(azimuth, elevation)], width, height)[0]
    own = draw(groom, groom.head, camera)
    with tempfile.TemporaryDirectory() as folder:
        theirs = _by_blender(groom, camera, python, Path(folder), args)
    write_picture(args.output, np.concatenate([own, theirs], axis=1))
    print(args.output)
    return 0


def _by_blender(
    groom: Groom, camera: Camera, python: Path, folder: Path, args: argparse.Namespace
) -> UInt8Array:
    """Return Blender's picture (H, W, 3) of the groom, over the same backdrop."""
    manager = Manager.loaded(autoload=False)
    options = manager.options("alembic", {})
    manager.call("export_groom", "alembic", options, groom=groom, path=folder / "hair.abc")
    groom.save(folder / "groom.npz")
    picture = folder / "picture.png"
    scene = _scene(groom, camera) | {
        "alembic": str(folder / "hair.abc"),
        "groom": str(folder / "groom.npz"),
        "picture": str(picture),
        "samples": args.samples,
        "threads": args.threads,
    }
    (folder / "scene.json").write_text(json.dumps(scene))
    program = Path(__file__).parent / "in_blender" / "picture.py"
    subprocess.run(
        [str(python), str(program), str(folder / "scene.json")],
        check=True,
        stdout=sys.stderr,
        env={**os.environ, "BLENDER_USER_RESOURCES": str(folder)},
    )
    drawn = cv2.imread(str(picture), cv2.IMREAD_UNCHANGED)
    alpha = drawn[..., 3:] / 255.0
    mixed = drawn[..., 2::-1] * alpha + backdrop(camera) * (1 - alpha)
    result: UInt8Array = np.rint(mixed).astype(np.uint8)
    return result


def _scene(groom: Groom, camera: Camera) -> dict[str, Any]:
    lights = Lights.at_camera(camera)
    pairs = ((lights.key_direction, lights.key_colour), (lights.rim_direction, lights.rim_colour))
    widths = display_width(groom.strands, groom.material)
    own = groom.material.width if groom.strands.widths is None else groom.strands.widths
    return {
        "width": camera.width,
        "height": camera.height,
        "focal": camera.focal,
        "position": camera.position.tolist(),
        "rotation": camera.rotation.tolist(),
        "wider": float(np.mean(widths / own)),
        "lights": [
            {"direction": way, "colour": [SUN * part for part in colour]} for way, colour in pairs
        ],
        "sky": lights.sky_colour,
        "exposure": float(np.log2(lights.exposure)),
    }


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("--groom", type=Path, default=Path("demo-out/groom.npz"), help="by default of `make demo`")
    add("-o", "--output", type=Path, default=Path("blender.png"))
    add("--hairs", type=int, default=20_000)
    add("--camera", default="35,5", help="azimuth,elevation in degrees")
    add("--size", default="360x480", metavar="WxH", help="of each half")
    add("--samples", type=int, default=48)
    add("--threads", type=int, default=2)
    add("--blender", help="a Python that can `import bpy`")
    return parser.parse_args()


if __name__ == "__main__":
    raise SystemExit(main())
