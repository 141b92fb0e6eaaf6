"""Reconstruct a groom from photos: run the stages of a recipe in order."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from hairkit.compilation import announce_compilation
from hairkit.errors import InputError, RenderError
from hairkit.io.head_reader import HeadFile
from hairkit.manager import Manager
from hairkit.memory import give_back_memory
from hairkit.parallel import one_blas_thread, thread_count
from hairkit.pipeline.figure import RED, Figure
from hairkit.pipeline.findings import Findings
from hairkit.pipeline.health import assess
from hairkit.pipeline.recipe import Choice, Recipe, missing_networks
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.run_record import RECORD, RunRecord, describe_run, finish_record
from hairkit.pipeline.stage_runner import StageRunner
from hairkit.pipeline.take_capture import take_with_choices
from hairkit.pipeline.work_folder import WORK, WorkFolder, drop_work
from hairkit.progress import Progress, Silent
from hairkit.stages import EXPORT, ROWS
from hairkit.stages import SHEET as SHEET_STAGE
from hairkit.system import utf8_name
from hairkit.types.capture import Capture
from hairkit.types.evidence import Evidence
from hairkit.types.groom import Groom
from hairkit.types.head import Head
from hairkit.types.orientation import OrientationMap

MAX_GUIDES = 100_000
SHEET = "contact_sheet.png"
"""Name of the picture that shows the result of every stage."""
THINNED = 320
"""Least width of an orientation map that is kept for the contact sheet: two pixels a pixel."""
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
    utf8_name(Path(out).absolute())
    manager = manager or Manager.loaded()
    if not 1 <= guides <= MAX_GUIDES:
        raise InputError(f"{guides} guides, expected 1 to {MAX_GUIDES}")
    given, chosen = take_with_choices(photos, recipe, manager)
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
        _sweep(folder, run, work)
        tell_missing(recipe, manager, log)
        try:
            made = _make(Findings(run, given, head, record.guides, record.seed))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        work.flush()
        give_back_memory()
        exports = export_paths(folder, recipe, manager)
        for name in (RECORD, SHEET):
            (folder / name).unlink(missing_ok=True)
        written = run.beside(_write, folder, run, made, exports)
        if sheet:
            _draw_sheet(folder / SHEET, made, log)
        written.result()
        manager.notify("groom_ready", groom=made.groom)
        log.message(made.evidence.parting.summary)
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


@dataclass(frozen=True, eq=False)
class _Made:
    """What is left of a run's results for its files."""

    capture: Capture
    evidence: Evidence
    """Its orientation maps are thinned, for the contact sheet."""
    groom: Groom
    health: tuple[Figure, ...]


def export_paths(
    out: str | os.PathLike[str], recipe: Recipe, manager: Manager
) -> tuple[tuple[Choice, Path], ...]:
    """Return plugin and path of every file that the recipe exports into a folder."""
    selection = recipe.stage(EXPORT.table)
    choices = selection.choices if selection is not None else ()
    usual = {c.plugin: (manager.info(c.plugin).suffixes or (f".{c.plugin}",))[0] for c in choices}
    return tuple((c, Path(out) / (c.file or f"groom{usual[c.plugin]}")) for c in choices)


def _make(findings: Findings) -> _Made:
    """Run the stages."""
    findings.run.beside(lambda: findings.own_head)  # while networks look at the photos
    capture, groom = findings.capture, findings.groom
    evidence = findings.evidence.value
    health = assess(capture, evidence, findings.tracked, findings.guides, findings.turn)
    few = tuple(_thinned(found) for found in evidence.orientations)
    return _Made(capture, replace(evidence, orientations=few), groom, health)


def _thinned(map_: OrientationMap) -> OrientationMap:
    """Return every n-th pixel of a map, so that at least `THINNED` columns are left."""
    every = max(map_.angle.shape[1] // THINNED, 1)
    return OrientationMap(map_.angle[::every, ::every], map_.confidence[::every, ::every])


def _write(
    folder: Path, run: StageRunner, made: _Made, exports: Sequence[tuple[Choice, Path]]
) -> None:
    """Write the groom, the scene and the exports."""
    made.groom.save(folder / "groom.npz")
    views = made.capture.views
    photos = [None if view.photo_path is None else view.photo_path.name for view in views]
    scene = made.evidence.scene
    cameras = tuple(
        camera.on_photo(view.frame, view.photo_size)
        for camera, view in zip(scene.cameras, views, strict=True)
    )
    replace(scene, cameras=cameras).write_json(folder / "scene.json", photos)
    for choice, path in exports:
        path.parent.mkdir(exist_ok=True)
        run.export(choice, made.groom, path)


def _draw_sheet(path: Path, made: _Made, log: RunLog) -> None:
    from hairkit.pipeline.contact_sheet import write_contact_sheet  # loads OpenGL

    began = time.perf_counter()
    log.started(SHEET_STAGE.name, 1)
    try:
        write_contact_sheet(path, made.capture, made.evidence, made.groom, made.health)
    except RenderError as error:
        log.message(f"no contact sheet: {error}")
    log.finished(SHEET_STAGE.name, time.perf_counter() - began, False)


def _sweep(folder: Path, run: StageRunner, work: WorkFolder) -> None:
    """Remove partial files of a run that was killed, and results that this recipe lacks."""
    for stage in ROWS:
        if stage.hook and stage.in_runs and not run.recipe.has(stage):
            work.drop(stage)
    for name in ("groom", "scene.json", "hairkit.log", RECORD, SHEET):
        for leftover in folder.glob(f".{name}*.part"):
            leftover.unlink(missing_ok=True)
