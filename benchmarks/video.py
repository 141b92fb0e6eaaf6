"""What a film of a turn gives, beside eight photos of the same turn.

    python benchmarks/video.py --styles short wavy curly

Each style of `hairkit synth` is filmed while it turns unevenly in front of a still room: 120 frames
of a hand-held camera whose direction, height, roll, distance and aim drift (sums of slow waves).
Eight frames at even steps of the film are the photos, JPEG. Both are reconstructed with nothing
else given, and scored against the true strands: F in per cent, lengths over the true ones, mean
error of the cameras' azimuth, health lights and processor seconds.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from hairkit.arrays import Float64Array
from hairkit.evaluation import Prediction, read_prediction, strand_scores
from hairkit.evaluation.align import align, alignment_points, camera_errors
from hairkit.evaluation.prediction import SCENE
from hairkit.head_model.template import default_head
from hairkit.pipeline.recipe import load_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.run_record import RECORD
from hairkit.rendering.picture import draw_views
from hairkit.stages import EXPORT
from hairkit.synth import STYLES, grow
from hairkit.synth.photographs import Shoot, cluttered_room
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom

GUIDES, STRANDS = 8000, 10_000
FRAMES, RATE = 120, 6.0
"""Of a film of 20 seconds; what lies between these frames of a phone's film is left out."""


class Lens(NamedTuple):
    """What a camera sees of a person."""

    size: tuple[int, int]
    focal: float
    """Pixels."""
    distance: float
    """Metres."""
    aim: float
    """Height at which it aims, metres."""
    tilt: float = 3.0
    """Mean elevation, degrees."""


CROPPED = Lens((810, 1440), 1417.5, 0.756, -0.10)
MAIN_LENS = Lens((1512, 2016), 1451.52, 0.8, -0.16)
"""Of a phone: 26 mm equivalent."""
FAR = Lens((1512, 2016), 2903.04, 2.0, -0.16)
"""The same at twice the zoom, from where a whole person fits into the picture without it."""
BELOW = FAR._replace(tilt=-12.0)
"""From there, held at the height of the waist."""
UNEVEN, TILT, ROLL, NEARER, ASIDE = 8.0, 5.0, 3.0, 0.08, 0.03
"""Greatest drifts: degrees of azimuth, elevation and roll, share of the distance, metres."""
COLUMNS = ("4/40", "3/30", "2/20", "length", "azimuth off", "red", "amber", "processor s")


def main() -> None:
    """Print two rows for each style, and the means."""
    parser = argparse.ArgumentParser(prog="video.py", description=__doc__.splitlines()[0])
    parser.add_argument("--styles", nargs="+", choices=list(STYLES), default=["short", "wavy"])
    parser.add_argument("--seed", type=int, default=5, help="of hair, room and camera (5)")
    args = parser.parse_args()
    print(f"| hair | from | {' | '.join(COLUMNS)} |")
    print("|---|---|" + "---|" * len(COLUMNS))
    rows: dict[str, list[list[float]]] = {"8 photos": [], "film": []}
    for style in args.styles:
        with tempfile.TemporaryDirectory() as made:
            film = shoot(grow(style, default_head(), STRANDS, args.seed), Path(made), args.seed)
            for source, figures in rows.items():
                figures.append(film.figures(source, GUIDES))
                print(format_row(f"{style} | {source}", figures[-1]), flush=True)
    for source, figures in rows.items():
        print(format_row(f"mean | {source}", np.mean(figures, axis=0).tolist()))


def format_row(name: str, figures: Sequence[float]) -> str:
    """Return a row of the table."""
    shown = [f"{value:.2f}" if k == 3 else f"{value:.1f}" for k, value in enumerate(figures)]
    return f"| {name} | {' | '.join(shown)} |"


