"""A quick groom after a change by hand: what the last run found is kept but for what was touched.

A stroke changes one mask. A whole run then solves the cameras again, because they follow from all
masks; a draft reads what `hairkit.stages` says that it keeps, and looks again at photos that were
drawn on alone, where `see_photo` has not done so already. Hull, field and strands are made anew, on
a coarser grid where the recipe says so and from smaller pictures where the capture was read so.
What a process has once read of a run it keeps, so that only the first of its drafts waits for the
disk, and the last result of each stage, so that a draft makes only what its change leads to. The
next full run replaces what a draft shows.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.errors import InputError
from hairkit.io.strokes import read_view_strokes
from hairkit.manager import Manager
from hairkit.parallel import one_blas_thread
from hairkit.pipeline.find_views import frame_photos
from hairkit.pipeline.findings import Findings
from hairkit.pipeline.found import found
from hairkit.pipeline.recipe import Recipe
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.single_photo import SeenPhoto, see_photo
from hairkit.pipeline.stage_runner import Given, StageRunner, Views, completed
from hairkit.pipeline.work_folder import LastRun, Memory, stage_file
from hairkit.progress import Progress, Silent
from hairkit.stages import DRAWN, FRAMED, KEPT, LABELS, ORIENTED, PARTING, REFINED, TURN, Stage
from hairkit.storage import Stored
from hairkit.types.capture import Capture, View
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.turnaround import Turnaround

_Result = TypeVar("_Result", bound=Stored)
MOST_KEPT = 64
"""Results of a stage that a process keeps: those of a turn of 36 photos, and spare ones."""


@one_blas_thread()
def draft(
    capture: Capture,
    work: Path,
    touched: Mapping[str, Path],
    recipe: Recipe,
    manager: Manager,
    guides: int,
    progress: Progress | None = None,
    anew: Collection[str] = (),
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
    progress
        Hears of each stage that is run; what it raises ends the draft.
    anew
        `orient` where the recipe follows strands otherwise than the last run did.

    Raises
    ------
    InputError
        The last run found other views, or was not ended.
    """
    with ThreadPoolExecutor(1, thread_name_prefix="hairkit") as pool:
        run = StageRunner(recipe, manager, _memory(work), RunLog(progress or Silent()), pool)
        return Drafted(run, capture, work, touched, guides, anew).groom


@lru_cache(1)
def _memory(work: Path) -> Memory:
    return Memory()


