"""Tests of the routes: a request for something unknown is refused, and its error names it."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import parse_qsl

import pytest
from starlette.routing import Route

from baldwinlab.lab.server.access import Access
from baldwinlab.lab.server.app import make_app
from tests.lab.client import CLIENT, SMALL, LabServer, check_errors

ROUTES = [
    (route.path, method)
    for route in make_app(Path(), Access()).routes
    if isinstance(route, Route) and route.path.startswith("/api")
    for method in sorted((route.methods or set()) - {"HEAD"})
]
NOTHING = "study=&condition=&run=&generation="
LONG_NAME = "a" * 5000
SPAN = "must be in order and at most 300, the number of steps of a lifetime"
CONDITIONS = "(did you mean 'evo/A'?); there are evo/A, evo+self-taught/A"
# Path, changes of SMALL, status and message. A parameter without a value is not sent.
REJECTED = f"""
recording | study=other | 404 | there is no study 'other' in ROOT
recording | condition=evo/C | 404 | ROOT/small has no condition 'evo/C' {CONDITIONS}
recording | run=2 | 404 | ROOT/small has no run 2 of evo+self-taught/A; 2 runs are stored, \
from 0 to 1
recording | generation=3 | 404 | evo+self-taught/A has no generation 3: its generations are 0 to 2
recording | run=-1 | 400 | run = '-1' must be a whole number of at least 0
recording | first=20&last=10 | 400 | first = 20 and last = 10 {SPAN}
recording | last=301 | 400 | first = 0 and last = 301 {SPAN}
recording | generation= | 400 | generation is missing from the request
recording | run= | 400 | run is missing from the request
recording | condition= | 400 | condition is missing from the request
recording | {NOTHING}0 | 400 | preset is missing from the request
recording | {NOTHING}0&preset=evo/A&seed=2147483648 | 400 | seed = 2147483648 must be a whole \
number from 0 to 2147483647
recording | {NOTHING}0&preset=ROOT/small/runs/evo/A/experiment.toml | 404 | there is no preset…
preset | {NOTHING}&name=ROOT/small/runs/evo/A/experiment.toml | 404 | there is no preset…
agent | agent=20 | 404 | evo+self-taught/A has no agent 20: its agents are 0 to 19
agent | agent=1000000 | 404 | evo+self-taught/A has no agent 1000000: its agents are 0 to 19
ancestors | agent=20 | 404 | evo+self-taught/A has no agent 20: its agents are 0 to 19
lineage | agent=20 | 404 | …has no agent 20…
run | condition=evo&generation= | 404 | …has no condition 'evo'…
run | run=7&generation= | 404 | …has no run 7…
run | {NOTHING}&study=small | 400 | condition is missing from the request
frames | first=300 | 400 | first = 300 must be less than 300, the number of steps of a lifetime
frames | interval=0 | 400 | interval = 0 must be at least 1 and at most 300
frames | count=33 | 400 | count = 33 must be at least 0 and at most 32
frames | columns=900&rows=900 | 400 | columns x rows = 810,000 must be at most 400,000
frames | left=nan | 400 | left = 'nan' must be a finite number
frames | left=x | 400 | left = 'x' must be a finite number
frames | left=10&right=10 | 400 | the window from (10, 0) to (10, 640) is empty: left must be less \
than right, and top less than bottom
behavior | condition=evo/A | 400 | …do not learn; choose a condition that learns…
behavior | generation=9 | 404 | …has no generation 9…
behavior | run=9 | 404 | …has no run 9…
results | {NOTHING}&study={LONG_NAME} | 404 | there is no study…
results | {NOTHING}&study=%00 | 404 | there is no study…
results | {NOTHING}&study=small/study.toml | 404 | there is no study…
results | {NOTHING}&study=small/runs | 404 | there is no study…
results/runs | condition=evo&measure=best&run=&generation= | 404 | …has no condition 'evo'…
results/runs | measure=worst&run=&generation= | 400 | measure = 'worst' must be one of best, mean, \
share
"""


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


def test_a_request_for_something_unknown_is_rejected(lab_server: LabServer) -> None:
    rows = []
    for line in REJECTED.strip().splitlines():
        path, changes, status, message = line.split(" | ")
        query = SMALL | dict(parse_qsl(changes, keep_blank_values=True))
        rows.append((path, query, int(status), message))
    check_errors(lab_server, rows)
