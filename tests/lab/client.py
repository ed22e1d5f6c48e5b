"""A client of running labs: requests, responses and browser contexts."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import httpx
import numpy.typing as npt
import pytest
from playwright.sync_api import Browser, BrowserContext, FloatRect, Locator, Page, ViewportSize
from websockets.sync.client import ClientConnection, connect

from baldwinlab.lab.server.access import make_cookie_name
from baldwinlab.lab.sources import binary_frames

# `httpx.get` loads certificates on each call, which takes 0.1 s. A lab on loopback needs none.
CLIENT = httpx.Client(timeout=300, verify=False, limits=httpx.Limits(max_keepalive_connections=0))
# Sizes of tested browser windows: width, height, and device pixels per CSS pixel.
WINDOWS = {
    "desktop": (1280, 800, 1),
    "phone": (390, 844, 3),
    "phone in landscape": (844, 390, 3),
    "desktop at 200 %": (640, 400, 2),
    "smallest phone": (320, 568, 2),
}
# `make test` checks the layout in the two smallest windows, and `make nightly` in all.
DAILY_WINDOWS = ("desktop at 200 %", "smallest phone")
every_window = pytest.mark.parametrize(
    ("width", "height", "dots"),
    [
        pytest.param(*size, id=name, marks=[pytest.mark.nightly] * (name not in DAILY_WINDOWS))
        for name, size in WINDOWS.items()
    ],
)
SMALL = {"study": "small", "condition": "evo+self-taught/A", "run": 1, "generation": 2}


def read_box(element: Locator) -> FloatRect:
    """Return the position of an element, also if the page replaces the element by a new one."""
    for _ in range(100):
        box = element.bounding_box()
        if box is not None:
            return box
    raise AssertionError(f"{element} is not visible")


@dataclass(frozen=True)
class LabServer:
    """A running lab, and the access token of its owner."""

    root: Path
    port: int
    token: str

    @classmethod
    def from_output(cls, root: Path, line: str) -> Self:
        """Create a server from the line that the command `baldwinlab lab` prints."""
        address = httpx.URL(line.split("is open at ")[1].split()[0])
        assert address.port is not None
        return cls(root, address.port, address.params["token"])

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def entry(self) -> str:
        """The address with the token, which the command prints."""
        return f"{self.address}/?token={self.token}"

    @property
    def cookie(self) -> str:
        return f"{make_cookie_name(self.port)}={self.token}"

    def request(self, lines: str) -> bytes:
        """Return the bytes of a request, with the port and the cookie of this lab."""
        return (
            lines.replace("PORT", str(self.port))
            .replace("COOKIE", self.cookie)
            .replace("\n", "\r\n")
            .encode()
        )

    def admit_client(self) -> None:
        """Allow CLIENT, and all functions of this module, to send requests to this lab."""
        CLIENT.cookies.set(make_cookie_name(self.port), self.token)

    def context(self, browser: Browser, **options: Any) -> BrowserContext:
        """Return a browser context whose pages are admitted to this lab."""
        context = browser.new_context(base_url=self.address, **options)
        context.add_cookies(
            [{"name": make_cookie_name(self.port), "value": self.token, "url": self.address}]
        )
        return context

    @contextmanager
    def open_page(self, browser: Browser, **options: Any) -> Iterator[Page]:
        """Yield a page of a new context that is admitted to this lab."""
        with self.context(browser, **options) as context:
            yield context.new_page()

    def websocket(self, path: str, **options: Any) -> ClientConnection:
        """Open a websocket as the owner of this lab."""
        address = f"ws://127.0.0.1:{self.port}{path}"
        headers = {"Cookie": self.cookie}
        connection: ClientConnection = connect(address, additional_headers=headers, **options)
        return connection


@contextmanager
def open_offline_page(
    browser: Browser, height: int, width: int = 1280, script: str = "", **options: Any
) -> Iterator[tuple[Page, list[str]]]:
    """Yield a page without a network, and the list of addresses that it requests.

    `script` runs before the scripts of the page. The test fails if the page logs a message or does
    not catch an error.
    """
    size: ViewportSize = {"width": width, "height": height}
    context = browser.new_context(offline=True, viewport=size, **options)
    page = context.new_page()
    page.add_init_script(script)
    messages = list[str]()
    requests = list[str]()
    page.on("console", lambda message: messages.append(message.text))
    page.on("pageerror", lambda error: messages.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    yield page, requests
    context.close()
    assert not messages


def list_remote(requests: Iterable[str]) -> list[str]:
    """Return the requested addresses that are neither files nor part of a page."""
    return [url for url in requests if not url.startswith(("data:", "blob:", "file:"))]


def wait_until(
    condition: Callable[[], bool], pause: Callable[[float], object] = time.sleep
) -> None:
    """Wait until a condition is true. A test that hangs fails after some minutes."""
    deadline = time.monotonic() + 300
    while not condition():
        assert time.monotonic() < deadline, "the condition is not true after 300 s"
        pause(0.005)


def wait_for(page: Page, condition: Callable[[], bool]) -> None:
    """Wait until a condition is true. The page handles its events meanwhile."""
    wait_until(condition, lambda _: page.wait_for_timeout(25))


def repeat_until(condition: Callable[[], bool], gesture: Callable[[], object]) -> None:
    """Repeat a gesture until a condition is true.

    A busy browser takes a touch for itself if the page does not answer in time.
    """
    for _ in range(10):
        gesture()
        if condition():
            return
    raise AssertionError("no gesture had an effect")


def draw_frames(page: Page) -> None:
    """Wait for 20 frames, so that all changes are drawn, and a moving picture would have moved."""
    page.evaluate(
        """async () => {
          for (let i = 0; i < 20; i++) await new Promise(requestAnimationFrame);
        }"""
    )


def get_response(address: str, path: str, **query: Any) -> httpx.Response:
    """Send a GET request to a path below /api."""
    return CLIENT.get(f"{address}/api/{path}", params=query)


def get_json(address: str, path: str, **query: Any) -> Any:
    """Return the JSON of a successful response."""
    response = get_response(address, path, **query)
    assert response.status_code == 200, response.text
    return response.json()


def get_arrays(
    address: str, path: str, **query: Any
) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Return the header and the arrays of a successful binary response."""
    response = get_response(address, path, **query)
    assert response.status_code == 200, response.text
    return binary_frames.unpack(response.content)


def get_error(address: str, path: str, status: int, **query: Any) -> str:
    """Return the error message of a response with this status."""
    response = get_response(address, path, **query)
    assert response.status_code == status, response.text
    return str(response.json()["error"])


def check_errors(server: LabServer, rows: Iterable[tuple[str, dict[str, Any], int, str]]) -> None:
    """Require the errors of requests: path, query, status, and message.

    An empty value is not sent. ROOT is the folder of the lab, and "…" in a message is any text.
    """
    wrong = []
    for path, query, status, message in rows:
        texts = {
            name: str(value).replace("ROOT", str(server.root)) for name, value in query.items()
        }
        sent = {name: text for name, text in texts.items() if text}
        response = get_response(server.address, path, **sent)
        error = response.json().get("error", "")
        pattern = re.escape(message.replace("ROOT", str(server.root))).replace("…", ".*")
        if response.status_code != status or not re.fullmatch(pattern, error, re.DOTALL):
            wrong.append((path, sent, response.status_code, error))
    assert wrong == []
