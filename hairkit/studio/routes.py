"""What pages ask of the server."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from hairkit.errors import HairkitError, one_line
from hairkit.grooming.brushes import BRUSHES
from hairkit.io.capture_reader import EDITS
from hairkit.io.capture_toml import HeadEntry
from hairkit.options import make_options, option
from hairkit.stages import ORIENTED
from hairkit.storage import read_bytes
from hairkit.studio.downloads import made_file
from hairkit.studio.feedback import for_pages
from hairkit.studio.guard import SESSION_PATH, Sessions
from hairkit.studio.lan import qr_svg
from hairkit.studio.project import Shot
from hairkit.studio.result_page import result_page
from hairkit.studio.studio import CHOICES, PHOTO_S, Studio
from hairkit.studio.uploads import receive_file, receive_json
from hairkit.types.chosen import ChosenHair
from hairkit.types.edits import GROUPS, Edits

TURNS = (8, 12, 16, 24)
"""Numbers of views of a guided turn."""
MOST_PAIRINGS = 20
"""Links that may wait to be opened."""
_VIDEO_S = 900.0
_UNKNOWN = "there is none yet"
_KINDS = {".bin": "application/octet-stream", ".png": "image/png"}


@dataclass(frozen=True)
class Tone:
    """How the stage `orient` sees a photo; in the ranges of the page's sliders."""

    brightness: float = option(1.0, low=0.1, high=10, doc="Factor.")
    contrast: float = option(1.0, low=0.1, high=10, doc="Factor about middle grey.")


Handler = Callable[[Request], Awaitable[Response]]


