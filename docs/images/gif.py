"""Make the animated pictures of the README; needs Pillow beside hairkit.

python docs/images/gif.py [pbd] [super_helix]

grows straight and wavy hair, plays shake.toml and wind.toml headless with each simulator, packs
every other picture: shake.gif and wind.gif for pbd, shake_super_helix.gif and so on for others.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from hairkit.cli import main as hairkit
from hairkit.default_head import default_head
from hairkit.groom_file import write_groom
from hairkit.synth import StyleName, grow

HERE = Path(__file__).parent
COLOURS = 96
MILLISECONDS = 70


def main() -> int:
    """Write the pictures of the simulators that are named, or of pbd, beside this program."""
    simulators = sys.argv[1:] or ["pbd"]
    shown: dict[str, StyleName] = {"shake": "straight", "wind": "wavy"}
    with tempfile.TemporaryDirectory() as folder:
        for name, style in shown.items():
            groom = Path(folder) / f"{style}.npz"
            write_groom(groom, grow(style, default_head(), 600))
            for simulator in simulators:
                words = ["view", str(groom), "--headless", "--simulator", simulator]
                words += ["--script", str(HERE / f"{name}.toml")]
                out = Path(folder) / simulator
                if hairkit([*words, "--out", str(out)]):
                    return 1
                ending = "" if simulator == "pbd" else f"_{simulator}"
                pack(sorted((out / name).glob("*.png")), HERE / f"{name}{ending}.gif")
    return 0


def pack(frames: list[Path], target: Path) -> None:
    """Write every other frame as a GIF with one palette."""
    from PIL import Image

    pictures = [Image.open(path).convert("RGB") for path in frames[::2]]
    palette = pictures[len(pictures) // 3].quantize(COLOURS, Image.Quantize.MEDIANCUT)
    # no dithering: it would flicker, and not compress
    packed = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    packed[0].save(
        target,
        save_all=True,
        append_images=packed[1:],
        duration=MILLISECONDS,
        loop=0,
        optimize=True,
    )


if __name__ == "__main__":
    sys.exit(main())
