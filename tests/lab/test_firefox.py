"""Firefox shows the same pages, and lives the same lives."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from baldwinlab.lab.export import live_page
from baldwinlab.lab.notebook_player import html
from baldwinlab.papers import presets
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.lab.client import WINDOWS, LabServer, get_response
from tests.lab.firefox import Firefox, firefox
from tests.lab.test_page_export import SIMULATE, TYPES, quick
from tests.lab.test_page_layout import LIFE, MEASURE, require_room_in

pytestmark = pytest.mark.nightly  # another browser, which `make nightly` installs


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    with firefox(tmp_path_factory.mktemp("profile")) as opened:
        yield opened
        assert opened.faults == []


@pytest.mark.parametrize(
    ("width", "height"), [window[:2] for window in WINDOWS.values()], ids=WINDOWS
)
def test_worlds_have_room_in_comparison_and_beside_the_inside_of_an_agent(
    browser: Firefox, lab_server: LabServer, width: int, height: int
) -> None:
    browser.open(f"{lab_server.entry}#/world?{LIFE}", width, height)
    browser.wait_for("document.querySelectorAll('[data-ready]').length === 1")
    for control, worlds in ((None, 1), ("compare", 2), ("agents", 2), ("agent-3", 2)):
        if control:
            there = f"""document.querySelector('[data-testid="{control}"]')"""
            browser.wait_for(f"{there} !== null")
            browser.ask(f"{there}.click()")
        browser.wait_for(f"document.querySelectorAll('[data-ready]').length === {worlds}")
        require_room_in(browser.ask(f"({MEASURE})('/world.js')"), worlds)
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
    browser.wait_for(
        """document.querySelector('[data-testid="replay-step"]')?.textContent === 'step 40 of 300'"""
    )
    require_room_in(browser.ask(f"({MEASURE})('lab/world.js')"), 1)


@pytest.mark.parametrize("name", ["evo+self-taught/A", "evo/B"])
def test_an_exported_page_has_python_s_bits(browser: Firefox, tmp_path: Path, name: str) -> None:
    experiment = quick(presets.load(name))
    path = tmp_path / "laboratory.html"
    path.write_bytes(live_page([experiment]))
    browser.open(path.as_uri(), 1280, 800)
    browser.wait_for("window.baldwinlab !== undefined")
    there = browser.ask(f"({SIMULATE})({{ seed: 5, run: 1 }})")
    here = simulate(experiment, seed=5, run=1)
    for variable, kind in TYPES.items():
        values = here[variable].values
        assert (
            values.dtype == kind
            and bytes(there[variable]) == np.ascontiguousarray(values).tobytes()
        ), variable


def test_a_trace_plays_in_a_notebook_s_frame(tmp_path: Path) -> None:
    path = tmp_path / "notebook.html"
    path.write_text(
        f"<!doctype html><meta charset='utf-8'>{html(replay(quick(presets.load('evo/A'))))}"
    )
    (tmp_path / "profile").mkdir()
    with firefox(tmp_path / "profile") as opened:
        opened.open(path.as_uri(), 800, 800)
        opened.inspect_agent()
        opened.wait_for(
            """document.querySelector('[data-testid="replay-step"]')?.textContent.startsWith('step 0 of')"""
        )
        assert opened.faults == []
