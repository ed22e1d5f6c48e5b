"""Networks with a memory, modules that gate, and lessons, as the page draws them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer
from tests.lab.conftest import run_server
from tests.models.miniworld.plain import compile_nothing
from tests.small_studies import make_small_study
from tests.worlds import make_small_experiment

pytestmark = pytest.mark.filterwarnings(
    "ignore:.*encountered in:RuntimeWarning"
)  # plain numbers that wrap around
DRAWN = """async ({ net }) => {
    const { drawNetwork } = await import("/network.js");
    const pen = document.createElement("canvas").getContext("2d");
    const [words, arcs] = [[], []];
    pen.fillText = (text) => words.push(text);
    pen.quadraticCurveTo = (...way) => arcs.push(way);
    drawNetwork(pen, { left: 0, top: 0, width: 400, height: 150 }, net);
    return { words, arcs };
}"""


GRAPH = """async ({ net }) => {
    const { drawGraph } = await import("/network.js");
    const pen = document.createElement("canvas").getContext("2d");
    const [words, lines, dots] = [[], [], []];
    pen.fillText = (text) => words.push(text);
    pen.lineTo = (x, y) => lines.push([x, y]);
    pen.arc = (x, y) => dots.push([Math.round(x), Math.round(y)]);
    drawGraph(pen, { left: 0, top: 0, width: 400, height: 150 }, { ...net, links: new Float32Array(net.links) });
    return { words, lines: lines.length, columns: [...new Set(dots.map(([x]) => x))].sort((a, b) => a - b), dots: dots.length };
}"""


@pytest.fixture(scope="module")
def minds(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    root = tmp_path_factory.mktemp("minds")
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
    with (
        pytest.MonkeyPatch.context() as patched
    ):  # in plain Python, as two combinations of parts take longer to compile
        compile_nothing(patched)
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
def guest(browser: Browser, minds: LabServer, request: pytest.FixtureRequest) -> Iterator[Page]:
    width, height = getattr(request, "param", (1280, 800))
    context = minds.context(browser, viewport={"width": width, "height": height})
    page, faults = context.new_page(), list[str]()
    page.on("pageerror", lambda error: faults.append(str(error)))
    yield page
    context.close()
    assert not faults


def test_units_that_remember_are_named_and_an_arc_leads_back_to_each(page: Page) -> None:
    page.goto("/")
    net = {
        "sizes": [3, 2, 1],
        "biases": False,
        "weights": None,
        "activations": [0] * 6,
        "action": 0,
    }
    named = {"inputs": ["front"], "actions": ["forward"], "memory": [[3, 1], [4, 2]]}
    found = page.evaluate(DRAWN, {"net": net | named})
    assert found["words"] == ["front", "memory 1", "memory 2", "forward"]
    assert len(found["arcs"]) == 2
    without = page.evaluate(DRAWN, {"net": net | named | {"memory": [], "sizes": [1, 2, 1]}})
    assert without == {"words": ["front", "forward"], "arcs": []}


@pytest.mark.parametrize("guest", [(1280, 800), (390, 844)], indirect=True)
def test_the_legend_says_what_a_line_to_a_teacher_is_only_where_there_are_lessons(
    guest: Page,
) -> None:
    guest.goto("/#/world?study=small&condition=follower&run=0&generation=2&step=70")
    lesson = guest.get_by_test_id("legend").first.get_by_text("learns from")
    expect(lesson).to_have_count(1)
    expect(guest.locator("[data-ready]")).to_have_count(1)
    assert lesson.evaluate("entry => !entry.hidden")
    guest.goto("/#/world?study=small&condition=gated&run=0&generation=2&step=70")
    expect(guest.get_by_text("gated").first).to_be_visible()
    guest.wait_for_function(
        "document.querySelector('[data-testid=legend] .lesson').parentElement.hidden"
    )


@pytest.mark.parametrize("guest", [(1280, 800), (390, 844)], indirect=True)
def test_elders_are_named_inside_an_agent_and_no_line_leads_to_them(
    guest: Page, minds: LabServer
) -> None:
    guest.goto("/#/world?study=small&condition=heir&run=0&generation=2&agent=3")
    fitter, other = StudyStore(minds.root / "small").read("heir", 0).parents.values[2, 3].tolist()
    assert fitter != other
    expect(guest.get_by_test_id("teachers")).to_have_text(
        f"Taught by agents {fitter} and {other} of generation 1. "
        "Its reinforcement module contains the weights that they had learned by their death."
    )
    assert guest.evaluate("document.documentElement.scrollWidth <= innerWidth")
    expect(guest.get_by_test_id("legend").get_by_text("learns from").first).to_be_hidden()
    guest.goto("/#/world?study=small&condition=heir&run=0&generation=0&agent=3")
    expect(guest.get_by_test_id("kin")).to_contain_text("random weights")
    expect(guest.get_by_test_id("teachers")).to_have_count(0)


def test_a_gate_is_no_teacher_whose_error_is_shown(guest: Page) -> None:
    guest.goto("/#/world?study=small&condition=gated&run=0&generation=2&step=70&agent=3")
    expect(guest.get_by_test_id("networks")).to_be_visible()
    expect(guest.get_by_text("weight changes, since birth")).to_be_visible()
    expect(guest.get_by_text("error between the networks")).to_be_hidden()


def test_a_network_whose_links_evolved_is_drawn_by_depth(page: Page) -> None:
    """Two units one behind the other, of which the first hears the input, and the second the bias and the first."""
    page.goto("/")
    links = [[0, 2, 1.0], [2, 3, -1.0], [-1, 3, 0.5], [3, 5, 2.0], [0, 5, 0.5]]
    net = {"inputs": ["front", "left"], "actions": ["forward"], "activations": [0] * 6, "action": 0}
    found = page.evaluate(
        GRAPH, {"net": net | {"links": [each for link in links for each in link]}}
    )
    assert found["words"] == ["front", "left", "bias", "forward"]
    assert (found["lines"], len(found["columns"]), found["dots"]) == (len(links), 4, 6)


def test_what_grew_inside_an_agent_is_looked_at(guest: Page) -> None:
    with guest.expect_response(lambda answer: "/api/agent" in answer.url) as answered:
        guest.goto("/#/world?study=small&condition=grown&run=0&generation=2&agent=3")
    assert answered.value.ok
    expect(guest.get_by_test_id("kin")).to_contain_text("parents")
