"""Bodies of requests, read within limits of size and time."""

from __future__ import annotations

import asyncio
import json
import secrets
from http import HTTPStatus
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request

PHOTO_BYTES = 64 * 2**20
"""Largest photo: 48 megapixels as JPEG take 25 MB, as PNG of an edited one more."""
VIDEO_BYTES = 2 * 2**30
"""Largest video: a minute of 4K takes 400 MB."""
JSON_BYTES = 2 * 2**20
"""Largest drawing: a thousand strokes of a hundred points."""
PAUSE_S, WHOLE_S = 10.0, 900.0
"""Longest pause between two pieces of a body, and longest time for all of it."""
LEAST_RATE = 20_000
"""Bytes a second that must arrive on average after the first `PAUSE_S`: a slow phone sends
fifty times that."""
AT_ONCE = asyncio.Semaphore(4)
"""Uploads that are received at the same time; others wait."""
DEEPEST = 12
"""Nested brackets of a JSON document; labelme's has five."""
_MAGIC = {"photo": (b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"), "video": (b"\x1aE\xdf\xa3", b"RIFF")}
"""First bytes of JPEG and PNG, of Matroska (WebM) and AVI; ISO files have `ftyp` at byte 4."""
_FIRST = 12


async def receive_file(request: Request, folder: Path, kind: str) -> Path:
    """Return a file in `folder` with the body of a request: a `photo` or a `video`.

    Raises `HTTPException`: 413 for too large, 415 for another kind of file, 408 for too slow.
    """
    limit = PHOTO_BYTES if kind == "photo" else VIDEO_BYTES
    _check_length(request, limit)
    path = folder / f"upload-{secrets.token_hex(8)}.part"
    try:
        async with AT_ONCE:
            with path.open("wb") as file:
                first = b""
                async for piece in _pieces(request, limit):
                    if len(first) < _FIRST:
                        first += piece[: _FIRST - len(first)]
                        if len(first) >= _FIRST and not _is_kind(first, kind):
                            raise HTTPException(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"not a {kind}")
                    file.write(piece)
        if not _is_kind(first, kind):
            raise HTTPException(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, f"not a {kind}")
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    return path


async def receive_json(request: Request) -> dict[str, Any]:
    """Return the JSON object that is the body of a request; `HTTPException` 400 for any other."""
    _check_length(request, JSON_BYTES)
    body = b"".join([piece async for piece in _pieces(request, JSON_BYTES)])
    depth = deepest = 0
    for byte in body:
        depth += (byte in b"[{") - (byte in b"]}")
        deepest = max(deepest, depth)
    if deepest > DEEPEST:
        raise HTTPException(HTTPStatus.BAD_REQUEST, "nested too deep")
    try:
        document = json.loads(body, parse_constant=_refuse_constant)
    except ValueError as error:
        raise HTTPException(HTTPStatus.BAD_REQUEST, "not JSON") from error
    if not isinstance(document, dict):
        raise HTTPException(HTTPStatus.BAD_REQUEST, "not a JSON object")
    return document


def _check_length(request: Request, limit: int) -> None:
    said = request.headers.get("content-length")
    if said is not None and (not said.isdigit() or int(said) > limit):
        raise HTTPException(
            HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"more than {limit} bytes", {"Connection": "close"}
        )


async def _pieces(request: Request, limit: int) -> Any:
    """Yield the pieces of a body as they come."""
    clock = asyncio.get_running_loop().time
    began, total = clock(), 0
    stream = request.stream()
    while True:
        try:
            piece = await asyncio.wait_for(anext(stream), PAUSE_S)
        except StopAsyncIteration:
            return
        except (TimeoutError, ClientDisconnect) as error:
            raise HTTPException(
                HTTPStatus.REQUEST_TIMEOUT, "too slow", {"Connection": "close"}
            ) from error
        total += len(piece)
        taken = clock() - began
        if total > limit:
            raise HTTPException(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                f"more than {limit} bytes",
                {"Connection": "close"},
            )
        slow = taken > PAUSE_S and total < LEAST_RATE * (taken - PAUSE_S)
        if taken > WHOLE_S or slow:
            raise HTTPException(HTTPStatus.REQUEST_TIMEOUT, "too slow", {"Connection": "close"})
        if piece:
            yield piece


def _is_kind(first: bytes, kind: str) -> bool:
    if kind == "photo":
        heic = first[4:8] == b"ftyp" and first[8:12] in _HEIC
        return heic or first.startswith(_MAGIC["photo"])
    return (first[4:8] == b"ftyp" and first[8:12] not in _HEIC) or first.startswith(_MAGIC["video"])


_HEIC = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1", b"avif")


def _refuse_constant(name: str) -> None:
    raise ValueError(name)  # NaN and Infinity are no JSON