class Routes:
    """Handlers that share the studio and the sessions."""

    def __init__(self, studio: Studio, sessions: Sessions, link: Callable[[], str]) -> None:
        """`link` returns a new link for a further browser."""
        self._studio = studio
        self._sessions = sessions
        self._writing = asyncio.Lock()
        """Held while a file is written: who asks for it meanwhile gets the same one."""
        self._link = link

    def all(self) -> list[Route]:
        """Return the routes below `/api`."""
        table: list[tuple[str, str, Handler]] = [
            (SESSION_PATH, "POST", self._open_session),
            ("/api/project", "GET", self._project),
            ("/api/events", "GET", self._events),
            ("/api/feedback", "GET", self._feedback),
            ("/api/guides/{count:int}", "GET", self._guides),
            ("/api/look/{azimuth:int}", "POST", self._look),
            ("/api/pairing", "POST", self._pairing),
            ("/api/photos", "POST", self._add_photo),
            ("/api/video", "POST", self._add_video),
            ("/api/order", "PUT", self._arrange),
            ("/api/hold", "PUT", self._hold),
            ("/api/photos/{id:int}", "PUT", self._retake),
            ("/api/photos/{id:int}", "DELETE", self._remove),
            ("/api/photos/{id:int}/small", "GET", partial(self._picture, size="small")),
            ("/api/photos/{id:int}/large", "GET", partial(self._picture, size="large")),
            ("/api/photos/{id:int}/outline", "GET", self._outline),
            ("/api/photos/{id:int}/strokes", "GET", self._strokes),
            ("/api/photos/{id:int}/strokes", "PUT", self._draw),
            ("/api/photos/{id:int}/landmarks", "PUT", self._mark),
            ("/api/photos/{id:int}/tone", "PUT", self._tone),
            ("/api/photos/{id:int}/strands", "POST", self._strands),
            ("/api/pose", "GET", self._pose),
            ("/api/head", "PUT", self._place_head),
            ("/api/head", "POST", self._nudge),
            ("/api/edits", "GET", self._edits),
            ("/api/edits", "PUT", self._edit),
            ("/api/edits/stroke", "POST", self._stroke),
            ("/api/choices", "GET", self._choices),
            ("/api/choices", "PUT", self._choose),
            ("/api/build", "POST", self._build),
            ("/api/build", "DELETE", self._stop),
            ("/api/result/hair", "GET", partial(self._made, name="studio-hair.bin")),
            ("/api/result/draft", "GET", partial(self._made, name=self._studio.project.draft.name)),
            ("/api/result/sheet", "GET", partial(self._made, name="contact_sheet.png")),
            ("/api/result/page", "GET", self._page),
            ("/api/result/{format:str}", "GET", self._file),
        ]
        return [Route(path, _clear(handler), methods=[method]) for path, method, handler in table]

    async def _open_session(self, request: Request) -> Response:
        token = (await receive_json(request)).get("token")
        secret = self._sessions.open(token) if isinstance(token, str) else None
        if secret is None:
            raise HTTPException(
                HTTPStatus.FORBIDDEN,
                "this link was used before, or is not whole; open the last one in the terminal",
            )
        response = JSONResponse({})
        secure = request.url.scheme == "https"
        response.set_cookie(
            self._sessions.cookie, secret, httponly=True, samesite="strict", secure=secure
        )
        if not self._sessions.unused:
            self._link()
        return response

    async def _project(self, request: Request) -> Response:
        return JSONResponse(self._studio.summary())

    async def _events(self, request: Request) -> Response:
        if self._studio.events.full:
            raise HTTPException(HTTPStatus.SERVICE_UNAVAILABLE, "too many pages are open")
        text = self._studio.events.listen(self._studio.summary)
        return StreamingResponse(text, media_type="text/event-stream")

    async def _feedback(self, request: Request) -> Response:
        return JSONResponse(for_pages())

    async def _guides(self, request: Request) -> Response:
        count = request.path_params["count"]
        if count not in TURNS:
            raise HTTPException(HTTPStatus.NOT_FOUND, f"a turn has {TURNS} views")
        above = "above" in request.query_params
        found = await self._studio.editor.call("guides", PHOTO_S, {"count": count, "above": above})
        return JSONResponse(found)

    async def _look(self, request: Request) -> Response:
        """Judge a small picture of the camera; it is not kept."""
        incoming = await receive_file(request, self._studio.project.incoming, "photo")
        values = {"incoming": str(incoming), "azimuth": request.path_params["azimuth"] % 360}
        try:
            return JSONResponse(await self._studio.drafter.call("look", PHOTO_S, values))
        finally:
            incoming.unlink(missing_ok=True)

    async def _pairing(self, request: Request) -> Response:
        if self._sessions.unused >= MOST_PAIRINGS:
            raise HTTPException(
                HTTPStatus.TOO_MANY_REQUESTS, "many links wait to be opened; use one of them"
            )
        link = self._link()
        return JSONResponse({"link": link, "qr": qr_svg(link)})

    async def _add_photo(self, request: Request) -> Response:
        incoming = await receive_file(request, self._studio.project.incoming, "photo")
        shot = await self._studio.add_photo(incoming, request.query_params.get("view"))
        return JSONResponse({"id": shot.id, **self._studio.facts[shot.id]}, HTTPStatus.CREATED)

    async def _retake(self, request: Request) -> Response:
        shot = self._shot(request)
        incoming = await receive_file(request, self._studio.project.incoming, "photo")
        await self._studio.add_photo(incoming, None, shot.id)
        return JSONResponse({"id": shot.id, **self._studio.facts[shot.id]})

    async def _add_video(self, request: Request) -> Response:
        studio = self._studio
        incoming = await receive_file(request, studio.project.incoming, "video")
        video = incoming.with_suffix(".mp4")
        incoming.replace(video)
        try:
            folder, name = str(studio.project.incoming), video.stem
            found = await studio.editor.call(
                "frames", _VIDEO_S, {"video": str(video), "folder": folder, "name": name}
            )
            shots = [await studio.add_photo(Path(path), None) for path in found["frames"]]
        finally:
            video.unlink(missing_ok=True)
        return JSONResponse({"ids": [shot.id for shot in shots]}, HTTPStatus.CREATED)

    async def _remove(self, request: Request) -> Response:
        shot = self._shot(request)
        answer = await self._change(partial(self._studio.project.remove, shot.id))
        self._studio.facts.pop(shot.id, None)
        return answer

    async def _arrange(self, request: Request) -> Response:
        order = (await receive_json(request)).get("order")
        if not isinstance(order, list) or not all(isinstance(n, int) for n in order):
            raise HTTPException(HTTPStatus.BAD_REQUEST, "expected the numbers of the photos")
        return await self._change(partial(self._studio.project.arrange, order))

    async def _change(
        self, change: Callable[[], object], touched: list[str] | None = None
    ) -> Response:
        """Change the project, and say so; `touched` as of `Studio.changed`."""
        async with self._studio.change:
            change()
        self._studio.changed(touched=touched)
        return JSONResponse({})

    async def _hold(self, request: Request) -> Response:
        self._studio.held = (await receive_json(request)).get("held") is True
        if not self._studio.held:
            self._studio.changed()
        return JSONResponse({})

    async def _picture(self, request: Request, size: str) -> Response:
        shot = self._shot(request)
        path = self._studio.project.picture(shot, size)
        if not path.is_file():
            await self._studio.draw_pictures(shot)
        return FileResponse(path, media_type="image/jpeg")

    async def _outline(self, request: Request) -> Response:
        return JSONResponse(await self._studio.outline(self._shot(request)))

    async def _strokes(self, request: Request) -> Response:
        path = self._studio.project.strokes(self._shot(request))
        if not path.is_file():
            return JSONResponse({"shapes": []})
        return FileResponse(path, media_type="application/json")

    async def _draw(self, request: Request) -> Response:
        shot, document = self._shot(request), await receive_json(request)
        async with self._studio.change:
            self._studio.project.draw(shot.id, document)
        self._studio.changed(touched=[shot.file])
        return JSONResponse(await self._studio.outline(shot))

    async def _mark(self, request: Request) -> Response:
        shot, points = self._shot(request), (await receive_json(request)).get("points")
        if points is not None and not _is_points(points):
            raise HTTPException(HTTPStatus.BAD_REQUEST, "expected pairs of numbers")
        return await self._change(partial(self._studio.project.mark, shot.id, points))

    async def _place_head(self, request: Request) -> Response:
        entry = make_options(HeadEntry, await receive_json(request), "head")
        return await self._change(partial(self._studio.project.place_head, entry), [CHOICES])

    async def _pose(self, request: Request) -> Response:
        return JSONResponse(await self._studio.editor.call("pose", PHOTO_S, self._placed()))

    async def _nudge(self, request: Request) -> Response:
        """Move the head as a hand did in one photo."""
        nudge = await receive_json(request)
        async with self._studio.change:
            values = {**self._placed(), "nudge": nudge}
            found = await self._studio.editor.call("pose", PHOTO_S, values)
            entry = make_options(HeadEntry, found.pop("entry"), "head")
            self._studio.project.place_head(entry)
        self._studio.changed(touched=[CHOICES])
        return JSONResponse(found)

    def _placed(self) -> dict[str, Any]:
        """Return what the task `pose` takes."""
        project = self._studio.project
        return {"folder": str(project.folder), "built": project.made.get("pose")}

    async def _tone(self, request: Request) -> Response:
        shot = self._shot(request)
        tone = make_options(Tone, await receive_json(request), "photo")
        change = partial(self._studio.project.tone, shot.id, tone.brightness, tone.contrast)
        return await self._change(change, [shot.file])

    async def _strands(self, request: Request) -> Response:
        """Draw the strands of a photo with options that need not be kept."""
        shot, said = self._shot(request), await receive_json(request)
        if not all(isinstance(said.get(key, {}), dict) for key in ("tone", "options")):
            raise HTTPException(HTTPStatus.BAD_REQUEST, "expected tone and options")
        tone = make_options(Tone, said.get("tone", {}), "photo")
        studio = self._studio
        with tempfile.TemporaryDirectory(dir=studio.project.incoming) as folder:
            path = Path(folder) / "strands.png"
            values = {
                **studio.drawn(shot),
                "options": said.get("options", {}),
                "tone": [tone.brightness, tone.contrast],
                "path": str(path),
            }
            await studio.editor.call("strands", PHOTO_S, values)
            return Response(read_bytes(path), media_type="image/png")

    async def _edits(self, request: Request) -> Response:
        strokes = self._studio.project.edits.values()
        return JSONResponse({"strokes": strokes, "brushes": [*BRUSHES], "groups": [*GROUPS]})

    async def _edit(self, request: Request) -> Response:
        """Keep the strokes over the hair: all of them, so that undoing one is leaving it out."""
        edits = Edits.of((await receive_json(request)).get("strokes"), "edits")
        return await self._change(partial(self._studio.project.edit, edits), [EDITS])

    async def _stroke(self, request: Request) -> Response:
        """Say what a stroke that is being drawn does to the page's guides."""
        values = {"stroke": (await receive_json(request)).get("stroke")}
        values["folder"] = str(self._studio.project.folder)
        return JSONResponse(await self._studio.editor.call("stroke", PHOTO_S, values))

    async def _choices(self, request: Request) -> Response:
        folder = {"folder": str(self._studio.project.folder)}
        return JSONResponse(await self._studio.editor.call("choices", PHOTO_S, folder))

    async def _choose(self, request: Request) -> Response:
        said = await receive_json(request)
        values = {"options": said.get("options", {}), "hair": said.get("hair", {})}
        if not all(isinstance(value, dict) for value in values.values()):
            raise HTTPException(HTTPStatus.BAD_REQUEST, "expected options and hair")
        found = await self._studio.editor.call("check", PHOTO_S, values)
        hair = make_options(ChosenHair, found["hair"], "hair")
        studio, before = self._studio, self._studio.project.chosen.settings
        async with studio.change:
            studio.project.choose(found["plugin"], found["options"], hair)
        followed = studio.project.chosen.settings != before
        studio.changed(touched=[CHOICES, *([ORIENTED.name] if followed else [])])
        return JSONResponse({})

    async def _build(self, request: Request) -> Response:
        if not self._studio.project.enough:
            raise HTTPException(HTTPStatus.CONFLICT, "add a photo first")
        self._studio.changed(ask=True)
        return JSONResponse({}, HTTPStatus.ACCEPTED)

    async def _stop(self, request: Request) -> Response:
        self._studio.builder.stop()
        return JSONResponse({}, HTTPStatus.ACCEPTED)

    async def _page(self, request: Request) -> Response:
        packet = self._studio.project.result / "studio-hair.bin"
        if not packet.is_file():
            raise HTTPException(HTTPStatus.NOT_FOUND, _UNKNOWN)
        data = await asyncio.to_thread(result_page, packet)
        headers = {"Content-Disposition": 'attachment; filename="result.html"'}
        return Response(data, media_type="application/octet-stream", headers=headers)

    async def _file(self, request: Request) -> Response:
        """Write the groom in a format, unless the build has, and send it."""
        studio, format_ = self._studio, request.path_params["format"]
        suffix = dict(studio.formats).get(format_)
        if suffix is None or not studio.project.groom.is_file():
            raise HTTPException(HTTPStatus.NOT_FOUND, _UNKNOWN)
        path = studio.project.result / f"groom{suffix}"
        async with self._writing:
            path = await made_file(studio, format_, path)
        return FileResponse(path, media_type="application/octet-stream", filename=path.name)

    async def _made(self, request: Request, name: str) -> Response:
        path = self._studio.project.result / name
        if not path.is_file():
            raise HTTPException(HTTPStatus.NOT_FOUND, _UNKNOWN)
        return FileResponse(path, media_type=_KINDS[path.suffix])

    def _shot(self, request: Request) -> Shot:
        try:
            return self._studio.project.shot(request.path_params["id"])
        except HairkitError as error:
            raise HTTPException(HTTPStatus.NOT_FOUND, str(error)) from error


def _clear(handler: Handler) -> Handler:
    """Return a handler whose errors are one line of JSON."""

    async def answer(request: Request) -> Response:
        try:
            return await handler(request)
        except HTTPException as error:
            return JSONResponse({"error": error.detail}, error.status_code, error.headers)
        except HairkitError as error:
            return JSONResponse({"error": one_line(error)}, HTTPStatus.UNPROCESSABLE_ENTITY)

    return answer


def _is_points(points: Any) -> bool:
    return isinstance(points, list) and all(
        isinstance(p, list) and len(p) == 2 and all(isinstance(c, int | float) for c in p)
        for p in points
    )
