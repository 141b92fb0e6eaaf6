"""Every importer faces damaged files: one HairkitError of one line, and little memory.

`HAIRKIT_FUZZ_CASES=20000 pytest tests/plugins/test_damage.py -k cyhair` runs more cases.
"""

from __future__ import annotations

import io
import logging
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzzing import CASES, damaged, long_run
from hypothesis import given
from rich_groom import rich_groom

from hairkit.errors import HairkitError, MissingExtraError, PluginError
from hairkit.grooming import adopt_strands
from hairkit.manager import Manager, PluginInfo
from hairkit.testing import ball_head

READERS = [
    (info, suffix)
    for info in Manager.loaded(autoload=False).plugins()
    if "import_groom" in info.stages and "export_groom" in info.stages
    for suffix in info.suffixes[:1]
]
_POINTS = np.zeros((4, 7), "<f4")
_POINTS[:, 1] = 0.1, 0.12, 0.1, 0.13
_POINTS[2:, 0] = 0.05
_PLACES = _POINTS[:, :3].reshape(2, 2, 3).astype("<f4")
_POINTS = _POINTS.view("<i4").reshape(-1)


def _array_file(array: Any) -> str:
    """Return a .npy file's bytes, one character each."""
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue().decode("latin-1")


OTHER_FILES_TEXT = {
    ("tressfx", "text.tfx"): """version 2.0
scale 0.01
rotation 0 0 0
translation 0 0 0
bothEndsImmovable 0
numStrands 2
is sorted 1
strand 0 numVerts 3 texcoord 0.25 0.5
0 10 0
0 11 1
0 12 3
strand 1 numVerts 2 texcoord 0.75 0.5
9 3 0
12 3 1
""",
    ("ply", "ascii.ply"): """ply
format ascii 1.0
comment two strands as edges
element vertex 5
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
element edge 3
property int vertex1
property int vertex2
end_header
0 0.1 0 90 60 30
0 0.12 0 90 60 30
0 0.13 0.01 90 60 30
0.1 0 0 90 60 30
0.13 0 0 90 60 30
0 1
1 2
3 4
""",
    ("obj", "edges.obj"): """# two strands as edges, one named backwards
v 0 0.1 0
v 0 0.12 0
v 0 0.13 0.01
l 1 2
l -2 -1
v 0.1 0 0
v 0.13 0 0
l 4/1 5/2
""",
    ("usc_data", "ct2hair.bin"): np.concatenate([[2, 2], _POINTS[:14], [2], _POINTS[14:]])
    .astype("<i4")
    .tobytes()
    .decode("latin-1"),
    ("numpy_arrays", "hair.npy"): _array_file(_PLACES),
    ("numpy_arrays", "map.convdata"): _array_file(
        np.pad(_PLACES, ((0, 2), (0, 0), (0, 1))).transpose(1, 2, 0).reshape(8, 2, 2)
    ),
    ("maya", "foreign.ma"): """//Maya ASCII 2022 scene
currentUnit -l meter -a degree -t film;
createNode transform -n "hair";
	setAttr ".t" -type "double3" 0 0.05 0 ;
	setAttr ".ry" 30;
	setAttr ".rp" -type "double3" 0.1 0 0 ;
createNode nurbsCurve -n "hairShape" -p "hair";
	setAttr ".cc" -type "nurbsCurve"
		3 1 0 no 3
		6 0 0 0 1 1 1
		4
		0 0.1 0
		0 0.12 0
		0 0.13 0.01
		0 0.14 0.01
		;
createNode transform -n "b" -p "hair";
createNode nurbsCurve -n "bShape" -p "|hair|b";
	setAttr ".cc" -type "nurbsCurve" 1 1 0 no 3 2 0 1 2 0.1 0 0 0.13 0 0 ;
createNode script -n "s";
	setAttr ".b" -type "string" "// print; \\"no\\";";
""",
}
"""Small files of two strands."""
OTHER_FILES = list(OTHER_FILES_TEXT)
SLOW = {"usd": 20}
"""Readers that start a process for each file: one case of so many."""
MOST_MEMORY = 24 * 2**20
"""Bytes that reading may take whatever the file is."""
MOST_TIMES = 64
"""And times the file's size besides."""


def named(values: object) -> str:
    """Return the test's name of a plugin or an ending."""
    return values.name if isinstance(values, PluginInfo) else str(values).strip(".")


@pytest.fixture
def quiet(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Leave out what takes time and is not meant: warnings, and reading the same head again."""
    logger = logging.getLogger("hairkit")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    head = ball_head(4)
    monkeypatch.setattr(adopt_strands, "_read", lambda *_: head)
    tracemalloc.start()
    yield
    tracemalloc.stop()
    logger.setLevel(level)


def reader_settings(info: PluginInfo, folder: Path) -> dict[str, Any]:
    """Return settings that name a head, where the reader takes one: fitting one takes time."""
    names = {option.name for option in info.options}
    return {"head": str(folder / "head.npz")} if "head" in names else {}


def assert_foreseen(refusal: HairkitError | None) -> None:
    """A reader raises its own errors, of one line; the manager wraps any other as PluginError."""
    if refusal is not None:
        assert type(refusal) is not PluginError, f"not foreseen: {refusal}"
        assert "\n" not in str(refusal)
        assert 0 < len(str(refusal)) < 500


def check(manager: Manager, name: str, settings: dict[str, Any], path: Path, data: bytes) -> None:
    """Read a file: it is a groom or refused in one line, and memory stays small."""
    path.write_bytes(data)
    tracemalloc.reset_peak()
    before = tracemalloc.get_traced_memory()[0]
    refusal = None
    try:
        groom = manager.call("import_groom", name, settings, path=path)
        assert np.isfinite(groom.strands.points).all()
    except HairkitError as error:
        refusal = error
    assert_foreseen(refusal)
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
    whole, chosen = path.read_bytes(), reader_settings(info, tmp_path)
    check(manager, info.name, chosen, path, whole)  # what loads once is not counted against it

    @long_run(max(CASES // SLOW.get(info.name, 1), 1))
    @given(data=damaged(whole))
    def every(data: bytes) -> None:
        check(manager, info.name, chosen, path, data)

    every()


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize(("name", "file"), OTHER_FILES, ids=lambda value: str(value)[-12:])
def test_other_kinds_of_files_are_refused_in_one_line(
    manager: Manager, name: str, file: str, tmp_path: Path
) -> None:
    """The same for kinds of files that are read but not written."""
    path, whole = tmp_path / file, OTHER_FILES_TEXT[name, file].encode("latin-1")
    chosen = reader_settings(manager.info(name), tmp_path)
    path.write_bytes(whole)
    assert len(manager.call("import_groom", name, chosen, path=path).strands) == 2
    check(manager, name, chosen, path, whole)

    @long_run(CASES)
    @given(data=damaged(whole))
    def every(data: bytes) -> None:
        check(manager, name, chosen, path, data)

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
        assert_foreseen(caught.value)
    for missing in (tmp_path / f"none{suffix}", tmp_path):
        with pytest.raises(HairkitError):
            manager.call("import_groom", info.name, settings, path=missing)
