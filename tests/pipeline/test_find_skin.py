"""Laws of the skin in a run: the recipe's table `texture` enhances the photographed albedo."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from example_textures import draw_skin

from hairkit.errors import HairkitError
from hairkit.manager import Manager
from hairkit.pipeline import find_skin as module
from hairkit.pipeline.recipe import load_recipe, parse_recipe
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.stage_runner import Given, StageRunner
from hairkit.pipeline.work_folder import WorkFolder
from hairkit.progress import Silent
from hairkit.testing import turn_capture, turn_scene
from hairkit.types.skin import SkinMaps, Texture

PHOTOGRAPHED = Texture.encode(draw_skin(40, 1))


def photographed(capture: object, scene: object, masks: object) -> SkinMaps:
    """Stands for the projection of photos."""
    return SkinMaps(albedo=PHOTOGRAPHED)


def skin_of(recipe: str, folder: Path, manager: Manager) -> SkinMaps:
    """Return the skin that a recipe makes."""
    parsed = parse_recipe(recipe.encode(), "mine", "mine")
    parsed.check(manager)
    with WorkFolder(folder / "work") as work, ThreadPoolExecutor(1) as pool:
        run = StageRunner(parsed, manager, work, RunLog(Silent()), pool)
        return module.find_skin(run, Given.of(turn_capture()), [], Given.of(turn_scene()))


def test_the_table_texture_enhances_the_albedo(
    tmp_path: Path, manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the table the albedo is the photographed one, with it the plugin's, of its size."""
    monkeypatch.setattr(module, "photograph_skin", photographed)
    photographed.__module__ = module.__name__  # whose sources make its digest
    assert load_recipe("default").stage("texture") is None
    plain = skin_of("", tmp_path, manager).albedo
    assert plain is not None
    np.testing.assert_array_equal(plain.pixels, PHOTOGRAPHED.pixels)
    close_up = tmp_path / "close_up.png"
    close_up.write_bytes(Texture.encode(draw_skin(48, 2)).data.tobytes())
    table = f'[texture]\nplugin = "image_analogies"\nclose_up = "{close_up}"\n'
    finer = skin_of(table, tmp_path, manager).albedo
    assert finer is not None
    assert finer.pixels.shape == plain.pixels.shape
    assert (finer.pixels != plain.pixels).any()
    with pytest.raises(HairkitError, match="close_up=FILE"):
        skin_of('[texture]\nplugin = "image_analogies"\n', tmp_path, manager)


def test_a_table_without_a_plugin_is_refused() -> None:
    """The default recipe names none that its options could be for."""
    with pytest.raises(HairkitError, match=r"texture\.plugin is None"):
        parse_recipe(b"[texture]\nalpha = 0.1\n", "mine", "mine")
