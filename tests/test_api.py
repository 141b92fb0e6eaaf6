"""Laws of the front door: the whole job in one import, on paths or objects alike."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture
from threadpoolctl import threadpool_info, threadpool_limits

import hairkit
from hairkit.errors import InputError
from hairkit.pipeline.recipe import parse_recipe
from hairkit.storage import to_arrays
from hairkit.testing import ball_head, bristle_groom, turn_capture, turn_scene

FAST = {"backend": "reference", "substeps": 1}
"""Options of the simulator that need no compiled kernels."""


def test_the_table_agrees_with_the_imports_for_type_checkers() -> None:
    """Each public name is listed with the module that the type checker finds it in."""
    tree = ast.parse(Path(inspect.getfile(hairkit)).read_text())
    typed = {
        alias.name: node.module
        for block in tree.body
        if isinstance(block, ast.If)
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert typed == hairkit._HOME_OF
    assert set(hairkit.__all__) == set(typed)


def test_no_public_name_is_hidden_by_a_module() -> None:
    """A module of the same name would replace the public name as soon as anyone imports it."""
    modules = {module.name for module in pkgutil.iter_modules(hairkit.__path__)}
    assert not modules & set(hairkit.__all__)
    for name in modules - {"__main__"}:
        importlib.import_module(f"hairkit.{name}")
    assert callable(hairkit.simulate)
    assert callable(hairkit.render)
    assert callable(hairkit.evaluate)


def test_importing_the_front_door_is_fast() -> None:
    """`import hairkit` takes under 0.2 s of processor time, Python's own start included."""
    code = "import hairkit, time; print(time.process_time())"
    runs = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        for _ in range(3)
    ]
    assert min(float(run.stdout) for run in runs) < 0.2


def test_photos_become_a_groom_in_one_call(tmp_path: Path) -> None:
    """A folder and a recipe file give what a capture and a recipe give."""
    photos = write_capture(tmp_path / "capture")
    (tmp_path / "ball.toml").write_text(RECIPE)
    manager = hairkit.Manager.loaded([PLUGIN_FILE], autoload=False)
    choices = {"manager": manager, "head": ball_head(), "guides": 20, "sheet": False}
    groom = hairkit.reconstruct(photos, tmp_path / "a", tmp_path / "ball.toml", **choices)
    capture = hairkit.read_capture(photos)
    recipe = hairkit.load_recipe(tmp_path / "ball.toml")
    again = hairkit.reconstruct(capture, tmp_path / "b", recipe, **choices)
    assert len(groom.strands) == 20
    first, second = to_arrays(groom), to_arrays(again)
    assert all(np.array_equal(first[name], second[name]) for name in first)
    assert len(hairkit.read_groom(tmp_path / "a").strands) == 20


def blas_threads() -> set[int]:
    """Return the numbers of threads of the loaded BLAS libraries."""
    return {info["num_threads"] for info in threadpool_info() if info["user_api"] == "blas"}


def test_reconstruct_limits_the_threads_of_matrix_products(tmp_path: Path) -> None:
    """While it runs BLAS has one thread, wherever it was called from; afterwards all it had."""
    manager = hairkit.Manager.loaded([PLUGIN_FILE], autoload=False)
    seen: list[set[int]] = []

    class Listener:
        """Notes the threads at the end of every stage."""

        @hairkit.hookimpl
        def stage_finished(self) -> None:
            seen.append(blas_threads())

    manager.register(Listener(), "listener")
    recipe = parse_recipe(RECIPE.encode(), "ball", "ball.toml")
    choices = {"head": ball_head(), "guides": 4, "sheet": False}
    with threadpool_limits(2, "blas"):
        hairkit.reconstruct(turn_capture(), tmp_path / "out", recipe, manager, **choices)
        assert blas_threads() == {2}
    assert seen
    assert all(threads == {1} for threads in seen)


def test_a_groom_goes_through_files_and_comes_back(tmp_path: Path) -> None:
    """What was written is read again, in hairkit's own file and in a plugin's format."""
    groom = bristle_groom()
    hairkit.write_groom(groom, tmp_path / "g.npz")
    hairkit.export(tmp_path / "g.npz", tmp_path / "g.ply", axis="z_up_metres")
    for name, settings in (("g.npz", {}), ("g.ply", {"axis": "z_up_metres"})):
        back = hairkit.read_groom(tmp_path / name, **settings)
        np.testing.assert_allclose(back.strands.points, groom.strands.points, atol=1e-6)
    with pytest.raises(InputError, match="use export"):
        hairkit.write_groom(groom, tmp_path / "g.abc")


def test_a_simulation_can_be_exported_and_drawn(tmp_path: Path) -> None:
    """The cache of `simulate` is what `export` and `render` take, as an object or a file."""
    groom = bristle_groom()
    cache = hairkit.simulate(groom, 4, shake=["yaw:40:4"], **FAST)
    assert cache.points.shape == (4, len(groom.strands.points), 3)
    hairkit.export(groom, tmp_path / "moving.usda", cache=cache)
    assert "timeSamples" in (tmp_path / "moving.usda").read_text()
    size = {"size": (96, 72), "hairs": 300}
    rest, last = (hairkit.render(groom, cache=cache, frame=i, **size) for i in (0, -1))
    np.testing.assert_array_equal(rest, hairkit.render(groom, **size))
    assert (rest != last).any()
    with pytest.raises(InputError, match="frame 4 of a cache of 4 frames, 0 to 3"):
        hairkit.render(groom, cache=cache, frame=4, **size)


def test_a_picture_is_returned_and_written(tmp_path: Path) -> None:
    """`render` draws from a view's name, from angles and from a camera."""
    groom, path = bristle_groom(), tmp_path / "left.png"
    drawn = hairkit.render(groom, path, "left", size=(96, 72), hairs=300)
    assert drawn.shape == (72, 96, 3)
    np.testing.assert_array_equal(cv2.imread(str(path))[..., ::-1], drawn)
    again = hairkit.render(groom, camera=(90.0, 0.0), size=(96, 72), hairs=300)
    np.testing.assert_array_equal(again, drawn)
    camera = turn_scene().cameras[0]
    assert hairkit.render(groom, camera=camera, hairs=300).shape == (camera.height, camera.width, 3)
    with pytest.raises(InputError, match="no view 'above'"):
        hairkit.render(groom, camera="above")
