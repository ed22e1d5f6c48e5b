"""Tests of sharing from the World tab: links, pages without a server, and pictures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlencode

import pytest
import xarray as xr
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from baldwinlab.simulation.replay import replay
from baldwinlab.studies.store import StudyStore
from tests.lab.client import SMALL, LabServer, get_response, open_offline_page, read_box

SHOWN = SMALL | {"step": 120, "agent": 3, "speed": 50}
SECOND_WORLD = {f"b.{name}": value for name, value in (SMALL | {"condition": "evo/A"}).items()}

# Record the worlds that a shared page draws. The page has no interface for tests.
RECORDER = """async () => {
    const { WorldView } = await import("lab/world/world_view.js");
    const draw = WorldView.prototype.draw;
    globalThis.drawn = [];
    WorldView.prototype.draw = function (...values) {
        const ready = draw.apply(this, values);
        globalThis.drawn.push({ x: [...this.x], y: [...this.y], time: values[1] });
        return ready;
    };
}"""


def trace_of(server: LabServer, condition: str) -> xr.Dataset:
    """Replay the lifetime that SMALL names, for a condition."""
    study = StudyStore(server.root / "small")
    energy = study.read(condition, 1).energy
    return replay(study.experiment(condition), seed=study.seed, run=1, generation=2, energy=energy)


@pytest.fixture
def offline_page(browser: Browser) -> Iterator[Page]:
    """Yield a page without a network. The test fails if it requests anything except its file."""
    with open_offline_page(browser, 800) as (page, requests):
        yield page
    files = [url for url in requests if url.startswith("file:")]
    assert [url for url in requests if not url.startswith("data:")] == files[:1]


def open_shared(page: Page, server: LabServer, folder: Path, **query: Any) -> None:
    """Open the shared page of a query from a file."""
    path = folder / "shared.html"
    path.write_bytes(get_response(server.address, "share", **query).content)
    page.goto(path.as_uri())
    page.locator("canvas").first.wait_for()


def last_drawn(page: Page, time: int) -> list[dict[str, Any]]:
    """Return the last drawing of each world at a step, in the order of the panels."""
    page.wait_for_function("time => globalThis.drawn.at(-1)?.time === time", arg=time)
    drawn = page.evaluate("globalThis.drawn")
    return [world for world in drawn if world["time"] == time][
        -page.get_by_test_id("replay-canvas").count() :
    ]


def test_a_shared_page_plays_from_a_file(
    offline_page: Page, lab_server: LabServer, tmp_path: Path
) -> None:
    open_shared(offline_page, lab_server, tmp_path, a=urlencode(SMALL))
    step = offline_page.get_by_test_id("replay-step")
    expect(step).to_have_text("0 / 299")
    offline_page.get_by_test_id("replay-speed").select_option("20")
    offline_page.get_by_role("button", name="Play").click()
    expect(offline_page.get_by_role("button", name="Pause")).to_be_visible()
    expect(step).to_have_text("299 / 299")
    expect(offline_page.get_by_role("button", name="Play")).to_be_visible()
    offline_page.locator("body").press("ArrowLeft")
    expect(step).to_have_text("298 / 299")


def test_the_positions_of_agents_on_a_shared_page_are_those_of_the_replay(
    offline_page: Page, lab_server: LabServer, tmp_path: Path
) -> None:
    open_shared(
        offline_page,
        lab_server,
        tmp_path,
        a=urlencode(SMALL),
        b=urlencode(SMALL | {"condition": "evo/A"}),
        step=40,
    )
    expect(offline_page.get_by_test_id("replay-step")).to_have_text("40 / 299")
    offline_page.evaluate(RECORDER)
    for step in (210, 17):
        offline_page.get_by_test_id("timeline").fill(str(step))
        worlds = last_drawn(offline_page, step)
        for world, condition in zip(worlds, ("evo+self-taught/A", "evo/A"), strict=True):
            trace = trace_of(lab_server, condition).isel(step=step)
            assert world["x"] == trace.x.values.tolist()
            assert world["y"] == trace.y.values.tolist()


def test_a_shared_page_shows_the_food_zooms_and_describes_an_agent(
    offline_page: Page, lab_server: LabServer, tmp_path: Path
) -> None:
    offline_page.set_viewport_size({"width": 390, "height": 844})
    open_shared(offline_page, lab_server, tmp_path, a=urlencode(SMALL), step=250)
    trace = trace_of(lab_server, "evo+self-taught/A")
    eaten = trace.eaten.values[:251].sum(axis=0)
    canvas = offline_page.get_by_test_id("replay-canvas")
    facts = offline_page.get_by_test_id("replay-canvas-facts")
    expect(offline_page.get_by_test_id("replay-canvas-count")).to_have_text(
        f"{eaten.sum()} eaten · {(eaten > 0).sum()} of 20 ate"
    )
    for meaning in ("food", "has eaten", "has not eaten", "active sensor", "eating"):
        expect(offline_page.get_by_test_id("legend")).to_contain_text(meaning)
    pixels = offline_page.evaluate(
        """Array.from(document.querySelector(".timeline canvas")
            .getContext("2d").getImageData(0, 0, 300, 30).data)"""
    )
    assert any(pixels)
    agent = int(eaten.argmax())
    offline_page.evaluate(RECORDER)
    offline_page.get_by_test_id("zoom-closer").click()
    offline_page.get_by_test_id("zoom-all").click()
    (world,) = last_drawn(offline_page, 250)
    box = read_box(canvas)
    assert min(box["width"], box["height"]) >= 240
    margin = min(28, box["width"] * 0.03)
    scale = (min(box["width"], box["height"]) - 2 * margin) / 640
    left, top = ((box[side] - 640 * scale) / 2 for side in ("width", "height"))
    x = left + world["x"][agent] * scale
    y = top + world["y"][agent] * scale
    canvas.click(position={"x": x, "y": y})
    action = ("left", "forward", "right")[int(trace.action.values[250, agent])]
    expect(facts).to_contain_text(f"Agent {agent}: {eaten[agent]} eaten")
    expect(facts).to_contain_text(f"action: {action}")
    offline_page.locator("body").press("Escape")
    expect(facts).to_be_hidden()
    assert offline_page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_shared_page_describes_its_lifetime_and_the_commands_that_reproduce_it(
    offline_page: Page, lab_server: LabServer, tmp_path: Path
) -> None:
    open_shared(offline_page, lab_server, tmp_path, a=urlencode(SMALL))
    expect(offline_page.locator("figcaption")).to_have_text(
        "evo+self-taught/A, run 1, generation 2seed 5, 20 agents, 50 items of food"
    )
    offline_page.locator("summary").click()
    expect(offline_page.get_by_test_id("replay-commands")).to_contain_text(
        "baldwinlab run experiment.toml --seed 5 --runs 2 --out study"
    )
    expect(offline_page.get_by_test_id("replay-experiment")).to_contain_text("steps = 300")


@pytest.mark.nightly
def test_the_link_reopens_the_shown_state(page: Page, lab_server: LabServer) -> None:
    page.goto(f"/#/world?{urlencode(SHOWN | SECOND_WORLD)}")
    page.get_by_test_id("share").click()
    link = page.get_by_test_id("share-link").input_value()
    query = dict(parse_qsl(link.partition("?")[2]))
    expected = {name: str(value) for name, value in (SHOWN | SECOND_WORLD).items()}
    assert expected.items() <= query.items()
    page.goto("about:blank")
    page.goto(link)
    expect(page.get_by_test_id("step")).to_have_text("120 / 299")
    expect(page.get_by_test_id("condition-b")).to_have_value("evo/A")
    page.get_by_test_id("share").click()
    expect(page.get_by_test_id("share-link")).to_have_value(link)


def test_the_menu_downloads_both_worlds_as_a_page_and_as_a_picture(
    page: Page, offline_page: Page, tmp_path: Path
) -> None:
    page.goto(f"/#/world?{urlencode(SHOWN | SECOND_WORLD)}")
    expect(page.get_by_test_id("step")).to_have_text("120 / 299")
    page.get_by_test_id("share").click()
    for kind in ("html", "png"):
        with page.expect_download() as download:
            page.get_by_test_id(f"share-{kind}").click()
        download.value.save_as(tmp_path / f"shared.{kind}")
    with Image.open(tmp_path / "shared.png") as picture:
        assert picture.width > 900
    offline_page.goto((tmp_path / "shared.html").as_uri())
    expect(offline_page.get_by_test_id("replay-canvas")).to_have_count(2)
    expect(offline_page.get_by_test_id("replay-step")).to_have_text("120 / 299")


@pytest.mark.nightly
def test_an_error_of_the_server_is_shown_on_the_page(
    browser: Browser, lab_server: LabServer
) -> None:
    page = lab_server.context(browser).new_page()
    page.route(
        "**/api/movie**",
        lambda route: route.fulfill(
            status=400, json={"error": "writing .mp4 needs the extra 'video'"}
        ),
    )
    page.goto(f"/#/world?{urlencode(SHOWN)}")
    page.get_by_test_id("share").click()
    page.get_by_test_id("share-mp4").click()
    expect(page.get_by_test_id("message-error")).to_contain_text(
        "writing .mp4 needs the extra 'video'"
    )
    page.close()
