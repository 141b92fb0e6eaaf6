"""A quick groom after a change by hand: what the last run found is kept but for what was touched.

A stroke changes one mask. A whole run then solves the cameras again, because they follow from all
masks; a draft keeps cameras, fitted head, waves, parting and hairline, and looks again at photos
that were drawn on alone, where `see_photo` has not done so already. Hull, field and strands are
made anew, on a coarser grid where the recipe says so and from smaller pictures where the capture
was read so. What a process has once read of a run it keeps, so that only the first of its drafts
waits for the disk. What a draft shows is replaced by the run that follows it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.cameras.similarity import move_head
from hairkit.errors import InputError
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.field.ties import measure_ties
from hairkit.grooming.assemble import assemble_groom
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.parallel import one_blas_thread
from hairkit.pipeline.recipe import Recipe
from hairkit.pipeline.single_photo import see_photo
from hairkit.pipeline.work_folder import LastRun, stage_file
from hairkit.stages import LABELS, OF_NAME, ORIENTED
from hairkit.storage import Stored
from hairkit.types.capture import Capture
from hairkit.types.groom import Groom
from hairkit.types.hairline import Hairline
from hairkit.types.head import Head
from hairkit.types.mask import Mask, Masks
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.skin import SkinMaps
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import Hull
from hairkit.types.waves import Waves

_Result = TypeVar("_Result", bound=Stored)
MOST_KEPT = 64
"""Results of each kind that a process keeps: those of a turn of 36 photos, and spare ones."""


@one_blas_thread()
def draft(
    capture: Capture,
    work: Path,
    touched: Mapping[str, Path],
    recipe: Recipe,
    manager: Manager,
    guides: int,
    check: Callable[[], None] = lambda: None,
) -> Groom:
    """Return a groom from a capture and what a whole run left in its work folder.

    Parameters
    ----------
    capture
        As it is now, with the photos of that run, at their size or smaller.
    work
        The work folder.
    touched
        File names of photos whose strokes changed since, each with the work folder in which
        `see_photo` keeps what it finds in that photo.
    recipe
        That of the run; a coarser hull makes the draft quicker.
    manager
        The plugins.
    guides
        Number of roots.
    check
        Called before each step; what it raises ends the draft.

    Raises
    ------
    InputError
        The last run found other views, or was not ended.
    """
    capture = _arranged(capture, work, recipe)
    masks, orientations = _seen(capture, work, touched, recipe, manager)
    scene = _read(Scene, work, "head" if recipe.stage("head") else "scene")
    if capture.chosen.head is not None:
        scene = move_head(scene, capture.chosen.head)
    scene = _reduced(scene, capture)
    check()
    hull = _call(manager, recipe, "hull", scene=scene, masks=masks)
    distance = measure_scalp_distance(scene.head, hull)
    tied = measure_ties(
        orientations=orientations, head=scene.head, hull=hull, scalp_distance=distance,
        masks=masks, cameras=scene.cameras,
    )  # fmt: skip
    waves = capture.chosen.hair.waves(_read(Waves, work, "waves"))
    seen = {
        "scene": scene, "masks": masks, "orientations": orientations, "hull": hull, "waves": waves,
        "scalp_distance": distance, "parting": _read(Parting, work, "parting"), "tied": tied,
    }  # fmt: skip
    check()
    field = _call(manager, recipe, "field", **seen)
    check()
    head = _complete_head(scene.head, hull, work)
    roots = sample_roots(head, guides, 0, rest=default_head())
    strands = _call(manager, recipe, "track", **seen, field=field, roots=roots)
    hair = capture.chosen.hair
    return assemble_groom(capture.views, masks, head, roots, strands, waves, tied, hair)


def _complete_head(head: Head, hull: Hull, work: Path) -> Head:
    """Return the head with the hairline and skin of the last run and the torso of a hull."""
    density, skin = _read(Hairline, work, "hairline").density, _read(SkinMaps, work, "skin")
    return replace(head, density=density, maps=skin, torso=hull.torso)


def _arranged(capture: Capture, work: Path, recipe: Recipe) -> Capture:
    """Return the views in the order of the turn."""
    if recipe.stage("turn") is None:
        return capture
    turn = _read(Turnaround, work, "turn")
    if len(turn.order) != len(capture.views):
        count = len(capture.views)
        raise InputError(f"{work}: the last run had {len(turn.order)} photos, now {count}")
    return capture.arranged(turn)


def _reduced(scene: Scene, capture: Capture) -> Scene:
    """Return the scene for pictures of the views' sizes."""
    factor = capture.views[0].height / scene.cameras[0].height
    misfit = None if scene.residual_px is None else factor * scene.residual_px
    sizes = [(view.width, view.height) for view in capture.views]
    return replace(scene.resized(sizes), residual_px=misfit)


