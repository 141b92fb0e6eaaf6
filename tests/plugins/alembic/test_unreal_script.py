"""The script for the Unreal editor, run against a stand-in: there is no Unreal here."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from unittest.mock import MagicMock

import pytest

SCRIPT = Path(__file__).parents[3] / "examples/unreal/import_groom.py"


def test_the_script_for_unreal_imports_without_turning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against a stand-in for Unreal: one task, its own factory, no rotation, scale 1."""
    unreal = MagicMock()
    unreal.GroomAsset = unreal.load_asset.return_value.__class__
    unreal.AssetImportTask.return_value.get_editor_property.return_value = ["/Game/Hair/hair"]
    monkeypatch.setitem(sys.modules, "unreal", unreal)
    monkeypatch.setattr(sys, "argv", [str(SCRIPT), str(tmp_path / "hair.abc"), "/Game/Hair"])
    runpy.run_path(str(SCRIPT), run_name="__main__")
    assert [call.args for call in unreal.Vector.call_args_list] == [(0, 0, 0), (1, 1, 1)]
    task = dict(
        call.args for call in unreal.AssetImportTask.return_value.set_editor_property.call_args_list
    )
    assert task["factory"] is unreal.HairStrandsFactory.return_value
    assert task["options"] is unreal.GroomImportOptions.return_value
    assert task["filename"] == str(tmp_path / "hair.abc")