class Drafted(Findings):
    """What is found in a capture of which a whole run has found the most."""

    def __init__(
        self,
        run: StageRunner,
        photos: Capture,
        work: Path,
        touched: Mapping[str, Path],
        guides: int,
        anew: Collection[str] = (),
    ) -> None:
        super().__init__(run, photos, guides=guides)
        self._work, self._touched, self._anew = work, touched, anew

    def kept(self, stage: Stage[Any]) -> Given[Any] | None:
        """Return the result of the last run, if a draft keeps it and the recipe has the stage."""
        if stage.hook and not self.run.recipe.has(stage):
            return None
        # of the stages that see all views the parting alone follows what was drawn
        if stage.draft is KEPT or (stage.draft is DRAWN and not self._parting_is_new):
            return _read(stage, self._work)
        return None

    @property
    def _parting_is_new(self) -> bool:
        """Whether one is said or drawn, or was before; in small pictures a measured one is lost."""
        views = [view for view in self.capture.views if self._folder(view) is not None]
        strokes = [read_view_strokes(view, view.width, view.height) for view in views]
        drawn = any(each is not None and each.labelled("parting") for each in strokes)
        last: Parting = _read(PARTING, self._work).value
        return drawn or self.capture.parting is not None or last.source != Parting().source

    @found
    def views(self) -> tuple[Capture, Turnaround | None]:
        """The views in the order of the turn, without faces and persons."""
        framing, count = _read(FRAMED, self._work).value, len(self.photos.views)
        if len(framing.frames) != count:
            raise InputError(
                f"{self._work}: the last run had {len(framing.frames)} photos, now {count}"
            )
        framed = frame_photos(self.photos, framing)
        if not self.run.recipe.has(TURN):
            return framed, None
        turn = _read(TURN, self._work).value
        return framed.arranged(turn), turn

    @found
    def scene(self) -> Given[Scene]:
        """The scene of the last run for pictures of the views' sizes, its head where it is now."""
        scene, views = super().scene.value, self.capture.views
        factor = views[0].height / scene.cameras[0].height
        misfit = None if scene.residual_px is None else factor * scene.residual_px
        sizes = [(view.width, view.height) for view in views]
        return Given.of(replace(scene.resized(sizes), residual_px=misfit))

    @found
    def view_masks(self) -> Views[Mask]:
        """Masks of the last run, found again where a photo was touched."""
        return [completed(self._mask(k)) for k in range(len(self.capture.views))]

    @found
    def view_orientations(self) -> Views[OrientationMap]:
        """Directions of the last run, found again where a photo was touched, or in all of them."""
        if ORIENTED.name in self._anew:
            return super().view_orientations
        return [completed(self._angles(view)) for view in self.capture.views]

    def _folder(self, view: View) -> Path | None:
        """Return where what is found in a photo that was touched is kept; None for other photos."""
        return None if view.photo_path is None else self._touched.get(view.photo_path.name)

    @found
    def _seen(self) -> dict[str, SeenPhoto]:
        """What is found in the photos that were touched, by view."""
        recipe, manager = self.run.recipe, self.run.manager
        folders = {view.name: self._folder(view) for view in self.capture.views}
        return {
            view.name: see_photo(view, folder, recipe, manager)
            for view in self.capture.views
            if (folder := folders[view.name]) is not None
        }

    def _mask(self, index: int) -> Given[Mask]:
        view = self.capture.views[index]
        if view.name in self._seen:
            return Given.of(self._seen[view.name].mask)
        if view.mask_path is None and LastRun(self._work).has(REFINED):
            return self._small(REFINED, view, index)
        return self._small(LABELS, view)

    def _angles(self, view: View) -> Given[OrientationMap]:
        if view.name in self._seen:
            return Given.of(cast(OrientationMap, self._seen[view.name].orientation))
        return self._small(ORIENTED, view)

    def _small(self, stage: Stage[Any], view: View, index: int = 0) -> Given[Any]:
        """Return what a stage of the last run found in a photo, at the view's size."""
        key = stage, self._work, view.name if stage.each else ""
        return _small_once(_time(*key), *key, index, (view.width, view.height))


def _read(stage: Stage[_Result], work: Path, view: str = "") -> Given[_Result]:
    """Return what a stage of the last run made; read once."""
    read: Any = _read_once  # of every kind
    return cast(Given[_Result], read(_time(stage, work, view), stage, work, view))


def _time(stage: Stage[Any], work: Path, view: str = "") -> int:
    """Return when a stage's file was written."""
    path = stage_file(work, stage, view)
    return path.stat().st_mtime_ns if path.is_file() else 0


@lru_cache(MOST_KEPT)
def _read_once(time: int, stage: Stage[Any], work: Path, view: str) -> Given[Any]:
    return Given.of(LastRun(work).latest(stage, view))


@lru_cache(2 * MOST_KEPT)
def _small_once(
    time: int, stage: Stage[Any], work: Path, view: str, index: int, size: tuple[int, int]
) -> Given[Any]:
    found: Any = LastRun(work).latest(stage, view) if stage.each else _read(stage, work).value
    if stage is ORIENTED:
        angle, confidence = (_every_few(part, size) for part in (found.angle, found.confidence))
        return Given.of(OrientationMap(angle, confidence))
    mask = found if stage.each else found.views[index]
    alpha = None if mask.alpha is None else np.asarray(cv2.resize(mask.alpha, size), np.uint8)
    return Given.of(Mask(_every_few(mask.labels, size), mask.person_known, alpha))


def _every_few(picture: npt.NDArray[Any], size: tuple[int, int]) -> Any:
    """Return a picture reduced to a size (width, height) by leaving pixels out."""
    return cv2.resize(picture, size, interpolation=cv2.INTER_NEAREST)
