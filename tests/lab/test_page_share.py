"""What leaves the World tab: a link, a page that plays with no server, a picture."""

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
from tests.lab.client import SMALL, LabServer, get_response
from tests.lab.conftest import open_offline_page

SHOWN = SMALL | {"step": 120, "agent": 3, "speed": 50}
BESIDE = {f"b.{name}": value for name, value in (SMALL | {"condition": "evo/A"}).items()}

# The shared page has no way in, and needs none: this stands between its own modules.
SPY = """async () => {
    const { WorldView } = await import("lab/world.js");
    const draw = WorldView.prototype.draw;
    globalThis.drawn = [];
    WorldView.prototype.draw = function (...given) {
        const ready = draw.apply(this, given);
        globalThis.drawn.push({ x: [...this.x], y: [...this.y], time: given[1] });
        return ready;
    };
}"""


def trace_of(server: LabServer, condition: str) -> xr.Dataset:
    study = StudyStore(server.root / "small")
    energy = study.read(condition, 1).energy
    return replay(
        study.experiment(condition), seed=study.seed, run=1, generation=2, energy=energy
    )  # the life that SMALL names


@pytest.fixture
def offline_page(browser: Browser) -> Iterator[Page]:
    """A page with no network; its test fails if it asks for anything but the file itself, or has a fault."""
    with open_offline_page(browser, 800) as (page, asked):
        yield page
    assert [url for url in asked if not url.startswith("data:")] == [
        f for f in asked if f.startswith("file:")
    ][:1]


def open_shared(page: Page, server: LabServer, folder: Path, **query: Any) -> None:
    path = folder / "shared.html"
    path.write_bytes(get_response(server.address, "share", **query).content)
    page.goto(path.as_uri())
    page.locator("canvas").first.wait_for()


def last_drawn(page: Page, time: int) -> list[dict[str, Any]]:
    """The worlds as they were drawn last at a step, in the order of their panels."""
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
    expect(step).to_have_text("step 0 of 300")
    offline_page.get_by_test_id("replay-speed").select_option("20")
    offline_page.get_by_role("button", name="Play").click()
    expect(offline_page.get_by_role("button", name="Pause")).to_be_visible()
    expect(step).to_have_text("step 299 of 300")
    expect(offline_page.get_by_role("button", name="Play")).to_be_visible()
    offline_page.locator("body").press("ArrowLeft")
    expect(step).to_have_text("step 298 of 300")


def test_a_shared_page_shows_the_agents_where_the_replay_has_them(
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
    expect(offline_page.get_by_test_id("replay-step")).to_have_text("step 40 of 300")
    offline_page.evaluate(SPY)
    for step in (210, 17):
        offline_page.get_by_test_id("timeline").fill(str(step))
        worlds = last_drawn(offline_page, step)
        for world, condition in zip(worlds, ("evo+self-taught/A", "evo/A"), strict=True):
            trace = trace_of(lab_server, condition).isel(step=step)
            assert world["x"] == trace.x.values.tolist()
            assert world["y"] == trace.y.values.tolist()


def test_a_shared_page_tells_what_was_eaten_and_can_be_zoomed_and_asked_for_an_agent(
    offline_page: Page, lab_server: LabServer, tmp_path: Path
) -> None:
    offline_page.set_viewport_size({"width": 390, "height": 844})
    open_shared(offline_page, lab_server, tmp_path, a=urlencode(SMALL), step=250)
    trace = trace_of(lab_server, "evo+self-taught/A")
    eaten = trace.eaten.values[:251].sum(axis=0)
    canvas, facts = (
        offline_page.get_by_test_id("replay-canvas"),
        offline_page.get_by_test_id("replay-canvas-facts"),
    )
    expect(offline_page.get_by_test_id("replay-canvas-count")).to_have_text(
        f"{eaten.sum()} eaten · {(eaten > 0).sum()} of 20 ate"
    )
    for meaning in ("food", "has eaten", "has not eaten", "active sensor", "eating"):
        expect(offline_page.get_by_test_id("legend")).to_contain_text(meaning)
    assert offline_page.evaluate(
        "[...document.querySelector('.timeline canvas').getContext('2d').getImageData(0, 0, 300, 30).data].some(Boolean)"
    )
    agent = int(eaten.argmax())
    offline_page.evaluate(SPY)
    offline_page.get_by_test_id("zoom-closer").click()
    offline_page.get_by_test_id("zoom-whole").click()
    (world,) = last_drawn(offline_page, 250)
    box = canvas.bounding_box()
    assert box and box["width"] >= 240 and box["height"] >= 240
    margin = min(28, box["width"] * 0.03)
    scale = (min(box["width"], box["height"]) - 2 * margin) / 640
    left, top = ((box[side] - 640 * scale) / 2 for side in ("width", "height"))
    canvas.click(
        position={"x": left + world["x"][agent] * scale, "y": top + world["y"][agent] * scale}
    )
    action = ("left", "forward", "right")[int(trace.action.values[250, agent])]
    expect(facts).to_contain_text(f"Agent {agent}: {eaten[agent]} eaten")
    expect(facts).to_contain_text(f"action: {action}")
    offline_page.locator("body").press("Escape")
    expect(facts).to_be_hidden()
    assert offline_page.evaluate("document.documentElement.scrollWidth") <= 390


def test_a_shared_page_says_what_it_is_and_how_to_have_it_again(
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


def test_the_link_opens_exactly_what_was_shown(page: Page, lab_server: LabServer) -> None:
    page.goto(f"/#/world?{urlencode(SHOWN | BESIDE)}")
    page.get_by_test_id("share").click()
    link = page.get_by_test_id("share-link").input_value()
    assert (SHOWN | BESIDE).items() <= {
        k: int(v) if v.isdigit() else v for k, v in parse_qsl(link.partition("?")[2])
    }.items()
    page.goto("about:blank")
    page.goto(link)
    expect(page.get_by_test_id("step")).to_have_text("120 / 299")
    expect(page.get_by_test_id("condition-b")).to_have_value("evo/A")
    page.get_by_test_id("share").click()
    expect(page.get_by_test_id("share-link")).to_have_value(link)


def test_the_menu_saves_both_worlds_as_a_page_and_as_a_picture(
    page: Page, offline_page: Page, tmp_path: Path
) -> None:
    page.goto(f"/#/world?{urlencode(SHOWN | BESIDE)}")
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
    expect(offline_page.get_by_test_id("replay-step")).to_have_text("step 120 of 300")


def test_what_the_server_refuses_is_a_sentence_on_the_page(
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