@dataclass(frozen=True, eq=False)
class Film:
    """A film of a groom, photos taken from it, and the cameras of its frames."""

    groom: Groom
    folder: Path
    cameras: list[Camera]

    def figures(self, source: str, guides: int) -> list[float]:
        """Reconstruct a source and return its row."""
        photos = self.folder / ("film.mp4" if source == "film" else "photos")
        recipe = load_recipe("default")
        stages = tuple(stage for stage in recipe.stages if stage.table != EXPORT.table)
        out, began = self.folder / source, _processor_seconds()
        options = {"guides": guides, "sheet": False, "keep_work": False}
        reconstruct(photos, out, replace(recipe, stages=stages), **options)
        seconds = _processor_seconds() - began
        lights = [each["light"] for each in json.loads((out / RECORD).read_text())["health"]]
        counts = lights.count("red"), lights.count("amber")
        shown = [view["photo"] for view in json.loads((out / SCENE).read_text())["views"]]
        numbers = [int(re.findall(r"\d+", photo)[-1]) for photo in shown]  # in the turn's order
        return [*self._scores(read_prediction(out), numbers), *counts, seconds]

    def _scores(self, found: Prediction, numbers: list[int]) -> list[float]:
        """Return F at three distances, the length's ratio and the azimuth's error."""
        strands, true = found.groom.strands, [self.cameras[number] for number in numbers]
        points = alignment_points(strands, found.groom.head.vertices)
        similarity = align(found.cameras, true, points)
        strands = similarity.moved_strands(strands)
        scores = strand_scores(strands, self.groom.strands).all
        errors = camera_errors(found.names, found.cameras, true, similarity, points)
        azimuth = float(np.mean([abs(each.azimuth_deg) for each in errors]))
        length = strands.lengths().mean() / self.groom.strands.lengths().mean()
        return [*(100 * score.f for score in reversed(scores)), float(length), azimuth]


def photo_numbers() -> list[int]:
    """Return the frames of the photos."""
    return [round(k * FRAMES / 8) for k in range(8)]


def shoot(groom: Groom, folder: Path, seed: int) -> Film:
    """Write `film.mp4` and `photos/` of a groom into a folder."""
    generator = np.random.default_rng(seed)
    cameras, shot = drifting_cameras(generator), Shoot.prepare(groom, generator)
    room = cluttered_room(cameras[0], generator)
    (folder / "photos").mkdir()
    code = cv2.VideoWriter.fourcc(*"mp4v")
    film = cv2.VideoWriter(str(folder / "film.mp4"), code, RATE, CROPPED.size)
    for first in range(0, FRAMES, 10):
        some = cameras[first : first + 10]
        still = {"lights": shot.lights, "backgrounds": [room] * len(some), "solids": [shot.torso]}
        pictures = draw_views(groom, None, some, **still)
        for number, picture in enumerate(pictures, first):
            frame = np.ascontiguousarray(picture[..., ::-1])
            film.write(frame)
            if number in photo_numbers():
                cv2.imwrite(str(folder / "photos" / f"IMG_{number:04d}.jpg"), frame)
    film.release()
    return Film(groom, folder, cameras)


def drifting_cameras(generator: np.random.Generator, lens: Lens | None = None) -> list[Camera]:
    """Return the cameras of all frames."""
    lens = lens or CROPPED

    def drift(most: float) -> Float64Array:
        waves = np.arange(1, 4)
        angle = 2 * np.pi * waves * np.arange(FRAMES)[:, None] / FRAMES
        shape = (generator.standard_normal(3) * np.cos(angle) / waves).sum(axis=1)
        shape += (generator.standard_normal(3) * np.sin(angle) / waves).sum(axis=1)
        return np.asarray(most * shape / np.abs(shape).max())

    way = generator.choice([-1, 1])
    azimuth = way * (np.linspace(0, 360, FRAMES, endpoint=False) + drift(UNEVEN))
    azimuth = azimuth + generator.uniform(-30, 30)
    tilt, roll, nearer, aside = drift(TILT) + lens.tilt, drift(ROLL), drift(NEARER), drift(ASIDE)
    return [
        Camera.on_turn(
            azimuth[k],
            elevation_deg=tilt[k],
            roll_deg=roll[k],
            distance=lens.distance * (1 + nearer[k]),
            target=(aside[k], lens.aim, 0.0),
            focal=lens.focal,
            width=lens.size[0],
            height=lens.size[1],
        )
        for k in range(FRAMES)
    ]


def _processor_seconds() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


if __name__ == "__main__":
    main()
