"""Print the health figures of captures as they are and of the same captures spoiled.

python benchmarks/health.py captures/ -o out/ > figures.md

The thresholds of `hairkit.pipeline.health` are chosen from this table, `docs/health_figures.md`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import spoiled
from captures_argument import NO_CAPTURES, add_captures
from spoiled import GROOMS, RUNS, Files, curled

from hairkit.errors import HairkitError
from hairkit.io.capture_reader import read_capture
from hairkit.manager import Manager
from hairkit.pipeline.drawn_hair import PhotoHair
from hairkit.pipeline.figure import AMBER, GREEN, RED, Figure
from hairkit.pipeline.find_views import frame_photos
from hairkit.pipeline.health import assess_drawing
from hairkit.pipeline.recipe import Recipe, load_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.run_record import RECORD, read_record
from hairkit.pipeline.work_folder import WORK, LastRun
from hairkit.progress import Silent
from hairkit.stages import FRAMED, TURN, WAVES
from hairkit.types.groom import Groom

GUIDES = 600
COLUMNS = {
    "margin over the next best": "margin",
    "landmarks off by": "landmarks, mm",
    "outlines off by": "outlines, mm",
    "hair that all views agree on, worst view": "views agree",
    "overlap with the masks": "hull",
    "face called hair": "face",
    "directions as photographed": "directions",
    "direction of curly hair": "curly",
    "drawn where no photo has hair": "astray",
    "hair left bare": "bare",
}
"""Headings of the figures that have a column; others are named where they are not green."""
DRAWN = [*COLUMNS][-4:]
"""Figures of the guides that are drawn."""
ALONE = "photos alone"
GOOD = (ALONE, "with masks")


@dataclass(frozen=True)
class Bench:
    """Runs of all captures, spoiled in all ways."""

    folders: list[Path]
    out: Path
    manager: Manager
    recipe: Recipe
    guides: int
    done: set[Path] = field(default_factory=set)

    def figures(self, way: str, index: int) -> Sequence[Figure]:
        """Return the figures of a capture spoiled in a way; none where nothing can be."""
        groom = Groom.load(self.run(ALONE, index) / "groom.npz")
        curly = groom.material.curl_radius > 0
        if way in GROOMS:
            spoiled_groom = GROOMS[way](groom)
            return () if curly and GROOMS[way] is curled else self._redrawn(index, spoiled_groom)
        if RUNS[way].curly and not curly:
            return ()
        return read_record(self.run(way, index) / RECORD).health

    def told(self, way: str, index: int) -> bool:
        """Return whether a figure is worse than those of the same run with nothing spoiled."""
        good = ALONE if way in GROOMS or "turn=none" not in RUNS[way].settings else "with masks"
        had, has = (
            {(f.name, f.light) for f in self.figures(each, index) if f.light != GREEN}
            for each in (good, way)
        )
        return bool(has - had)

    def run(self, way: str, index: int) -> Path:
        """Reconstruct a capture, once, and return the folder of the results."""
        folder = self.out / way.replace(" ", "_") / self.folders[index].name
        if folder not in self.done:
            files = (self._files(way, k % len(self.folders)) for k in (index, index + 1))
            capture = RUNS[way].spoil(*files, folder / "capture")
            recipe = self.recipe.with_set(["export=none", *RUNS[way].settings])
            reconstruct(
                capture, folder / "out", recipe, self.manager,
                guides=self.guides, sheet=False, progress=Silent(),
            )  # fmt: skip
            self.done.add(folder)
        return folder / "out"

    def _files(self, way: str, index: int) -> Files:
        """Return the files of a capture, in the order of the turn where that is not looked for."""
        files = Files.of(self.folders[index])
        if "turn=none" not in RUNS[way].settings:
            return files
        return files.picked(LastRun(self.run(ALONE, index) / WORK).latest(TURN).order.tolist())

    def _redrawn(self, index: int, groom: Groom) -> tuple[Figure, ...]:
        """Return the figures of a run with photos alone after its guides were exchanged."""
        out = self.run(ALONE, index)
        last = LastRun(out / WORK)
        capture = frame_photos(read_capture(out.parent / "capture"), last.latest(FRAMED))
        capture, scene = capture.arranged(last.latest(TURN)), last.latest(last.scene)
        masks = last.masks(scene.names)
        assert masks is not None
        shown = [PhotoHair.of(v.image, mask) for v, mask in zip(capture.views, masks, strict=True)]
        drawn = assess_drawing(shown, scene, groom, last.latest(WAVES).slant)
        old = read_record(out / RECORD).health
        return (*(f for f in old if f.name not in DRAWN), *drawn)


def row(name: str, figures: Sequence[Figure]) -> str:
    """Return a row of the table: values with their lights where they are not green."""
    known = {figure.name: _cell(figure) for figure in figures}
    rest = [f for f in figures if f.name not in COLUMNS and f.light != GREEN]
    others = "; ".join(f"{f.stage}: {f.name} {_cell(f)}" for f in rest)
    return f"| {name} | {' | '.join(known.get(c, '') for c in COLUMNS)} | {others} |"


def _cell(figure: Figure) -> str:
    light = {GREEN: "", AMBER: " amber", RED: " **red**"}[figure.light]
    return f"{figure.value:.{figure.digits}f}{light}"


def main() -> None:
    """Reconstruct every capture as it is and spoiled in every way, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("-o", "--out", type=Path, default=Path("health-out"))
    parser.add_argument("--ways", nargs="+", choices=[*RUNS, *GROOMS], default=[*RUNS, *GROOMS])
    parser.add_argument("--recipe", default="default")
    parser.add_argument("--plugin", action="append", default=[], metavar="FILE")
    parser.add_argument("--guides", type=int, default=GUIDES)
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    manager = Manager.loaded(arguments.plugin)
    manager.register(spoiled, "nonsense")
    folders = sorted(path.parent for path in arguments.captures.glob("*/masks"))
    recipe = load_recipe(arguments.recipe)
    bench = Bench(folders, arguments.out, manager, recipe, arguments.guides)
    silent = [name for way in arguments.ways for name in print_way(bench, way)]
    print(f"\nSpoiled, and no light is worse: {', '.join(silent) or 'none'}.")


def print_way(bench: Bench, way: str) -> list[str]:
    """Print the table of a way, and return the captures that are spoiled and do not show it."""
    print(
        f"\n### {way[0].upper()}{way[1:]}\n\n| capture | {' | '.join(COLUMNS.values())} | others |"
    )
    print(f"|---|{'---|' * len(COLUMNS)}---|")
    silent = []
    for index, folder in enumerate(bench.folders):
        try:
            figures = bench.figures(way, index)
        except HairkitError as error:
            print(f"| {folder.name} | {'| ' * len(COLUMNS)}| refused: {error} |", flush=True)
            continue
        if figures:
            print(row(folder.name, figures), flush=True)
            if way not in GOOD and not bench.told(way, index):
                silent.append(f"{folder.name} {way}")
    return silent


if __name__ == "__main__":
    main()
