"""Laws of the server against hostile clients: nothing they send succeeds, others are served."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import zlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from hairkit.studio.project import Project
from hairkit.studio.uploads import JSON_BYTES, PHOTO_BYTES

Server = Any  # of conftest.py


@pytest.fixture(scope="module")
def server(
    tmp_path_factory: pytest.TempPathFactory, start_studio: Callable[[Path], Server]
) -> Iterator[Server]:
    """One studio with a session for all attacks."""
    started = start_studio(tmp_path_factory.mktemp("hostile") / "head")
    yield started.enter()
    started.kill()


REQUESTS = int(os.environ.get("HAIRKIT_HOSTILE_REQUESTS", "400"))
MOST_MEMORY = 500 * 2**20
"""Bytes of the server's process."""


def memory(server: Server) -> int:
    """Return the resident memory of the server's process, bytes."""
    status = Path(f"/proc/{server.process.pid}/status")
    if not status.is_file():
        pytest.skip("this system has no /proc")
    line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024


def bomb() -> bytes:
    """Return a PNG file of a few kilobytes that claims 60,000 x 60,000 pixels."""

    def chunk(name: bytes, data: bytes) -> bytes:
        body = name + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    pixels = zlib.compress(bytes(2**22), 9)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    )


def raw(server: Server, data: bytes, wait: float = 20.0) -> bytes:
    """Send bytes as they are and return what comes back before the line is closed."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=wait) as line:
        with contextlib.suppress(OSError):
            line.sendall(data)
        found = b""
        with contextlib.suppress(OSError):
            while piece := line.recv(65536):
                found += piece
        return found


PATHS = [
    "/../pyproject.toml", "/..%2f..%2f..%2fetc/passwd", "/%2e%2e/%2e%2e/guard.py", "//etc/passwd",
    "/api/result/../../capture.toml", "/api/result/..%2fstudio.json", "/api/photos/-1/large",
    "/api/photos/99999999999999999999/large", "/api/photos/1%00/large", "/app.py", "/api/../app.py",
    "/api/result/%2e%2e", "/\\..\\..\\windows", "/api/photos/1;/large",
]  # fmt: skip


@pytest.mark.parametrize("path", PATHS)
def test_no_path_leads_out(server: Server, path: str) -> None:
    """A path that is no page and no route gives nothing, whoever asks."""
    answer = server.ask("GET", path)
    assert answer.status in (400, 404, 422), (path, answer.status)
    assert b"root:" not in answer.body


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Cookie": None}, 401),
        ({"Cookie": "hairkit-1=x; hairkit=y"}, 401),
        ({"Origin": "https://evil.example"}, 403),
        ({"Origin": None}, 403),
        ({"Origin": "null"}, 403),
        ({"Host": "evil.example"}, 421),
        ({"Host": "127.0.0.1"}, 421),
    ],
)
def test_only_own_pages_change_something(
    server: Server, headers: dict[str, Any], status: int
) -> None:
    """Without session, from another origin or under another name nothing is changed."""
    for method, path in [
        ("POST", "/api/build"),
        ("DELETE", "/api/photos/1"),
        ("PUT", "/api/order"),
    ]:
        assert server.ask(method, path, {}, headers).status == status


def test_a_link_opens_one_session(server: Server) -> None:
    """A token that was used, is wrong or is no text opens nothing."""
    for token in (server.token, "x" * 32, "", None, 7, ["a"], "ä" * 9):
        assert server.ask("POST", "/api/session", {"token": token}).status == 403


def test_answers_say_what_browsers_may_do(server: Server) -> None:
    """Every answer, of errors too, allows nothing from elsewhere and is not kept."""
    for path in ("/", "/app.js", "/api/project", "/nothing", "/api/photos/9/large"):
        headers = server.ask("GET", path).headers
        assert "default-src 'self'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert "server" not in headers


JPEG = b"\xff\xd8\xff\xe0"


@pytest.mark.parametrize(
    ("body", "statuses"),
    [
        (b"", (415,)),
        (b"<svg xmlns='http://www.w3.org/2000/svg'><script>1</script></svg>", (415,)),
        (b"%PDF-1.7 ........................", (415,)),
        (b"GIF89a..........................", (415,)),
        (b"\x1f\x8b\x08 zipped.................", (415,)),
        (JPEG + b"\0" * 5000, (422,)),
        (JPEG + b"\xff" * 5000, (422,)),
        (b"\x89PNG\r\n\x1a\n" + b"\0" * 500, (422,)),
        (bomb(), (422,)),
        (b"\0\0\0\x18ftypheic" + b"\0" * 900, (422,)),
    ],
    ids=["empty", "svg", "pdf", "gif", "gzip", "zeros", "fill", "png", "bomb", "heic"],
)
def test_what_is_no_photo_is_refused(
    server: Server, body: bytes, statuses: tuple[int, ...]
) -> None:
    """Wrong and damaged files are refused in one line; nothing of them is left."""
    answer = server.ask("POST", "/api/photos", body)
    assert answer.status in statuses, answer.body
    assert "\n" not in answer.json["error"]
    project = server.folder
    assert not list((project / "photos").iterdir())
    assert not list((project / ".studio" / "incoming").iterdir())


def head(server: Server, path: str, *lines: str) -> bytes:
    """Return the head of a POST request of the session."""
    own = [f"Host: 127.0.0.1:{server.port}", f"Origin: {server.origin}", f"Cookie: {server.cookie}"]
    return "\r\n".join([f"POST {path} HTTP/1.1", *own, *lines, "", ""]).encode()


def test_too_large_is_refused_early(server: Server) -> None:
    """A length beyond the limit, said or streamed in chunks, ends the request."""
    said = head(server, "/api/photos", f"Content-Length: {PHOTO_BYTES + 1}")
    assert b" 413 " in raw(server, said).split(b"\r\n")[0]
    chunk = b"100000\r\n" + b"[" * 0x100000 + b"\r\n"
    chunked = head(server, "/api/session", "Transfer-Encoding: chunked") + chunk * (
        JSON_BYTES // 0x100000 + 2
    )
    assert b" 413 " in raw(server, chunked).split(b"\r\n")[0]
    assert memory(server) < MOST_MEMORY


@pytest.mark.parametrize(
    "data",
    [
        b"\x16\x03\x01\x02\x00\x01\x00",
        b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
        b"POST /api/photos HTTP/1.1\r\nContent-Length: 5\r\nContent-Length: 6\r\n\r\nhello",
        b"POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nZZ\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 20_000 + b"\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"TRACE / HTTP/1.1\r\nHost: x\r\n\r\n",
    ],
    ids=["tls", "hosts", "lengths", "chunks", "path", "headers", "version", "trace"],
)
def test_broken_requests_are_refused(server: Server, data: bytes) -> None:
    """What is no HTTP, or two things at once, is answered by an error, and the server goes on."""
    answer = raw(server, data)
    assert not answer or answer.split(b" ")[1][:1] == b"4", answer[:80]
    assert server.ask("GET", "/api/project").status == 200


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"[]",
        b"{",
        b"[" * 1000,
        b'{"order": NaN}',
        b'{"order": ["1"]}',
        b'{"order": [1, 1]}',
        b"\xff\xfe",
    ],
)
def test_broken_json_changes_nothing(server: Server, body: bytes) -> None:
    """Bodies of the wrong kind are refused in one line."""
    answer = server.ask("PUT", "/api/order", body)
    assert answer.status in (400, 422)
    assert "\n" not in answer.json["error"]


def test_slow_clients_do_not_hold_others_up(server: Server) -> None:
    """While many clients send one byte and wait, others are served; the slow ones are let go."""
    begun = head(server, "/api/photos", "Content-Length: 100000") + JPEG
    lines = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(40)]
    try:
        for line in lines:
            line.sendall(begun)
        assert server.ask("GET", "/api/project", timeout=20).status == 200
        lines[0].settimeout(60)
        assert b" 408 " in lines[0].recv(65536).split(b"\r\n")[0]
    finally:
        for line in lines:
            line.close()


def kinds_of(server: Server) -> list[tuple[str, str, Any, dict[str, Any]]]:
    """Return twenty requests, none of which may succeed."""
    evil, svg = {"Origin": "http://evil.example"}, b"<svg xmlns='http://www.w3.org/2000/svg'/>"
    return [
        ("GET", "/api/project", None, {"Cookie": None}),
        ("GET", "/", None, {"Host": "evil.example"}),
        ("GET", "/../../etc/passwd", None, {}),
        ("GET", "/api/result/..%2fstudio.json", None, {}),
        ("GET", "/api/photos/99999999999999999999/large", None, {}),
        ("DELETE", "/api/photos/5", None, evil),
        ("PATCH", "/api/photos/5", {"view": "front"}, {}),
        ("POST", "/api/session", {"token": server.token}, {}),
        ("POST", "/api/photos", bomb(), {}),
        ("POST", "/api/photos", JPEG + bytes(10_000), {}),
        ("POST", "/api/photos", svg * 100, {}),
        ("POST", "/api/photos", b"", {}),
        ("POST", "/api/look/0", b"\x1f\x8b\x08" + bytes(500), {}),
        ("POST", "/api/video", b"\0\0\0\x18ftypisom" + b"\xff" * 500, {}),
        ("PUT", "/api/order", {"order": [5]}, {}),
        ("PUT", "/api/order", b"[" * 5000, {}),
        ("PUT", "/api/photos/5/strokes", {"shapes": [{"label": "../../x"}]}, {}),
        ("PUT", "/api/choices", {"options": {"window_sigma": "1e999"}}, {}),
        ("POST", "/api/head", {"photo": "../../etc/passwd", "shift": [9, 9]}, {}),
        ("POST", "/api/photos/5/strands", {"options": {"__class__": 1}}, {}),
    ]


def test_a_crowd_of_requests_at_once(server: Server) -> None:
    """Of 400 requests of twenty kinds, 100 at a time, none succeeds, and memory stays bounded.

    `HAIRKIT_HOSTILE_REQUESTS` asks for another number.
    """
    kinds = kinds_of(server)

    def ask(number: int) -> int:
        method, path, body, headers = kinds[number % len(kinds)]
        try:
            return int(server.ask(method, path, body, headers, timeout=300).status)
        except OSError:
            return 0  # the line was closed

    with ThreadPoolExecutor(100) as pool:
        statuses = list(pool.map(ask, range(REQUESTS)))
    wrong = {kinds[k % len(kinds)][:2] for k, s in enumerate(statuses) if s and s < 400}
    assert not wrong
    assert all(status < 500 or status == 503 for status in statuses), set(statuses)
    assert server.ask("GET", "/api/project").status == 200
    assert memory(server) < MOST_MEMORY
    assert not Project(server.folder).shots
    assert not list((server.folder / ".studio" / "incoming").iterdir())


def test_what_is_refused_names_no_file_of_the_server(server: Server, tmp_path: Path) -> None:
    """A picture bomb is `the photo`; a wrong link says what to open."""
    size = struct.pack(">IIBBBBB", 20_000, 20_000, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", size), (b"IEND", b"")]
    data = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
        for name, body in chunks
    )
    answer = server.ask("POST", "/api/photos", data)
    assert answer.status == 422
    said = json.loads(answer.body)["error"]
    assert said.startswith("the photo: 20000 x 20000 pixels")
    assert str(tmp_path) not in said
    answer = server.ask("POST", "/api/session", {"token": "x" * 22})
    assert answer.status == 403
    assert "open the last one in the terminal" in json.loads(answer.body)["error"]
