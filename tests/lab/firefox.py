"""A Firefox as a test drives it: by WebDriver BiDi, which it speaks by itself, since Playwright drives only its own builds.

Source: W3C, WebDriver BiDi (editor's draft), for the names of commands.
"""

from __future__ import annotations

import itertools
import json
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

SECONDS = 60  # in which a browser has begun, and in which it answers


class Firefox:
    """One page of a browser. `faults` are what it logged as errors."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection, self._numbers, self.faults = connection, itertools.count(), list[str]()
        self._do("session.new", capabilities={})
        self._do("session.subscribe", events=["log.entryAdded"])
        self._page = self._do("browsingContext.getTree")["contexts"][0]["context"]

    def _do(self, command: str, **parameters: Any) -> Any:
        number = next(self._numbers)
        self._connection.send(json.dumps({"id": number, "method": command, "params": parameters}))
        while True:
            told = json.loads(self._connection.recv(timeout=SECONDS))
            if told.get("method") == "log.entryAdded" and told["params"]["level"] == "error":
                self.faults.append(str(told["params"]["text"]))
            if told.get("id") == number:
                assert told["type"] == "success", told
                return told["result"]

    def open(self, address: str, width: int, height: int) -> None:
        self._do(
            "browsingContext.setViewport",
            context=self._page,
            viewport={"width": width, "height": height},
        )
        self._do(
            "browsingContext.navigate", context=self._page, url="about:blank", wait="complete"
        )  # or # alone changes
        self._do("browsingContext.navigate", context=self._page, url=address, wait="complete")

    def inspect_agent(self) -> None:
        """Ask the first frame of the page from now on, and not the page around it."""
        (page,) = self._do("browsingContext.getTree", root=self._page)["contexts"]
        self._page = page["children"][0]["context"]

    def ask(self, expression: str) -> Any:
        """The value of an expression of JavaScript, which is waited for."""
        text = f"(async () => JSON.stringify(await ({expression})))()"
        found = self._do(
            "script.evaluate", expression=text, target={"context": self._page}, awaitPromise=True
        )
        assert found["type"] == "success", found
        return json.loads(found["result"].get("value", "null"))

    def wait_for(self, expression: str) -> None:
        """Until it is true."""
        until = time.monotonic() + SECONDS
        while not self.ask(expression):
            assert time.monotonic() < until, expression
            time.sleep(0.1)


@contextmanager
def firefox(profile: Path) -> Iterator[Firefox]:
    """A browser without a window, for a test; skips the test where there is none on this machine."""
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        pytest.skip("there is no Firefox on this machine")
    with closing(socket.create_server(("127.0.0.1", 0))) as free:
        port = free.getsockname()[1]
    line = [
        program,
        "--headless",
        "--no-remote",
        "--profile",
        str(profile),
        "--remote-debugging-port",
        str(port),
    ]
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with _connected(f"ws://127.0.0.1:{port}/session") as connection:
            yield Firefox(connection)
    finally:
        process.terminate()
        process.wait()


def _connected(address: str) -> ClientConnection:
    until = time.monotonic() + SECONDS
    while True:
        try:
            return connect(address, max_size=None)
        except (OSError, WebSocketException):
            assert time.monotonic() < until, "Firefox did not begin"
            time.sleep(0.3)
