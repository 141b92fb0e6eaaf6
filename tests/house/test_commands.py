"""Laws of the commands that README, docs and examples print: they are understood, and they run."""

from __future__ import annotations

import argparse
import importlib
import itertools
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import hairkit
from hairkit.cli import VERBS, main
from hairkit.head_model.template import default_head
from hairkit.synth import grow
from hairkit.testing import turn_scene
from hairkit.types.skin import Texture

PROJECT = Path(__file__).parents[2]
PAGES = [PROJECT / "README.md", *sorted((PROJECT / "docs").rglob("*.md"))]
PAGES += sorted((PROJECT / "examples").rglob("*.md"))
NOT_RUN = {"reconstruct", "masks", "head", "rerun", "studio", "view", "evaluate", "doctor", "study"}
NOT_RUN |= {"validate", "wrap", "batch"}
"""They take long, or need a window, captures, a record, a head or a file for an engine: arguments
and recipes are checked."""
ALONE = ("doctor", "plugins")
"""Verbs that are commands without arguments; a page may speak of the others by name."""
LIGHTER = {
    "simulate": ["--frames", "2"],
    "render": ["--size", "48x64", "--hairs", "100"],
}
"""Further arguments that make a run quick."""
PICTURES = (
    "scan", "close_up", "albedo", "plain", "painted", "labels", "map", "photo", "bump",
    "other_albedo", "other_normal", "blood", "melanin",
)  # fmt: skip
"""Textures that pages speak of, all .png."""
FEW_GUIDES = "10"
"""Guides where a page chooses some from full hair: the stand-in has few strands."""


EXAMPLES = {"sobel", "asset_database"}
"""Plugins of examples/, which are distributions of their own."""


@dataclass(frozen=True)
class Command:
    """One printed command."""

    words: tuple[str, ...]
    inline: bool
    """It stands in a sentence or table, where capital words may be placeholders."""

    @property
    def verb(self) -> str:
        """What it does: `export`."""
        return self.words[0]

    @property
    def runs(self) -> bool:
        """Whether it can be run on stand-ins as it is."""
        placeholder = any(re.fullmatch(r"\[?[A-Z]{2,}\]?", word) for word in self.words)
        units = "--scale" in self.words  # of the file at hand, which the stand-in's are not
        shell = any("$" in word for word in self.words)
        return self.verb not in NOT_RUN and not placeholder and not units and not shell


def commands(page: Path) -> list[Command]:
    """Return the hairkit commands of a page, in their order."""
    text = page.read_text()
    found = [(at, line, False) for at, line in _lines_of_code(text)]
    for match in re.finditer(r"(?<!`)`(hairkit [a-z-]+[^`]*)`(?!`)", text):
        found.append((match.start(), " ".join(match[1].split()), True))
    return [
        Command(tuple(words[1:]), inline)
        for _, line, inline in sorted(found)
        for words in _commands_of(line)
        if words[1] in VERBS and (len(words) > 2 or words[1] in ALONE)
    ]


