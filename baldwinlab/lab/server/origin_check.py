"""Middleware that rejects requests of other hosts and origins, and requests without the token.

A browser lets any page send requests to the local machine. A request is rejected in three cases:
its header Host is not this server (for example because another name resolves to this address), its
header Origin is another page, or the browser marks the request as sent for another page.

On a shared machine, every user can send requests to the local machine. Requests that read a study
or start a run therefore need the token of `access`. The files of the page are the same in every
installation, so they need no token.

Behind a proxy, the header Host can be that of the proxy, and the path can start with a prefix.
"""

from __future__ import annotations

from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from baldwinlab.lab.server.access import MISSING_TOKEN_ERROR, Access, make_cookie_name

HTTP_PORT = 80
HOST_NAMES = ("127.0.0.1", "localhost", "[::1]")
RESPONSE_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; "
    "img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class OriginCheck:
    """Middleware that rejects requests and websockets, and adds headers to all responses.

    A request of another host or origin gets status 403, and a request without the token gets 401.
    A websocket handshake gets the same status.

    `root_path`: the path under which a proxy serves the lab, such as "/user/ada/proxy/8642". It is
    "" for a proxy that serves the lab at its root, and None without a proxy. A proxy can keep this
    path in the requests that it forwards, or remove it.
    """

    def __init__(self, app: ASGIApp, access: Access, root_path: str | None = None) -> None:
        self.app = app
        self.access = access
        self.root_path = root_path

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or pass it to the application."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        # All later checks and routes get the path without `root_path`.
        if self.root_path and scope["path"].startswith(f"{self.root_path}/"):
            scope = {**scope, "path": scope["path"].removeprefix(self.root_path)}
        response = self._make_response(scope)
        if response is None:
            await self.app(scope, receive, _add_response_headers(scope, send))
        else:
            await response(scope, receive, _add_response_headers(scope, send))

    def _make_response(self, scope: Scope) -> Response | None:
        """Return the response of the middleware, or None if the application responds."""
        find_fault = _find_fault if self.root_path is None else _find_fault_behind_proxy
        if fault := find_fault(scope):
            return JSONResponse({"error": fault}, HTTPStatus.FORBIDDEN)
        if self.root_path and scope["path"] == self.root_path:
            return _add_slash(scope)
        connection = HTTPConnection(scope)
        cookie_name = make_cookie_name(_read_port(scope))
        token_or_ticket = connection.query_params.get("token")
        if scope["path"] == "/" and token_or_ticket is not None:
            return self._log_in(token_or_ticket, cookie_name, _read_scheme(scope) == "https")
        is_public = scope["type"] == "http" and not scope["path"].startswith("/api")
        if is_public or self.access.is_token(connection.cookies.get(cookie_name, "")):
            return None
        return JSONResponse({"error": MISSING_TOKEN_ERROR}, HTTPStatus.UNAUTHORIZED)

    def _log_in(self, token_or_ticket: str, cookie_name: str, is_secure: bool) -> Response:
        """Store the token in a cookie, and remove it from the address.

        The cookie has no path. Browsers then send it only to the folder of the address, which
        differs between the users of a hub.
        """
        if not self.access.accept(token_or_ticket):
            return JSONResponse({"error": MISSING_TOKEN_ERROR}, HTTPStatus.UNAUTHORIZED)
        response = RedirectResponse("./", HTTPStatus.SEE_OTHER)
        response.set_cookie(
            cookie_name,
            self.access.token,
            path=None,
            secure=is_secure,
            httponly=True,
            samesite="strict",
        )
        return response


def _add_slash(scope: Scope) -> Response:
    """Redirect to the same path with a slash, because the addresses in the page are relative."""
    query = scope["query_string"].decode("latin-1")
    folder = scope["path"].rpartition("/")[2]
    return RedirectResponse(f"{folder}/?{query}" if query else f"{folder}/", HTTPStatus.SEE_OTHER)


def _read_port(scope: Scope) -> int | None:
    server: tuple[str, int | None] = scope.get("server") or ("", None)
    _, port = server
    return port


def _read_scheme(scope: Scope) -> str:
    """Return "http" or "https": the scheme that the browser used, as the first proxy states it."""
    forwarded = Headers(scope=scope).get("x-forwarded-proto", scope["scheme"])
    return forwarded.split(",")[0].strip().replace("ws", "http")


def _find_fault(scope: Scope) -> str | None:
    """Return the reason why a request without a proxy is rejected, or None."""
    headers = Headers(scope=scope)
    port = _read_port(scope)
    host = headers.get("host", "")
    origin = headers.get("origin")
    allowed_hosts = {f"{name}:{port}" for name in HOST_NAMES}
    if port == HTTP_PORT:
        # Browsers omit the default port of HTTP.
        allowed_hosts.update(HOST_NAMES)
    if host not in allowed_hosts:
        return (
            f"the host {host!r} is not allowed: use 127.0.0.1:{port} or localhost:{port}, or start"
            " the lab with --root-path if a proxy serves it"
        )
    if origin is not None and origin != f"http://{host}":
        return f"pages of {origin} are not allowed to use this server"
    return _find_foreign_sender(scope)


def _find_fault_behind_proxy(scope: Scope) -> str | None:
    """Return the reason why a request through a proxy is rejected, or None.

    The server does not know the name of the proxy. It therefore compares two headers: Origin names
    the page that sends a request, and Host (or X-Forwarded-Host) the receiver. They must agree. A
    page cannot set these headers. A page of another host also lacks the cookie with the token.
    """
    headers = Headers(scope=scope)
    origin = headers.get("origin")
    # Each proxy appends a value. The browser sent the request to the first one.
    forwarded_host = headers.get("x-forwarded-host", "").split(",")[0].strip()
    hosts = [host for host in (headers.get("host"), forwarded_host) if host]
    # A proxy may use https without stating it in X-Forwarded-Proto.
    schemes = ["https"] if _read_scheme(scope) == "https" else ["http", "https"]
    if origin is not None and origin not in [f"{a}://{b}" for a in schemes for b in hosts]:
        return (
            f"pages of {origin} are not allowed to use this server, whose host is"
            f" {' or '.join(hosts)}; a proxy must pass on the header Host, or send X-Forwarded-Host"
        )
    return _find_foreign_sender(scope)


def _find_foreign_sender(scope: Scope) -> str | None:
    """Return an error if the browser marks a request as sent for another page, else None."""
    sending_site = Headers(scope=scope).get("sec-fetch-site", "none")
    if scope["path"].startswith("/api") and sending_site not in ("none", "same-origin"):
        return "other pages are not allowed to use this server"
    return None


def _add_response_headers(scope: Scope, send: Send) -> Send:
    """Return a `send` that adds `RESPONSE_HEADERS` and a cache rule to each response.

    Browsers must not store data of `/api`. They can store the files of the page, but must ask the
    server before each use whether a file has changed.
    """

    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in RESPONSE_HEADERS.items():
                headers.setdefault(name, value)
            headers["Cache-Control"] = (
                "no-store" if scope["path"].startswith("/api") else "no-cache"
            )
        await send(message)

    return send_with_headers
