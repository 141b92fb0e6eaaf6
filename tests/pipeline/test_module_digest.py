"""Laws of the digests of source code: a change runs again what it concerns, and nothing else."""

from __future__ import annotations

import functools
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hairkit.manager import Manager
from hairkit.manager.loading import import_file
from hairkit.pipeline import recipe as recipe_module
from hairkit.pipeline.module_digest import Roots, imported_modules, module_digest
from hairkit.pipeline.recipe import load_recipe, stage_digest
from hairkit.stages import EXPORT, OF_TABLE

PROJECT = Path(__file__).parents[2]

CACHED = ("segment", "scene", "fit", "orient", "hull", "field", "track")
"""Stages of the default recipe whose results are kept."""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Roots:
    """Return a copy of hairkit's sources and of its plugins' to change."""
    folder = tmp_path_factory.mktemp("tree")
    ignored = shutil.ignore_patterns("__pycache__", "sample")
    for name in ("hairkit", "plugins"):
        shutil.copytree(PROJECT / name, folder / name, ignore=ignored)
    return {"hairkit": folder / "hairkit", "hairkit_plugins": folder / "plugins"}


def stage_digests(roots: Roots, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Return the digests of the default recipe's cached stages, with the sources of a tree."""
    digest = functools.partial(module_digest, roots=roots)
    monkeypatch.setattr(recipe_module, "module_digest", digest)
    manager = Manager.loaded(autoload=False)
    stages = load_recipe("default").stages
    return {stage.table: stage_digest(manager, stage) for stage in stages if stage.table in CACHED}


@pytest.mark.parametrize(
    ("changed", "again"),
    [
        ("hairkit/types/camera.py", "scene fit hull field track"),
        ("hairkit/types/mask.py", "segment scene fit orient hull field track"),
        ("hairkit/storage.py", "segment scene fit orient hull field track"),
        ("hairkit/cameras/silhouette_coherence.py", "scene"),
        ("hairkit/cameras/outlines.py", "scene fit"),
        ("hairkit/cameras/projection_kernels.py", "hull field track"),
        ("hairkit/imaging/seeded_segmentation.py", "segment"),
        ("hairkit/imaging/geodesic.py", "segment"),
        ("hairkit/head_model/signed_distance.py", "hull"),
        ("hairkit/field/diffusion.py", "field"),
        ("hairkit/helices/floating_tangents.py", ""),
        ("hairkit/grooming/head_collision.py", "track"),
        ("hairkit/io/strokes.py", "segment"),
        ("hairkit/simulation/wind.py", ""),
        ("hairkit/rendering/hair.py", ""),
        ("hairkit/evaluation/scores.py", ""),
        ("hairkit/synth/growth.py", ""),
        ("hairkit/viewer/session.py", ""),
        ("hairkit/cli/info.py", ""),
        ("hairkit/pipeline/contact_sheet.py", ""),
        ("hairkit/__init__.py", ""),
        ("plugins/thin_plate.py", "fit"),
        ("plugins/silhouette/landmark_transfer.py", "scene"),
        ("plugins/tensor_diffusion.py", ""),
        ("hairkit/imaging/hair_network.npz", "segment"),
        ("hairkit/field/hair_depth.npz", "hull"),
        ("hairkit/head_model/template_skin.jpg", ""),
        ("hairkit/recipes/thesis.toml", ""),
    ],
)
def test_a_changed_file_runs_again_the_stages_that_import_it(
    changed: str, again: str, tree: Roots, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the default recipe exactly the stages whose plugins import a file depend on it."""
    before = stage_digests(tree, monkeypatch)
    path = tree["hairkit"].parent / changed
    text = path.read_bytes()
    path.write_bytes(text + b"\n# changed\n")
    after = stage_digests(tree, monkeypatch)
    path.write_bytes(text)
    assert {table for table in CACHED if before[table] != after[table]} == set(again.split())


@pytest.mark.parametrize(
    ("module", "changed"),
    [
        ("hairkit_plugins.face_mesh", "plugins/face_mesh/landmark_table.csv"),
        ("hairkit_plugins.auto_matte", "hairkit/imaging/hair_network.npz"),
        ("hairkit.head_model.template_skin", "hairkit/head_model/template_skin.jpg"),
    ],
)
def test_a_file_that_a_module_names_counts_as_its_source(
    module: str, changed: str, tree: Roots
) -> None:
    """Weights, tables and pictures beside a module change its digest, and that of no other."""
    others = ("hairkit.field.diffusion", "hairkit_plugins.structure_tensor")
    before = [module_digest(name, tree) for name in (module, *others)]
    path = tree["hairkit"].parent / changed
    data = path.read_bytes()
    path.write_bytes(data + b"\0")
    after = [module_digest(name, tree) for name in (module, *others)]
    path.write_bytes(data)
    assert after[0] != before[0]
    assert after[1:] == before[1:]


@pytest.mark.parametrize(
    "module",
    [
        "head_model.photo_skin",
        "head_model.hairline",
        "imaging.waves",
        "field.find_ties",
        "field.find_parting",
        "field.growth_prior",
    ],
)
def test_no_measured_result_is_drawn(module: str) -> None:
    """Digests do not cover shaders, so what is kept may not depend on them."""
    assert "hairkit.rendering.context" not in imported_modules(f"hairkit.{module}")


def test_no_stage_of_a_run_draws(manager: Manager) -> None:
    """Of the plugins for stages whose results are kept none uses the shaders."""
    for stage in OF_TABLE.values():
        for name in manager.names(stage.hook) if stage is not EXPORT else ():
            assert "hairkit.rendering.context" not in imported_modules(manager.info(name).module)


def test_what_is_read_is_what_python_imports() -> None:
    """The modules read from the sources of a plugin are those that Python loads with it."""
    code = "import {0}, sys; print(*(m for m in sys.modules if m.startswith('hairkit')))"
    for plugin in ("hairkit_plugins.silhouette", "hairkit_plugins.certainty_tracker"):
        done = subprocess.run(
            [sys.executable, "-c", code.format(plugin)], capture_output=True, text=True, check=True
        )
        loaded = set(done.stdout.split()) - {"hairkit"}
        assert loaded <= set(imported_modules(plugin))


def write_package(folder: Path, files: dict[str, str]) -> Roots:
    """Write a package `outside` and an empty hairkit; return where they are."""
    (folder / "hairkit").mkdir()
    door = "if TYPE_CHECKING:\n    from hairkit.colour import Colour\n"
    for name, text in {"hairkit/__init__.py": door, "hairkit/colour.py": "", **files}.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return {"hairkit": folder / "hairkit", "outside": folder / "outside"}


@pytest.mark.parametrize(
    ("statement", "found"),
    [
        ("from . import near", "outside outside.near"),
        ("from .near import value", "outside outside.near"),
        ("from outside.near import value as other", "outside outside.near"),
        ("import outside.near", "outside outside.near"),
        ("def run():\n    if True:\n        from . import near", "outside outside.near"),
        ("try:\n    import x\nexcept ImportError:\n    from . import near", "outside outside.near"),
        ("from hairkit import Colour", "outside hairkit.colour"),
        ("import hairkit\nprint(hairkit.Colour)", "outside hairkit.colour"),
        ("from hairkit import colour", "outside hairkit.colour"),
        ("if TYPE_CHECKING:\n    from . import near", "outside"),
        ("import numpy, elsewhere.near", "outside"),
    ],
)
def test_every_way_to_import_is_understood(statement: str, found: str, tmp_path: Path) -> None:
    """Imports count wherever they are and however they are written, but for those for types."""
    files = {"outside/__init__.py": "", "outside/near.py": "value = 1", "outside/far.py": ""}
    roots = write_package(tmp_path, {**files, "outside/plugin.py": statement})
    modules = imported_modules("outside.plugin", roots)
    assert set(modules) == {"outside.plugin", *found.split()}


def test_a_plugin_file_has_the_digest_of_its_content(tmp_path: Path) -> None:
    """A changed plugin file has another stage digest, an unchanged one the same."""
    source = "import hairkit\n@hairkit.hookimpl\ndef orient(view): ...\n"
    path, digests = tmp_path / "mine.py", []
    for text in (source, source, f"{source}\n"):
        path.write_text(text)
        manager = Manager.loaded([path], autoload=False)
        stage = load_recipe("default").with_set(["orient=mine"]).stage("orient")
        assert stage is not None
        digests.append(stage_digest(manager, stage))
    assert digests[0] == digests[1] != digests[2]


def test_a_plugin_file_in_another_folder_is_another(tmp_path: Path) -> None:
    """Files of one name are loaded as one module; the digest is that of the file loaded last."""
    digests = []
    for text in ("first = 1\n", "second = 2\n"):
        path = tmp_path / text.split()[0] / "mine.py"
        path.parent.mkdir()
        path.write_text(text)
        digests.append(module_digest(import_file(path).__name__))
    assert digests[0] != digests[1]
