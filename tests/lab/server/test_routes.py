"""A request with a field or a parameter that no route reads is refused by its name."""

from __future__ import annotations

from pathlib import Path

import pytest
from starlette.routing import Route

from baldwinlab.lab.server.access import Access
from baldwinlab.lab.server.app import make_app
from tests.lab.client import CLIENT, LabServer

ROUTES = [
    (route.path, method)
    for route in make_app(Path(), Access()).routes
    if isinstance(route, Route) and route.path.startswith("/api")
    for method in sorted((route.methods or set()) - {"HEAD"})
]


@pytest.mark.parametrize(("path", "method"), ROUTES)
def test_an_unknown_parameter_or_field_is_refused_by_its_name(
    lab_server: LabServer, path: str, method: str
) -> None:
    address = lab_server.address + path.replace("{id}", "1").replace("{path:path}", "report.html")
    response = CLIENT.request(method, address, params={"unknown": "1"}, json={})
    assert response.status_code == 400
    assert "has no parameter 'unknown'; it reads" in response.json()["error"]
    # Stopping a comparison needs no field, and reads none.
    if method == "POST" and not path.endswith("/stop"):
        response = CLIENT.post(address, json={"unknown": 1})
        assert response.status_code == 400
        assert "has no field 'unknown'; it reads" in response.json()["error"]
