"""The World tab in a real browser: watch, steer, scrub, compare, look inside, and come back by the address."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, Route, expect

from baldwinlab.evolution import GenerationKey
from baldwinlab.lab.agent_inspector import inspect_agent
from baldwinlab.lab.life_query import Life, ParentGeneration, Span
from baldwinlab.lab.recording import record_life
from baldwinlab.simulation.replay import recompute_genomes, replay, simulate_energy_before
from tests.lab.client import LabServer
from tests.lab.conftest import run_server
from tests.small_studies import make_small_study, shorten_preset

TAUGHT = "study=small&condition=evo%2Bself-taught/A&run=1&generation=2"


def open_world(page: Page, state: str = f"{TAUGHT}&step=0", panels: int = 1) -> None:
    page.goto(f"/#/world?{state}")
    expect(page.locator("[data-ready]")).to_have_count(panels)


def part(page: Page, name: str) -> Locator:
    return page.get_by_test_id(name)


def state_of(page: Page) -> dict[str, Any]:
    found: dict[str, Any] = page.evaluate(
        "Object.fromEntries(new URLSearchParams(location.hash.split('?')[1]))"
    )
    return found


def fulfil(raw: bytes, route: Route) -> None:
    route.fulfill(body=raw)


def expect_step(page: Page, step: int) -> None:
    expect(part(page, "step")).to_have_text(f"{step} / 299")


def test_a_world_plays_by_itself_within_a_second_and_pauses_where_it_is(page: Page) -> None:
    page.goto("/")
    expect(page.locator("[data-ready]")).to_have_count(1)
    expect(part(page, "play")).to_have_attribute("data-playing", "true")
    expect(part(page, "step")).not_to_have_text("0 / 299")
    part(page, "play").click()
    expect(part(page, "play")).to_have_attribute("data-playing", "false")
    page.evaluate("() => new Promise(requestAnimationFrame)")  # in which what was begun is drawn
    step = part(page, "step").text_content()
    page.wait_for_timeout(150)
    assert part(page, "step").text_content() == step


def test_the_keyboard_steers_time_speed_and_generation(page: Page) -> None:
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
    expect(part(page, "speed")).to_have_value("5")  # of so short a life
    page.keyboard.press("+")
    expect(part(page, "speed")).to_have_value("10")
    page.keyboard.press("[")
    expect(part(page, "generation-a")).to_have_value("1")
    page.keyboard.press("Space")
    expect(part(page, "play")).to_have_attribute("data-playing", "true")


def test_at_a_thousandfold_a_life_is_over_at_once_and_stops_at_its_last_step(page: Page) -> None:
    open_world(page)
    part(page, "speed").select_option("1000")
    part(page, "play").click()
    expect_step(page, 299)
    expect(part(page, "play")).to_have_attribute("data-playing", "false")


def test_what_is_shown_as_eaten_is_what_the_replay_says(page: Page) -> None:
    eaten = replay(shorten_preset(), seed=5, run=1, generation=2).eaten.cumsum("step")
    for step in (120, 299, 3):
        open_world(page, f"{TAUGHT}&step={step}")
        so_far = eaten.isel(step=step)
        expect(part(page, "eaten-a")).to_have_text(
            f"{int(so_far.sum())} eaten · {int((so_far > 0).sum())} of 20 ate"
        )


def test_scrubbing_goes_to_any_step_and_the_picture_follows(page: Page) -> None:
    open_world(page)
    before = part(page, "world-a").screenshot()
    part(page, "timeline").fill("250")
    expect_step(page, 250)
    assert part(page, "world-a").screenshot() != before
    part(page, "timeline").fill("0")
    expect_step(page, 0)
    page.wait_for_timeout(50)
    assert part(page, "world-a").screenshot() == before


def test_an_agent_opens_with_its_networks_and_kin_and_a_parent_opens_its_own_life(
    page: Page,
) -> None:
    open_world(page)
    trace = replay(shorten_preset(), seed=5, run=1, generation=2)
    box = part(page, "world-a").bounding_box()
    assert box is not None
    margin = min(28.0, 0.03 * min(box["width"], box["height"]))
    scale = min(box["width"], box["height"]) - 2 * margin
    left, top = (box["x"] + (box["width"] - scale) / 2, box["y"] + (box["height"] - scale) / 2)
    x, y = (float(trace[axis].isel(step=0, agent=7)) / 640 * scale for axis in ("x", "y"))
    page.mouse.click(left + x, top + y)
    expect(part(page, "agent")).to_have_text("Agent 7")
    expect(part(page, "kin")).to_contain_text("parents, in generation 1")
    parent = part(page, "parent").first
    name = (parent.text_content() or "").replace("agent", "Agent")
    parent.click()
    expect(part(page, "agent")).to_have_text(name)
    expect(part(page, "generation-a")).to_have_value("1")
    part(page, "close-agent").click()
    expect(part(page, "agent")).to_be_hidden()


def test_an_agent_s_action_is_shown_as_done_and_marked_where_it_was_noise(page: Page) -> None:
    noisy = shorten_preset("evo/A").replace(motor={"noise": 0.5})
    trace = replay(noisy, seed=5, run=1, generation=2)
    done, largest = trace.action.values[:, 3], trace.output.values[:, 3].argmax(axis=1)
    moment, whole = GenerationKey(5, 1, 2), Span(0, 300)
    life = Life(
        noisy,
        moment,
        lambda: ParentGeneration(
            recompute_genomes(noisy, moment, None), simulate_energy_before(noisy, moment)
        ),
    )
    for path, raw in (
        ("agent", inspect_agent(life, whole, 3)),
        ("recording", record_life(life, whole, {})),
    ):
        page.route(f"**/api/{path}?*", partial(fulfil, raw))
    names = ("left", "forward", "right")
    for step in (int((done == largest).argmax()), int((done != largest).argmax())):
        open_world(page, f"{TAUGHT}&step={step}&agent=3")
        mark = "" if done[step] == largest[step] else " (noise)"
        expect(part(page, "action")).to_have_text(names[done[step]] + mark)
        page.goto("about:blank")


def test_real_valued_inputs_are_shown_as_numbers_and_their_sectors_the_brighter_the_more(
    page: Page,
) -> None:
    experiment = shorten_preset("evo/A").replace(senses={"kinds": ["food", "nearest", "smell"]})
    moment, whole = GenerationKey(5, 1, 2), Span(0, 300)
    life = Life(
        experiment,
        moment,
        lambda: ParentGeneration(
            recompute_genomes(experiment, moment, None), simulate_energy_before(experiment, moment)
        ),
    )
    for path, raw in (
        ("agent", inspect_agent(life, whole, 3)),
        ("recording", record_life(life, whole, {})),
    ):
        page.route(f"**/api/{path}?*", partial(fulfil, raw))
    sensor = replay(experiment, seed=5, run=1, generation=2).sensor.values[:, 3]
    step = int((sensor[:, 5] > 0.1).argmax())
    assert sensor[step, 5] > 0.1
    open_world(page, f"{TAUGHT}&step={step}&agent=3")
    lights = page.locator(".sensor")
    numbers = [
        f"{name} {value:.2f}"
        for name, value in zip(("angle", "distance", "smell left"), sensor[step, 3:6], strict=True)
    ]
    expect(lights).to_have_text(
        ["left", "front", "right", *numbers, f"smell right {sensor[step, 6]:.2f}"]
    )
    expect(lights.nth(5)).to_have_class("sensor lit")
    expect(part(page, "responses")).to_be_hidden()


def test_two_lives_go_in_step_from_the_same_start(page: Page) -> None:
    open_world(page)
    part(page, "compare").click()
    expect(page.locator("[data-ready]")).to_have_count(2)
    expect(part(page, "condition-b")).to_have_value("evo/A")
    expect(part(page, "run-b")).to_have_value("1")
    expect(part(page, "generation-b")).to_have_value("2")
    part(page, "compare").click()
    expect(page.locator("[data-ready]")).to_have_count(1)


def test_the_address_reopens_exactly_what_is_seen(page: Page) -> None:
    open_world(page)
    part(page, "timeline").fill("140")
    part(page, "speed").select_option("50")
    part(page, "trails").select_option("life")
    part(page, "sight").uncheck()
    part(page, "agent-4").click()
    part(page, "compare").click()
    part(page, "world-a").hover()
    page.mouse.wheel(0, -600)
    expect(page).to_have_url(re.compile("zoom="))
    page.wait_for_timeout(600)  # the address follows a moment later
    seen = state_of(page)
    assert (seen["step"], seen["speed"], seen["agent"], seen["trails"], seen["sight"]) == (
        "140",
        "50",
        "4",
        "life",
        "off",
    )
    picture = part(page, "world-a").screenshot()
    page.reload()
    expect(page.locator("[data-ready]")).to_have_count(2)
    expect(part(page, "agent")).to_have_text("Agent 4")
    expect(part(page, "kin")).to_contain_text("parents")
    page.wait_for_timeout(600)
    assert state_of(page) == seen
    assert part(page, "world-a").screenshot() == picture


def test_back_returns_to_the_generation_before(page: Page) -> None:
    open_world(page)
    page.get_by_role("button", name="Previous generation").click()
    expect(part(page, "generation-a")).to_have_value("1")
    page.go_back()
    expect(part(page, "generation-a")).to_have_value("2")


def test_the_address_that_follows_never_takes_a_reader_back_who_is_on_the_way_to_another_view(
    page: Page,
) -> None:
    open_world(page)
    page.evaluate("""async () => {
        const { navigate } = await import("/address.js");
        navigate({ step: 17 }); // to be written in a moment
        location.hash = "#/results";
        dispatchEvent(new Event("pagehide")); // the moment comes before the page has heard that it is elsewhere
    }""")
    expect(page.get_by_test_id("results")).to_be_visible()
    page.go_back()
    expect(page.get_by_test_id("step")).to_be_visible()


@pytest.mark.parametrize(
    ("state", "sentence"),
    [
        ("study=nowhere", "There is no study nowhere in this folder"),
        ("study=small&condition=evo/B", "no finished runs of evo/B"),
        ("study=small&condition=evo/A&generation=99", "its generations are 0 to 2"),
        ("study=small&condition=evo/A&run=7", "no run 7 of evo/A"),
    ],
)
def test_an_address_of_what_is_not_there_gets_a_sentence_and_a_world(
    page: Page, state: str, sentence: str
) -> None:
    open_world(page, state)
    expect(part(page, "message-error")).to_contain_text(sentence)


def test_a_lost_connection_is_told_and_work_goes_on_when_it_is_back(
    browser: Browser, lab_server: LabServer
) -> None:
    context = lab_server.context(browser)
    page = context.new_page()
    open_world(page)
    page.route("**/api/**", lambda route: route.abort())
    part(page, "condition-a").select_option("evo/A")
    expect(part(page, "connection")).to_be_visible()
    page.unroute("**/api/**")
    expect(part(page, "connection")).to_be_hidden()
    expect(part(page, "eaten-a")).to_contain_text("of 20 ate")
    context.close()


def test_a_damaged_record_gets_a_sentence_and_no_other_life_in_its_place(
    browser: Browser, tmp_path: Path
) -> None:
    study = make_small_study(tmp_path / "small", runs=2)
    path = study.path("evo/A", 1)
    path.write_bytes(path.read_bytes()[:-9] + b"something")
    with run_server(tmp_path) as server, server.context(browser) as context:
        page = context.new_page()
        open_world(page, "study=small&condition=evo/A&run=0&generation=1&step=0")
        page.goto("/#/world?study=small&condition=evo/A&run=1&generation=1&step=0")
        expect(part(page, "messages")).to_contain_text(
            "0001.nc is damaged: its checksum does not fit its content"
        )
        expect(page.locator("[data-ready]")).to_have_count(0)
        expect(page.locator(".run-curve.plain")).to_have_count(1)
        page.goto("/#/world?study=small&condition=evo/A&run=0&generation=2&step=0")
        expect(page.locator("[data-ready]")).to_have_count(1)


def test_a_long_session_holds_no_more_than_a_short_one(page: Page) -> None:
    open_world(page, f"{TAUGHT}&step=0&agent=3")
    devtools = page.context.new_cdp_session(page)

    def held() -> float:
        devtools.send("HeapProfiler.collectGarbage")
        usage = devtools.send("Runtime.getHeapUsage")
        return float(usage["usedSize"] + usage["backingStorageSize"])

    def wander(times: int) -> None:
        for _ in range(times):
            for key in "[]":
                with page.expect_response("**/api/recording?*"):
                    page.keyboard.press(key)
                page.wait_for_timeout(20)

    wander(2)
    before = held()
    wander(15)
    page.wait_for_timeout(200)
    assert held() < before + 1e6  # thirty recordings are 3 MB


def test_on_a_phone_everything_fits_and_fingers_pick(
    browser: Browser, lab_server: LabServer
) -> None:
    context = lab_server.context(browser, viewport={"width": 390, "height": 844}, has_touch=True)
    page = context.new_page()
    for state, panels in (
        (f"{TAUGHT}&step=0", 1),
        (f"{TAUGHT}&step=0&b.condition=evo/A", 2),
        (f"{TAUGHT}&step=0&agent=2", 1),
    ):
        page.goto("about:blank")
        open_world(page, state, panels)
        assert page.evaluate("document.documentElement.scrollWidth") == 390
        assert page.evaluate("document.documentElement.scrollHeight") == 844
    page.touchscreen.tap(195, 200)
    context.close()
