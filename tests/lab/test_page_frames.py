"""Tests of worlds with many agents in the browser: density, zoom, playback and layout."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.lab.sources import binary_frames
from baldwinlab.lab.sources.frames import FrameQuery, Window, WorldCursor, make_frames
from tests.axe import find_violations
from tests.lab.client import WINDOWS, LabServer, read_box
from tests.lab.conftest import run_server
from tests.lab.crowds import CROWD_SIZE, make_crowd, make_life
from tests.lab.test_page_layout import check_page_layout, open_window
from tests.small_studies import make_small_study

CROWD = "/#/world?study=crowd&condition=evo/A&run=0&generation=0"
UNIT = "per square of 6 pixels"


@pytest.fixture(scope="module")
def crowd_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LabServer]:
    """Yield a server with the study `crowd`, whose world has many agents."""
    root = tmp_path_factory.mktemp("crowd")
    make_small_study(root / "crowd", [make_crowd()], runs=1)
    with run_server(root) as server:
        yield server


def open_crowd(page: Page, step: int) -> None:
    page.goto(f"{CROWD}&step={step}")
    expect(page.get_by_test_id("world-a")).to_have_attribute("data-step", str(step))


READ_ZOOM = "new URLSearchParams(location.hash.split('?')[1]).get('zoom') ?? '0.5,0.5,1'"


def press_and_read(page: Page, key: str) -> list[float]:
    """Press a key that changes the camera, and return its x, y and zoom from the address."""
    before = page.evaluate(READ_ZOOM)
    page.keyboard.press(key)
    page.wait_for_function(f"before => ({READ_ZOOM}) !== before", arg=before)
    return [float(part) for part in page.evaluate(READ_ZOOM).split(",")]


def test_a_map_shows_a_density_and_after_zooming_in_single_agents(
    browser: Browser, crowd_server: LabServer
) -> None:
    with open_window(browser, *WINDOWS["desktop"], lab=crowd_server) as page:
        open_crowd(page, 20)
        legend = page.get_by_test_id("density-legend")
        expect(legend).to_contain_text(f"agents {UNIT}")
        expect(legend).to_contain_text(f"food {UNIT}")
        expect(page.get_by_test_id("world-a-count")).to_contain_text(f"of {CROWD_SIZE:,} ate")
        canvas = page.get_by_test_id("world-a")
        both = canvas.screenshot()
        page.get_by_test_id("density-agents").uncheck()
        without_agents = canvas.screenshot()
        page.get_by_test_id("density-items").uncheck()
        pictures = {both, without_agents, canvas.screenshot()}
        assert len(pictures) == 3
        page.get_by_test_id("density-agents").check()
        for _ in range(7):
            page.get_by_role("button", name="Zoom in").click()
        expect(legend).not_to_contain_text(UNIT)
        # Find an agent near the center of the map with a click on each point of a grid.
        box = read_box(canvas)
        for number in range(40):
            x, y = number % 8 - 4, number // 8 - 2
            page.mouse.click(box["x"] + 640 + 24 * x, box["y"] + 250 + 24 * y)
            if page.get_by_test_id("agent").is_visible():
                break
        expect(page.get_by_test_id("agent")).to_contain_text("Agent ")
        expect(page.get_by_test_id("relatives")).to_contain_text("parents")


@pytest.mark.nightly
def test_keys_of_the_focused_map_zoom_and_move_it(
    browser: Browser, crowd_server: LabServer
) -> None:
    with open_window(browser, *WINDOWS["desktop"], lab=crowd_server) as page:
        open_crowd(page, 20)
        page.get_by_test_id("world-a").focus()
        assert press_and_read(page, "+") == [0.5, 0.5, 1.5]
        before = press_and_read(page, "+")
        assert before == [0.5, 0.5, 2.25]
        for key, direction in (
            ("ArrowRight", [1, 0]),
            ("ArrowUp", [0, -1]),
            ("ArrowLeft", [-1, 0]),
            ("ArrowDown", [0, 1]),
        ):
            after = press_and_read(page, key)
            assert np.sign(np.subtract(after, before)).tolist() == [*direction, 0], key
            before = after
        assert press_and_read(page, "0") == [0.5, 0.5, 1]
        # With the complete map, arrows change the step.
        page.keyboard.press("ArrowRight")
        expect(page.get_by_test_id("step")).to_have_text("21 / 59")


@pytest.mark.nightly
def test_a_world_of_many_agents_plays_to_its_end(browser: Browser, crowd_server: LabServer) -> None:
    with open_window(browser, *WINDOWS["desktop"], lab=crowd_server) as page:
        open_crowd(page, 0)
        page.get_by_test_id("play").click()
        expect(page.get_by_test_id("step")).to_have_text("59 / 59")
        expect(page.get_by_test_id("play")).to_have_attribute("data-playing", "false")
        page.get_by_test_id("timeline").fill("10")
        expect(page.get_by_test_id("world-a")).to_have_attribute("data-step", "10")


@pytest.mark.nightly
def test_a_density_fits_in_each_window(browser: Browser, crowd_server: LabServer) -> None:
    for width, height, dots in WINDOWS.values():
        with open_window(browser, width, height, dots, crowd_server) as page:
            open_crowd(page, 20)
            expect(page.get_by_test_id("density-legend")).to_contain_text(f"agents {UNIT}")
            check_page_layout(page, 1)


@pytest.mark.nightly
def test_a_density_has_no_barriers(browser: Browser, crowd_server: LabServer) -> None:
    with open_window(browser, *WINDOWS["phone"], lab=crowd_server) as page:
        open_crowd(page, 20)
        assert find_violations(page) == []
        page.emulate_media(color_scheme="dark")
        assert find_violations(page) == []


@pytest.mark.nightly
def test_an_exported_page_counts_as_the_server(offline_page: Page, tmp_path: Path) -> None:
    experiment = make_crowd()
    path = tmp_path / "crowd.html"
    path.write_bytes(render_live_page([experiment], seed=5))
    offline_page.goto(path.as_uri())
    offline_page.get_by_test_id("setup-runs").fill("1")
    offline_page.get_by_test_id("pace").select_option("0")
    offline_page.get_by_test_id("start").click()
    expect(offline_page.get_by_test_id("live-state")).to_have_text("Done")
    expect(offline_page.get_by_test_id("density-legend")).to_contain_text(f"agents {UNIT}")
    window = Window(60, 40, 540, 280, columns=40, rows=30, max_shapes=100)
    for checked in (window, window._replace(left=390, right=420, max_shapes=2000)):
        query = FrameQuery(20, 1, 1, checked)
        life = make_life(experiment)
        _, expected = binary_frames.unpack(make_frames(life, WorldCursor(life), query, {}))
        arrays = offline_page.evaluate(REQUEST, checked._asdict())
        assert arrays.keys() == expected.keys()
        for name, values in expected.items():
            assert arrays[name] == values.ravel().tolist(), name


REQUEST = """async window_ => {
  const { getBinary } = await import("lab/core/common.js");
  const live = new URLSearchParams(location.hash.split("?")[1]).get("id");
  const query = new URLSearchParams({
    live, run: 0, generation: 0, first: 20, count: 1, ...window_,
  });
  let answer;
  // A response can end before the step is simulated.
  do answer = await getBinary(`api/frames?${query}`); while (!answer.header.frames.length);
  const entries = Object.entries(answer.arrays).filter(([, array]) => array);
  return Object.fromEntries(entries.map(([name, array]) => [name, Array.from(array)]));
}"""