def _lines_of_code(text: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of fenced and indented blocks of code that run hairkit."""
    pattern = r"^ {2,}(hairkit .*)$|^(hairkit .*)$"
    for match in re.finditer(pattern, text, re.MULTILINE):
        fenced = text[: match.start()].count("\n```") % 2 == 1
        if fenced or match[1]:
            yield match.start(), match[1] or match[2]


def _commands_of(line: str) -> Iterator[list[str]]:
    for part in line.split("&&"):
        words = shlex.split(part, comments=True)
        if len(words) > 1 and words[0] == "hairkit":
            yield words


def code_block(page: Path, language: str, part: str) -> str:
    """Return the first block of a language on a page that has a text in it."""
    blocks = re.findall(rf"```{language}\n(.*?)```", page.read_text(), re.DOTALL)
    return next(block for block in blocks if part in block)


@pytest.fixture(scope="module")
def groom() -> hairkit.Groom:
    """A small groom, in the place of the reader's."""
    return grow("wavy", default_head(), 40, seed=1)


@pytest.fixture
def folder(tmp_path: Path, groom: hairkit.Groom, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with the files that pages speak of."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    still = hairkit.PointCache(
        np.repeat(groom.strands.points[None], 2, axis=0),
        np.array([0.0, 1 / 24]),
        np.repeat(np.eye(4)[None], 2, axis=0),
    )
    for name in ("groom.npz", "out/groom.npz"):
        hairkit.write_groom(groom, name)
    for name in ("cache.npz", "sway.npz"):
        still.save(name)
    turn_scene().write_json("out/scene.json")
    hairkit.export(groom, "hair.abc")
    for name in PICTURES:
        grain = np.random.default_rng(len(name)).integers(60, 200, (48, 48, 3), np.uint8)
        Path(f"{name}.png").write_bytes(Texture.encode(grain).data.tobytes())
    return tmp_path


def parsed(command: Command, monkeypatch: pytest.MonkeyPatch) -> argparse.Namespace | None:
    """Return the arguments as the command line understands them, None where it only prints."""
    caught = SimpleNamespace(args=None)
    module = importlib.import_module(f"hairkit.cli.{command.verb.replace('-', '_')}")
    with monkeypatch.context() as patch:
        patch.setattr(module, "run", lambda args: setattr(caught, "args", args) or 0)
        try:
            code = main(command.words)
        except SystemExit as done:  # after --help and the like
            code = done.code
    assert not code, command.words
    return caught.args


def check_recipe(page: Path, args: argparse.Namespace) -> None:
    """Load a `reconstruct` command's plugins and recipe, from the page's own code if need be."""
    for name in args.plugin:
        Path(name).write_text(code_block(page, "python", "@hookimpl"))
    manager = hairkit.Manager.loaded(args.plugin)
    if args.recipe.endswith(".toml"):
        Path(args.recipe).write_text(code_block(page, "toml", "plugin ="))
    recipe = hairkit.load_recipe(args.recipe).with_set(args.set)
    chosen = {choice.plugin for stage in recipe.stages for choice in stage.choices}
    if not chosen & EXAMPLES:
        recipe.check(manager)


def run(page: Path, command: Command, groom: hairkit.Groom) -> None:
    """Run a command, made lighter."""
    words = [re.sub(r"hairs=\d+", "hairs=100", word) for word in command.words]
    if command.verb == "synth":
        target = Path(words[words.index("-o") + 1])
        target.mkdir(exist_ok=True)
        hairkit.write_groom(groom, target / "groom.npz")
        return
    for name in (after for word, after in itertools.pairwise(words) if word == "--plugin"):
        Path(name).write_text(code_block(page, "python", "@hookimpl"))
    fewer = ["--guides", FEW_GUIDES] if {"simulate", "--guides"} <= set(words) else []
    assert main([*words, *LIGHTER.get(command.verb, []), *fewer]) == 0, words


def test_pages_print_commands() -> None:
    """The search finds commands in blocks, in tables and in sentences."""
    every = [command for page in PAGES for command in commands(page)]
    assert {command.verb for command in every} == set(VERBS)
    assert sum(not command.inline for command in every) > 30
    assert sum(command.inline for command in every) > 30


@pytest.mark.parametrize(
    "page", [p for p in PAGES if commands(p)], ids=lambda p: str(p.relative_to(PROJECT))
)
def test_printed_commands_run(
    page: Path, folder: Path, groom: hairkit.Groom, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each command is understood; those that can run on small stand-ins do, one after the other."""
    for command in commands(page):
        if command.verb == "plugins" and set(command.words) & {*EXAMPLES, "my_method", "NAME"}:
            continue  # of plugins that the reader writes
        args = parsed(command, monkeypatch)
        if args is not None and command.verb == "reconstruct":
            check_recipe(page, args)
        if command.runs:
            run(page, command, groom)
