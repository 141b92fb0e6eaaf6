"""A studio on a folder, asked as a page would ask it, and a browser that shows its pages."""

from __future__ import annotations

import http.client
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import pytest
from studio_browser import GUIDES, OPTION, SLOW_S, USED, opened

from hairkit.io.capture_reader import sample_folder

START_S = 60
SIZE = (360, 480)
"""Pixels of the photos: a third of the time of the sample's own."""
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")


@dataclass
class Answer:
    """What the server said."""

    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        """The body as JSON."""
        return json.loads(self.body)


@dataclass
class Server:
    """A studio that runs in a process of its own."""

    folder: Path
    process: subprocess.Popen[str]
    link: str
    cookie: str = ""
    port: int = field(init=False)
    token: str = field(init=False)

    def __post_init__(self) -> None:
        self.port = int(self.link.split(":")[2].split("/")[0])
        self.token = self.link.split("#t=")[1]

    @property
    def origin(self) -> str:
        """What a page of this server sends as its origin."""
        return f"http://127.0.0.1:{self.port}"

    def ask(
        self,
        method: str,
        path: str,
        body: Any = None,
        headers: dict[str, str | None] | None = None,
        timeout: float = 120,
    ) -> Answer:
        """Return the answer to a request of a page; headers of None are left out."""
        sent: dict[str, str | None] = {"Origin": self.origin, "Cookie": self.cookie or None}
        data = json.dumps(body).encode() if isinstance(body, dict) else body
        sent |= headers or {}
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        try:
            kept = {name: value for name, value in sent.items() if value is not None}
            connection.request(method, path, data, kept)
            answer = connection.getresponse()
            named = {name.lower(): value for name, value in answer.getheaders()}
            return Answer(answer.status, named, answer.read())
        finally:
            connection.close()

    def enter(self) -> Server:
        """Open a session by the link, as a page does."""
        answer = self.ask("POST", "/api/session", {"token": self.token})
        assert answer.status == 200, answer.body
        self.cookie = answer.headers["set-cookie"].split(";")[0]
        return self

    def kill(self) -> None:
        """End the process as a power failure would."""
        self.process.kill()
        self.process.wait()
        if self.process.stderr is not None:
            self.process.stderr.close()


def start(folder: Path, *words: str) -> Server:
    """Start a studio on a folder."""
    command = [sys.executable, "-m", "hairkit", "studio", str(folder), "--no-browser", *words]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=os.environ)
    assert process.stderr is not None
    line = process.stderr.readline()
    assert line.startswith("open http"), line + process.stderr.read()
    return Server(folder, process, line.split()[1])


@pytest.fixture(scope="session")
def start_studio() -> Callable[..., Server]:
    """The function that starts a studio on a folder."""
    return start


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    """A studio on a new project, with a session."""
    started = start(tmp_path / "head")
    try:
        yield started.enter()
    finally:
        started.kill()


@pytest.fixture(scope="session")
def photos(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The photos of the sample, in their order, small."""
    folder = tmp_path_factory.mktemp("photos")
    for path in sorted((sample_folder() / "photos").iterdir()):
        picture = cv2.resize(cv2.imread(str(path)), SIZE, interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(folder / path.name), picture, [cv2.IMWRITE_JPEG_QUALITY, 95])
    return sorted(folder.iterdir())


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Headless Chromium with a camera that shows a test picture."""
    if CHROMIUM is None:
        pytest.skip("there is no chromium on this machine: apt-get install chromium")
    sync_api = pytest.importorskip("playwright.sync_api")
    arguments = [
        "--no-sandbox", "--disable-quic", "--no-first-run", "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader", "--use-fake-device-for-media-stream",
        "--use-fake-ui-for-media-stream", "--disable-background-networking",
        "--disable-component-update", "--disable-sync",
    ]  # fmt: skip
    with sync_api.sync_playwright() as play:
        started = play.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield started
        started.close()


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory, photos: list[Path]) -> Path:
    """A project whose hair is made, with an option of its own; not to be changed."""
    studio = start(tmp_path_factory.mktemp("made") / "head", "--guides", str(GUIDES)).enter()
    try:
        studio.ask("PUT", "/api/hold", {"held": True})  # the hair is made once, of all photos
        for photo in photos:
            path = f"/api/photos?view={photo.stem.partition('_')[2]}"
            assert studio.ask("POST", path, photo.read_bytes()).status == 201
        assert studio.ask("PUT", "/api/choices", {"options": {OPTION: USED}}).status == 200
        studio.ask("PUT", "/api/hold", {"held": False})
        wait_for_hair(studio)
    finally:
        studio.kill()
    return studio.folder


@pytest.fixture
def story(made: Path, tmp_path: Path) -> Iterator[Server]:
    """A studio on a copy of the project whose hair is made; no session is open."""
    shutil.copytree(made, tmp_path / "head")
    started = start(tmp_path / "head", "--guides", str(GUIDES))
    yield started
    started.kill()


@pytest.fixture
def page(browser: Any, story: Server) -> Iterator[Any]:
    """The page that the link of that studio opens."""
    with opened(browser, story) as page:
        yield page


def wait_for_hair(studio: Server) -> None:
    """Wait until the hair of a studio with a session is made."""
    end = time.monotonic() + SLOW_S
    build: dict[str, Any] = {}
    while build.get("state") != "done":
        assert time.monotonic() < end, f"no hair: {build}"
        time.sleep(0.2)
        build = studio.ask("GET", "/api/project").json["build"]
        assert build["state"] != "failed", build
