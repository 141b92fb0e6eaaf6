"""The server: pages, routes and guard put together, and run until Ctrl-C."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import sys
import webbrowser
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hairkit.errors import InputError, MissingExtraError
from hairkit.system import keep_port, lock_file

try:
    import uvicorn
    from starlette.applications import Starlette
    from starlette.responses import RedirectResponse
    from starlette.routing import Mount, Route
    from starlette.staticfiles import StaticFiles
    from starlette.types import ASGIApp
except ImportError as error:
    raise MissingExtraError(
        "the studio needs starlette and uvicorn: pip install 'hairkit[studio]'"
    ) from error

from hairkit.studio.guard import Guard, Sessions
from hairkit.studio.lan import lan_addresses, make_certificate, qr_text
from hairkit.studio.project import Project
from hairkit.studio.routes import Routes
from hairkit.studio.studio import Studio

PORT = 8420
"""Port that is tried first; another that is free is taken where somebody has it."""
MOST_CONNECTIONS = 200
"""Connections at the same time, beyond which the server answers 503."""
KEEP_ALIVE_S, GRACE_S = 15, 3
"""Seconds for which idle connections stay, and for which answers may go on at the end."""
LARGEST_HEADER = 16 * 1024
"""Bytes of a request's headers."""


@dataclass(frozen=True)
class Settings:
    """How the server is reached."""

    port: int | None = None
    lan: bool = False
    browser: bool = True
    guides: int = 600


def serve(folder: str | os.PathLike[str], settings: Settings, say: Callable[[str], None]) -> None:
    """Serve a project until Ctrl-C; `say` receives lines for the user.

    Raises `InputError` where the port is taken or another studio has the project open.
    """
    with _locked(Path(folder)):
        project = Project(folder)
        addresses = lan_addresses() if settings.lan else []
        if settings.lan and not addresses:
            raise InputError("this machine is in no network; leave out --lan")
        with _socket(settings) as listening:
            asyncio.run(_run(project, settings, addresses, listening, say))


async def _run(
    project: Project,
    settings: Settings,
    addresses: list[str],
    listening: socket.socket,
    say: Callable[[str], None],
) -> None:
    port = listening.getsockname()[1]
    scheme = "https" if settings.lan else "http"
    names = [*addresses, "127.0.0.1", "localhost"]
    sessions = Sessions(f"hairkit-{port}")
    origin = f"{scheme}://{names[0]}:{port}"

    def link() -> str:
        made = f"{origin}/#t={sessions.issue()}"
        say(f"open {made}")
        return made

    studio = Studio(project, settings.guides)
    hosts = frozenset(f"{name}:{port}" for name in names)
    app = Guard(make_app(studio, sessions, link), sessions, hosts, scheme)
    config = _config(app)
    if settings.lan:
        certificate = make_certificate(project.folder / ".studio", addresses)
        config.ssl_certfile = str(certificate.certificate)
        config.ssl_keyfile = str(certificate.key)
        say("anybody in this network who has the link can see the photos")
        say(f"fingerprint of the certificate (SHA-256): {certificate.fingerprint}")
    first = link()
    if settings.lan and sys.stderr.isatty():
        say(qr_text(first))
    server = uvicorn.Server(config)
    if settings.browser:
        own = first.replace(names[0], "127.0.0.1", 1)
        asyncio.get_running_loop().call_later(1.0, webbrowser.open, own)
    await server.serve([listening])


def _config(app: ASGIApp) -> uvicorn.Config:
    """Return how requests are taken: few at a time, none of them large, nothing logged."""
    return uvicorn.Config(
        app,
        log_level="error",
        access_log=False,
        limit_concurrency=MOST_CONNECTIONS,
        timeout_keep_alive=KEEP_ALIVE_S,
        timeout_graceful_shutdown=GRACE_S,
        h11_max_incomplete_event_size=LARGEST_HEADER,
        http="h11",
        ws="none",
        server_header=False,
        date_header=False,
    )


def make_app(studio: Studio, sessions: Sessions, link: Callable[[], str]) -> ASGIApp:
    """Return the pages and routes of a studio, without the guard."""

    @contextlib.asynccontextmanager
    async def lifespan(_: object) -> AsyncIterator[None]:
        await studio.start()
        try:
            yield
        finally:
            await studio.close()

    pages = str(Path(__file__).parent / "pages")
    routes = [
        *Routes(studio, sessions, link).all(),
        Route("/favicon.ico", lambda _: RedirectResponse("/icon.svg")),
        Mount("/", StaticFiles(directory=pages, html=True)),
    ]
    return Starlette(routes=routes, lifespan=lifespan)


def _socket(settings: Settings) -> socket.socket:
    """Return a socket that listens, on loopback unless the network was asked for."""
    host = "0.0.0.0" if settings.lan else "127.0.0.1"
    ports = [settings.port] if settings.port is not None else [PORT, 0]
    for port in ports:
        listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        keep_port(listening)
        try:
            listening.bind((host, port))
            listening.listen()  # who opens the link at once waits until the server is there
            return listening
        except OSError:
            listening.close()
    raise InputError(f"port {settings.port} is taken; give another --port, or none")


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the project for one server; the system lets it go when the process ends."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: not a folder; name one for the project")
    (folder / ".studio").mkdir(parents=True, exist_ok=True)
    with (folder / ".studio" / "lock").open("wb") as file:
        if not lock_file(file.fileno(), folder):
            raise InputError(f"{folder}: another studio has this project open")
        yield
