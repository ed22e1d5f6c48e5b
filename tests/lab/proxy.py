"""A reverse proxy that serves a lab under a path, as JupyterHub and nginx do."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import httpx
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket
from uvicorn import Config, Server
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from baldwinlab.cli.lab import open_listener
from tests.lab.conftest import serve

# A self-signed certificate of 127.0.0.1 and its key, for tests only.
CERTIFICATE = Path(__file__).parent / "loopback.pem"
METHODS = ["GET", "HEAD", "POST", "DELETE"]
# Headers of one connection or of an encoded body. The proxy does not pass them on.
DROPPED = {"connection", "upgrade", "transfer-encoding", "content-length", "content-encoding"}


class Proxy(NamedTuple):
    """A proxy and the way in which it passes requests on.

    Parameters
    ----------
    prefix
        The path of the lab. All other paths are missing.
    keeps_prefix
        Whether the lab gets the complete path.
    keeps_host
        Whether the lab gets the header Host of the browser. If not, it gets X-Forwarded-Host.
    is_encrypted
        Whether the browser uses https.

    """

    prefix: str
    keeps_prefix: bool
    keeps_host: bool
    is_encrypted: bool

    @contextmanager
    def run(self, port: int) -> Iterator[str]:
        """Serve the lab at a port of loopback, and yield the address with the prefix."""
        certificate = CERTIFICATE if self.is_encrypted else None
        config = Config(
            self._make_app(port),
            log_level="error",
            timeout_graceful_shutdown=1,
            ssl_certfile=certificate,
            ssl_keyfile=certificate,
        )
        server = Server(config)
        with serve(server, open_listener(0)) as proxy_port:
            scheme = "https" if self.is_encrypted else "http"
            yield f"{scheme}://127.0.0.1:{proxy_port}{self.prefix}"

    def _make_app(self, port: int) -> Starlette:
        # All requests share one client, because each client loads the certificates of the machine.
        client = httpx.AsyncClient(timeout=60, verify=False)

        async def pass_request(request: Request) -> Response:
            address = self._find_address(f"http://127.0.0.1:{port}", request)
            headers = self._find_headers(port, request)
            answer = await client.request(
                request.method, address, headers=headers, content=await request.body()
            )
            # Several cookies have a header each.
            passed = [pair for pair in answer.headers.multi_items() if pair[0] not in DROPPED]
            response = Response(answer.content, answer.status_code)
            response.raw_headers += [(name.encode(), value.encode()) for name, value in passed]
            return response

        async def pass_websocket(websocket: WebSocket) -> None:
            headers = self._find_headers(port, websocket)
            address = self._find_address(f"ws://{headers.pop('host')}", websocket)
            # `connect` makes a new handshake, so the headers of the old handshake are dropped.
            replaced = {name for name in headers if name.startswith("sec-websocket")} | {
                "user-agent"
            }
            headers = {name: headers[name] for name in headers if name not in replaced}
            async with connect(
                address, additional_headers=headers, host="127.0.0.1", port=port
            ) as lab:
                await websocket.accept()
                await _connect_both(websocket, lab)

        path = f"{self.prefix}{{path:path}}"
        return Starlette(
            routes=[
                Route(path, pass_request, methods=METHODS),
                WebSocketRoute(path, pass_websocket),
            ]
        )

    def _find_address(self, host: str, request: Request | WebSocket) -> str:
        path = request.url.path if self.keeps_prefix else request.path_params["path"] or "/"
        return f"{host}{path}?{request.url.query}".rstrip("?")

    def _find_headers(self, port: int, request: Request | WebSocket) -> dict[str, str]:
        headers = {name: value for name, value in request.headers.items() if name not in DROPPED}
        if not self.keeps_host:
            headers["x-forwarded-host"] = headers["host"]
            headers["host"] = f"127.0.0.1:{port}"
        if self.is_encrypted:
            headers["x-forwarded-proto"] = "https"
        return headers


async def _connect_both(websocket: WebSocket, lab: ClientConnection) -> None:
    """Pass on messages in both directions until one side closes."""

    async def pass_down() -> None:
        async for text in lab:
            await websocket.send_text(str(text))
        await websocket.close()

    async def pass_up() -> None:
        async for text in websocket.iter_text():
            await lab.send(text)

    try:
        tasks = [asyncio.create_task(pass_down()), asyncio.create_task(pass_up())]
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in tasks:
            task.cancel()
    except ConnectionClosed:
        pass
