"""The plugin in examples/ is a distribution of its own: it is installed by pip, found and run."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hairkit.pipeline.recipe import load_recipe, recipe_names

EXAMPLE = Path(__file__).parents[2] / "examples" / "hairkit-sobel"

RUN_BY_RECIPE = """
import sys
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe
from hairkit.testing import stage_arguments
manager, recipe = Manager.loaded(), load_recipe(sys.argv[1])
recipe.check(manager)
stage = recipe.stage("orient")
choice = stage.choices[0]
arguments = stage_arguments(stage.hook)
result = manager.call(stage.hook, choice.plugin, choice.options, **arguments)
print(choice.plugin, type(result).__name__, manager.info(choice.plugin).distribution)
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of a process that has the example installed, by pip, in a folder."""
    if importlib.util.find_spec("pip") is None:
        pytest.skip("there is no pip in this environment to install the example with")
    folder = tmp_path_factory.mktemp("example")
    shutil.copytree(EXAMPLE, folder / "source")
    options = "--quiet --no-deps --no-build-isolation --disable-pip-version-check --no-index"
    target = ["--target", str(folder / "site"), str(folder / "source")]
    install = [sys.executable, "-m", "pip", "install", *options.split(), *target]
    subprocess.run(install, check=True, capture_output=True)
    environment = {**os.environ, "PYTHONPATH": str(folder / "site")}
    environment.pop("HAIRKIT_DISABLE_PLUGIN_AUTOLOAD", None)
    return environment


def run(words: list[str], environment: dict[str, str], folder: Path) -> str:
    """Run Python and return what it prints; its errors show when it fails."""
    done = subprocess.run(
        [sys.executable, *words],
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def command(*words: str) -> list[str]:
    """Return Python's arguments that run hairkit's command line."""
    return ["-c", "import sys; from hairkit.cli import main; sys.exit(main())", *words]


def test_it_is_thirty_lines() -> None:
    """A third-party plugin is no more than that, options and docstrings included."""
    for name in ("sobel", "assets"):
        path = EXAMPLE.with_name(f"hairkit-{name}") / f"hairkit_{name}.py"
        assert len(path.read_text().splitlines()) <= 30


def test_it_is_found_and_listed_with_its_options(installed: dict[str, str], tmp_path: Path) -> None:
    """Installed, it is in the list of its stage, with distribution and options."""
    (entry,) = json.loads(run(command("plugins", "sobel", "--json"), installed, tmp_path))
    assert entry["distribution"] == "hairkit-sobel"
    assert entry["broken"] is None
    assert [option["name"] for option in entry["options"]] == ["sigma"]
    listing = run(command("plugins", "orient"), installed, tmp_path)
    assert "sobel" in listing


def test_a_recipe_runs_it_by_name(installed: dict[str, str], tmp_path: Path) -> None:
    """A recipe that names it gets its orientations, with the recipe's options."""
    stages = ("segment", "scene", "hull", "field", "track")
    shipped = (Path(__file__).parents[2] / "hairkit" / "recipes" / "default.toml").read_text()
    assert "default" in recipe_names()
    before, _, after = shipped.partition("[orient]")
    rest = after[after.index("\n[") :]
    (tmp_path / "mine.toml").write_text(f'{before}[orient]\nplugin = "sobel"\nsigma = 3.0\n{rest}')
    assert all(f"[{stage}]" in before + rest for stage in stages)
    output = run(["-c", RUN_BY_RECIPE, "mine.toml"], installed, tmp_path)
    assert output.split() == ["sobel", "OrientationMap", "hairkit-sobel"]


def test_its_own_test_passes(installed: dict[str, str], tmp_path: Path) -> None:
    """The example's test holds on the installed distribution."""
    shutil.copy(EXAMPLE / "test_hairkit_sobel.py", tmp_path)
    output = run(["-m", "pytest", "-q", "-W", "error", "."], installed, tmp_path)
    assert "4 passed" in output


def test_the_example_of_captures_passes_its_own_test(tmp_path: Path) -> None:
    """The plugin that finds captures in a database is a plugin as it stands."""
    shutil.copytree(EXAMPLE.with_name("hairkit-assets"), tmp_path / "example")
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    output = run(["-m", "pytest", "-q", "-W", "error", "."], environment, tmp_path / "example")
    assert "1 passed" in output


def test_the_command_example_passes_its_own_test(tmp_path: Path) -> None:
    """The plugin that runs in an environment of its own is a plugin, and its recipe names it."""
    example = EXAMPLE.with_name("hairkit-matte")
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    shutil.copytree(example, tmp_path / "example")
    output = run(["-m", "pytest", "-q", "-W", "error", "."], environment, tmp_path / "example")
    assert "1 passed" in output
    (command,) = load_recipe(example / "matte.toml").commands
    assert command.command[-1] == "hairkit_matte"
    for path in example.glob("*.py"):
        compile(path.read_text(), str(path), "exec")
