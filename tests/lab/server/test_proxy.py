"""Tests of a lab behind a reverse proxy, under a path and with https."""

from __future__ import annotations

import re
from collections.abc import Iterator

import httpx
import pytest
from playwright.sync_api import Browser, expect

from tests.lab.client import LabServer
from tests.lab.conftest import run_server
from tests.lab.proxy import Proxy

PREFIX = "/user/ada/proxy/8642"
PROXIES = {
    # jupyter-server-proxy removes the path at proxy/8642, and keeps it at proxy/absolute/8642.
    "jupyter behind https": Proxy(PREFIX, False, True, True),
    "jupyter absolute": Proxy(PREFIX, True, True, False),
    "nginx": Proxy(PREFIX, False, False, False),
}
LIVE = "preset=evo/A&pace=0&set=%7B%22evolution.generations%22:2,%22lifetime.steps%22:100%7D"


@pytest.fixture(scope="module")
def server(lab_server: LabServer) -> Iterator[LabServer]:
    with run_server(lab_server.root, root_path=PREFIX) as opened:
        yield opened


@pytest.mark.parametrize(
    "name",
    [
        "jupyter behind https",
        "jupyter absolute",
        pytest.param("nginx", marks=pytest.mark.nightly),
    ],
)
def test_the_world_results_and_live_runs_work_behind_a_proxy(
    browser: Browser, server: LabServer, name: str
) -> None:
    errors = list[str]()
    with (
        PROXIES[name].run(server.port) as address,
        browser.new_context(ignore_https_errors=True) as context,
    ):
        page = context.new_page()
        page.on("console", lambda note: errors.append(note.text) if note.type == "error" else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(f"{address}/?token={server.token}")
        assert page.url.split("#")[0] == f"{address}/"
        (cookie,) = context.cookies()
        assert (cookie["path"], cookie["secure"]) == (PREFIX, address.startswith("https"))
        expect(page.get_by_test_id("step")).to_have_text(re.compile(r"^[1-9]\d* / 299"))
        page.get_by_test_id("tab-results").click()
        expect(page.get_by_test_id("curves").locator("canvas").first).to_be_visible()
        page.goto(f"{address}/#/live?{LIVE}")
        expect(page.get_by_test_id("field-lifetime.steps")).to_have_value("100", timeout=60_000)
        page.get_by_test_id("start").click()
        expect(page.get_by_test_id("live-state")).to_have_text("Done", timeout=60_000)
        expect(page.get_by_test_id("live-count")).to_have_text("2 of 2 generations")
        page.get_by_test_id("tab-papers").click()
        expect(page.locator(".view-papers img").first).to_have_js_property("complete", True)
    assert not errors


def test_the_path_of_the_proxy_gets_a_slash_and_keeps_its_token(server: LabServer) -> None:
    response = httpx.get(f"{server.address}{PREFIX}?token=a")
    assert (response.status_code, response.headers["location"]) == (303, "8642/?token=a")
    assert httpx.get(f"{server.address}{PREFIX}").headers["location"] == "8642/"


@pytest.mark.parametrize("path", ["/api/studies", f"{PREFIX}/api/studies"])
def test_a_proxy_does_not_replace_the_token(server: LabServer, path: str) -> None:
    headers = {"Host": "hub.org", "X-Forwarded-Host": "hub.org"}
    assert httpx.get(f"{server.address}{path}", headers=headers).status_code == 401
    headers["Cookie"] = server.cookie
    assert httpx.get(f"{server.address}{path}", headers=headers).status_code == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "hub.org", "Origin": "https://hub.org"}, 200),
        ({"Host": "lab", "X-Forwarded-Host": "hub.org, lab", "Origin": "http://hub.org"}, 200),
        ({"Host": "hub.org", "X-Forwarded-Proto": "https,http", "Origin": "http://hub.org"}, 403),
        ({"Host": "hub.org", "Origin": "https://evil.org"}, 403),
        ({"Host": "hub.org", "Origin": "https://hub.org.evil.org"}, 403),
        ({"Host": "hub.org", "Origin": "null"}, 403),
        ({"Host": "hub.org", "Sec-Fetch-Site": "same-site"}, 403),
    ],
)
def test_only_pages_of_the_proxy_are_allowed(
    server: LabServer, headers: dict[str, str], status: int
) -> None:
    headers = {**headers, "Cookie": server.cookie}
    response = httpx.get(f"{server.address}/api/studies", headers=headers)
    assert response.status_code == status
