"""A quick groom after a change by hand: what the last run found is kept but for what was touched.

A stroke changes one mask. A whole run then solves the cameras again, because they follow from all
masks; a draft keeps cameras, fitted head, waves, parting and hairline, and follows strands again in
the photos that were drawn on alone. Hull, field and strands are made anew, on a coarser grid where
the recipe says so. What a draft shows is replaced by the run that follows it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from hairkit.cameras.similarity import move_head
from hairkit.errors import InputError
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.field.ties import measure_ties
from hairkit.grooming.assemble import assemble_groom
from hairkit.head_model.hairline import Hairline
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.parallel import one_blas_thread
from hairkit.pipeline.recipe import Recipe
from hairkit.pipeline.work_folder import read_latest
from hairkit.types.capture import Capture
from hairkit.types.face import Face
from hairkit.types.groom import Groom
from hairkit.types.mask import Mask, Masks
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.person import Person
from hairkit.types.scene import Scene
from hairkit.types.skin import SkinMaps
from hairkit.types.turnaround import Turnaround
from hairkit.types.waves import Waves


@one_blas_thread()
def draft(
    capture: Capture,
    work: Path,
    touched: Collection[str],
    recipe: Recipe,
    manager: Manager,
    guides: int,
    check: Callable[[], None] = lambda: None,
) -> Groom:
    """Return a groom from a capture and what a whole run left in its work folder.

    Parameters
    ----------
    capture
        As it is now, with the photos of that run.
    work
        The work folder.
    touched
        File names of photos whose strokes changed since.
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
    capture = _arranged(capture, work, touched, recipe)
    masks, orientations = _seen(capture, work, touched, recipe, manager)
    scene = read_latest(Scene, work, "head" if recipe.stage("head") else "scene")
    if capture.chosen.head is not None:
        scene = move_head(scene, capture.chosen.head)
    check()
    hull = _call(manager, recipe, "hull", scene=scene, masks=masks)
    distance = measure_scalp_distance(scene.head, hull)
    tied = measure_ties(
        orientations=orientations, head=scene.head, hull=hull, scalp_distance=distance,
        masks=masks, cameras=scene.cameras,
    )  # fmt: skip
    waves = capture.chosen.hair.waves(read_latest(Waves, work, "waves"))
    seen = {
        "scene": scene, "masks": masks, "orientations": orientations, "hull": hull, "waves": waves,
        "scalp_distance": distance, "parting": read_latest(Parting, work, "parting"), "tied": tied,
    }  # fmt: skip
    check()
    field = _call(manager, recipe, "field", **seen)
    check()
    head = replace(
        scene.head,
        density=read_latest(Hairline, work, "hairline").density,
        maps=read_latest(SkinMaps, work, "skin"),
    )
    roots = sample_roots(head, guides, 0, rest=default_head())
    strands = _call(manager, recipe, "track", **seen, field=field, roots=roots)
    return assemble_groom(
        capture.views, masks, head, roots, strands, waves, tied, capture.chosen.hair
    )


def _arranged(capture: Capture, work: Path, touched: Collection[str], recipe: Recipe) -> Capture:
    """Return the views in the order of the turn; those that were touched with what is in them."""
    has = {table: recipe.stage(table) is not None for table in ("landmarks", "person", "turn")}
    views = list(capture.views)
    for index, view in enumerate(views):
        if view.photo_path is not None and view.photo_path.name in touched:
            face, person = Face.absent(), Person.absent()
            if has["landmarks"]:
                face = read_latest(Face, work, "landmarks", view.name)
            if has["person"]:
                person = read_latest(Person, work, "person", view.name)
            views[index] = view.with_findings(face, person)
    found = replace(capture, views=tuple(views))
    if not has["turn"]:
        return found
    turn = read_latest(Turnaround, work, "turn")
    if len(turn.order) != len(views):
        raise InputError(f"{work}: the last run had {len(turn.order)} photos, now {len(views)}")
    return found.arranged(turn)


def _seen(
    capture: Capture, work: Path, touched: Collection[str], recipe: Recipe, manager: Manager
) -> tuple[tuple[Mask, ...], tuple[OrientationMap, ...]]:
    """Return masks and orientations of all views, made again where a photo was touched."""
    refined = read_latest(Masks, work, "refine").views if (work / "refine.npz").is_file() else None
    masks, orientations = [], []
    for index, view in enumerate(capture.views):
        if view.photo_path is not None and view.photo_path.name in touched:
            mask = _call(manager, recipe, "segment", view=view.plain())
            orientation = _call(manager, recipe, "orient", view=view.toned(), mask=mask)
        else:
            kept = refined if view.mask_path is None else None
            mask = read_latest(Mask, work, "segment", view.name) if kept is None else kept[index]
            orientation = read_latest(OrientationMap, work, "orient", view.name)
        masks.append(mask)
        orientations.append(orientation)
    return tuple(masks), tuple(orientations)


def _call(manager: Manager, recipe: Recipe, table: str, **values: Any) -> Any:
    """Return what the first plugin of a stage that has an answer makes."""
    stage = recipe.stage(table)
    if stage is None:
        raise InputError(f"recipe {recipe.name} has no stage {table!r}")
    choices = [(choice.plugin, choice.options) for choice in stage.choices]
    return manager.call_first(stage.hook, choices, **values)[1]
