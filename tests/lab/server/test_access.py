"""Tests of access: a lab responds to its owner only, and its stored token is private."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import httpx
import platformdirs
import pytest
from playwright.sync_api import Browser, expect
from starlette.routing import BaseRoute, Route, WebSocketRoute
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from baldwinlab.lab.server.access import MISSING_TOKEN_ERROR, Access, load_token, make_cookie_name
from baldwinlab.lab.server.app import make_app
from tests.lab.client import LabServer, get_json
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

# Routes that serve files of the page.
PUBLIC = {"/palette.css"}


@pytest.fixture
def other_user(lab_server: LabServer) -> Iterator[httpx.Client]:
    """Yield a client without the token, which has the port."""
    with httpx.Client(base_url=lab_server.address, timeout=300) as client:
        yield client


def private_routes() -> list[BaseRoute]:
    """Return the routes that need the token."""
    return [
        route
        for route in make_app(Path(), Access()).routes
        if isinstance(route, Route) and route.path not in PUBLIC
    ]


def test_every_route_except_the_files_of_the_page_needs_the_token(other_user: httpx.Client) -> None:
    assert len(private_routes()) > 25
    for route in private_routes():
        assert isinstance(route, Route) and route.methods is not None
        for method in route.methods:
            response = other_user.request(method, route.path)
            assert response.status_code == 401, (method, route.path)
            assert method == "HEAD" or response.json() == {"error": MISSING_TOKEN_ERROR}


@pytest.mark.parametrize(
    "path",
    ["/%61pi/studies", "//api/studies", "/./api/studies", "/x/../api/studies", "/API/studies"],
)
def test_an_unusual_spelling_of_a_path_does_not_bypass_the_token(
    lab_server: LabServer, path: str
) -> None:
    # A socket sends the path unchanged.
    with socket.create_connection(("127.0.0.1", lab_server.port), timeout=300) as connection:
        connection.sendall(
            lab_server.request(f"GET {path} HTTP/1.1\nHost: 127.0.0.1:PORT\nConnection: close\n\n")
        )
        status = connection.makefile("rb").readline().split()[1]
    assert status in (b"401", b"404")


def test_a_client_without_the_token_starts_no_run_and_writes_no_study(
    other_user: httpx.Client, lab_server: LabServer
) -> None:
    order = {"experiment": shorten_preset().to_dict(), "runs": 2, "seed": 7}
    sweep = {"name": "intruder", "fields": {"learning.rate": [0.1, 0.2]}}
    before = get_json(lab_server.address, "live"), set(lab_server.root.iterdir())
    assert other_user.post("/api/live", json=order).status_code == 401
    assert other_user.post("/api/comparison", json={**order, **sweep}).status_code == 401
    assert (get_json(lab_server.address, "live"), set(lab_server.root.iterdir())) == before


@pytest.mark.parametrize("path", ["/api/live/1", "/nowhere", "/"])
def test_a_websocket_without_the_token_is_rejected(lab_server: LabServer, path: str) -> None:
    for cookie in ("", f"{make_cookie_name(lab_server.port)}=wrong"):
        with pytest.raises(InvalidStatus) as refused:
            connect(
                f"ws://127.0.0.1:{lab_server.port}{path}", additional_headers={"Cookie": cookie}
            )
        response = refused.value.response
        assert (response.status_code, json.loads(response.body)) == (
            401,
            {"error": MISSING_TOKEN_ERROR},
        )


def test_every_websocket_route_needs_the_token() -> None:
    sockets = [
        route.path
        for route in make_app(Path(), Access()).routes
        if isinstance(route, WebSocketRoute)
    ]
    assert sockets == ["/api/live/{id}", "/{path:path}"]


@pytest.mark.parametrize("token", ["", "wrong", "é", "\x00", "a" * 4000])
def test_a_wrong_token_is_rejected(
    other_user: httpx.Client, lab_server: LabServer, token: str
) -> None:
    response = other_user.get("/", params={"token": token})
    assert (response.status_code, response.json()) == (401, {"error": MISSING_TOKEN_ERROR})
    assert "set-cookie" not in response.headers
    cookie = f"{make_cookie_name(lab_server.port)}={token}".replace("\x00", "")
    assert other_user.get("/api/studies", headers={b"Cookie": cookie.encode()}).status_code == 401


def test_the_printed_address_moves_the_token_to_a_cookie_that_scripts_cannot_read(
    other_user: httpx.Client, lab_server: LabServer
) -> None:
    response = other_user.get(lab_server.entry)
    assert (response.status_code, response.headers["location"]) == (303, "./")
    _, *attributes = response.headers["set-cookie"].split("; ")
    assert set(attributes) == {"HttpOnly", "SameSite=strict"}
    # The cookie admits later requests.
    assert other_user.get("/api/studies").status_code == 200


def test_the_token_of_a_lab_is_rejected_by_another_lab(
    lab_server: LabServer, other_user: httpx.Client, tmp_path: Path
) -> None:
    with run_server(tmp_path) as second_server:
        assert second_server.token != lab_server.token
        # 32 random bytes in base64.
        assert len(second_server.token) >= 43
        assert other_user.get("/", params={"token": second_server.token}).status_code == 401
        assert (
            other_user.get("/api/studies", headers={"Cookie": second_server.cookie}).status_code
            == 401
        )
        other_user.get(lab_server.entry)
        other_user.get(second_server.entry)
        # A browser sends both cookies to both servers.
        for server in (lab_server, second_server):
            assert other_user.get(f"{server.address}/api/studies").status_code == 200


def test_a_ticket_is_valid_once() -> None:
    access = Access()
    first = access.issue_ticket()
    second = access.issue_ticket()
    assert len({access.token, first, second}) == 3
    assert access.accept(first)
    assert not access.accept(first)
    assert access.accept(second)
    assert access.accept(access.token) and access.accept(access.token)
    assert not access.is_token(second) and not access.accept("")


def test_a_page_explains_access_until_the_printed_address_is_opened(
    browser: Browser, lab_server: LabServer
) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        for tab in ("papers", "world", "live", "results"):
            page.goto("about:blank")
            page.goto(f"{lab_server.address}/#/{tab}")
            expect(page.get_by_test_id("connection")).to_have_text(MISSING_TOKEN_ERROR)
        page.goto(f"{lab_server.entry}#/results?study=small")
        expect(page.get_by_test_id("curves")).to_be_visible()
        assert page.url == f"{lab_server.address}/#/results?study=small"
        expect(page.get_by_test_id("connection")).to_be_hidden()
        assert page.evaluate("document.cookie") == ""


def test_a_link_from_another_page_opens_the_owner_s_view(
    browser: Browser, lab_server: LabServer, tmp_path: Path
) -> None:
    path = tmp_path / "letter.html"
    path.write_text(f'<a href="{lab_server.address}/#/results?study=small">look</a>')
    with lab_server.open_page(browser) as page:
        page.goto(path.as_uri())
        page.get_by_role("link").click()
        expect(page.get_by_test_id("curves")).to_be_visible()


def test_a_page_of_a_restarted_lab_explains_access(browser: Browser, lab_server: LabServer) -> None:
    with lab_server.context(browser) as context:
        page = context.new_page()
        page.goto("/#/live?preset=evo/A")
        expect(page.get_by_test_id("start")).to_be_enabled()
        # A restarted lab has another token.
        context.clear_cookies()
        page.get_by_test_id("start").click()
        expect(page.get_by_test_id("connection")).to_have_text(MISSING_TOKEN_ERROR)
        expect(page.get_by_test_id("setup-fault")).to_contain_text(MISSING_TOKEN_ERROR)


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the user's state."""
    monkeypatch.setattr(platformdirs, "user_state_dir", lambda name: str(tmp_path / "state"))
    return tmp_path / "state"


