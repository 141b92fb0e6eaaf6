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
from hairkit.testing import VIEW_NAMES, bristle_groom, stage_arguments

PROJECT = Path(__file__).parents[2]
HOOK_SPECS = {n: f for n, f in vars(hookspecs).items() if hasattr(f, "hairkit_spec")}
PAGES = [
    path.relative_to(PROJECT)
    for path in (
        PROJECT / "README.md",
        PROJECT / "CHANGELOG.md",
        PROJECT / "CONTRIBUTING.md",
        *sorted((PROJECT / "docs").rglob("*.md")),
    )
]
LONGEST = 40
"""Words of a sentence."""
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


def sentences(text: str) -> list[str]:
    """Return the sentences of a page, cells of tables too, without code, headings and targets."""
    code = r"^( *)```(?s:.*?)^\1```$|(?<=\n\n)(?: {4}(?![*\d ]).*\n+)+|^ *[#<].*$"
    text = re.sub(code, "\n\n", text, flags=re.MULTILINE)
    text = re.sub(r"`[^`]+`", "X", text)
    text = re.sub(r"\]\([^)]*\)", "]", text)
    parts = re.split(r"\n\s*\n|\n(?=\s*(?:[*+-]|\d+\.)\s)|\|", text)
    return [
        " ".join(sentence.split())
        for part in parts
        for sentence in re.split(r"(?<=[.!?])[)\"*]*\s+(?=\W*[A-Z0-9])", part)
    ]


def words(sentence: str) -> int:
    """Return how many words and numbers a sentence has; a piece of code is one."""
    return sum(any(map(str.isalnum, word)) for word in sentence.split())


@pytest.mark.parametrize("hook", HOOK_SPECS)
def test_every_hook_is_documented_with_its_arguments(hook: str) -> None:
    """A hook has a heading in the guide, and below it every one of its arguments."""
    _, heading, rest = plugins_page().partition(f"\n### `{hook}`")
    assert heading, f"docs/plugins.md has no heading for {hook}"
    section = rest.partition("\n### ")[0]
    for argument in inspect.signature(HOOK_SPECS[hook]).parameters:
        assert f"`{argument}`" in section or argument == "options", f"{hook}: {argument}"


def test_the_guide_opens_with_a_plugin() -> None:
    """The first code of the guide is a whole plugin."""
    assert "@hookimpl" in blocks(plugins_page(), "python")[0]


@pytest.mark.parametrize(
    "page", [p for p in PAGES if "\n@hookimpl\n" in (PROJECT / p).read_text()], ids=str
)
def test_printed_plugins_obey_the_contract(page: Path, tmp_path: Path) -> None:
    """Saved to files, the plugins of a page give valid results; an ending finds an exporter."""
    codes = blocks((PROJECT / page).read_text(), "python")
    for number, code in enumerate(code for code in codes if "\n@hookimpl\n" in code):
        name = f"printed_{number}"
        path = tmp_path / f"{name}.py"
        path.write_text(code)
        manager = Manager.loaded([path], autoload=False)
        info = manager.info(name)
        assert info.summary
        assert info.stages or info.notifications
        for stage in info.stages:
            assert manager.call(stage, name, **stage_arguments(stage, tmp_path)) is not None
        if "export_groom" in info.stages:
            file = tmp_path / f"groom{info.suffixes[0]}"
            hairkit.export(bristle_groom(), file, manager=manager)
            assert file.stat().st_size
        if "validate_groom" in info.notifications:
            assert manager.findings(bristle_groom(), path, "web")


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


@pytest.mark.parametrize("page", PAGES, ids=str)
def test_no_sentence_has_more_than_forty_words(page: Path) -> None:
    """What a page says in one sentence can be read in one breath; lists are lists."""
    found = sentences((PROJECT / page).read_text())
    assert any(words(sentence) > 1 for sentence in found)
    assert [sentence for sentence in found if words(sentence) > LONGEST] == []


def test_long_sentences_are_found_wherever_they_stand() -> None:
    """In a paragraph, an item or a cell, through links and over lines; not in code."""
    long = "word " * 20 + "[linked\nword](https://a.b/c.d) " + "`code of one word` " * 20
    for page in (f"Short. {long}.", f"* one\n* {long}\n", f"| a | {long} |"):
        assert [words(sentence) > LONGEST for sentence in sentences(page)].count(True) == 1, page
    for page in (f"```\n{long}\n```\n", f"A:\n\n    {'word ' * 50}\n", f"# {'word ' * 50}\n"):
        assert not any(words(sentence) > LONGEST for sentence in sentences(page)), page


@pytest.mark.parametrize(("path", "package"), WITH_DOCTESTS, ids=lambda v: getattr(v, "stem", v))
def test_examples_in_docstrings_run(path: Path, package: str) -> None:
    """What a docstring shows is what the installed package does."""
    parts = path.relative_to(PROJECT).with_suffix("").parts[1:]
    name = ".".join([package, *(part for part in parts if part != "__init__")])
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted
    assert not result.failed
