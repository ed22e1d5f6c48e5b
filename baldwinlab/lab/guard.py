"""Who may ask: the page itself, and nobody else's.

A browser lets any page send requests to loopback. So a request is refused whose Host is not this server (as where another
name was made to point here), whose Origin is another page, or which the browser says was made for another page.
"""

from __future__ import annotations

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

NAMES = ("127.0.0.1", "localhost", "[::1]")
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class Guard:
    """Middleware that refuses requests and websockets of others with status 403, and puts the headers on every answer."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        fault = _fault(scope)
        if fault and scope["type"] == "websocket":
            await WebSocket(scope, receive, send).close()  # before it is accepted, so the handshake is answered with 403
        elif fault:
            await JSONResponse({"error": fault}, 403, HEADERS)(scope, receive, send)
        else:
            await self.app(scope, receive, _with_headers(scope, send))


def _fault(scope: Scope) -> str | None:
    """Why a request is refused, if it is."""
    headers, port = Headers(scope=scope), (scope.get("server") or ("", None))[1]
    host, origin = headers.get("host", ""), headers.get("origin")
    if host not in {f"{name}:{port}" for name in NAMES} | ({*NAMES} if port == 80 else set()):
        return f"this server is not {host!r}: it answers to 127.0.0.1:{port} and localhost:{port} only"
    if origin is not None and origin != f"http://{host}":
        return f"a page of {origin} may not ask this server"
    if scope["path"].startswith("/api") and headers.get("sec-fetch-site", "none") not in ("none", "same-origin"):
        return "another page may not ask this server"
    return None


def _with_headers(scope: Scope, send: Send) -> Send:
    """As `send`, with the headers that every answer carries. Data is never stored; the page's own files are asked for anew."""

    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
            headers["Cache-Control"] = "no-store" if scope["path"].startswith("/api") else "no-cache"
        await send(message)

    return send_with_headers
