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
from hairkit.pipeline.recipe import Recipe
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.stage_runner import Given, StageRunner
from hairkit.pipeline.work_folder import WorkFolder, digest_of
from hairkit.progress import Silent
from hairkit.types.capture import View
from hairkit.types.face import Face
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.person import Person


@dataclass(frozen=True, eq=False)
class SeenPhoto:
    """A photo and what stages of single photos found in it."""

    view: View
    """With face and person."""
    mask: Mask
    orientation: OrientationMap | None
    """None where nobody asked for it."""


def given_photo(view: View) -> Given[View]:
    """Return a photo without its place in the turn; its name does not count in the digest."""
    alone = view.alone()
    return Given(alone, digest_of(replace(alone, name="")))


def given_bare_photo(view: View, name: str = "") -> Given[View]:
    """Return a photo as networks see it: as `given_photo`, and without what was drawn on it."""
    bare = replace(view.plain(), mask_path=None, strokes_path=None)
    return given_photo(replace(bare, name=name or view.name))


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
    with WorkFolder(folder) as work, ThreadPoolExecutor(1) as pool:
        run = StageRunner(recipe, manager, work, RunLog(Silent()), pool)
        bare = [given_bare_photo(view)]
        [face] = run.every_view("landmarks", Face, bare, absent=Face.absent)
        [person] = run.every_view("person", Person, bare, absent=Person.absent)
        seen = view.with_findings(face.result().value, person.result().value)
        masks = run.every_view("segment", Mask, [given_photo(seen.plain())])
        orientation = None
        if strands:
            toned = [given_photo(seen.toned())]
            [found] = run.every_view("orient", OrientationMap, toned, mask=masks)
            orientation = found.result().value
        return SeenPhoto(seen, masks[0].result().value, orientation)
