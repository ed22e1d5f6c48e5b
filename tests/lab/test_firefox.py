"""Tests of pages in Firefox, with the simulations bit-identical to Python."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest

from baldwinlab.lab.pages import explorable
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.lab.pages.notebook_player import format_html
from baldwinlab.papers import presets
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.lab.client import WINDOWS, LabServer, get_response
from tests.lab.firefox import Firefox, open_firefox
from tests.lab.test_page_export import SIMULATE, TYPES, shorten
from tests.lab.test_page_layout import LIFE, MEASURE, check_layout

# `make nightly` installs Firefox.
pytestmark = pytest.mark.nightly
# The text that names the step of a shared page.
STEP = """document.querySelector('[data-testid="replay-step"]')?.textContent"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    with open_firefox(tmp_path_factory.mktemp("profile")) as opened:
        yield opened
        assert opened.errors == []


@pytest.mark.parametrize(
    ("width", "height"), [window[:2] for window in WINDOWS.values()], ids=WINDOWS
)
def test_maps_are_large_enough_with_two_worlds_and_an_agent_inspector(
    browser: Firefox, lab_server: LabServer, width: int, height: int
) -> None:
    browser.open(f"{lab_server.entry}#/world?{LIFE}", width, height)
    browser.wait_for("document.querySelectorAll('[data-ready]').length === 1")
    for control, worlds in ((None, 1), ("compare", 2), ("agents", 2), ("agent-3", 2)):
        if control:
            element = f"""document.querySelector('[data-testid="{control}"]')"""
            browser.wait_for(f"{element} !== null")
            browser.evaluate(f"{element}.click()")
        browser.wait_for(f"document.querySelectorAll('[data-ready]').length === {worlds}")
        check_layout(browser.evaluate(f"({MEASURE})('/world/world_view.js')"), worlds)
    browser.wait_for("document.querySelector('.inside table') !== null")


@pytest.mark.parametrize(
    ("width", "height"), [window[:2] for window in WINDOWS.values()], ids=WINDOWS
)
def test_a_shared_page_plays_from_its_file(
    browser: Firefox, lab_server: LabServer, tmp_path: Path, width: int, height: int
) -> None:
    path = tmp_path / "shared.html"
    path.write_bytes(get_response(lab_server.address, "share", a=LIFE, step=40).content)
    browser.open(path.as_uri(), width, height)
    browser.wait_for(f"{STEP} === '40 / 299'")
    check_layout(browser.evaluate(f"({MEASURE})('lab/world/world_view.js')"), 1)


@pytest.mark.parametrize("name", ["evo+self-taught/A", "evo/B"])
def test_an_exported_page_is_bit_identical_to_python(
    browser: Firefox, tmp_path: Path, name: str
) -> None:
    experiment = shorten(presets.load(name))
    path = tmp_path / "laboratory.html"
    path.write_bytes(render_live_page([experiment]))
    browser.open(path.as_uri(), 1280, 800)
    browser.wait_for("window.baldwinlab !== undefined")
    actual = browser.evaluate(f"({SIMULATE})({{ seed: 5, run: 1 }})")
    expected = simulate(experiment, seed=5, run=1)
    for variable, kind in TYPES.items():
        values = expected[variable].values
        assert values.dtype == kind, variable
        assert bytes(actual[variable]) == np.ascontiguousarray(values).tobytes(), variable


def test_a_trace_plays_in_the_frame_of_a_notebook(tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    trace = replay(shorten(presets.load("evo/A")))
    path.write_text(f"<!doctype html><meta charset='utf-8'>{format_html(trace)}")
    (tmp_path / "profile").mkdir()
    with open_firefox(tmp_path / "profile") as opened:
        opened.open(path.as_uri(), 800, 800)
        opened.enter_frame()
        opened.wait_for(f"{STEP}.startsWith('0 /')")
        assert opened.errors == []


def test_the_explorable_simulates_in_its_file(browser: Firefox, essay: Path) -> None:
    browser.open(essay.as_uri(), 390, 844)
    browser.wait_for("""document.querySelector('[data-value="ring_items"]').textContent > 0""")
    for step in ("puzzle", "evolution"):
        browser.evaluate(f"document.querySelector('#{step} .picture').scrollIntoView()")
        text = f"""document.querySelector('#{step} [data-value="generation"]').textContent"""
        browser.wait_for(f"{text} > 3")
    assert browser.evaluate("document.documentElement.scrollWidth") <= 390
    request = {"scene": "learning", "changes": {"evolution.generations": 2}, "run": 1}
    expression = f"window.baldwinlab.simulate({json.dumps(request)}).then(run => [...run.energy])"
    experiment = explorable.make_scenes()["learning"].replace(evolution={"generations": 2})
    expected = simulate(experiment, seed=explorable.SEED, run=1).energy.values.ravel().tolist()
    assert browser.evaluate(expression) == expected


def test_two_values_are_compared_in_the_dialog_at_320_pixels(
    browser: Firefox, lab_server: LabServer
) -> None:
    changes = {"lifetime.steps": 100, "evolution.generations": 2}
    compared = {"fields": {"learning.rate": [0.01, 0.1]}}
    query = {"runs": 2, "set": json.dumps(changes), "compare": json.dumps(compared)}
    browser.open(f"{lab_server.entry}#/live?{urlencode(query)}", 320, 568)
    browser.wait_for(f"{select('compare-start')}?.disabled === false")
    dialog = select("compare-dialog")
    assert browser.evaluate(f"{dialog}.scrollWidth - {dialog}.clientWidth") == 0
    browser.evaluate(f"{select('compare-start')}.click()")
    browser.wait_for(f"{select('compare-answer')}?.textContent.includes('too few to compare')")
    assert browser.evaluate(f"{select('comparison')}.querySelectorAll('tbody tr').length") == 4
    assert browser.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
    assert not browser.errors
    shutil.rmtree(lab_server.root / "live")


def test_the_map_of_behavior_and_the_freezer_work(browser: Firefox, lab_server: LabServer) -> None:
    def press(test_id: str) -> None:
        element = select(test_id)
        browser.wait_for(f"{element}?.checkVisibility() && !{element}.disabled")
        browser.evaluate(f"{element}.click()")

    browser.open(f"{lab_server.entry}#/world?{LIFE}&step=1", 1280, 800)
    browser.wait_for("document.querySelectorAll('[data-ready]').length === 1")
    press("behavior")
    browser.wait_for("document.querySelectorAll('.scatter circle').length === 3")
    browser.evaluate("history.back()")
    browser.wait_for("document.querySelectorAll('[data-ready]').length === 1")
    press("share")
    press("keep-a")
    browser.evaluate(f"{select('save-name')}.value = 'firefox'")
    press("save-submit")
    browser.wait_for(f"{select('message-done')} !== null")
    assert (lab_server.root / "freezer" / "firefox.nc").is_file()
    shutil.rmtree(lab_server.root / "freezer")


def select(name: str) -> str:
    """Return a JavaScript expression for the element with a test id."""
    return f"""document.querySelector('[data-testid="{name}"]')"""
