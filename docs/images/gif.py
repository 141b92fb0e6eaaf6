"""Make the animated pictures of the README; needs Pillow beside hairkit.

python docs/images/gif.py [pbd] [super_helix] [--every 3] [--colours 160] [--still 6]

grows straight and wavy hair, plays shake.toml and wind.toml headless with each simulator, packs
every third picture: shake.gif and wind.gif for pbd, shake_super_helix.gif and so on for others.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hairkit.cli import main as hairkit
from hairkit.head_model.template import default_head
from hairkit.synth import StyleName, grow

HERE = Path(__file__).parent
MILLISECONDS = 35
"""Between two pictures of the viewer's script."""


def main() -> int:
    """Write the pictures of the simulators that are named, or of pbd, beside this program."""
    args = _arguments()
    shown: dict[str, StyleName] = {"shake": "straight", "wind": "wavy"}
    with tempfile.TemporaryDirectory() as folder:
        for name, style in shown.items():
            groom = Path(folder) / f"{style}.npz"
            grow(style, default_head(), 600).save(groom)
            for simulator in args.simulators or ["pbd"]:
                words = ["view", str(groom), "--headless", "--simulator", simulator]
                words += ["--script", str(HERE / f"{name}.toml")]
                out = Path(folder) / simulator
                if hairkit([*words, "--out", str(out)]):
                    return 1
                ending = "" if simulator == "pbd" else f"_{simulator}"
                frames = sorted((out / name).glob("*.png"))[:: args.every]
                target = HERE / f"{name}{ending}.gif"
                pack(frames, target, args.colours, args.still, MILLISECONDS * args.every)
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = parser.add_argument
    add("simulators", nargs="*", metavar="SIMULATOR", help="pbd by default")
    add("--every", type=int, default=3, metavar="N", help="take one picture of N (default 3)")
    add("--colours", type=int, default=160, metavar="N", help="of the palette (default 160)")
    add("--still", type=int, default=6, metavar="D", help="change that is not shown (default 6)")
    return parser.parse_args()


def pack(frames: list[Path], target: Path, colours: int, still: int, milliseconds: int) -> None:
    """Write frames as a GIF with one palette; what hardly changes is not written again.

    A pixel stays as it was shown until a channel is more than `still` of 255 away from that. GIF
    keeps such pixels from frame to frame at hardly any cost.
    """
    from PIL import Image

    pictures = [np.asarray(Image.open(path).convert("RGB")) for path in frames]
    middle = Image.fromarray(pictures[len(pictures) // 3])
    palette = middle.quantize(colours, Image.Quantize.MEDIANCUT)
    # no dithering: it would flicker, and not compress
    packed = [
        Image.fromarray(shown).quantize(palette=palette, dither=Image.Dither.NONE)
        for shown in _steadied(pictures, still)
    ]
    packed[0].save(
        target,
        save_all=True,
        append_images=packed[1:],
        duration=milliseconds,
        loop=0,
        optimize=True,
    )


def _steadied(
    pictures: list[np.ndarray[tuple[int, ...], np.dtype[np.uint8]]], still: int
) -> Iterator[np.ndarray[tuple[int, ...], np.dtype[np.uint8]]]:
    """Yield pictures (H, W, 3) whose pixels change only where they change by more than `still`."""
    shown = pictures[0]
    for picture in pictures:
        change = np.abs(picture.astype(np.int16) - shown).max(axis=2, keepdims=True)
        shown = np.where(change > still, picture, shown)
        yield shown


if __name__ == "__main__":
    sys.exit(main())
