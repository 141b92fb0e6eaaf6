"""Laws of files at URLs: they are read, written and copied as those at paths are."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from pathlib import Path

import fsspec
import pytest

from hairkit import remote
from hairkit.errors import InputError, MissingExtraError


@pytest.fixture(params=["path", "file", "memory"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """An empty folder: a path, its URL, or a folder in memory."""
    path = tmp_path / "place"
    path.mkdir()
    memory = f"memory://{uuid.uuid4().hex}"
    fsspec.filesystem("memory").mkdir(memory)
    yield {"path": str(path), "file": path.as_uri(), "memory": memory}[request.param]
    fsspec.filesystem("memory").rm(memory, recursive=True)


@pytest.fixture(autouse=True)
def own_copies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Copies of this test lie in its folder."""
    (tmp_path / "copies").mkdir()
    monkeypatch.setattr(remote.tempfile, "tempdir", str(tmp_path / "copies"))


def test_what_was_written_is_read(place: str) -> None:
    """A file is there once it was written, whole, and its folder lists it."""
    file = remote.join(place, "a", "b.txt")
    assert not remote.exists(file)
    if not remote.is_url(place):
        Path(place, "a").mkdir()
    remote.write_text(file, "grün")
    assert remote.exists(file)
    assert not remote.exists(remote.join(place, "a"))
    assert remote.read_bytes(file).decode() == "grün"
    assert remote.children(place) == [("a", True)]
    assert remote.children(remote.join(place, "a")) == [("b.txt", False)]
    with pytest.raises(InputError, match="5 bytes, hairkit reads up to 4"):
        remote.read_bytes(file, 4)
    with pytest.raises(InputError, match="no such"):
        remote.read_bytes(remote.join(place, "none"))


@pytest.mark.parametrize("place", ["file", "memory"], indirect=True)
def test_a_folder_is_copied_there_and_back(place: str, tmp_path: Path) -> None:
    """All files but those that are left out; a copy is made anew when something has changed."""
    source = tmp_path / "source"
    for name in ("photos/1.txt", "top.txt", "work/big.txt"):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_text(name)
    remote.send(source, remote.join(place, "anna"), without="work")
    copy = remote.fetch(remote.join(place, "anna"))
    assert copy.name == "anna"
    found = {str(p.relative_to(copy)): p.read_text() for p in copy.rglob("*") if p.is_file()}
    assert found == {"photos/1.txt": "photos/1.txt", "top.txt": "top.txt"}
    assert remote.fetch(remote.join(place, "anna")) == copy
    remote.write_text(remote.join(place, "anna", "top.txt"), "longer than before")
    newer = remote.fetch(remote.join(place, "anna"))
    assert newer != copy
    assert (newer / "top.txt").read_text() == "longer than before"
    for each in (copy, newer):
        remote.forget(each)
    remote.forget(source)
    assert [path.name for path in remote.copies().iterdir()] == []
    assert source.is_dir()


@pytest.mark.parametrize("place", ["file", "memory"], indirect=True)
def test_one_file_is_copied(place: str) -> None:
    """A video at a URL is a file of its own name."""
    remote.write_text(remote.join(place, "turn.mp4"), "film")
    copy = remote.fetch(remote.join(place, "turn.mp4"))
    assert (copy.name, copy.read_text()) == ("turn.mp4", "film")


def test_what_is_wrong_with_a_url_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """A service that nobody knows, a folder that is not there, a library that is missing."""
    for url in ("nosuch://bucket/a", "memory://nobody/here", "file:///nobody/here"):
        with pytest.raises((InputError, MissingExtraError), match=url) as caught:
            remote.fetch(url)
        assert "\n" not in str(caught.value)

    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(remote.importlib, "import_module", absent)
    with pytest.raises(MissingExtraError, match=r"pip install 'hairkit\[batch\]'"):
        remote.children("memory://a")
