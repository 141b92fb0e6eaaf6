"""What a photo shows by itself: face, person, mask and strands, before the whole turn is there.

These stages see no other photo and do not know from where theirs was taken, so they can run while
the turn is still being taken, and a change to one photo restarts them for that photo alone.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from hairkit.manager import Manager
from hairkit.parallel import one_blas_thread
from hairkit.pipeline.findings import Findings
from hairkit.pipeline.recipe import Recipe
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.stage_runner import StageRunner
from hairkit.pipeline.work_folder import WorkFolder
from hairkit.progress import Silent
from hairkit.stages import FACES, LABELS, ORIENTED, PERSONS
from hairkit.types.capture import Capture, View
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap


@dataclass(frozen=True, eq=False)
class SeenPhoto:
    """A photo and what stages of single photos found in it."""

    view: View
    """With face and person."""
    mask: Mask
    orientation: OrientationMap | None
    """None where nobody asked for it."""


@one_blas_thread()
def see_photo(
    view: View, folder: Path, recipe: Recipe, manager: Manager, *, strands: bool = True
) -> SeenPhoto:
    """Return what a recipe finds in one photo; only what changed since is found again.

    Parameters
    ----------
    view
        The photo.
    folder
        Work folder of this photo alone, made if need be. Inside `work/ahead/` of an output folder
        a later `reconstruct` of the same photos takes the results from there.
    recipe
        Its stages `landmarks`, `person`, `segment` and `orient` are run.
    manager
        The plugins.
    strands
        False leaves `orient` out.

    Raises
    ------
    HairkitError
        A plugin refuses the photo.
    """
    if view.photo_path is not None:
        view = replace(view, name=view.photo_path.stem)  # whatever the turn calls it
    recipe = recipe.only(FACES, PERSONS, LABELS, ORIENTED)
    with WorkFolder(folder) as work, ThreadPoolExecutor(1) as pool:
        run = StageRunner(recipe, manager, work, RunLog(Silent()), pool)
        found = Findings(run, Capture((view,)))
        orientation = found.orientations.value[0] if strands else None
        return SeenPhoto(found.capture.views[0], found.masks.value[0], orientation)
