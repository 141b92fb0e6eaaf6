"""Laws of what stands where a file is expected: pipes, devices, folders and loops never hang."""

from __future__ import annotations

import ast
import os
import resource
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich_groom import rich_groom

from hairkit.cli import explain
from hairkit.errors import FormatError, HairkitError
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import read_capture, sample_folder
from hairkit.io.head_reader import read_head, write_head_obj
from hairkit.io.strokes import read_strokes
from hairkit.manager import Manager
from hairkit.pipeline.recipe import load_recipe
from hairkit.simulation.motion import read_motion
from hairkit.storage import read_npz, write_bytes, write_npz
from hairkit.types.groom import Groom
from hairkit.types.scene import read_cameras
from hairkit.viewer.actions.presets import read_presets
from hairkit.viewer.actions.script import read_script

PROJECT = Path(__file__).parents[2]
SECONDS = 20
"""A reader that takes longer waits for something that never comes."""
OWN_FILES = {
    "hairkit/storage.py": "opens every file",
    "hairkit/system.py": "what the system says of memory",
    "hairkit/kernel_cache.py": "sources of kernels",
    "hairkit/worker.py": "runs without the rest of hairkit; its own files",
    "hairkit/head_model/template_skin.py": "its own picture",
    "hairkit/pipeline/module_digest.py": "sources",
    "hairkit/pipeline/recipe.py": "shipped recipes",
    "hairkit/pipeline/work_folder.py": "files that hairkit wrote there, and digests",
    "hairkit/rendering/context.py": "shaders",
    "plugins/face_mesh/landmark_table.py": "its own tables",
}
"""Modules that read files of hairkit itself in other ways."""


@contextmanager
def alarm(seconds: float) -> Iterator[None]:
    """Raise `TimeoutError` in what takes longer."""

    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    here = Path.cwd()
    os.chdir(path.parent)  # a socket's path holds 107 bytes
    try:
        with socket.socket(socket.AF_UNIX) as end:
            end.bind(path.name)
    finally:
        os.chdir(here)


PLACES: dict[str, Callable[[Path], None]] = {
    "pipe": _pipe,
    "socket": _socket,
    "endless device": lambda path: path.symlink_to("/dev/zero"),
    "loop": lambda path: path.symlink_to(path),
    "folder": lambda path: path.mkdir(),
    "empty": lambda path: path.touch(),
}
"""What may stand where a file is expected."""
WITHOUT_EMPTY = [name for name in PLACES if name != "empty"]


def _refused(read: Callable[[], Any], path: Path) -> None:
    """Check that a reader ends soon, in one line that names the file."""
    with alarm(SECONDS), pytest.raises(HairkitError) as caught:
        read()
    assert "\n" not in str(caught.value)
    assert path.name in str(caught.value)


def _importers() -> list[tuple[str, str]]:
    return [
        (info.name, suffix)
        for info in Manager.loaded(autoload=False).plugins()
        if "import_groom" in info.stages
        for suffix in info.suffixes
    ]


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("name", "suffix"), _importers())
def test_importers_refuse_what_is_no_file(
    manager: Manager, tmp_path: Path, name: str, suffix: str, place: str
) -> None:
    """Every format: one line, and soon."""
    if name == "usd":
        pytest.importorskip("pxr")
    path = tmp_path / f"hair{suffix}"
    PLACES[place](path)
    _refused(lambda: manager.call("import_groom", name, path=path), path)


