"""The stage `capture`: the photos of a folder, a video, or a name that a plugin knows."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from hairkit.errors import InputError
from hairkit.io.capture_reader import WORKING_EDGE
from hairkit.manager import Manager
from hairkit.pipeline.recipe import Recipe
from hairkit.types.capture import Capture


def take_capture(
    source: str | os.PathLike[str],
    recipe: Recipe,
    manager: Manager,
    max_edge: int = WORKING_EDGE,
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
    recipe.alone("capture").check(manager)
    stage = recipe.stage("capture")
    if stage is None:
        raise InputError(
            f"{text}: recipe {recipe.name} has no stage 'capture'; give it one, or photos that"
            " were read before"
        )
    choices = [(choice.plugin, choice.options) for choice in stage.choices]
    found: Capture = manager.call_first(stage.hook, choices, source=text, max_edge=max_edge)[1]
    asked = str(Path(text).resolve()) if Path(text).exists() else text
    return replace(found, asked=asked, max_edge=max_edge)
