"""How hair of persons comes out who are unlike the default head and the styles of `hairkit synth`.

    python benchmarks/persons.py fringe:1 layered:2 messy:3 coily:4 bun:8 blunt:5:main side:9:far

A person is a kind of hair and a seed, which chooses the head's breadth, height and depth, the skin,
the colour of the hair, the clothes, the room and the lights. With `:main` a phone's main lens takes
the photos, in which the head is small; with `:far` it is 2 m away, and with `:below` as low as the
waist, too. Eight photos of an uneven turn are reconstructed with nothing else given, and scored
against the true strands: F in per cent, length over the true one, mean error of the cameras'
azimuth, health lights and processor seconds.
"""

from __future__ import annotations

import argparse
import re
import tempfile
from dataclasses import replace
from pathlib import Path
from unittest import mock

import cv2
import numpy as np
from video import (
    BELOW,
    COLUMNS,
    CROPPED,
    FAR,
    GUIDES,
    MAIN_LENS,
    STRANDS,
    Film,
    Lens,
    drifting_cameras,
    format_row,
    photo_numbers,
)

from hairkit.arrays import BoolArray, Float64Array
from hairkit.head_model.template import default_head
from hairkit.rendering.picture import draw_views
from hairkit.synth import STYLES, Style, StyleName, grow
from hairkit.synth.growth import cut_strands
from hairkit.synth.photographs import Shoot, cluttered_room
from hairkit.types.groom import Groom
from hairkit.types.head import Head
from hairkit.types.skin import Texture
from hairkit.types.strands import Strands


def _like(style: StyleName, **changes: float | None) -> Style:
    return replace(STYLES[style], **changes)  # type: ignore[arg-type]


KINDS = {
    "fringe": _like("straight", length=0.36, parting=None, cut=-0.17),
    "layered": _like(
        "wavy", length=0.30, length_spread=0.35, wave_radius=0.004, wave_pitch=0.09, frizz=0.003,
        clumps=250,
    ),
    "messy": _like(
        "short", length=0.11, points=48, lift=0.6, bend=0.06, layer=0.012, clumps=140,
        clumping=0.7, frizz=0.004, wave_radius=0.004, wave_pitch=0.06, coil=0.3, length_spread=0.25,
    ),
    "coily": _like(
        "curly", length=0.15, points=360, parting=None, lift=1.5, bend=0.5, layer=0.02, cut=None,
        wave_radius=0.0036, wave_pitch=0.0095, clumps=1500, clumping=0.4, frizz=0.002,
    ),
    "blunt": _like("straight", length=0.30, cut=-0.16, parting=0.025, frizz=0.0006),
    "waist": _like("straight", length=0.55, points=110, cut=-0.45, parting=0.0),
    "crop": _like("short", length=0.012, points=16),
    "bun": _like("tied", tail=0.06),
    "undercut": _like(
        "short", length=0.08, points=48, lift=0.5, bend=0.06, layer=0.015, clumps=140, clumping=0.7,
        frizz=0.002, length_spread=0.15,
    ),
    "side": _like("parted", length=0.14, points=48, cut=None, parting=0.04),
}  # fmt: skip
COLOURS = (
    (0.012, 0.009, 0.008), (0.03, 0.02, 0.014), (0.09, 0.05, 0.028), (0.30, 0.19, 0.10),
    (0.45, 0.33, 0.2), (0.16, 0.05, 0.02), (0.35, 0.34, 0.33),
)  # fmt: skip
"""Linear RGB of the hair."""
TONES = (1.0, 1.0, 0.8, 0.55, 0.35)
"""Brightness of the skin over that of the default head."""
SIZES = np.array([0.06, 0.04, 0.05])
"""Greatest deviations of the head's breadth, height and depth."""
FACE = np.array([0.075, 0.03])
"""Half the width of the face, and how far before the head's origin it begins; a fringe is there."""
BROWS, FRINGE_SPREAD = -0.012, 0.004
"""Height where a fringe ends, and its standard deviation, metres."""
SIDES, TOP, SHAVED = 0.02, 0.05, 0.2
"""Heights in metres of roots up to which an undercut's hair is short, and from which it is long,
and the share of the length that short hair has."""
LENSES = {"main": MAIN_LENS, "far": FAR, "below": BELOW}
PERSON = re.compile(f"({'|'.join(KINDS)}):([0-9]+)(?::({'|'.join(LENSES)}))?")