READERS: dict[str, Callable[[Path], Any]] = {
    "a.npz": Groom.load,
    "a.json": read_strokes,
    "scene.json": read_cameras,
    "motion.json": read_motion,
    "motion.glb": read_motion,
    "a.obj": read_head,
    "a.ply": read_head,
    "a.glb": read_head,
    "a.stl": read_head,
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", READERS)
def test_readers_refuse_what_is_no_file(tmp_path: Path, name: str, place: str) -> None:
    """Grooms, strokes, cameras, motions and heads: one line, and soon."""
    path = tmp_path / name
    PLACES[place](path)
    _refused(lambda: READERS[name](path), path)


MAY_BE_EMPTY: dict[str, Callable[[Path], Any]] = {
    "recipe.toml": lambda path: load_recipe(str(path)),
    "script.toml": read_script,
    "a.presets.toml": read_presets,
}


@pytest.mark.parametrize("place", WITHOUT_EMPTY)
@pytest.mark.parametrize("name", MAY_BE_EMPTY)
def test_settings_refuse_what_is_no_file(tmp_path: Path, name: str, place: str) -> None:
    """Recipes, scripts and presets: one line, and soon."""
    path = tmp_path / name
    PLACES[place](path)
    _refused(lambda: MAY_BE_EMPTY[name](path), path)


@pytest.mark.parametrize("place", WITHOUT_EMPTY)
@pytest.mark.parametrize("name", ["head.landmarks.json", "head.scalp.png"])
def test_files_beside_a_head_are_files(tmp_path: Path, name: str, place: str) -> None:
    """What stands in the place of landmarks or of the scalp's picture is not passed over."""
    write_head_obj(tmp_path / "head.obj", default_head())
    text = (tmp_path / "head.obj").read_text()
    (tmp_path / "head.obj").write_text(text.replace("g scalp", "g other"))
    (tmp_path / name).unlink(missing_ok=True)
    PLACES[place](tmp_path / name)
    scalp = "other" if "landmarks" in name else None
    _refused(lambda: read_head(tmp_path / "head.obj", scalp=scalp), tmp_path / name)


@pytest.mark.parametrize("place", WITHOUT_EMPTY)
@pytest.mark.parametrize(
    "name", ["photos/3_*", "masks/3_*", "strokes/3_*", "landmarks.json", "capture.toml"]
)
def test_files_of_a_capture_are_files(tmp_path: Path, name: str, place: str) -> None:
    """Photos, masks, strokes, landmarks and settings that are no files are named."""
    for source in sample_folder().rglob("*"):
        if source.is_file():
            copy = tmp_path / source.relative_to(sample_folder())
            copy.parent.mkdir(exist_ok=True)
            copy.symlink_to(source)
    path = next(tmp_path.glob(name), tmp_path / name)
    path.unlink(missing_ok=True)
    PLACES[place](path)

    def read() -> None:
        for view in read_capture(tmp_path).views:
            if view.strokes_path is not None:
                read_strokes(view.strokes_path)

    _refused(read, path)


@pytest.mark.parametrize("place", WITHOUT_EMPTY)
def test_writing_replaces_files_alone(tmp_path: Path, place: str) -> None:
    """A device, pipe, socket or folder is not written over, and nothing is left beside it."""
    path = tmp_path / "target"
    PLACES[place](path)
    before = os.lstat(path).st_mode
    with pytest.raises((HairkitError, OSError), match="target"):
        write_bytes(path, b"data")
    assert os.lstat(path).st_mode == before
    assert [each.name for each in tmp_path.iterdir()] == ["target"]


@pytest.mark.parametrize("room", [0, 4096])
@pytest.mark.parametrize("name", Manager.loaded(autoload=False).names("export_groom"))
def test_a_full_disk_leaves_nothing(manager: Manager, tmp_path: Path, name: str, room: int) -> None:
    """Where there is no room the old file stays, no part is left, and one line names the file."""
    if name == "usd":
        pytest.importorskip("pxr")
    path = tmp_path / f"hair{manager.info(name).suffixes[0]}"
    path.write_bytes(b"old")
    groom = rich_groom(60)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        with pytest.raises((HairkitError, OSError)) as caught:
            manager.call("export_groom", name, groom=groom, path=path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    line, code = explain(caught.value)
    assert code == 2
    assert path.name in line
    assert "\n" not in line
    assert len(line) < 300 + len(str(path))
    assert path.read_bytes() == b"old"
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def _reading_calls(path: Path) -> list[str]:
    """Return the calls in a file that read files in another way than `hairkit.storage` does."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.Call):
            continue
        text = ast.unparse(node.func)
        method = isinstance(node.func, ast.Attribute)
        if (method and text.rpartition(".")[2] in ("read_bytes", "read_text")) or text in (
            "np.load", "np.fromfile", "np.loadtxt", "np.genfromtxt", "np.memmap", "cv2.imread",
            "trimesh.load", "trimesh.load_mesh", "trimesh.load_path",
        ):  # fmt: skip
            found.append(f"{path.relative_to(PROJECT)}:{node.lineno} {text}")
    return found


def test_one_function_opens_what_users_name() -> None:
    """Modules read files through `hairkit.storage`, but for those that read hairkit's own."""
    sources = [*(PROJECT / "hairkit").rglob("*.py"), *(PROJECT / "plugins").rglob("*.py")]
    others = [path for path in sources if str(path.relative_to(PROJECT)) not in OWN_FILES]
    assert [call for path in others for call in _reading_calls(path)] == []
    assert np.all([(PROJECT / name).is_file() for name in OWN_FILES])


FAR = [1e30, -1e30, 1001.0]
"""Metres where no hair or head is."""


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize(
    "name", ["points", "widths", "head.vertices", "head.joints", "head.capsules.first"]
)
def test_grooms_of_absurd_size_are_refused(tmp_path: Path, name: str, far: float) -> None:
    """A single length beyond a kilometre is named with its file."""
    path = tmp_path / "groom.npz"
    rich_groom(4).save(path)
    arrays = read_npz(path)
    arrays[name].reshape(-1)[3] = abs(far) if name == "widths" else far
    write_npz(path, arrays)
    with pytest.raises(FormatError, match=r"groom\.npz: .* expected at most 1000 m"):
        Groom.load(path)


@pytest.mark.parametrize("far", FAR)
def test_heads_of_absurd_size_are_refused(tmp_path: Path, far: float) -> None:
    """A vertex beyond a kilometre is named with its file."""
    path = tmp_path / "head.obj"
    write_head_obj(path, default_head())
    path.write_text(path.read_text().replace("v ", f"v {far:g} 0 0\nv ", 1))
    with pytest.raises(FormatError, match=r"head\.obj: "):
        read_head(path)


@pytest.mark.parametrize(
    "name", ["obj", "cyhair", "ply", "usc_data", "alembic", "gltf", "hairworks", "tressfx"]
)
def test_strands_of_absurd_size_are_refused(manager: Manager, tmp_path: Path, name: str) -> None:
    """One tip a few kilometres off is refused by every reader of bare strands."""
    groom = rich_groom(40)
    points = groom.strands.points.copy()
    points[-1] = 3000.0
    groom = replace(groom, strands=replace(groom.strands, points=points))
    path = tmp_path / f"hair{manager.info(name).suffixes[0]}"
    manager.call("export_groom", name, groom=groom, path=path)
    with pytest.raises(FormatError, match=r"hair\..* m"):
        manager.call("import_groom", name, path=path)