def find_file(state: Path) -> Path:
    (path,) = (state / "lab").iterdir()
    return path


def test_a_restart_has_the_same_token_and_another_lab_has_another(
    state: Path, tmp_path: Path
) -> None:
    token = load_token(tmp_path, 8642)
    assert len(token) >= 43
    assert load_token(tmp_path / "state" / "..", 8642) == token
    tokens = {token, load_token(tmp_path, 8643), load_token(tmp_path / "other", 8642)}
    assert len(tokens) == 3


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="the platform has no file modes")
def test_a_token_that_other_users_could_read_is_replaced(state: Path, tmp_path: Path) -> None:
    token = load_token(tmp_path, 8642)
    path = find_file(state)
    assert (path.stat().st_mode & 0o777, path.parent.stat().st_mode & 0o777) == (0o600, 0o700)
    path.chmod(0o640)
    second = load_token(tmp_path, 8642)
    assert second != token
    assert path.stat().st_mode & 0o777 == 0o600
    # A link could lead to a file of another user.
    path.rename(tmp_path / "elsewhere")
    path.symlink_to(tmp_path / "elsewhere")
    assert load_token(tmp_path, 8642) != second
    assert not path.is_symlink()


def test_a_damaged_file_gets_a_new_token(state: Path, tmp_path: Path) -> None:
    load_token(tmp_path, 8642)
    path = find_file(state)
    path.write_bytes(b"")
    assert len(load_token(tmp_path, 8642)) >= 43
    path.write_bytes(b"short\xff")
    assert len(load_token(tmp_path, 8642)) >= 43


def test_without_a_folder_for_the_state_the_lab_starts_with_a_new_token(
    state: Path, tmp_path: Path
) -> None:
    state.write_bytes(b"a file instead of a folder")
    assert load_token(tmp_path, 8642) != load_token(tmp_path, 8642)