def main() -> None:
    """Print a row for each person, and the mean."""
    parser = argparse.ArgumentParser(prog="persons.py", description=__doc__.splitlines()[0])
    parser.add_argument(
        "persons", nargs="+", type=_person, metavar="KIND:SEED[:LENS]", help=", ".join(KINDS)
    )
    args = parser.parse_args()
    print(f"| person | {' | '.join(COLUMNS)} |")
    print("|---|" + "---|" * len(COLUMNS))
    rows = []
    for person in args.persons:
        kind, seed, lens = person.groups()
        with tempfile.TemporaryDirectory() as made:
            film = photograph(kind, int(seed), Path(made), LENSES[lens] if lens else CROPPED)
            rows.append(film.figures("8 photos", GUIDES))
        print(format_row(person[0], rows[-1]), flush=True)
    print(format_row("mean", np.mean(rows, axis=0).tolist()))


def _person(text: str) -> re.Match[str]:
    """Return kind, seed and lens of a person."""
    if read := PERSON.fullmatch(text):
        return read
    raise argparse.ArgumentTypeError(f"{text!r}: expected KIND:SEED, or KIND:SEED:LENS")


def photograph(kind: str, seed: int, folder: Path, lens: Lens) -> Film:
    """Write eight photos of a person into a folder."""
    generator = np.random.default_rng([seed, 99])
    colour = COLOURS[generator.integers(len(COLOURS))]
    head = _some_head(generator)
    look = replace(KINDS[kind], colour=colour)
    with mock.patch.dict(STYLES, {"straight": look}):
        groom = grow("straight", head, STRANDS, seed)
    if kind == "fringe":
        groom = _with_fringe(groom, look.points, generator)
    if kind == "undercut":
        groom = _with_shaved_sides(groom, look.points)
    cameras, shot = drifting_cameras(generator, lens), Shoot.prepare(groom, generator)
    room = cluttered_room(cameras[0], generator)
    some = [cameras[k] for k in photo_numbers()]
    still = {"lights": shot.lights, "backgrounds": [room] * len(some), "solids": [shot.torso]}
    (folder / "photos").mkdir()
    for number, picture in zip(
        photo_numbers(), draw_views(groom, None, some, **still), strict=True
    ):
        name = str(folder / "photos" / f"IMG_{number:04d}.jpg")
        cv2.imwrite(name, np.ascontiguousarray(picture[..., ::-1]))
    return Film(groom, folder, cameras)


def _some_head(generator: np.random.Generator) -> Head:
    """Return the default head with other proportions and another skin."""
    head, scale = default_head(), 1 + SIZES * generator.uniform(-1, 1, 3)
    tone = TONES[generator.integers(len(TONES))]
    warm = tone * np.array([1, 1 - 0.15 * (1 - tone), 1 - 0.3 * (1 - tone)])
    assert head.maps is not None
    assert head.joints is not None
    skin = (head.maps.albedo.pixels * warm).clip(0, 255).astype(np.uint8)
    return replace(
        head,
        vertices=(head.vertices * scale).astype(np.float32),
        joints=(head.joints * scale).astype(np.float32),
        maps=replace(head.maps, albedo=Texture.encode(skin, lossless=False)),
    )


def _with_fringe(groom: Groom, points: int, generator: np.random.Generator) -> Groom:
    """Return the groom with strands before the face cut off above the eyes."""
    paths = groom.strands.points.reshape(-1, points, 3).astype(np.float64)
    line = BROWS + FRINGE_SPREAD * generator.standard_normal(len(paths))
    before = (np.abs(paths[..., 0]) < FACE[0]) & (paths[..., 2] > FACE[1])
    return _cut(groom, paths, before & (paths[..., 1] < line[:, None]))


def _with_shaved_sides(groom: Groom, points: int) -> Groom:
    """Return the groom with strands that are the shorter, the lower their roots are."""
    paths = groom.strands.points.reshape(-1, points, 3).astype(np.float64)
    kept = np.interp(paths[:, 0, 1], [SIDES, TOP], [SHAVED, 1])
    return _cut(groom, paths, np.linspace(0, 1, points) > kept[:, None])


def _cut(groom: Groom, paths: Float64Array, beyond: BoolArray) -> Groom:
    """Return the groom with paths (N, points, 3) that end where they are `beyond` (N, points)."""
    strands = groom.strands
    flat = cut_strands(paths, beyond, 4).reshape(-1, 3).astype(np.float32)
    return replace(groom, strands=Strands(flat, strands.offsets, root_uv=strands.root_uv))


if __name__ == "__main__":
    main()
