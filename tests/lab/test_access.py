"""A lab answers its owner, and no other user of the machine."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from playwright.sync_api import Browser, expect
from starlette.routing import BaseRoute, Route, WebSocketRoute
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from baldwinlab.lab.access import REFUSAL, Access, cookie_name
from baldwinlab.lab.server import make_app
from tests.lab.client import LabServer, get_json
from tests.lab.conftest import run_server
from tests.small_studies import shorten_preset

PUBLIC = {"/palette.css"}  # a route of the page's own files


@pytest.fixture
def stranger(lab_server: LabServer) -> Iterator[httpx.Client]:
    """Another user of the machine, who knows the port."""
    with httpx.Client(base_url=lab_server.address, timeout=60) as client:
        yield client


def routes() -> list[BaseRoute]:
    return [
        route
        for route in make_app(Path(), Access()).routes
        if isinstance(route, Route) and route.path not in PUBLIC
    ]


def test_every_answer_but_the_page_s_own_files_needs_the_token(stranger: httpx.Client) -> None:
    assert len(routes()) > 25
    for route in routes():
        assert isinstance(route, Route) and route.methods is not None
        for method in route.methods:
            answer = stranger.request(method, route.path)
            assert answer.status_code == 401, (method, route.path)
            assert method == "HEAD" or answer.json() == {"error": REFUSAL}


@pytest.mark.parametrize(
    "path",
    ["/%61pi/studies", "//api/studies", "/./api/studies", "/x/../api/studies", "/API/studies"],
)
def test_no_other_way_to_write_its_path_leads_past_the_token(
    lab_server: LabServer, path: str
) -> None:
    with socket.create_connection(
        ("127.0.0.1", lab_server.port), timeout=10
    ) as connection:  # which writes it as it is
        connection.sendall(
            lab_server.request(f"GET {path} HTTP/1.1\nHost: 127.0.0.1:PORT\nConnection: close\n\n")
        )
        status = connection.makefile("rb").readline().split()[1]
    assert status in (b"401", b"404")


def test_a_stranger_starts_no_run_and_writes_no_study(
    stranger: httpx.Client, lab_server: LabServer
) -> None:
    order = {"experiment": shorten_preset().to_dict(), "runs": 2, "seed": 7}
    sweep = {"name": "intruder", "fields": {"learning.rate": [0.1, 0.2]}}
    before = get_json(lab_server.address, "live"), set(lab_server.root.iterdir())
    assert stranger.post("/api/live", json=order).status_code == 401
    assert stranger.post("/api/sweep", json={**order, **sweep}).status_code == 401
    assert (get_json(lab_server.address, "live"), set(lab_server.root.iterdir())) == before


@pytest.mark.parametrize("path", ["/api/live/1", "/nowhere", "/"])
def test_a_websocket_without_the_token_is_refused(lab_server: LabServer, path: str) -> None:
    for cookie in ("", f"{cookie_name(lab_server.port)}=wrong"):
        with pytest.raises(InvalidStatus) as refused:
            connect(
                f"ws://127.0.0.1:{lab_server.port}{path}", additional_headers={"Cookie": cookie}
            )
        answer = refused.value.response
        assert (answer.status_code, json.loads(answer.body)) == (401, {"error": REFUSAL})


def test_every_websocket_lies_where_the_token_is_asked_for() -> None:
    sockets = [
        route.path
        for route in make_app(Path(), Access()).routes
        if isinstance(route, WebSocketRoute)
    ]
    assert sockets == ["/api/live/{id}", "/{path:path}"]


@pytest.mark.parametrize("token", ["", "wrong", "é", "\x00", "a" * 4000])
def test_a_wrong_token_admits_nobody(
    stranger: httpx.Client, lab_server: LabServer, token: str
) -> None:
    answer = stranger.get("/", params={"token": token})
    assert (answer.status_code, answer.json()) == (401, {"error": REFUSAL})
    assert "set-cookie" not in answer.headers
    cookie = f"{cookie_name(lab_server.port)}={token}".replace("\x00", "")
    assert stranger.get("/api/studies", headers={b"Cookie": cookie.encode()}).status_code == 401


def test_the_printed_address_stores_the_token_where_no_script_reads_it_and_leaves_the_address(
    stranger: httpx.Client, lab_server: LabServer
) -> None:
    answer = stranger.get(lab_server.entry)
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    _, *attributes = answer.headers["set-cookie"].split("; ")
    assert set(attributes) == {"HttpOnly", "Path=/", "SameSite=strict"}
    assert stranger.get("/api/studies").status_code == 200  # from now on its cookie admits it


def test_the_token_of_one_lab_admits_to_no_other(
    lab_server: LabServer, stranger: httpx.Client, tmp_path: Path
) -> None:
    with run_server(tmp_path) as other:
        assert other.token != lab_server.token and len(other.token) >= 43  # 32 random bytes
        assert stranger.get("/", params={"token": other.token}).status_code == 401
        assert stranger.get("/api/studies", headers={"Cookie": other.cookie}).status_code == 401
        stranger.get(lab_server.entry)
        stranger.get(other.entry)
        for server in (lab_server, other):  # a browser sends both cookies to both
            assert stranger.get(f"{server.address}/api/studies").status_code == 200


def test_a_ticket_admits_once() -> None:
    access = Access()
    first, second = access.issue_ticket(), access.issue_ticket()
    assert len({access.token, first, second}) == 3
    assert [access.admits(first), access.admits(first), access.admits(second)] == [
        True,
        False,
        True,
    ]
    assert access.admits(access.token) and access.admits(access.token)
    assert not access.is_token(second) and not access.admits("")


def test_a_page_without_the_token_says_how_to_get_in_and_the_printed_address_keeps_its_view(
    browser: Browser, lab_server: LabServer
) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        for tab in ("papers", "world", "live", "results"):
            page.goto("about:blank")
            page.goto(f"{lab_server.address}/#/{tab}")
            expect(page.get_by_test_id("connection")).to_have_text(REFUSAL)
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
    with lab_server.context(browser) as context:
        page = context.new_page()
        page.goto(path.as_uri())
        page.get_by_role("link").click()
        expect(page.get_by_test_id("curves")).to_be_visible()


def test_a_page_of_a_lab_that_was_restarted_says_how_to_get_in(
    browser: Browser, lab_server: LabServer
) -> None:
    with lab_server.context(browser) as context:
        page = context.new_page()
        page.goto("/#/live?preset=evo/A")
        expect(page.get_by_test_id("start")).to_be_enabled()
        context.clear_cookies()  # as if its token were another
        page.get_by_test_id("start").click()
        expect(page.get_by_test_id("connection")).to_have_text(REFUSAL)
        expect(page.get_by_test_id("setup-fault")).to_contain_text(REFUSAL)
