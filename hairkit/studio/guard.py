"""Who may ask the server for what: sessions, hosts, origins, headers.

* A link holds a token behind `#`, which browsers neither send nor log. It opens one session.
* Whoever has a session holds a cookie that scripts cannot read and other sites cannot send.
* What changes something must come from this server's own pages: the `Origin` is this server's.
* The `Host` must be a name of this server, so that no other name can be pointed at it.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

TOKEN_BYTES = 24
"""Random bytes of a token and of a session's secret: not to be guessed (OWASP asks for 16)."""
MOST_SESSIONS = 64
"""Browsers that may be connected to one server; the one that came first goes."""
SAFE = ("GET", "HEAD")
METHODS = (*SAFE, "POST", "PUT", "DELETE")
SESSION_PATH = "/api/session"
POLICY = (
    "default-src 'self'; img-src 'self' blob: data:; media-src 'self' blob: mediastream:;"
    " style-src 'self'; script-src 'self'; connect-src 'self'; object-src 'none';"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "Permissions-Policy": (
        "camera=(self), gyroscope=(self), accelerometer=(self), magnetometer=(self),"
        " microphone=(), geolocation=(), payment=(), usb=()"
    ),
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""Of every answer."""


class Sessions:
    """Tokens that were not used yet, and the sessions that used ones opened."""

    def __init__(self, name: str) -> None:
        """Set the name of the cookie, which differs between servers on one machine."""
        self.cookie = name
        self._tokens: set[str] = set()
        self._sessions: list[str] = []

    def issue(self) -> str:
        """Return a new token."""
        token = secrets.token_urlsafe(TOKEN_BYTES)
        self._tokens.add(_digest(token))
        return token

    def open(self, token: str) -> str | None:
        """Return the secret of a new session, None where the token was used or never issued."""
        digest = _digest(token)
        found = [known for known in self._tokens if hmac.compare_digest(known, digest)]
        if not found:
            return None
        self._tokens -= set(found)
        secret = secrets.token_urlsafe(TOKEN_BYTES)
        self._sessions = [*self._sessions, _digest(secret)][-MOST_SESSIONS:]
        return secret

    def knows(self, cookies: str) -> bool:
        """Return whether a `Cookie` header holds the secret of a session."""
        try:
            morsel = SimpleCookie(cookies).get(self.cookie)
        except CookieError:
            return False
        digest = _digest(morsel.value if morsel is not None else "")
        return any(hmac.compare_digest(known, digest) for known in self._sessions)

    @property
    def unused(self) -> int:
        """Number of tokens that were not used."""
        return len(self._tokens)


class Guard:
    """Refuses what is not for this server, before any route sees it."""

    def __init__(
        self, app: ASGIApp, sessions: Sessions, hosts: frozenset[str], scheme: str
    ) -> None:
        """Allow requests for `hosts` (`name:port`) over `scheme`."""
        self._app = app
        self._sessions = sessions
        self._hosts = hosts
        self._scheme = scheme

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer or refuse one request."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            return  # a WebSocket; nothing here speaks it
        refused = self._refusal(scope)
        app = self._app if refused is None else PlainTextResponse(refused[1], refused[0])

        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in HEADERS.items():
                    headers[name] = value
                if refused is not None:
                    headers["Connection"] = "close"  # the body is not read
            await send(message)

        await app(scope, receive, with_headers)

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Return status and reason for a request that is not answered."""
        headers, path, method = Headers(scope=scope), scope["path"], scope["method"]
        hosts = headers.getlist("host")
        if len(hosts) != 1 or hosts[0].lower() not in self._hosts:
            return 421, "this server has another name"
        if method not in METHODS:
            return 405, "not allowed"
        origins = headers.getlist("origin")
        own = f"{self._scheme}://{hosts[0].lower()}"
        if any(origin.lower() != own for origin in origins) or len(origins) > 1:
            return 403, "asked by the page of another server"
        if method not in SAFE and not origins:
            return 403, "only pages of this server may change something"
        opening = path == SESSION_PATH and method == "POST"
        if not path.startswith("/api/") or opening:
            return None
        if self._sessions.knows(headers.get("cookie", "")):
            return None
        return 401, "open the link that hairkit studio printed"


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()
