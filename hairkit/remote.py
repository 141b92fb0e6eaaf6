"""Files and folders at URLs that fsspec knows: `s3://bucket/captures`, `sftp://host/captures`.

Functions take paths, too. Which service a URL means, and its credentials, are fsspec's settings:
environment variables of the service, and files in `~/.config/fsspec/`.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hairkit.errors import HairkitError, InputError, MissingExtraError, one_line
from hairkit.storage import MAX_FILE_BYTES
from hairkit.storage import read_bytes as read_local
from hairkit.storage import write_text as write_local
from hairkit.system import user_id

STAMPS = ("ETag", "etag", "mtime", "LastModified", "last_modified", "updated", "created")
"""What services call that which changes with a file's content."""


def is_url(place: str | os.PathLike[str]) -> bool:
    """Return whether a text is a URL and no path.

    >>> is_url("s3://bucket/captures"), is_url("captures/anna")
    (True, False)
    """
    return "://" in os.fspath(place)


def join(place: str | os.PathLike[str], *names: str) -> str:
    """Return the place of a file in a folder.

    >>> join("s3://bucket/captures/", "anna")
    's3://bucket/captures/anna'
    """
    text = os.fspath(place)
    return "/".join([text.rstrip("/"), *names]) if is_url(text) else str(Path(text, *names))


def read_bytes(place: str | os.PathLike[str], limit: int = MAX_FILE_BYTES) -> bytes:
    """Return a file's bytes; `InputError` where there is none, or above `limit` bytes."""
    if not is_url(place):
        return read_local(place, limit)
    with _files(place) as (files, path):
        size = int(files.size(path) or 0)
        if size > limit:
            raise InputError(f"{place}: {size} bytes, hairkit reads up to {limit}")
        return bytes(files.cat_file(path))


def write_text(place: str | os.PathLike[str], text: str) -> None:
    """Write a file whole."""
    if not is_url(place):
        write_local(place, text)
        return
    with _files(place) as (files, path):
        files.makedirs(files._parent(path), exist_ok=True)
        files.pipe_file(path, text.encode())


def exists(place: str | os.PathLike[str]) -> bool:
    """Return whether there is a file."""
    if not is_url(place):
        return Path(place).is_file()
    with _files(place) as (files, path):
        return bool(files.isfile(path))


def children(place: str) -> list[tuple[str, bool]]:
    """Return what a folder holds, sorted: names, and whether each is a folder itself."""
    if not is_url(place):
        return sorted((path.name, path.is_dir()) for path in Path(place).iterdir())
    with _files(place) as (files, path):
        files.invalidate_cache()
        found = [
            (e["name"].rstrip("/"), e["type"] == "directory") for e in files.ls(path, detail=True)
        ]
        inside = [(name, folder) for name, folder in found if name != path.rstrip("/")]
        return sorted((name.rpartition("/")[2], folder) for name, folder in inside)


def describe(url: str) -> dict[str, str]:
    """Return size and stamp of each file in a folder at a URL, or of one file, by its path."""
    with _files(url) as (files, path):
        files.invalidate_cache()
        found = files.find(path, detail=True)
        if not found:
            raise InputError(f"{url}: no such folder or file")
        names = {name: name[len(path.rstrip("/")) :].lstrip("/") for name in found}
        return {
            names[name]: f"{entry['size']} {next((entry[k] for k in STAMPS if k in entry), '')}"
            for name, entry in sorted(found.items())
        }


def fetch(url: str) -> Path:
    """Return a copy of the folder or file at a URL, on this machine.

    It lies with temporary files, and is used again as long as the URL's files stay as they are.
    """
    state = hashlib.sha256(f"{url} {describe(url)}".encode()).hexdigest()
    copy = copies() / state / url.rstrip("/").rpartition("/")[2]
    if copy.exists():
        return copy
    with tempfile.TemporaryDirectory(dir=copies(), prefix=".part-") as folder, _files(url) as at:
        files, path = at
        files.get(path.rstrip("/"), f"{folder}/{copy.name}", recursive=True)
        with contextlib.suppress(OSError):  # another process was faster
            os.rename(folder, copy.parent)
            os.mkdir(folder)
    return copy


def send(folder: Path, url: str, *, without: str) -> None:
    """Copy the files of a folder to a URL, but for those of its folder `without`."""
    with _files(url) as (files, path):
        for source in sorted(p for p in folder.rglob("*") if p.is_file()):
            part = source.relative_to(folder)
            if part.parts[0] != without:
                target = f"{path.rstrip('/')}/{part.as_posix()}"
                files.makedirs(files._parent(target), exist_ok=True)
                files.put_file(str(source), target)


def copies() -> Path:
    """Return this user's folder for copies of what lies at URLs."""
    folder = Path(tempfile.gettempdir()) / f"hairkit-copies-{user_id()}"
    folder.mkdir(mode=stat.S_IRWXU, exist_ok=True)
    if folder.stat().st_uid != user_id():
        raise InputError(f"{folder}: belongs to somebody else; set TMPDIR to a folder of yours")
    return folder


def forget(copy: Path) -> None:
    """Remove a copy that `fetch` made; leaves anything else as it is."""
    if copies() in copy.parents:
        shutil.rmtree(copies() / copy.relative_to(copies()).parts[0], ignore_errors=True)


@contextlib.contextmanager
def _files(url: str | os.PathLike[str]) -> Iterator[tuple[Any, str]]:
    """Yield fsspec's file system and the path in it; what goes wrong there is one line."""
    try:
        core: Any = importlib.import_module("fsspec.core")
    except ImportError as error:
        raise MissingExtraError(
            f"{url}: fsspec is not installed; pip install 'hairkit[batch]'"
        ) from error
    try:
        yield core.url_to_fs(os.fspath(url))
    except HairkitError:
        raise
    except ImportError as error:  # the library of this service
        raise MissingExtraError(f"{url}: {_line(error)}") from error
    except FileNotFoundError as error:
        raise InputError(f"{url}: no such folder or file") from error
    except Exception as error:  # each service has errors of its own
        raise InputError(f"{url}: {_line(error)}") from error


def _line(error: Exception) -> str:
    return one_line(error) or type(error).__name__
