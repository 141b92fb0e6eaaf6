"""How hair moves: films of grooms as sheets of pictures, and how soon hair is back at rest.

    python benchmarks/films.py out/curls/groom.npz out/tied/groom.npz -o sheets/

Without files, of grown hair, straight, wavy, curly and short. In seven films of 2.5 s the head
shakes (28 degrees) or nods (25 degrees, 1.5 Hz) or jumps twice by 15 cm, or wind of 6 m/s with
gusts blows from the left, the right, in front or behind, for the first second. The table has one
row for each groom and film:

| column | what |
|---|---|
| away | mm that 95 % of the tips are within of their places at rest, 0.5, 1 and 1.5 s after that |
| rise | mm that 99 % of the guides rise against the head at most, at their highest point |
| over | tips 3 cm above the resting hair, at most at one time |
| eyes | points of guides newly in front of the eyes, at most at one time, and a second after |
| inside | mm that the deepest point lies deeper in head or torso than at rest, every sixth frame |

Where `-o` names a folder, twelve pictures of each film are written there as one.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hairkit.arrays import BoolArray, Float64Array, UInt8Array
from hairkit.grooming.densify import densify
from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.template import default_head
from hairkit.imaging.picture_file import write_picture
from hairkit.manager import Manager
from hairkit.rendering import draw_views
from hairkit.rendering.framing import framing_cameras
from hairkit.rendering.head import bust_solid
from hairkit.simulation import HeadMotion, Surroundings, add_shakes
from hairkit.simulation.posing import pose_frames, pose_groom, pose_torso
from hairkit.synth import StyleName, grow
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands

KINDS: tuple[StyleName, ...] = ("straight", "wavy", "curly", "short")
GUIDES = 400
"""Of grown hair."""
FRAME, MOVING, LENGTH = 1 / 60, 1.0, 2.5
"""Seconds of a frame, of motion or wind, and of a film."""
AFTER = (0.5, 1.0, 1.5)
"""Seconds after the motion at which tips are measured."""
MEASURED = 6
"""Every so manieth frame is measured."""
GUSTS = 0.4
"""Over the wind."""
HOP_M, HOP_S = 0.15, 0.5
SHOWN = (*np.arange(0.125, 1.01, 0.125), 1.15, 1.35, 1.6, 2.0)
"""Seconds at which a sheet shows the film."""
COLUMNS, SIZE = 6, (260, 300)
"""Pictures in a row of a sheet; pixels of one."""
TURN, USUAL = {"front": 65.0}, 20.0
"""Azimuths of the camera, degrees, and where none is named."""
ROOM = 0.05
"""Metres around the captured hair that pictures show."""
ABOVE = 0.03
"""Metres above the resting hair at which a tip stands up."""
EYES = np.array([0.045, 0.02, 0.05])
"""Half the box in front of the eyes, metres."""


@dataclass(frozen=True)
class Film:
    """What happens in the first `MOVING` seconds."""

    shakes: tuple[str, ...] = ()
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hops: bool = False

    def motion(self, groom: Groom) -> HeadMotion:
        """Return the motion of the head."""
        if not self.hops:
            return add_shakes([f"{shake}:{MOVING:g}" for shake in self.shakes], groom.head)
        times = np.arange(0.0, MOVING + 1e-6, FRAME / 4)
        keys = np.tile(np.eye(4), (len(times), 1, 1))
        keys[:, 1, 3] = HOP_M * np.sin(np.pi * times / HOP_S) ** 2
        return HeadMotion(times, keys)


FILMS = {
    "shake": Film(("yaw:28:1.5",)),
    "nod": Film(("pitch:25:1.5",)),
    "jump": Film(hops=True),
    "left": Film(wind=(-6.0, 0.0, 0.0)),
    "right": Film(wind=(6.0, 0.0, 0.0)),
    "front": Film(wind=(0.0, 0.0, -6.0)),
    "behind": Film(wind=(0.0, 0.0, 6.0)),
}


def main() -> int:
    """Print the table, and write the sheets."""
    parser = argparse.ArgumentParser(
        prog="films.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("grooms", nargs="*", type=Path, metavar="GROOM")
    parser.add_argument("-o", "--output", type=Path, help="folder of the sheets")
    parser.add_argument("--films", nargs="*", default=list(FILMS), choices=FILMS)
    parser.add_argument("--using", default="rods", help="simulator plugin (default rods)")
    parser.add_argument("--hairs", type=int, default=6000, help="strands drawn (default 6000)")
    args = parser.parse_args()
    print("| groom | film | away, mm | rise, mm | over | eyes | inside, mm |")
    print("|---|---|---|---|---|---|---|")
    for kind, groom in read(args.grooms):
        hair = None if args.output is None else densify(groom, args.hairs, 0)
        for name in args.films:
            cache, row = filmed(groom, FILMS[name], args.using)
            print(f"| {kind} | {name} | {row} |", flush=True)
            if hair is not None:
                args.output.mkdir(parents=True, exist_ok=True)
                picture = sheet(groom, hair, cache, TURN.get(name, USUAL))
                write_picture(args.output / f"{kind}_{name}.png", picture)
    return 0


def read(paths: Sequence[Path]) -> Iterator[tuple[str, Groom]]:
    """Yield grooms with the names of their folders, or grown ones with those of their kinds."""
    for path in paths:
        yield path.parent.name, Groom.load(path)
    for kind in () if paths else KINDS:
        yield kind, grow(kind, default_head(), GUIDES)


def filmed(groom: Groom, film: Film, using: str) -> tuple[PointCache, str]:
    """Return the frames of a film and its cells of the table."""
    guides = groom.select(guide_mask(groom.strands))
    simulator = Manager.loaded().call("make_simulator", using, groom=guides)
    motion, points, depth = film.motion(groom), [], 0.0
    times = np.arange(0.0, LENGTH + 1e-6, FRAME)
    heads = np.stack([motion(float(at)) for at in times])
    simulator.reset(heads[0])
    for frame, head in enumerate(heads):
        wind = np.array(film.wind) * (times[frame] <= MOVING)
        if frame:
            simulator.advance(FRAME, Surroundings(head, wind, GUSTS))
        points.append(simulator.points)
        depth = depth if frame % MEASURED else max(depth, simulator.measure().depth)
    cache = PointCache(np.array(points), times, heads)
    return cache, f"{measured(guides, cache)} | {1000 * depth:.1f}"


def measured(guides: Groom, cache: PointCache) -> str:
    """Return how far tips are away after the motion, and what stands up or covers the eyes."""
    heads, tips = cache.head_from_rest, guides.strands.offsets[1:] - 1
    own = np.einsum("tpi,tij->tpj", cache.points - heads[:, None, :3, 3], heads[:, :3, :3])
    away = np.linalg.norm(own[:, tips] - own[0, tips], axis=2)
    settled = [round((MOVING + after) / FRAME) for after in AFTER]
    cells = " ".join(f"{1000 * np.percentile(away[k], 95):.0f}" for k in settled)
    risen = (own[..., 1] - own[0, :, 1]).max(axis=0)
    rise = np.percentile(np.maximum.reduceat(risen, guides.strands.offsets[:-1]), 99)
    high = (own[:, tips, 1] > own[0, :, 1].max() + ABOVE).sum(axis=1)
    covered = before_eyes(guides, own).sum(axis=1)
    over = f"{high.max()} | {covered.max()} {covered[settled[1]]}"
    return f"{cells} | {1000 * rise:.0f} | {over}"


def before_eyes(guides: Groom, own: Float64Array) -> BoolArray:
    """Return which points (T, P, 3) of guides, head axes, are newly in front of the eyes."""
    vertices = guides.head.vertices
    middle = vertices[np.abs(vertices[:, 0]) < 0.01]
    centre = np.array([0.0, 0.01, middle[:, 2].max() - 0.01])
    near = (np.abs(own - centre) < EYES).all(axis=2)
    result: BoolArray = near & ~near[:1]
    return result


def sheet(groom: Groom, hair: Strands, cache: PointCache, turn: float) -> UInt8Array:
    """Return pictures of the film at the times `SHOWN`, in rows."""
    cloud = np.concatenate([hair.points - ROOM, hair.points + ROOM])
    camera, pictures = framing_cameras(cloud, [(turn, 5.0)], *SIZE), []
    at = np.rint(np.array(SHOWN) / FRAME).astype(int)
    shown = PointCache(cache.points[at], cache.times[at], cache.head_from_rest[at])
    for frame, points in enumerate(pose_frames(groom, hair, shown)):
        posed = pose_groom(groom, shown, frame)
        below = bust_solid(groom.head, hair, pose_torso(groom, shown, frame))
        pictures += draw_views(
            replace(hair, points=points),
            posed.head,
            camera,
            material=groom.material,
            solids=[] if below is None else [below],
            supersample=2,
        )
    rows = [pictures[first : first + COLUMNS] for first in range(0, len(pictures), COLUMNS)]
    return np.concatenate([np.concatenate(row, axis=1) for row in rows])


if __name__ == "__main__":
    raise SystemExit(main())
