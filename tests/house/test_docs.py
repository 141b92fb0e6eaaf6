"""Laws of the documents: what they show runs, what exists is in them."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
from pathlib import Path

import pytest

import hairkit
from hairkit import hookspecs
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe, parse_recipe
from hairkit.stages import OF_TABLE
from hairkit.testing import VIEW_NAMES, stage_arguments

PROJECT = Path(__file__).parents[2]
HOOK_SPECS = {n: f for n, f in vars(hookspecs).items() if hasattr(f, "hairkit_spec")}
WITH_DOCTESTS = [
    (path, package)
    for folder, package in (("hairkit", "hairkit"), ("plugins", "hairkit_plugins"))
    for path in sorted((PROJECT / folder).rglob("*.py"))
    if ">>>" in path.read_text()
]


def plugins_page() -> str:
    """Return the plugin author's guide."""
    return (PROJECT / "docs" / "plugins.md").read_text()


def blocks(text: str, language: str) -> list[str]:
    """Return the code blocks of a language in a page."""
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


@pytest.mark.parametrize("hook", HOOK_SPECS)
def test_every_hook_is_documented_with_its_arguments(hook: str) -> None:
    """A hook has a heading in the guide, and below it every one of its arguments."""
    _, heading, rest = plugins_page().partition(f"\n### `{hook}`")
    assert heading, f"docs/plugins.md has no heading for {hook}"
    section = rest.partition("\n### ")[0]
    for argument in inspect.signature(HOOK_SPECS[hook]).parameters:
        assert f"`{argument}`" in section or argument == "options", f"{hook}: {argument}"


def test_the_guide_opens_with_a_plugin_that_works(tmp_path: Path) -> None:
    """The first code of the guide is a whole plugin; saved to a file it obeys the contract."""
    path = tmp_path / "upright.py"
    path.write_text(blocks(plugins_page(), "python")[0])
    manager = Manager.loaded([path], autoload=False)
    stages = manager.info("upright").stages
    assert stages
    for stage in stages:
        assert manager.call(stage, "upright", **stage_arguments(stage, tmp_path)) is not None


@pytest.mark.parametrize("number", range(len(blocks(plugins_page(), "python"))))
def test_code_in_the_guide_compiles(number: int) -> None:
    """No block of Python in the guide has gone stale in its imports or its grammar."""
    code = blocks(plugins_page(), "python")[number]
    compile(code, "docs/plugins.md", "exec")
    for line in re.findall(r"^from hairkit.* import .*$|^import hairkit.*$", code, re.MULTILINE):
        exec(line, {})


@pytest.mark.parametrize("number", range(len(blocks(plugins_page(), "toml"))))
def test_recipes_in_the_guide_can_be_run(number: int, manager: Manager) -> None:
    """A TOML block is a recipe whose plugins and options are there."""
    recipe = parse_recipe(blocks(plugins_page(), "toml")[number].encode(), "x", "x")
    recipe.check(manager)
    tables = {stage.table for stage in load_recipe("default").stages}
    assert {stage.table for stage in recipe.stages} == tables <= set(OF_TABLE)


def test_the_readme_needs_one_import() -> None:
    """README stays short, and its snippet is one import whose names exist."""
    readme = (PROJECT / "README.md").read_text()
    assert len(readme.splitlines()) < 150
    (snippet,) = blocks(readme, "python")
    compile(snippet, "README.md", "exec")
    assert re.findall(r"^(?:import|from) .*$", snippet, re.MULTILINE) == ["import hairkit"]
    for name in re.findall(r"hairkit\.(\w+)", snippet):
        assert name in hairkit.__all__


def test_every_file_that_the_readme_links_to_exists() -> None:
    """Links and pictures of README and CONTRIBUTING lead to files of the project."""
    for page in ("README.md", "CONTRIBUTING.md"):
        for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", (PROJECT / page).read_text()):
            assert (PROJECT / target).exists(), f"{page}: {target}"


def test_the_conventions_name_every_view_and_file() -> None:
    """The conventions page has the names that users must spell right."""
    page = (PROJECT / "docs" / "conventions.md").read_text()
    names = [*VIEW_NAMES, "photos/", "masks/", "strokes/", "landmarks.json", "capture.toml"]
    for name in names:
        assert f"`{name}`" in page, name


@pytest.mark.parametrize(("path", "package"), WITH_DOCTESTS, ids=lambda v: getattr(v, "stem", v))
def test_examples_in_docstrings_run(path: Path, package: str) -> None:
    """What a docstring shows is what the installed package does."""
    parts = path.relative_to(PROJECT).with_suffix("").parts[1:]
    name = ".".join([package, *(part for part in parts if part != "__init__")])
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted
    assert not result.failed
