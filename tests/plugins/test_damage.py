"""Every importer faces damaged files: one HairkitError of one line, and little memory.

`HAIRKIT_FUZZ_CASES=20000 pytest tests/plugins/test_damage.py -k cyhair` runs more cases.
"""

from __future__ import annotations

import logging
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzzing import damaged, long_run
from hypothesis import given
from rich_groom import rich_groom

from hairkit.errors import HairkitError, MissingExtraError, PluginError
from hairkit.groom_file import write_groom
from hairkit.manager import Manager, PluginInfo

READERS = [
    (info, suffix)
    for info in Manager.loaded(autoload=False).plugins()
    if "import_groom" in info.stages and "export_groom" in info.stages
    for suffix in info.suffixes[:1]
]
MOST_MEMORY = 24 * 2**20
"""Bytes that reading may take whatever the file is."""
MOST_TIMES = 64
"""And times the file's size besides."""


def named(values: object) -> str:
    """Return the test's name of a plugin or an ending."""
    return values.name if isinstance(values, PluginInfo) else str(values).strip(".")


@pytest.fixture
def quiet() -> Iterator[None]:
    """Damaged files are warned of in many words, which nobody reads here."""
    logger = logging.getLogger("hairkit")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    tracemalloc.start()
    yield
    tracemalloc.stop()
    logger.setLevel(level)


def reader_settings(info: PluginInfo, folder: Path) -> dict[str, Any]:
    """Return settings that name a head, where the reader takes one: fitting one takes time."""
    groom = rich_groom(3)
    write_groom(folder / "head.npz", groom)
    names = {option.name for option in info.options}
    return {"head": str(folder / "head.npz")} if "head" in names else {}


def check(manager: Manager, name: str, settings: dict[str, Any], path: Path, data: bytes) -> None:
    """Read a file: it is a groom or refused in one line, and memory stays small."""
    path.write_bytes(data)
    tracemalloc.reset_peak()
    before = tracemalloc.get_traced_memory()[0]
    try:
        groom = manager.call("import_groom", name, settings, path=path)
        assert np.isfinite(groom.strands.points).all()
    except HairkitError as error:
        assert type(error) is not PluginError, f"not foreseen: {error}"
        assert "\n" not in str(error)
        assert 0 < len(str(error)) < 500
    peak = tracemalloc.get_traced_memory()[1] - before
    assert peak < MOST_MEMORY + MOST_TIMES * len(data), f"{peak} bytes for a file of {len(data)}"


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize(("info", "suffix"), READERS, ids=named)
def test_damaged_files_are_refused_in_one_line(
    manager: Manager, info: PluginInfo, suffix: str, tmp_path: Path
) -> None:
    """Flips, extreme numbers, cuts and splices never surprise a reader."""
    path = tmp_path / f"hair{suffix}"
    try:
        manager.call("export_groom", info.name, groom=rich_groom(6), path=path)
    except MissingExtraError as error:
        pytest.skip(str(error))
    whole, settings = path.read_bytes(), reader_settings(info, tmp_path)
    check(manager, info.name, settings, path, whole)  # what loads once is not counted against it

    @long_run
    @given(data=damaged(whole))
    def every(data: bytes) -> None:
        check(manager, info.name, settings, path, data)

    every()


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize(("info", "suffix"), READERS, ids=named)
def test_files_of_anything_are_refused_in_one_line(
    manager: Manager, info: PluginInfo, suffix: str, tmp_path: Path
) -> None:
    """Empty files, noise and folders are told apart from hair."""
    path = tmp_path / f"hair{suffix}"
    settings = reader_settings(info, tmp_path)
    for data in (b"", b"\0", b"\0" * 4096, b"\xff" * 4096, b"1 " * 2048, bytes(range(256)) * 16):
        path.write_bytes(data)
        with pytest.raises(HairkitError) as caught:
            manager.call("import_groom", info.name, settings, path=path)
        if type(caught.value) is not MissingExtraError:
            assert type(caught.value) is not PluginError, f"not foreseen: {caught.value}"
            assert "\n" not in str(caught.value)
    for missing in (tmp_path / f"none{suffix}", tmp_path):
        with pytest.raises(HairkitError):
            manager.call("import_groom", info.name, settings, path=missing)
