"""Laws of `hairkit plugins`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hairkit.cli import main
from hairkit.manager import DISABLE_AUTOLOAD, Manager

PLUGIN = '''\
"""Stripes are hair."""
from dataclasses import dataclass
from hairkit import hookimpl
from hairkit.options import option

@dataclass(frozen=True)
class Options:
    width: int = option(3, low=1, high=9, doc="Width of a stripe.", unit="px")
    both: bool = option(True, doc="Both sides.")
    parts: tuple[float, ...] = option((0.5, 1.0), doc="Parts.")

@hookimpl
def segment(view, options):
    return None
'''


@pytest.fixture
def plugin_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A plugin in a file, beside the shipped ones."""
    monkeypatch.setenv(DISABLE_AUTOLOAD, "1")
    path = tmp_path / "stripes.py"
    path.write_text(PLUGIN)
    return path


def test_the_list_has_every_plugin_below_its_stage(
    plugin_file: Path, capsys: pytest.CaptureFixture[str], manager: Manager
) -> None:
    """Shipped plugins and those of files are listed with where they come from and what they do."""
    assert main(["plugins", "--plugin", str(plugin_file)]) == 0
    text = capsys.readouterr().out
    assert "Stripes are hair." in text.partition("segment\n")[2].partition("\norient")[0]
    for info in manager.plugins():
        assert f"  {info.name} " in text


def test_summaries_are_whole_sentences(manager: Manager) -> None:
    """What the list says of a shipped plugin fits a line and is not cut."""
    for info in manager.plugins():
        assert info.summary.endswith("."), info.name
        assert len(info.summary) <= 100, info.name


def test_one_plugin_tells_its_options(
    plugin_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Name, default, bounds, unit and meaning are shown, and a --set that works."""
    assert main(["plugins", "stripes", "--plugin", str(plugin_file)]) == 0
    text = capsys.readouterr().out
    assert "width = 3  (a whole number from 1 to 9 (px))" in text
    assert "Width of a stripe." in text
    assert "both = true" in text
    assert "parts = 0.5,1.0" in text
    assert "--set stripes.width=3" in text


def test_json_says_the_same(plugin_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """--json gives one document with the plugin's options."""
    assert main(["plugins", "stripes", "--json", "--plugin", str(plugin_file)]) == 0
    (entry,) = json.loads(capsys.readouterr().out)
    assert entry["stages"] == ["segment"]
    assert entry["options"][0] == {
        "name": "width",
        "default": 3,
        "wanted": "a whole number from 1 to 9 (px)",
        "low": 1,
        "high": 9,
        "choices": None,
        "unit": "px",
        "doc": "Width of a stripe.",
    }


def test_a_stage_lists_its_plugins_only(
    plugin_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`hairkit plugins segment` leaves the other stages out."""
    assert main(["plugins", "segment", "--plugin", str(plugin_file)]) == 0
    text = capsys.readouterr().out
    assert "stripes" in text
    assert "track\n" not in text


def test_a_broken_file_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A plugin file with a mistake stops the command with the reason."""
    (tmp_path / "bad.py").write_text("import nothing_like_that\n")
    assert main(["plugins", "--plugin", str(tmp_path / "bad.py")]) == 2
    error = capsys.readouterr().err
    assert "bad.py: ModuleNotFoundError: No module named 'nothing_like_that'" in error
    assert error.count("\n") == 1
