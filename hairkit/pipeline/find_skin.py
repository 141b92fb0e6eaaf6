"""The skin of the head in a run: projected from the photos, and enhanced by the recipe's plugin."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace

from hairkit.head_model.photo_skin import photograph_skin
from hairkit.pipeline.stage_runner import Given, StageRunner
from hairkit.types.capture import Capture
from hairkit.types.mask import Mask
from hairkit.types.scene import Scene
from hairkit.types.skin import SkinMaps, Texture


def find_skin(
    run: StageRunner,
    photos: Given[Capture],
    masks: Sequence[Future[Given[Mask]]],
    scene: Given[Scene],
) -> SkinMaps:
    """Return the maps of the photographed skin, enhanced where the recipe says so."""
    skin = run.derive("skin", SkinMaps, photograph_skin, capture=photos, scene=scene, masks=masks)
    if not run.has("texture") or skin.value.albedo is None:
        return skin.value
    albedo = Given(skin.value.albedo, skin.digest)
    finer = run.once("texture", Texture, texture=albedo, example=Given.of(None))
    return replace(skin.value, albedo=finer.value)