def _seen(
    capture: Capture, work: Path, touched: Mapping[str, Path], recipe: Recipe, manager: Manager
) -> tuple[tuple[Mask, ...], tuple[OrientationMap, ...]]:
    """Return masks and orientations of all views, made again where a photo was touched."""
    is_refined = (work / "refine.npz").is_file()
    masks, orientations = [], []
    for index, view in enumerate(capture.views):
        size = (view.width, view.height)
        folder = None if view.photo_path is None else touched.get(view.photo_path.name)
        if folder is not None:
            seen = see_photo(view, folder, recipe, manager)
            mask, orientation = seen.mask, cast(OrientationMap, seen.orientation)
        else:
            if is_refined and view.mask_path is None:
                mask = _small_refined(_time(work, "refine"), work, index, size)
            else:
                mask = _small_mask(_time(work, "segment", view.name), work, view.name, size)
            time = _time(work, "orient", view.name)
            orientation = _small_orientation(time, work, view.name, size)
        masks.append(mask)
        orientations.append(orientation)
    return tuple(masks), tuple(orientations)


def _read(kind: type[_Result], work: Path, stage: str, view: str = "") -> _Result:
    """Return what a stage of the last run made; read once."""
    read: Any = _read_once  # of every kind
    return cast(_Result, read(_time(work, stage, view), kind, work, stage, view))


def _time(work: Path, stage: str, view: str = "") -> int:
    """Return when a stage's file was written."""
    path = stage_file(work, stage, view)
    return path.stat().st_mtime_ns if path.is_file() else 0


@lru_cache(MOST_KEPT)
def _read_once(time: int, kind: type[Stored], work: Path, stage: str, view: str) -> Stored:
    found: Any = LastRun(work).latest(OF_NAME[stage], view)
    return cast(Stored, found)


@lru_cache(MOST_KEPT)
def _small_refined(time: int, work: Path, index: int, size: tuple[int, int]) -> Mask:
    return _small(_read(Masks, work, "refine").views[index], size)


@lru_cache(MOST_KEPT)
def _small_mask(time: int, work: Path, view: str, size: tuple[int, int]) -> Mask:
    return _small(LastRun(work).latest(LABELS, view), size)


def _small(mask: Mask, size: tuple[int, int]) -> Mask:
    alpha = None if mask.alpha is None else np.asarray(cv2.resize(mask.alpha, size), np.uint8)
    return Mask(_every_few(mask.labels, size), mask.person_known, alpha)


@lru_cache(MOST_KEPT)
def _small_orientation(time: int, work: Path, view: str, size: tuple[int, int]) -> OrientationMap:
    found = LastRun(work).latest(ORIENTED, view)
    return OrientationMap(_every_few(found.angle, size), _every_few(found.confidence, size))


def _every_few(picture: npt.NDArray[Any], size: tuple[int, int]) -> Any:
    """Return a picture reduced to a size (width, height) by leaving pixels out."""
    return cv2.resize(picture, size, interpolation=cv2.INTER_NEAREST)


def _call(manager: Manager, recipe: Recipe, table: str, **values: Any) -> Any:
    """Return what the first plugin of a stage that has an answer makes."""
    stage = recipe.stage(table)
    if stage is None:
        raise InputError(f"recipe {recipe.name} has no stage {table!r}")
    choices = [(choice.plugin, choice.options) for choice in stage.choices]
    return manager.call_first(stage.hook, choices, **values)[1]
