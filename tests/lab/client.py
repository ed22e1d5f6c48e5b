"""Labs that run, questions to them, and their answers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import httpx
import numpy.typing as npt
from playwright.sync_api import Browser, BrowserContext
from websockets.sync.client import ClientConnection, connect

from baldwinlab.lab import binary_frames
from baldwinlab.lab.access import cookie_name

# Loads no certificates, as `httpx.get` does each time: that takes a tenth of a second, and a lab's own page needs none.
CLIENT = httpx.Client(timeout=60, verify=False, limits=httpx.Limits(max_keepalive_connections=0))
WINDOWS = {  # in which pages are tried: width, height, and dots of the screen for each of the page's
    "desk": (1280, 800, 1),
    "phone": (390, 844, 3),
    "phone on its side": (844, 390, 3),
    "a desk at 200 %": (640, 400, 2),
    "the narrowest": (320, 568, 2),
}
SMALL = {"study": "small", "condition": "evo+self-taught/A", "run": 1, "generation": 2}


@dataclass(frozen=True)
class LabServer:
    """A lab that runs, and the token that admits its owner."""

    root: Path
    port: int
    token: str

    @classmethod
    def from_output(cls, root: Path, line: str) -> Self:
        """Read the line that the command `baldwinlab lab` prints."""
        address = httpx.URL(line.split("is open at ")[1].split()[0])
        assert address.port is not None
        return cls(root, address.port, address.params["token"])

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def entry(self) -> str:
        """The address that the command prints."""
        return f"{self.address}/?token={self.token}"

    @property
    def cookie(self) -> str:
        return f"{cookie_name(self.port)}={self.token}"

    def request(self, lines: str) -> bytes:
        """The lines of a request, in which PORT and COOKIE stand for those of this lab."""
        return (
            lines.replace("PORT", str(self.port))
            .replace("COOKIE", self.cookie)
            .replace("\n", "\r\n")
            .encode()
        )

    def admit_client(self) -> None:
        """Let CLIENT, and with it all functions of this module, ask this lab."""
        CLIENT.cookies.set(cookie_name(self.port), self.token)

    def context(self, browser: Browser, **options: Any) -> BrowserContext:
        """A browser whose pages may ask this lab."""
        context = browser.new_context(base_url=self.address, **options)
        context.add_cookies(
            [{"name": cookie_name(self.port), "value": self.token, "url": self.address}]
        )
        return context

    def websocket(self, path: str, **options: Any) -> ClientConnection:
        headers, address = {"Cookie": self.cookie}, f"ws://127.0.0.1:{self.port}{path}"
        connection: ClientConnection = connect(address, additional_headers=headers, **options)
        return connection


def get_response(address: str, path: str, **query: Any) -> httpx.Response:
    return CLIENT.get(f"{address}/api/{path}", params=query)


def get_json(address: str, path: str, **query: Any) -> Any:
    answer = get_response(address, path, **query)
    assert answer.status_code == 200, answer.text
    return answer.json()


def get_arrays(
    address: str, path: str, **query: Any
) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    answer = get_response(address, path, **query)
    assert answer.status_code == 200, answer.text
    return binary_frames.unpack(answer.content)


def get_error(address: str, path: str, status: int, **query: Any) -> str:
    """The sentence with which a question is refused."""
    answer = get_response(address, path, **query)
    assert answer.status_code == status, answer.text
    return str(answer.json()["error"])
