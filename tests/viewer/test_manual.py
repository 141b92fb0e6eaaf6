"""Laws of the manual page: it names what there is, and what it shows runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hairkit.viewer.actions.actions import ACTIONS
from hairkit.viewer.actions.script import read_script
from hairkit.viewer.draw.colouring import COLOURINGS
from hairkit.viewer.window.hud import help_lines, keys_label


@pytest.fixture(scope="module")
def page(project: Path) -> str:
    """The manual."""
    return (project / "docs" / "viewer.md").read_text()


def test_the_manual_names_every_action_and_colouring(page: str) -> None:
    """Nothing that a user can do is left out."""
    words = set(re.findall(r"\w+", page))
    assert set(ACTIONS) <= words, sorted(set(ACTIONS) - words)
    assert set(COLOURINGS) <= words


def test_the_scripts_of_the_manual_are_scripts(page: str, project: Path, tmp_path: Path) -> None:
    """TOML blocks and the scripts of the animated pictures are read without complaint."""
    blocks = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    assert blocks
    for number, block in enumerate(blocks):
        path = tmp_path / f"{number}.toml"
        path.write_text(block)
        assert read_script(path).steps
    for path in (project / "docs" / "images").glob("*.toml"):
        assert read_script(path).steps


def test_the_help_sheet_names_every_key() -> None:
    """Each action's keys stand beside what it does, as they are called on a keyboard."""
    sheet = help_lines()
    for action in ACTIONS.values():
        if action.keys:
            keys = keys_label(list(action.keys))
            assert f"{keys}\t{action.doc.removesuffix('.')}" in sheet


def test_keys_are_called_as_they_are_printed_on_a_keyboard() -> None:
    """Groups are shortened, and keys that say the same are said once."""
    assert keys_label(["CTRL_LEFT", "CTRL_RIGHT", "CTRL_UP", "CTRL_DOWN"]) == "ctrl+arrows"
    assert keys_label(["N1", "N3"]) == "1 3"
    assert keys_label(["F2", "F10"]) == "F2 F10"
    assert keys_label(["EQUAL", "MINUS", "KP_ADD", "KP_SUBTRACT"]) == "+ -"
    assert keys_label(["TAB", "SHIFT_TAB"]) == "tab shift+tab"
