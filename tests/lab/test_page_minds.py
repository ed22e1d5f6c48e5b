"""Networks with a memory, modules that gate, and lessons, as the page draws them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.lab.conftest import LabServer, serving
from tests.library.plain import compile_nothing
from tests.small import small_study
from tests.worlds import small

pytestmark = pytest.mark.filterwarnings("ignore:.*encountered in:RuntimeWarning")  # plain numbers that wrap around
DRAWN = """async ({ net }) => {
    const { drawNetwork } = await import("/network.js");
    const pen = document.createElement("canvas").getContext("2d");
    const [words, arcs] = [[], []];
    pen.fillText = (text) => words.push(text);
    pen.quadraticCurveTo = (...way) => arcs.push(way);
    drawNetwork(pen, { left: 0, top: 0, width: 400, height: 150 }, net);
    return { words, arcs };
}"""


@pytest.fixture(scope="module")
def minds(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    root = tmp_path_factory.mktemp("minds")
    kinds: dict[str, dict[str, Any]] = {
        "follower": {"learning": {"rule": "imitation"}},
        "gated": {"learning": {"rule": "modulated"}},
    }
    with pytest.MonkeyPatch.context() as patched:  # in plain Python, as two combinations of parts take longer to compile
        compile_nothing(patched)
        small_study(root / "small", [small("evo").replace(name=name, **changes) for name, changes in kinds.items()], runs=1)
        with serving(root) as server:
            yield server


@pytest.fixture
def guest(browser: Browser, minds: LabServer, request: pytest.FixtureRequest) -> Iterator[Page]:
    width, height = getattr(request, "param", (1280, 800))
    context = browser.new_context(base_url=minds.address, viewport={"width": width, "height": height})
    page, faults = context.new_page(), list[str]()
    page.on("pageerror", lambda error: faults.append(str(error)))
    yield page
    context.close()
    assert not faults


def test_units_that_remember_are_named_and_an_arc_leads_back_to_each(page: Page) -> None:
    page.goto("/")
    net = {"sizes": [3, 2, 1], "biases": False, "weights": None, "activations": [0] * 6, "action": 0}
    named = {"inputs": ["front"], "actions": ["forward"], "memory": [[3, 1], [4, 2]]}
    found = page.evaluate(DRAWN, {"net": net | named})
    assert found["words"] == ["front", "memory 1", "memory 2", "forward"]
    assert len(found["arcs"]) == 2
    without = page.evaluate(DRAWN, {"net": net | named | {"memory": [], "sizes": [1, 2, 1]}})
    assert without == {"words": ["front", "forward"], "arcs": []}


@pytest.mark.parametrize("guest", [(1280, 800), (390, 844)], indirect=True)
def test_the_legend_says_what_a_line_to_a_teacher_is_only_where_there_are_lessons(guest: Page) -> None:
    guest.goto("/#/world?study=small&condition=follower&run=0&generation=2&step=70")
    lesson = guest.get_by_test_id("legend").first.get_by_text("learns from")
    expect(lesson).to_have_count(1)
    expect(guest.locator("[data-ready]")).to_have_count(1)
    assert lesson.evaluate("entry => !entry.hidden")
    guest.goto("/#/world?study=small&condition=gated&run=0&generation=2&step=70")
    expect(guest.get_by_text("gated").first).to_be_visible()
    guest.wait_for_function("document.querySelector('[data-testid=legend] .lesson').parentElement.hidden")


def test_a_gate_is_no_teacher_whose_error_is_shown(guest: Page) -> None:
    guest.goto("/#/world?study=small&condition=gated&run=0&generation=2&step=70&agent=3")
    expect(guest.get_by_test_id("networks")).to_be_visible()
    expect(guest.get_by_text("weights, from birth on")).to_be_visible()
    expect(guest.get_by_text("error between the modules")).to_be_hidden()
