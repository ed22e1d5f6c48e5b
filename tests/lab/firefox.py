"""A driver of Firefox by WebDriver BiDi, because Playwright drives only its own builds.

References
----------
W3C, WebDriver BiDi (editor's draft).
"""

from __future__ import annotations

import itertools
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

# Seconds until a test that hangs fails.
TIMEOUT = 300
# Firefox writes its port to this file of the profile.
PORT_FILE = "WebDriverBiDiServer.json"


class Firefox:
    """One page of a browser. `errors` contains the errors that the page has logged."""

    def __init__(self, connection: ClientConnection) -> None:
        self._connection = connection
        self._numbers = itertools.count()
        self.errors = list[str]()
        self._send_command("session.new", capabilities={})
        self._send_command("session.subscribe", events=["log.entryAdded"])
        self._tab = self._send_command("browsingContext.getTree")["contexts"][0]["context"]
        # The tab, or a frame in it.
        self._page = self._tab

    def _send_command(self, command: str, **parameters: Any) -> Any:
        """Send a command and return its result."""
        number = next(self._numbers)
        self._connection.send(json.dumps({"id": number, "method": command, "params": parameters}))
        while True:
            message = json.loads(self._connection.recv(timeout=TIMEOUT))
            if message.get("method") == "log.entryAdded" and message["params"]["level"] == "error":
                self.errors.append(str(message["params"]["text"]))
            if message.get("id") == number:
                assert message["type"] == "success", message
                return message["result"]

    def open(self, address: str, width: int, height: int) -> None:
        """Open an address in a new tab of this size, and close the previous tab.

        In the same tab, a change of the address by the old page can cancel the load of the new one.
        """
        previous = self._tab
        self._tab = self._page = self._send_command("browsingContext.create", type="tab")["context"]
        self._send_command("browsingContext.close", context=previous)
        self._send_command(
            "browsingContext.setViewport",
            context=self._tab,
            viewport={"width": width, "height": height},
        )
        self._send_command(
            "browsingContext.navigate", context=self._tab, url=address, wait="complete"
        )

    def enter_frame(self) -> None:
        """Evaluate later expressions in the first frame of the page."""
        (page,) = self._send_command("browsingContext.getTree", root=self._tab)["contexts"]
        self._page = page["children"][0]["context"]

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression. Wait for a promise."""
        text = f"(async () => JSON.stringify(await ({expression})))()"
        result = self._send_command(
            "script.evaluate", expression=text, target={"context": self._page}, awaitPromise=True
        )
        assert result["type"] == "success", result
        return json.loads(result["result"].get("value", "null"))

    def wait_for(self, expression: str) -> None:
        """Wait until an expression is true."""
        deadline = time.monotonic() + TIMEOUT
        while not self.evaluate(expression):
            assert time.monotonic() < deadline, expression
            time.sleep(0.1)


@contextmanager
def open_firefox(profile: Path) -> Iterator[Firefox]:
    """Yield a headless browser. Skip the test if Firefox is not installed."""
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        pytest.skip("Firefox is not installed")
    command = [
        program,
        "--headless",
        "--no-remote",
        "--profile",
        str(profile),
        "--remote-debugging-port",
        "0",
    ]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        with _connect(profile / PORT_FILE) as connection:
            yield Firefox(connection)
    finally:
        process.terminate()
        process.wait()


def _connect(port_file: Path) -> ClientConnection:
    """Connect to a browser that is starting."""
    deadline = time.monotonic() + TIMEOUT
    while True:
        try:
            port = json.loads(port_file.read_text("utf-8"))["ws_port"]
            return connect(f"ws://127.0.0.1:{port}/session", max_size=None)
        # The file does not exist yet, or is not complete.
        except (OSError, ValueError, WebSocketException):
            assert time.monotonic() < deadline, "Firefox did not start"
            time.sleep(0.1)
