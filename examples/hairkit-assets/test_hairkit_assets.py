"""Laws of the plugin `asset_database`."""

import sqlite3
from contextlib import closing
from pathlib import Path

import hairkit_assets
import pytest

from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.testing import stage_arguments


@pytest.fixture
def manager() -> Manager:
    """The plugin alone."""
    manager = Manager()
    manager.register(hairkit_assets, "asset_database")
    return manager


def test_an_asset_has_the_photos_of_its_folder(manager: Manager, tmp_path: Path) -> None:
    """Its name stands for the folder in the database; paths are left to other plugins."""
    (tmp_path / "photos").mkdir()
    given = stage_arguments("capture", tmp_path / "photos")
    options = {"database": tmp_path / "assets.db"}
    with closing(sqlite3.connect(tmp_path / "assets.db")) as database, database:
        database.execute("CREATE TABLE captures (name TEXT, folder TEXT)")
        database.execute("INSERT INTO captures VALUES (?, ?)", ["hero", given["source"]])
    found = manager.call("capture", "asset_database", options, **given | {"source": "asset:hero"})
    assert len(found.views) == 8
    with pytest.raises(InputError, match="no asset:extra; add it"):
        manager.call("capture", "asset_database", options, **given | {"source": "asset:extra"})
    assert manager.find_first("capture", [("asset_database", options)], **given) is None
