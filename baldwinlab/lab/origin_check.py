"""Admission of requests: only the page of this lab, in the browser of its owner, is answered.

A browser lets any page send requests to loopback. A request is refused if its Host is not this server (for example where another
name was made to point here), if its Origin is another page, or if the browser marks it as made for another page. On a shared
machine every user can send requests to loopback. Whatever reads a study or starts a run therefore needs the token of `access`;
the page's own files, which every installation has, need none.
"""

from __future__ import annotations

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from baldwinlab.lab.access import REFUSAL, Access, cookie_name

NAMES = ("127.0.0.1", "localhost", "[::1]")
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class Guard:
    """Middleware that refuses requests and websockets of others, and puts the headers on every answer.

    A foreign page gets status 403, a request without the token 401. The handshake of a websocket is answered in the same way.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self.app, self.access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        response = self._answer(scope)
        if response is None:
            await self.app(scope, receive, _with_headers(scope, send))
        else:
            await response(scope, receive, _with_headers(scope, send))

    def _answer(self, scope: Scope) -> Response | None:
        """Return the answer to a request that the application does not get."""
        if fault := _fault(scope):
            return JSONResponse({"error": fault}, 403)
        connection, name = HTTPConnection(scope), cookie_name(_port(scope))
        if scope["path"] == "/" and (text := connection.query_params.get("token")) is not None:
            return self._enter(text, name)
        is_public = scope["type"] == "http" and not scope["path"].startswith("/api")
        if is_public or self.access.is_token(connection.cookies.get(name, "")):
            return None
        return JSONResponse({"error": REFUSAL}, 401)

    def _enter(self, text: str, name: str) -> Response:
        """Store the token in the browser, and take it out of the address."""
        if not self.access.admits(text):
            return JSONResponse({"error": REFUSAL}, 401)
        response = RedirectResponse("/", 303)
        response.set_cookie(name, self.access.token, httponly=True, samesite="strict")
        return response


def _port(scope: Scope) -> int | None:
    server: tuple[str, int | None] = scope.get("server") or ("", None)
    return server[1]


def _fault(scope: Scope) -> str | None:
    """Why a request is refused, if it is."""
    headers, port = Headers(scope=scope), _port(scope)
    host, origin = headers.get("host", ""), headers.get("origin")
    if host not in {f"{name}:{port}" for name in NAMES} | ({*NAMES} if port == 80 else set()):
        return (
            f"this server is not {host!r}: it answers to 127.0.0.1:{port} and localhost:{port} only"
        )
    if origin is not None and origin != f"http://{host}":
        return f"a page of {origin} may not ask this server"
    if scope["path"].startswith("/api") and headers.get("sec-fetch-site", "none") not in (
        "none",
        "same-origin",
    ):
        return "another page may not ask this server"
    return None


def _with_headers(scope: Scope, send: Send) -> Send:
    """As `send`, with the headers that every answer carries. Data is never stored; the page's own files are asked for anew."""

    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
            headers["Cache-Control"] = (
                "no-store" if scope["path"].startswith("/api") else "no-cache"
            )
        await send(message)

    return send_with_headers
