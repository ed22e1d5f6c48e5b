"""Tests of the World tab: playback, keyboard, comparison, agent inspector and address."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, Route, expect

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.lab.sources.inspector import inspect_agent
from baldwinlab.lab.sources.life_query import Life, Span, StartData
from baldwinlab.lab.sources.recording import record_life
from baldwinlab.simulation.replay import recompute_genomes, replay, simulate_energy_before
from tests.lab.client import LabServer, draw_frames, read_box, wait_for
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study, shorten_preset

SELF_TAUGHT = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2"


def open_world(page: Page, state: str = f"{SELF_TAUGHT}&step=0", panels: int = 1) -> None:
    page.goto(f"/#/world?{state}")
    expect(page.locator("[data-ready]")).to_have_count(panels)


def find(page: Page, name: str) -> Locator:
    return page.get_by_test_id(name)


def read_state(page: Page) -> dict[str, Any]:
    """Return the query of the address, without the delay of its updates."""
    state: dict[str, Any] = page.evaluate(
        """async () => {
          const { formatAddress } = await import("/core/address.js");
          return Object.fromEntries(new URLSearchParams(formatAddress().split("?")[1]));
        }"""
    )
    return state


def fulfill(raw: bytes, route: Route) -> None:
    route.fulfill(body=raw)


def route_life(page: Page, experiment: Experiment) -> None:
    """Answer requests for a lifetime and for its agent 3 with those of an experiment."""
    key = GenerationKey(5, 1, 2)
    span = Span(0, 300)
    life = Life(
        experiment,
        key,
        lambda: StartData(
            recompute_genomes(experiment, key, None), simulate_energy_before(experiment, key)
        ),
    )
    page.route("**/api/agent?*", partial(fulfill, inspect_agent(life, span, 3)))
    page.route("**/api/recording?*", partial(fulfill, record_life(life, span, {})))


def expect_step(page: Page, step: int) -> None:
    expect(find(page, "step")).to_have_text(f"{step} / 299")


def test_a_world_plays_without_a_click_and_pauses_at_the_current_step(page: Page) -> None:
    page.goto(f"/#/world?{SELF_TAUGHT}")
    expect(page.locator("[data-ready]")).to_have_count(1)
    expect(find(page, "step")).not_to_have_text("0 / 299")
    find(page, "play").click()
    expect(find(page, "play")).to_have_attribute("data-playing", "false")
    draw_frames(page)
    step = find(page, "step").text_content()
    draw_frames(page)
    assert find(page, "step").text_content() == step


def test_keys_change_the_step_the_speed_and_the_generation(page: Page) -> None:
    open_world(page)
    for key, step in (
        ("ArrowRight", 1),
        ("Shift+ArrowRight", 101),
        ("ArrowLeft", 100),
        ("End", 299),
        ("Home", 0),
    ):
        page.keyboard.press(key)
        expect_step(page, step)
    # The default speed of a short lifetime.
    expect(find(page, "speed")).to_have_value("5")
    page.keyboard.press("+")
    expect(find(page, "speed")).to_have_value("10")
    page.keyboard.press("[")
    expect(find(page, "generation-a")).to_have_value("1")
    page.keyboard.press("Space")
    expect(find(page, "step")).not_to_have_text("0 / 299")


def test_the_number_of_eaten_items_is_that_of_the_replay(page: Page) -> None:
    eaten = replay(shorten_preset(), seed=5, run=1, generation=2).eaten.cumsum("step")
    for step in (120, 299, 3):
        open_world(page, f"{SELF_TAUGHT}&step={step}")
        totals = eaten.isel(step=step)
        expect(find(page, "world-a-count")).to_have_text(
            f"learns · {int(totals.sum())} eaten · {int((totals > 0).sum())} of 20 ate"
        )


def test_the_timeline_changes_the_step_and_the_picture(page: Page) -> None:
    open_world(page)
    before = find(page, "world-a").screenshot()
    find(page, "timeline").fill("250")
    expect_step(page, 250)
    assert find(page, "world-a").screenshot() != before
    find(page, "timeline").fill("0")
    expect_step(page, 0)
    wait_for(page, lambda: find(page, "world-a").screenshot() == before)


def test_a_click_opens_an_agent_and_its_parents(
    page: Page,
) -> None:
    open_world(page)
    trace = replay(shorten_preset(), seed=5, run=1, generation=2)
    box = read_box(find(page, "world-a"))
    margin = min(28.0, 0.03 * min(box["width"], box["height"]))
    scale = min(box["width"], box["height"]) - 2 * margin
    left = box["x"] + (box["width"] - scale) / 2
    top = box["y"] + (box["height"] - scale) / 2
    x, y = (float(trace[axis].isel(step=0, agent=7)) / 640 * scale for axis in ("x", "y"))
    page.mouse.click(left + x, top + y)
    expect(find(page, "agent")).to_have_text("Agent 7")
    expect(find(page, "relatives")).to_contain_text("parents, in generation 1")
    parent = find(page, "parent").first
    name = (parent.text_content() or "").replace("agent", "Agent")
    parent.click()
    expect(find(page, "agent")).to_have_text(name)
    expect(find(page, "generation-a")).to_have_value("1")
    find(page, "close-agent").click()
    expect(find(page, "agent")).to_be_hidden()


def test_the_shown_action_is_that_of_the_replay_and_noise_is_marked(page: Page) -> None:
    noisy = shorten_preset("evo/A").replace(motor={"noise": 0.5})
    trace = replay(noisy, seed=5, run=1, generation=2)
    actions = trace.action.values[:, 3]
    largest = trace.output.values[:, 3].argmax(axis=1)
    route_life(page, noisy)
    names = ("left", "forward", "right")
    for step in (int((actions == largest).argmax()), int((actions != largest).argmax())):
        open_world(page, f"{SELF_TAUGHT}&step={step}&agent=3")
        mark = "" if actions[step] == largest[step] else " (noise)"
        expect(find(page, "action")).to_have_text(names[actions[step]] + mark)
        page.goto("about:blank")


@pytest.mark.nightly
def test_real_valued_inputs_are_shown_as_numbers_and_highlighted(
    page: Page,
) -> None:
    experiment = shorten_preset("evo/A").replace(senses={"kinds": ["food", "nearest", "smell"]})
    route_life(page, experiment)
    sensor = replay(experiment, seed=5, run=1, generation=2).sensor.values[:, 3]
    step = int((sensor[:, 5] > 0.1).argmax())
    assert sensor[step, 5] > 0.1
    open_world(page, f"{SELF_TAUGHT}&step={step}&agent=3")
    sensors = page.locator(".sensor")
    numbers = [
        f"{name} {value:.3g}"
        for name, value in zip(("angle", "distance", "smell left"), sensor[step, 3:6], strict=True)
    ]
    expect(sensors).to_have_text(
        ["left", "front", "right", *numbers, f"smell right {sensor[step, 6]:.3g}"]
    )
    expect(sensors.nth(5)).to_have_class("sensor lit")
    expect(find(page, "responses")).to_be_hidden()


@pytest.mark.nightly
def test_a_comparison_starts_with_the_same_run_and_generation(page: Page) -> None:
    open_world(page)
    find(page, "compare").click()
    expect(page.locator("[data-ready]")).to_have_count(2)
    expect(find(page, "condition-b")).to_have_value("evo/A")
    expect(find(page, "run-b")).to_have_value("1")
    expect(find(page, "generation-b")).to_have_value("2")
    find(page, "compare").click()
    expect(page.locator("[data-ready]")).to_have_count(1)


def test_the_address_reopens_the_shown_state(page: Page) -> None:
    open_world(page)
    find(page, "timeline").fill("140")
    find(page, "speed").select_option("50")
    find(page, "trails").select_option("life")
    find(page, "sight").uncheck()
    find(page, "agent-4").click()
    find(page, "compare").click()
    find(page, "world-a").hover()
    page.mouse.wheel(0, -600)
    expect(page).to_have_url(re.compile("zoom="))
    state = read_state(page)
    expected = {"step": "140", "speed": "50", "agent": "4", "trails": "life", "sight": "off"}
    assert expected.items() <= state.items()
    draw_frames(page)
    picture = find(page, "world-a").screenshot()
    page.reload()
    expect(page.locator("[data-ready]")).to_have_count(2)
    expect(find(page, "agent")).to_have_text("Agent 4")
    expect(find(page, "relatives")).to_contain_text("parents")
    assert read_state(page) == state
    wait_for(page, lambda: find(page, "world-a").screenshot() == picture)


@pytest.mark.nightly
def test_back_returns_to_the_generation_before(page: Page) -> None:
    open_world(page)
    page.get_by_role("button", name="Previous generation").click()
    expect(find(page, "generation-a")).to_have_value("1")
    page.go_back()
    expect(find(page, "generation-a")).to_have_value("2")


@pytest.mark.nightly
def test_a_delayed_update_of_the_address_does_not_return_from_another_tab(
    page: Page,
) -> None:
    open_world(page)
    page.evaluate("""async () => {
        const { navigate } = await import("/core/address.js");
        // This update of the address is delayed.
        navigate({ step: 17 });
        location.hash = "#/results";
        // The page writes the delayed update before it handles the new tab.
        dispatchEvent(new Event("pagehide"));
    }""")
    expect(page.get_by_test_id("results")).to_be_visible()
    page.go_back()
    expect(page.get_by_test_id("step")).to_be_visible()


@pytest.mark.parametrize(
    ("state", "message", "link"),
    [
        ("study=nowhere", "There is no study nowhere", "small"),
        ("study=small&condition=evo/B", "no finished runs of evo/B", "evo/A"),
        ("study=small&condition=evo/A&generation=99", "its generations are 0 to 2", "generation 2"),
        ("study=small&condition=evo/A&run=7", "no run 7 of evo/A", "run 1"),
        (f"{SELF_TAUGHT}&b.condition=evo/B", "no finished runs of evo/B", "evo/A"),
    ],
)
def test_a_wrong_address_shows_a_message_links_and_no_picture(
    page: Page, state: str, message: str, link: str
) -> None:
    page.goto(f"/#/world?{state}")
    expect(find(page, "missing-lifetime")).to_contain_text(message)
    expect(page.locator("main canvas")).to_have_count(0)
    page.get_by_role("link", name=link, exact=True).click()
    expect(page.locator("[data-ready]")).to_have_count(1)


def test_a_lost_connection_shows_a_message_until_it_is_restored(
    browser: Browser, lab_server: LabServer
) -> None:
    context = lab_server.context(browser)
    page = context.new_page()
    open_world(page)
    page.route("**/api/**", lambda route: route.abort())
    find(page, "condition-a").select_option("evo/A")
    expect(find(page, "connection")).to_be_visible()
    page.unroute("**/api/**")
    expect(find(page, "connection")).to_be_hidden()
    expect(find(page, "world-a-count")).to_contain_text("of 20 ate")
    context.close()


def test_a_damaged_record_shows_a_message_and_no_lifetime(browser: Browser, tmp_path: Path) -> None:
    study = make_small_study(tmp_path / "small", runs=2)
    path = study.path("evo/A", 1)
    path.write_bytes(path.read_bytes()[:-9] + b"something")
    with run_server(tmp_path) as server, server.open_page(browser) as page:
        open_world(page, "study=small&condition=evo/A&run=0&generation=1&step=0")
        page.goto("/#/world?study=small&condition=evo/A&run=1&generation=1&step=0")
        expect(find(page, "messages")).to_contain_text(
            "0001.nc is damaged: its checksum does not fit its content"
        )
        expect(page.locator("[data-ready]")).to_have_count(0)
        expect(page.locator(".run-curve.plain")).to_have_count(1)
        page.goto("/#/world?study=small&condition=evo/A&run=0&generation=2&step=0")
        expect(page.locator("[data-ready]")).to_have_count(1)


@pytest.mark.nightly
def test_memory_does_not_grow_in_a_long_session(page: Page) -> None:
    open_world(page, f"{SELF_TAUGHT}&step=0&agent=3")
    devtools = page.context.new_cdp_session(page)

    def used_memory() -> float:
        devtools.send("HeapProfiler.collectGarbage")
        usage = devtools.send("Runtime.getHeapUsage")
        return float(usage["usedSize"] + usage["backingStorageSize"])

    def change_generations(times: int) -> None:
        for _ in range(times):
            for key in "[]":
                with page.expect_response("**/api/recording?*"):
                    page.keyboard.press(key)
                page.evaluate("() => new Promise(requestAnimationFrame)")

    change_generations(2)
    before = used_memory()
    change_generations(15)
    # Thirty recordings have 3 MB.
    assert used_memory() < before + 1e6
