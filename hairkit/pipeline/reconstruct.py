"""Reconstruct a groom from photos: run the stages of a recipe in order."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hairkit.cameras.similarity import move_head
from hairkit.compilation import announce_compilation
from hairkit.errors import InputError, RenderError
from hairkit.field.find_parting import measure_parting
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.field.ties import measure_ties
from hairkit.grooming.assemble import assemble_groom
from hairkit.head_model.hairline import measure_hairline
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.imaging.waves import measure_waves
from hairkit.io.head_reader import HeadFile
from hairkit.manager import Manager
from hairkit.memory import give_back_memory
from hairkit.parallel import one_blas_thread, thread_count
from hairkit.pipeline.find_skin import find_skin
from hairkit.pipeline.find_views import find_views
from hairkit.pipeline.health import RED, Figure, assess
from hairkit.pipeline.masks_and_scene import fit_scene, label_views
from hairkit.pipeline.own_head import mark_head
from hairkit.pipeline.recipe import Recipe, load_recipe, missing_networks
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.run_record import RECORD, RunRecord, describe_run, finish_record
from hairkit.pipeline.single_photo import given_photo
from hairkit.pipeline.stage_runner import Given, StageRunner
from hairkit.pipeline.take_capture import take_capture
from hairkit.pipeline.work_folder import WORK, WorkFolder, drop_work
from hairkit.progress import Progress, Silent
from hairkit.types.capture import Capture
from hairkit.types.chosen import ChosenHair
from hairkit.types.groom import Groom
from hairkit.types.hairline import Hairline
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import Hull, OrientationField, ScalpDistance
from hairkit.types.waves import Waves

MAX_GUIDES = 100_000
SHEET = "contact_sheet.png"
THINNED = 320
"""Least width of an orientation map that is kept for the contact sheet: two pixels a pixel."""
"""Name of the picture that shows the result of every stage."""
_log = logging.getLogger("hairkit")


@one_blas_thread()
def reconstruct(
    photos: Capture | str | os.PathLike[str],
    out: str | os.PathLike[str],
    recipe: Recipe | str | os.PathLike[str] = "default",
    manager: Manager | None = None,
    *,
    head: Head | HeadFile | str | os.PathLike[str] | None = None,
    guides: int = 600,
    seed: int = 0,
    progress: Progress | None = None,
    reuse: bool = True,
    sheet: bool = True,
    keep_work: bool = True,
) -> Groom:
    """Run a recipe on photos and return the groom: `reconstruct("photos/", "out/")`.

    Parameters
    ----------
    photos
        The folder of a capture, or what else the recipe's stage `capture` takes; or a capture that
        was read before.
    out
        Folder for `groom.npz`, `scene.json`, the recipe's exports, `contact_sheet.png`,
        `run.json` and `hairkit.log`; its `work/` keeps the results of stages, so that unchanged
        stages are not run again.
    recipe
        Which plugin does each stage: a shipped recipe's name or a `.toml` file, to which the
        options of the capture are added; or a recipe, which is run as it is.
    manager
        The plugins; the installed ones when None.
    head
        The head to fit, or a file of it (OBJ, PLY, GLB in metres, y up; `HeadFile` for others);
        None for the default head.
    guides
        Number of roots, each of which grows a strand.
    seed
        Seed of the root positions.
    progress
        Receives the progress of the run; None reports nothing.
    reuse
        False runs every stage again.
    sheet
        Draw the contact sheet; where there is no OpenGL one line of progress says so.
    keep_work
        False empties `work/` at the end. Groom, exports and `run.json` do not need it; the viewer's
        layers, scores of masks and a faster second run do.

    Raises
    ------
    HairkitError
        The recipe, the photos or a plugin is at fault; the message is one line.
    OSError
        A file cannot be written. Files are written whole or not at all.
    """
    manager = manager or Manager.loaded()
    if not 1 <= guides <= MAX_GUIDES:
        raise InputError(f"{guides} guides, expected 1 to {MAX_GUIDES}")
    chosen = recipe if isinstance(recipe, Recipe) else load_recipe(recipe)
    chosen.check(manager)
    given = photos if isinstance(photos, Capture) else take_capture(photos, chosen, manager)
    if not isinstance(recipe, Recipe):
        chosen = chosen.with_set(given.chosen.settings)
        chosen.check(manager)
    head = HeadFile(os.fspath(head)) if isinstance(head, (str, os.PathLike)) else head
    record = describe_run(given, head, chosen, manager, guides, seed)
    log = RunLog(progress or Silent())
    groom, health = _run(record, given, Path(out), head, chosen, manager, log, reuse, sheet)
    if not keep_work:
        drop_work(out)
    if progress is None:
        for figure in health:
            if figure.light == RED:
                _log.warning("%s", figure.line())
    return groom


def _run(
    record: RunRecord,
    given: Capture,
    folder: Path,
    head: Head | HeadFile | None,
    recipe: Recipe,
    manager: Manager,
    log: RunLog,
    reuse: bool,
    sheet: bool,
) -> tuple[Groom, tuple[Figure, ...]]:
    """Run the stages in the work folder and write all files; the record comes last."""
    busy = f"{folder}: another run is working here; waiting for it to end"
    work = WorkFolder(folder / WORK, reuse=reuse, waiting=lambda: log.message(busy))
    with (
        work,
        announce_compilation(log.message),
        ThreadPoolExecutor(thread_count(), thread_name_prefix="hairkit") as pool,
    ):
        run = StageRunner(recipe, manager, work, log, pool)
        _sweep(folder, run)
        tell_missing(recipe, manager, log)
        try:
            loaded = run.beside(_head, head)  # while networks look at the photos
            capture, turn = find_views(run, given, log)
            marked = mark_head(loaded.result(), recipe, manager, log.message)
            made = _grow(run, capture, marked, record.guides, record.seed, turn)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        work.flush()
        give_back_memory()
        exports = export_paths(folder, recipe, manager)
        for name in (RECORD, SHEET):
            (folder / name).unlink(missing_ok=True)
        written = run.beside(_write, folder, run, capture, made, exports)
        if sheet:
            _draw_sheet(folder / SHEET, capture, made, log)
        written.result()
        manager.notify("groom_ready", groom=made.groom)
        log.message(made.parting.summary)
        for figure in made.health:
            log.message(figure.line())
        log.write(folder / "hairkit.log", recipe, manager)
        outputs = [folder / "groom.npz", folder / "scene.json", *(path for _, path in exports)]
        whole = finish_record(record, [*outputs, folder / SHEET], log.stages, made.health)
        whole.write(folder / RECORD)
    return made.groom, made.health


def tell_missing(recipe: Recipe, manager: Manager, log: RunLog) -> None:
    """Say in one line which plugins work without their networks."""
    missing = missing_networks(recipe, manager)
    if missing:
        plugins = " and ".join(missing)
        log.message(f"no networks for {plugins}, results are worse; hairkit models install")


def _head(head: Head | HeadFile | None) -> Head:
    if head is None:
        return default_head()
    return head if isinstance(head, Head) else head.read()


@dataclass(frozen=True, eq=False)
class _Made:
    """Results of the stages of one run."""

    masks: tuple[Mask, ...]
    orientations: tuple[OrientationMap, ...]
    """Thinned, for the contact sheet."""
    hull: Hull
    scene: Scene
    parting: Parting
    groom: Groom
    health: tuple[Figure, ...]


def export_paths(
    out: str | os.PathLike[str], recipe: Recipe, manager: Manager
) -> tuple[tuple[str, Path], ...]:
    """Return plugin and path of every file that the recipe exports into a folder."""
    stage = recipe.stage("export")
    names = [choice.plugin for choice in stage.choices] if stage is not None else []
    suffixes = [(manager.info(name).suffixes or (f".{name}",))[0] for name in names]
    return tuple(
        (name, Path(out) / f"groom{suffix}") for name, suffix in zip(names, suffixes, strict=True)
    )


def _grow(
    run: StageRunner,
    capture: Capture,
    head: Head,
    guides: int,
    seed: int,
    turn: Turnaround | None,
) -> _Made:
    """Run the stages; views are processed in parallel, later stages wait for them."""
    plain = capture.plain()
    photos = Given.of(plain)
    masks, first = label_views(run, photos, head)
    toned = [given_photo(view.toned()) for view in capture.views]
    orientations = run.every_view("orient", OrientationMap, toned, mask=masks)
    scene = fit_scene(run, photos, masks, head, first)
    if capture.chosen.head is not None:
        scene = Given.of(move_head(scene.value, capture.chosen.head))
    skin = run.beside(find_skin, run, photos, masks, scene)  # strands need none of it
    hull = run.once("hull", Hull, scene=scene, masks=masks)
    seen = _measure(run, photos, masks, orientations, scene, hull, capture.chosen.hair)
    field = run.once("field", OrientationField, **seen)
    waves, distance = seen["waves"].value, seen["scalp_distance"].value
    parting, tied = seen["parting"].value, seen["tied"].value
    hairline = run.derive("hairline", Hairline, measure_hairline, scene=scene, masks=masks)
    grown = replace(scene.value.head, density=hairline.value.density, torso=hull.value.torso)
    roots = Given.of(sample_roots(grown, guides, seed, rest=head))
    strands = run.once("track", Strands, **seen, field=field, roots=roots)
    grown = replace(grown, maps=skin.result())
    labels = tuple(mask.result().value for mask in masks)
    angles = tuple(_thinned(orientation.result().value) for orientation in orientations)
    groom = assemble_groom(
        capture.views, labels, grown, roots.value, strands.value, waves, tied, capture.chosen.hair
    )
    health = assess(
        capture, labels, scene.value, hull.value, groom, guides, distance.hair_length, turn,
        parting, tied,
    )  # fmt: skip
    return _Made(labels, angles, hull.value, scene.value, parting, groom, health)


def _thinned(map_: OrientationMap) -> OrientationMap:
    """Return every n-th pixel of a map, so that at least `THINNED` columns are left."""
    every = max(map_.angle.shape[1] // THINNED, 1)
    return OrientationMap(map_.angle[::every, ::every], map_.confidence[::every, ::every])


def _measure(
    run: StageRunner,
    photos: Given[Capture],
    masks: Sequence[Future[Given[Mask]]],
    orientations: Sequence[Future[Given[OrientationMap]]],
    scene: Given[Scene],
    hull: Given[Hull],
    hair: ChosenHair,
) -> dict[str, Any]:
    """Return what field and strands are made from: stage results, and what is measured in them."""
    cameras, head = Given.of(scene.value.cameras), Given.of(scene.value.head)
    views: dict[str, Any] = {"masks": masks, "cameras": cameras}
    distance = run.derive("distance", ScalpDistance, measure_scalp_distance, head=head, hull=hull)
    waves = run.derive(
        "waves", Waves, measure_waves, capture=photos, orientations=orientations,
        scalp_distance=distance, **views,
    )  # fmt: skip
    waves = waves if hair == ChosenHair() else Given.of(hair.waves(waves.value))
    tied = run.derive(
        "ties", TiedHair, measure_ties, orientations=orientations, head=head, hull=hull,
        scalp_distance=distance, **views,
    )  # fmt: skip
    parting = run.derive(
        "parting", Parting, measure_parting, capture=photos, orientations=orientations, head=head,
        tied=tied, hull=hull, scalp_distance=distance, **views,
    )  # fmt: skip
    return {
        "scene": scene, "masks": masks, "orientations": orientations, "hull": hull,
        "waves": waves, "scalp_distance": distance, "parting": parting, "tied": tied,
    }  # fmt: skip


def _write(
    folder: Path,
    run: StageRunner,
    capture: Capture,
    made: _Made,
    exports: Sequence[tuple[str, Path]],
) -> None:
    """Write the groom, the scene and the exports."""
    made.groom.save(folder / "groom.npz")
    photos = [None if v.photo_path is None else v.photo_path.name for v in capture.views]
    sizes = [view.photo_size for view in capture.views]
    made.scene.resized(sizes).write_json(folder / "scene.json", photos)
    for plugin, path in exports:
        run.export(plugin, made.groom, path)


def _draw_sheet(path: Path, capture: Capture, made: _Made, log: RunLog) -> None:
    from hairkit.pipeline.contact_sheet import write_contact_sheet  # loads OpenGL

    began = time.perf_counter()
    log.started("sheet", 1)
    try:
        write_contact_sheet(
            path, capture, made.masks, made.orientations, made.hull, made.groom, made.scene,
            made.health,
        )  # fmt: skip
    except RenderError as error:
        log.message(f"no contact sheet: {error}")
    log.finished("sheet", time.perf_counter() - began, False)


def _sweep(folder: Path, run: StageRunner) -> None:
    """Remove partial files of a run that was killed, and results that this recipe lacks."""
    for table in ("turn", "refine"):
        if not run.has(table):
            (folder / "work" / f"{table}.npz").unlink(missing_ok=True)
    for name in ("groom", "scene.json", "hairkit.log", RECORD, SHEET):
        for leftover in folder.glob(f".{name}*.part"):
            leftover.unlink(missing_ok=True)
