"""Questions to a lab, and its answers."""

from __future__ import annotations

from typing import Any

import httpx
import numpy.typing as npt

from baldwinlab.lab import frames

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


def ask(address: str, path: str, **query: Any) -> httpx.Response:
    return CLIENT.get(f"{address}/api/{path}", params=query)


def data(address: str, path: str, **query: Any) -> Any:
    answer = ask(address, path, **query)
    assert answer.status_code == 200, answer.text
    return answer.json()


def arrays(address: str, path: str, **query: Any) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    answer = ask(address, path, **query)
    assert answer.status_code == 200, answer.text
    return frames.unpack(answer.content)


def refusal(address: str, path: str, status: int, **query: Any) -> str:
    """The sentence with which a question is refused."""
    answer = ask(address, path, **query)
    assert answer.status_code == status, answer.text
    return str(answer.json()["error"])
