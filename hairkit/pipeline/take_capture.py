"""The stage `capture`: the photos of a folder, a video, or a name that a plugin knows."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from hairkit.errors import InputError
from hairkit.io.capture_reader import WORKING_EDGE
from hairkit.manager import Manager
from hairkit.pipeline.recipe import Recipe, load_recipe
from hairkit.stages import CAPTURE
from hairkit.types.capture import Capture


def take_capture(
    source: str | os.PathLike[str], recipe: Recipe, manager: Manager, max_edge: int = WORKING_EDGE
) -> Capture:
    """Return the photos of a source by the first of the recipe's plugins that knows it.

    Parameters
    ----------
    source
        A folder, a video, or what else a plugin takes: `assets:hero_042`.
    recipe, manager
        The recipe's table `capture` is used.
    max_edge
        Photos whose long edge has more pixels are scaled down to it.

    Raises
    ------
    InputError
        The recipe leaves the stage out, or there is something wrong with the photos.
    """
    text = os.fspath(source)
    reading = recipe.only(CAPTURE)
    reading.check(manager)
    if not reading.has(CAPTURE):
        raise InputError(
            f"{text}: recipe {recipe.name} has no stage 'capture'; give it one, or photos that"
            " were read before"
        )
    found = reading.ask(manager, CAPTURE, source=text, max_edge=max_edge)
    asked = str(Path(text).resolve()) if Path(text).exists() else text
    return replace(found, asked=asked, max_edge=max_edge)


def take_with_choices(
    photos: Capture | str | os.PathLike[str],
    recipe: Recipe | str | os.PathLike[str],
    manager: Manager,
    settings: Sequence[str] = (),
    max_edge: int = WORKING_EDGE,
) -> tuple[Capture, Recipe]:
    """Return the photos, and the recipe that they are run with, checked.

    Parameters
    ----------
    photos
        A source, or a capture that was read before.
    recipe
        The name of a recipe, to which the options of the capture are added; or a recipe, which is
        taken as it is.
    manager, max_edge
        As for `take_capture`.
    settings
        Options as `--set` takes them; they come last, and are checked before the photos are read.

    Raises
    ------
    HairkitError
        An option, a plugin or a photo is at fault.
    """
    start = recipe if isinstance(recipe, Recipe) else load_recipe(recipe)
    asked = start.with_set(settings)
    asked.check(manager)
    capture = (
        photos if isinstance(photos, Capture) else take_capture(photos, asked, manager, max_edge)
    )
    if not isinstance(recipe, Recipe):
        asked = start.with_set([*capture.chosen.settings, *settings])
        asked.check(manager)
    return capture, asked
