"""Draw the recordings of simulated hair: those of the README, and both simulators side by side.

python docs/images/gif.py [shake.gif ...] [--hairs 8000]

| file | what |
|---|---|
| shake.gif, wind.gif | straight hair on a shaken head, wavy hair in wind, by rods |
| shake_super_helix.gif, wind_super_helix.gif | the same by super_helix |
| hair_shake.gif, hair_jump.gif | straight, wavy, curly, short; above rods, below super_helix |
| hair_nod.gif, hair_wind.gif | the same |

Needs Pillow beside hairkit. Without names all are drawn.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.rendering.context import Renderer, renderer
from hairkit.synth import StyleName, grow
from hairkit.viewer.actions.actions import perform
from hairkit.viewer.head_motion import HeadMotion
from hairkit.viewer.preview import Preview
from hairkit.viewer.session import Session

Picture = npt.NDArray[np.uint8]
HERE = Path(__file__).parent
GUIDES = 400
STYLES: tuple[StyleName, ...] = ("straight", "wavy", "curly", "short")
SIMULATORS = ("rods", "super_helix")
FRAME, EVERY = 1 / 30, 3
"""Seconds of a picture of the viewer, and of how many one is kept."""
SECONDS = 3.0
LARGE, SMALL = (480, 360), (200, 200)
"""Pixels of a picture alone and of one beside others."""
HOP_M, HOP_S = 0.05, 0.5
"""Height and time of a jump, metres and seconds."""
LARGE_COLOURS, SMALL_COLOURS = 160, 96
"""Of the palettes of pictures alone and of those beside others."""
STILL = 8
"""Largest change of a channel, of 255, that is not written again."""


@dataclass
class Jumping(HeadMotion):
    """A head that also jumps twice."""

    age: float = 0.0

    def advance(self, seconds: float) -> None:
        """Advance by `seconds`."""
        super().advance(seconds)
        self.age += seconds

    def matrix(self) -> npt.NDArray[np.float64]:
        """Return head_from_rest (4, 4)."""
        result = super().matrix()
        if 0 < self.age < 2 * HOP_S:
            result[1, 3] += HOP_M * np.sin(np.pi * self.age / HOP_S) ** 2
        return result


def shake(session: Session, frame: int) -> None:
    """Shake the head for 1.6 seconds."""
    if frame == 0:
        perform(session, "shake", {"degrees": 28.0, "hertz": 1.2, "seconds": 1.6})


def nod(session: Session, frame: int) -> None:
    """Nod for 1.6 seconds."""
    if frame == 0:
        perform(session, "shake", {"axis": "pitch", "degrees": 20.0, "hertz": 1.2, "seconds": 1.6})


def jump(session: Session, frame: int) -> None:
    """Jump twice."""
    if frame == 0:
        session.motion = Jumping(session.motion.pivot)


def wind(session: Session, frame: int) -> None:
    """Let wind blow for 1.8 seconds."""
    if frame == 0:
        values = {"on": True, "speed": 5.0, "azimuth": -70.0, "turbulence": 0.6}
        perform(session, "wind", values)
    if frame == round(1.8 / FRAME):
        perform(session, "wind", {"on": False})


Motion = Callable[[Session, int], None]
ALONE: dict[str, tuple[StyleName, str, Motion]] = {
    "shake.gif": ("straight", "rods", shake),
    "wind.gif": ("wavy", "rods", wind),
    "shake_super_helix.gif": ("straight", "super_helix", shake),
    "wind_super_helix.gif": ("wavy", "super_helix", wind),
}
TOGETHER = {f"hair_{motion.__name__}.gif": motion for motion in (shake, jump, nod, wind)}


def main() -> int:
    """Draw what is named, or all."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    every = [*ALONE, *TOGETHER]
    parser.add_argument("names", nargs="*", metavar="FILE", help=", ".join(every))
    parser.add_argument("--hairs", type=int, default=8000, help="strands drawn (default 8000)")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, renderer() as gl:
        for name in args.names or every:
            if name in ALONE:
                frames = recorded(gl, Path(folder), *ALONE[name], LARGE, args.hairs)
                pack(frames, HERE / name, LARGE_COLOURS)
            else:
                frames = side_by_side(gl, Path(folder), TOGETHER[name], args.hairs)
                pack(frames, HERE / name, SMALL_COLOURS)
            print(HERE / name, flush=True)
    return 0


def side_by_side(gl: Renderer, folder: Path, motion: Motion, hairs: int) -> list[Picture]:
    """Return pictures of all hair, a row for each simulator."""
    rows = []
    for simulator in SIMULATORS:
        row = [recorded(gl, folder, style, simulator, motion, SMALL, hairs) for style in STYLES]
        rows.append(np.concatenate(row, axis=2))
    return list(np.concatenate(rows, axis=1))


def recorded(
    gl: Renderer,
    folder: Path,
    style: StyleName,
    simulator: str,
    motion: Motion,
    size: tuple[int, int],
    hairs: int,
) -> list[Picture]:
    """Return every `EVERY`th picture (H, W, 3) of hair in motion."""
    groom = folder / f"{style}.npz"
    if not groom.exists():
        grow(style, default_head(), GUIDES).save(groom)
    session = Session(Manager.loaded(), groom, size=size, simulator=simulator, hairs=hairs)
    preview, frames = Preview(gl, session), []
    perform(session, "layer", {"name": "torso", "on": True})
    perform(session, "orbit", {"right": 15.0})
    for frame in range(round(SECONDS / FRAME)):
        motion(session, frame)
        if frame % EVERY:
            session.advance(FRAME)
        else:
            preview.frame(FRAME, still=True)
            frames.append(preview.picture().copy())
    preview.release()
    return frames


def pack(pictures: list[Picture], target: Path, colours: int) -> None:
    """Write pictures as a GIF with one palette; what hardly changes is not written again.

    A pixel stays as it was shown until a channel is more than `STILL` away from that. GIF keeps
    such pixels from frame to frame at hardly any cost.
    """
    from PIL import Image

    middle = Image.fromarray(pictures[len(pictures) // 3])
    palette = middle.quantize(colours, Image.Quantize.MEDIANCUT)
    # no dithering: it would flicker, and not compress
    packed = [
        Image.fromarray(shown).quantize(palette=palette, dither=Image.Dither.NONE)
        for shown in _steadied(pictures)
    ]
    packed[0].save(
        target,
        save_all=True,
        append_images=packed[1:],
        duration=round(1000 * FRAME * EVERY),
        loop=0,
        optimize=True,
    )


def _steadied(pictures: list[Picture]) -> Iterator[Picture]:
    """Yield pictures (H, W, 3) whose pixels change only where they change by more than `STILL`."""
    shown = pictures[0]
    for picture in pictures:
        change = np.abs(picture.astype(np.int16) - shown).max(axis=2, keepdims=True)
        shown = np.where(change > STILL, picture, shown)
        yield shown


if __name__ == "__main__":
    sys.exit(main())
