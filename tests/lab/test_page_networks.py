"""Tests of the drawing of networks with memory, gating modules and teachers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer
from tests.lab.conftest import run_server
from tests.models.miniworld.plain import disable_compilation
from tests.small_studies import make_small_study
from tests.worlds import make_small_experiment

# Random numbers in plain Python overflow.
pytestmark = pytest.mark.filterwarnings("ignore:.*encountered in:RuntimeWarning")
# Draw a network of layers, and return the texts and the arcs.
DRAWN = """async ({ net }) => {
    const { drawNetwork } = await import("/inspector/network.js");
    const pen = document.createElement("canvas").getContext("2d");
    const words = [];
    const arcs = [];
    pen.fillText = (text) => words.push(text);
    pen.quadraticCurveTo = (...values) => arcs.push(values);
    drawNetwork(pen, { left: 0, top: 0, width: 400, height: 150 }, net);
    return { words, arcs };
}"""


# Draw a network without layers. Return the texts, and count the lines, columns and units.
GRAPH = """async ({ net }) => {
    const { drawNetwork } = await import("/inspector/network.js");
    const pen = document.createElement("canvas").getContext("2d");
    const words = [];
    const lines = [];
    const dots = [];
    pen.fillText = (text) => words.push(text);
    pen.lineTo = (x, y) => lines.push([x, y]);
    pen.arc = (x, y) => dots.push([Math.round(x), Math.round(y)]);
    const box = { left: 0, top: 0, width: 400, height: 150 };
    drawNetwork(pen, box, { ...net, links: new Float32Array(net.links) });
    const columns = new Set(dots.map(([x]) => x)).size;
    return { words, lines: lines.length, columns, dots: dots.length };
}"""


@pytest.fixture(scope="module")
def networks_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with a study of four kinds of learning and networks."""
    root = tmp_path_factory.mktemp("networks")
    kinds: dict[str, dict[str, Any]] = {
        "follower": {"learning": {"rule": "imitation"}},
        "gated": {"learning": {"rule": "modulated"}},
        "heir": {
            "learning": {"rule": "self-taught"},
            "evolution": {"inheritance": "social-heredity"},
        },
        "grown": {
            "network": {"kind": "neat", "hidden": [40]},
            "evolution": {
                "variation": "neat",
                "selection": "species",
                "neat": {"add_node_rate": 1.0},
            },
        },
    }
    # Plain Python is faster here than the compilation of these combinations of parts.
    with pytest.MonkeyPatch.context() as patch:
        disable_compilation(patch)
        make_small_study(
            root / "small",
            [
                make_small_experiment("evo").replace(name=name, **changes)
                for name, changes in kinds.items()
            ],
            runs=1,
        )
        with run_server(root) as server:
            yield server


@pytest.fixture
def networks_page(
    browser: Browser, networks_server: LabServer, request: pytest.FixtureRequest
) -> Iterator[Page]:
    """Yield a blank page. The test fails if the page does not catch an error."""
    width, height = getattr(request, "param", (1280, 800))
    context = networks_server.context(browser, viewport={"width": width, "height": height})
    page = context.new_page()
    errors = list[str]()
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    context.close()
    assert not errors


def test_memory_units_have_names_and_feedback_arcs(page: Page) -> None:
    page.goto("/")
    net = {
        "sizes": [3, 2, 1],
        "biases": False,
        "weights": None,
        "activations": [0] * 6,
        "action": 0,
    }
    named = {"inputs": ["front"], "actions": ["forward"], "memory": [[3, 1], [4, 2]]}
    drawing = page.evaluate(DRAWN, {"net": net | named})
    assert drawing["words"] == ["front", "memory 1", "memory 2", "forward"]
    assert len(drawing["arcs"]) == 2
    drawing = page.evaluate(DRAWN, {"net": net | named | {"memory": [], "sizes": [1, 2, 1]}})
    assert drawing == {"words": ["front", "forward"], "arcs": []}


@pytest.mark.parametrize("networks_page", [(1280, 800), (390, 844)], indirect=True)
def test_the_legend_has_an_entry_for_teachers_only_if_agents_learn_from_others(
    networks_page: Page,
) -> None:
    networks_page.goto("/#/world?study=small&condition=follower&run=0&generation=2&step=70")
    lesson = networks_page.get_by_test_id("legend").first.get_by_text("learns from")
    expect(lesson).to_have_count(1)
    expect(networks_page.locator("[data-ready]")).to_have_count(1)
    assert lesson.evaluate("entry => !entry.hidden")
    networks_page.goto("/#/world?study=small&condition=gated&run=0&generation=2&step=70")
    expect(networks_page.get_by_test_id("condition-a")).to_have_value("gated")
    entry = networks_page.get_by_test_id("legend").first.locator(".entry:has(.lesson)")
    expect(entry).to_have_attribute("hidden", "")


@pytest.mark.parametrize("networks_page", [(1280, 800), (390, 844)], indirect=True)
def test_the_inspector_names_teachers_of_the_previous_generation_without_a_line(
    networks_page: Page, networks_server: LabServer
) -> None:
    networks_page.goto("/#/world?study=small&condition=heir&run=0&generation=2&agent=3")
    record = StudyStore(networks_server.root / "small").read("heir", 0)
    fitter, second = record.parents.values[2, 3].tolist()
    assert fitter != second
    expect(networks_page.get_by_test_id("teachers")).to_have_text(
        f"Taught by agents {fitter} and {second} of generation 1. "
        "Its reinforcement module contains the weights that they had learned by their death."
    )
    assert networks_page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    expect(networks_page.get_by_test_id("legend").get_by_text("learns from").first).to_be_hidden()
    networks_page.goto("/#/world?study=small&condition=heir&run=0&generation=0&agent=3")
    expect(networks_page.get_by_test_id("relatives")).to_contain_text("random weights")
    expect(networks_page.get_by_test_id("teachers")).to_have_count(0)


def test_a_gating_module_has_no_error_chart(networks_page: Page) -> None:
    networks_page.goto("/#/world?study=small&condition=gated&run=0&generation=2&step=70&agent=3")
    expect(networks_page.get_by_test_id("networks")).to_be_visible()
    expect(networks_page.get_by_text("weight changes, since birth")).to_be_visible()
    expect(networks_page.get_by_text("error between the networks")).to_be_hidden()


def test_an_evolved_topology_is_drawn_by_depth(page: Page) -> None:
    """Draw two hidden units in series. The input feeds the first one, the bias the second one."""
    page.goto("/")
    links = [[0, 2, 1.0], [2, 3, -1.0], [-1, 3, 0.5], [3, 5, 2.0], [0, 5, 0.5]]
    net = {"inputs": ["front", "left"], "actions": ["forward"], "activations": [0] * 6, "action": 0}
    flat_links = [value for link in links for value in link]
    drawing = page.evaluate(GRAPH, {"net": net | {"links": flat_links}})
    assert drawing["words"] == ["front", "left", "bias", "forward"]
    assert (drawing["lines"], drawing["columns"], drawing["dots"]) == (len(links), 4, 6)


def test_the_inspector_opens_an_agent_with_an_evolved_topology(networks_page: Page) -> None:
    with networks_page.expect_response(lambda response: "/api/agent" in response.url) as event:
        networks_page.goto("/#/world?study=small&condition=grown&run=0&generation=2&agent=3")
    assert event.value.ok
    expect(networks_page.get_by_test_id("relatives")).to_contain_text("parents")
