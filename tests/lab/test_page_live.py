"""Tests of the Live run tab: its form, the control of runs, and the shown worlds."""

from __future__ import annotations

import json
import re
from pathlib import Path
from threading import Event
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from baldwinlab.papers.presets import load
from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer, get_json, read_box, wait_for

QUICK = {"lifetime.steps": 300, "world.start.x": 400, "evolution.generations": 4}
# Tests stop a long run.
LONG = QUICK | {"evolution.generations": 5000}


def make_address(changes: dict[str, Any], **query: Any) -> str:
    """Return the address of the tab with changed settings."""
    state = {"preset": "evo+self-taught/A", "runs": 2, "set": json.dumps(changes), **query}
    return "/#/live?" + "&".join(
        f"{name}={quote(str(value), safe='')}" for name, value in state.items()
    )


def start_live_run(page: Page, changes: dict[str, Any], **query: Any) -> None:
    page.goto(make_address(changes, **query))
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-head")).to_be_visible()


def count_generations(page: Page) -> int:
    """Return the number of finished generations that the page shows."""
    return int((page.get_by_test_id("live-count").text_content() or "").split()[0].replace(",", ""))


def expect_state(page: Page, state: str) -> None:
    expect(page.get_by_test_id("live-state")).to_have_text(state)


def test_a_live_run_is_started_paused_resumed_stopped_saved_and_opened(
    page: Page, lab_server: LabServer
) -> None:
    start_live_run(page, LONG)
    wait_for(page, lambda: count_generations(page) >= 3)
    expect(page.get_by_test_id("live-caption")).to_have_text(re.compile(r"Generation \d+"))
    page.get_by_test_id("pause").click()
    expect_state(page, "Paused")

    def read_server_state() -> str:
        runs = get_json(lab_server.address, "live")["runs"]
        return next(str(run["state"]) for run in runs if run["id"] in page.url)

    wait_for(page, lambda: read_server_state() == "paused")
    before = count_generations(page)
    page.get_by_test_id("pause").click()
    wait_for(page, lambda: count_generations(page) > before)
    page.get_by_test_id("stop").click()
    expect_state(page, "Stopped")
    page.get_by_test_id("save").click()
    page.get_by_test_id("save-name").fill("saved/mine")
    page.get_by_test_id("save-submit").click()
    page.get_by_test_id("open-saved").click()
    expect(page.get_by_test_id("results")).to_be_visible()
    assert "study=saved" in page.url
    expect(page.get_by_test_id("curves")).to_contain_text("evo+self-taught/A")
    study = StudyStore(lab_server.root / "saved/mine")
    assert study.runs("evo+self-taught/A") == [0, 1]
    generations = study.experiment("evo+self-taught/A").evolution.generations
    expected = load("evo+self-taught/A").replace(
        lifetime={"steps": 300},
        world={"start": {"x": 400}},
        evolution={"generations": generations},
    )
    assert study.experiment("evo+self-taught/A") == expected


def test_a_value_out_of_range_shows_a_message_at_its_field_and_at_the_button(page: Page) -> None:
    page.goto(make_address({}))
    # The presets are grouped by paper, and a search of their captions shortens the list.
    options = page.get_by_test_id("preset").locator("option")
    expect(page.get_by_test_id("preset").locator("optgroup").first).to_have_attribute(
        "label", "Nam Le, 2019"
    )
    page.get_by_test_id("all-presets").locator("summary").click()
    page.get_by_test_id("preset-search").fill("guess undecided")
    assert {"guessing", "evo+self-taught/A"} <= set(
        options.evaluate_all("options => options.map(option => option.value)")
    )
    assert options.count() < 40
    start = page.get_by_test_id("start")
    page.get_by_test_id("group-learning").locator("summary").click()
    rate = page.get_by_test_id("field-learning.rate")
    rate.fill("11")
    message = "learning.rate = 11: input should be less than or equal to 10"
    setup_error = page.get_by_test_id("setup-fault")
    expect(page.get_by_test_id("main-settings")).to_contain_text(message)
    expect(rate).to_have_attribute("aria-invalid", "true")
    expect(start).to_be_disabled()
    expect(setup_error).to_contain_text(message)
    page.get_by_test_id("group-learning").locator("summary").click()
    page.get_by_test_id("setup-show").click()
    expect(rate).to_be_focused()
    rate.fill("0.5")
    expect(page.get_by_text(message)).to_have_count(0)
    expect(start).to_be_enabled()
    expect(setup_error).to_be_empty()


def test_four_choices_in_words_are_before_all_presets(page: Page) -> None:
    page.goto("/#/live")
    choices = page.get_by_role("group", name="What to simulate").get_by_role("radio")
    expect(choices).to_have_count(4)
    expect(page.get_by_label("Agents that learn", exact=True)).to_be_checked()
    expect(page.get_by_test_id("preset")).to_be_hidden()
    page.get_by_label("Agents that do not learn").check()
    expect(page).to_have_url(re.compile(r"preset=evo/A"))
    expect(page.get_by_test_id("field-learning.rule")).to_have_value("none")
    # A preset without words is shown in the list.
    page.goto("about:blank")
    page.goto("/#/live?preset=evo%2Bdrift/A")
    expect(page.get_by_test_id("preset")).to_have_value("evo+drift/A")
    expect(page.get_by_test_id("preset")).to_be_visible()


def test_the_form_has_one_scroller_and_names_its_settings_in_words(page: Page) -> None:
    page.goto(make_address({}))
    page.get_by_test_id("group-population").locator("summary").first.click()
    field = page.get_by_test_id("field-population.size")
    scrollers = field.evaluate(
        """field => {
          const heights = [];
          for (let box = field; box.id !== "view"; box = box.parentElement)
            if (/auto|scroll/.test(getComputedStyle(box).overflowY)) heights.push(box.clientHeight);
          return heights;
        }"""
    )
    assert len(scrollers) == 1 and scrollers[0] >= 300
    # The path is in the tooltip.
    label = page.get_by_text("Number of agents per generation", exact=True)
    expect(label).to_have_attribute("title", "population.size")
    expect(label).to_have_attribute("for", "field-population.size")


@pytest.mark.nightly
def test_too_few_runs_show_a_note_below_their_number(page: Page) -> None:
    page.goto(make_address({}))
    runs = page.get_by_test_id("setup-runs")
    note = page.get_by_test_id("setup-note")
    runs.fill("4")
    expect(note).to_contain_text("At least 5 runs are needed.")
    expect(page.get_by_test_id("start")).to_be_enabled()
    runs.fill("5")
    expect(note).to_be_hidden()


@pytest.mark.nightly
def test_an_error_of_a_group_opens_it(page: Page) -> None:
    page.goto(make_address({"world.start.x": 700}))
    group = page.get_by_test_id("group-world").first
    expect(group).to_have_attribute("open", "")
    expect(group).to_contain_text("world.start.x = 700: must be less than world.width = 640")


def test_an_invalid_number_shows_a_message_at_the_button_until_it_is_fixed(page: Page) -> None:
    page.goto(make_address({}))
    setup_error = page.get_by_test_id("setup-fault")
    runs = page.get_by_test_id("setup-runs")
    for value, message in (
        ("51", "runs = 51 must be at least 1 and at most 50 for a live run"),
        ("", "runs = '' must be a whole number"),
    ):
        runs.fill(value)
        expect(setup_error).to_have_text(f"{message}.")
        expect(runs).to_have_attribute("aria-invalid", "true")
        expect(page.get_by_test_id("start")).to_be_disabled()
        runs.fill("2")
        expect(setup_error).to_be_empty()
        expect(page.get_by_test_id("start")).to_be_enabled()
    page.get_by_test_id("setup-seed").fill("-1")
    expect(setup_error).to_contain_text("seed = -1 must be a whole number from 0")


@pytest.mark.nightly
def test_an_existing_name_shows_a_message_until_it_is_changed(page: Page) -> None:
    live_page = page.context.new_page()
    start_live_run(live_page, QUICK, pace="0")
    live_page.get_by_test_id("save").click()
    live_page.get_by_test_id("save-name").fill("small")
    live_page.get_by_test_id("save-submit").click()
    expect(live_page.get_by_test_id("save-fault")).to_contain_text("small exists already")
    live_page.get_by_test_id("save-name").fill("another")
    live_page.get_by_test_id("save-submit").click()
    expect(live_page.get_by_test_id("open-saved")).to_be_visible()
    live_page.reload()
    expect(live_page.get_by_test_id("open-saved")).to_be_visible()


def test_every_kind_of_field_changes_the_simulated_experiment(
    page: Page, lab_server: LabServer
) -> None:
    page.goto(make_address(QUICK))
    for group in ("network", "learning", "evolution", "world"):
        page.get_by_test_id(f"group-{group}").locator("summary").first.click()
    page.get_by_test_id("field-name").fill("mine")
    page.get_by_test_id("add-network.hidden").click()
    page.get_by_test_id("field-network.hidden.1").fill("7")
    page.get_by_test_id("remove-network.hidden.0").click()
    page.get_by_test_id("field-network.biases").check()
    page.get_by_test_id("field-evolution.selection").select_option("rank")
    page.get_by_label("Learning rate, slider", exact=True).fill("0.03")
    # An empty number of steps means the complete lifetime.
    expect(page.get_by_test_id("field-learning.steps")).to_have_value("")
    page.get_by_test_id("field-learning.steps").fill("250")
    page.get_by_test_id("add-world.food").click()
    page.get_by_test_id("field-world.food.1.count").fill("3")
    page.get_by_test_id("remove-world.food.0").click()
    page.get_by_test_id("start").click()
    expect_state(page, "Done")
    runs = get_json(lab_server.address, "live")["runs"]
    experiment = next(run["experiment"] for run in runs if run["id"] in page.url)
    assert experiment["name"] == "mine"
    assert experiment["network"] == {"kind": "feed-forward", "hidden": [7], "biases": True}
    assert experiment["evolution"]["selection"] == "rank"
    assert (experiment["learning"]["rate"], experiment["learning"]["steps"]) == (0.03, 250)
    assert [region["count"] for region in experiment["world"]["food"]] == [3]
    # The address contains all settings.
    page.reload()
    expect(page.get_by_test_id("field-network.hidden.0")).to_have_value("7")
    expect_state(page, "Done")


def test_a_page_receives_all_generations_after_a_lost_connection(page: Page) -> None:
    sockets: list[WebSocketRoute] = []
    is_noticed = Event()

    def connect_or_close(socket: WebSocketRoute) -> None:
        if sockets and not is_noticed.is_set():
            # The page tries to connect, and shows that the connection is lost.
            socket.close()
            return
        socket.connect_to_server()
        sockets.append(socket)

    page.route_web_socket("**/api/live/*", connect_or_close)
    start_live_run(page, LONG)
    wait_for(page, lambda: count_generations(page) >= 3)
    sockets[0].close()
    expect(page.get_by_test_id("connection")).to_be_visible()
    is_noticed.set()
    before = count_generations(page)
    wait_for(page, lambda: len(sockets) == 2 and count_generations(page) > before)
    expect(page.get_by_test_id("connection")).to_be_hidden()
    page.get_by_test_id("stop").click()
    expect_state(page, "Stopped")


@pytest.mark.nightly
def test_a_live_run_continues_while_another_tab_is_open_and_two_pages_share_it(page: Page) -> None:
    start_live_run(page, LONG)
    wait_for(page, lambda: count_generations(page) >= 2)
    live_address = page.url
    before = count_generations(page)
    page.get_by_test_id("tab-results").click()
    expect(page.get_by_test_id("results")).to_be_visible()
    page.goto(live_address)
    wait_for(page, lambda: count_generations(page) > before)
    second_page = page.context.new_page()
    second_page.goto(live_address)
    wait_for(second_page, lambda: count_generations(second_page) > before)
    second_page.get_by_test_id("stop").click()
    expect_state(page, "Stopped")
    wait_for(page, lambda: count_generations(page) == count_generations(second_page))


@pytest.mark.nightly
def test_the_pace_can_be_changed_while_it_runs(page: Page) -> None:
    start_live_run(page, LONG | {"evolution.generations": 300}, pace="5")
    expect_state(page, "Running")
    page.get_by_test_id("pace").select_option("0")
    expect_state(page, "Done")


@pytest.mark.nightly
def test_a_click_on_a_curve_shows_the_world_of_that_generation(page: Page) -> None:
    start_live_run(
        page, QUICK | {"evolution.generations": 2, "lifetime.steps": 1500}, pace="0", speed="20"
    )
    expect_state(page, "Done")
    plot = page.get_by_test_id("live-fitness").locator(".u-over")
    for x, generation in ((2, 0), (-3, 1), (2, 0)):
        box = read_box(plot)
        plot.click(position={"x": x % box["width"], "y": box["height"] / 2})
        expect(page.get_by_test_id("live-caption")).to_have_text(f"Generation {generation}")


def shown_generation(page: Page) -> int:
    """Return the generation of the shown world, or -1."""
    return int(re.sub(r"\D", "", page.get_by_test_id("live-caption").text_content() or "") or -1)


@pytest.mark.nightly
def test_the_world_is_that_of_the_newest_generation_until_the_user_pauses_it(
    page: Page,
) -> None:
    """Simulate 10 generations per second. The playback of a lifetime takes 40 s."""
    start_live_run(page, LONG | {"lifetime.steps": 2000}, pace="0.1", speed="5")
    wait_for(page, lambda: shown_generation(page) >= 5)
    newest = page.get_by_test_id("live-newest")
    step = page.get_by_test_id("live-step")
    expect(newest).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("live-play").click()
    expect(newest).to_have_attribute("aria-pressed", "false")
    paused_generation = shown_generation(page)
    step_text = step.text_content() or ""
    wait_for(page, lambda: count_generations(page) >= paused_generation + 12)
    assert (shown_generation(page), step.text_content()) == (paused_generation, step_text)
    number = int(step_text.split()[0].replace(",", ""))
    page.get_by_test_id("live-on").click()
    expect(step).to_have_text(f"{number + 1:,} / 1,999")
    page.get_by_test_id("live-canvas").press("ArrowLeft")
    expect(step).to_have_text(step_text)
    page.get_by_test_id("timeline").fill("1500")
    expect(step).to_have_text("1,500 / 1,999")
    assert shown_generation(page) == paused_generation
    newest.click()
    wait_for(page, lambda: shown_generation(page) > paused_generation)
    page.get_by_test_id("stop").click()
    expect_state(page, "Stopped")
    wait_for(page, lambda: shown_generation(page) == count_generations(page) - 1)


@pytest.mark.nightly
def test_the_address_reopens_an_agent_of_a_live_run(page: Page) -> None:
    start_live_run(page, QUICK, pace="0", speed="1")
    expect_state(page, "Done")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 3")
    page.get_by_test_id("live-canvas-agent").select_option("7")
    agent_title = page.get_by_test_id("agent")
    expect(agent_title).to_have_text("Agent 7")
    expect(page.get_by_test_id("responses").get_by_role("row")).to_have_count(1 + 2**3)
    expect(page.get_by_role("row", name="left, front, right")).to_have_text(
        re.compile("(left|forward|right){2}$")
    )
    expect(page.get_by_test_id("live-newest")).to_have_attribute("aria-pressed", "false")
    page.get_by_test_id("live-play").click()
    page.get_by_test_id("timeline").fill("40")
    expect(page.get_by_test_id("live-step")).to_have_text("40 / 299")
    # The address is updated with a delay.
    expect(page).to_have_url(re.compile("generation=3&step=40&agent=7"))
    page.reload()
    expect(agent_title).to_have_text("Agent 7")
    expect(page.get_by_test_id("live-step")).to_have_text("40 / 299")
    page.get_by_test_id("parent").first.click()
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 2")
    expect(agent_title).to_be_visible()
    page.get_by_test_id("live-canvas").press("Escape")
    expect(agent_title).to_be_hidden()


@pytest.mark.nightly
def test_a_new_run_starts_with_the_changed_settings_of_an_old_run(
    page: Page, lab_server: LabServer
) -> None:
    start_live_run(
        page, QUICK | {"evolution.selection": "rank", "name": "mine"}, pace="0", runs=3, seed=8
    )
    expect_state(page, "Done")
    first_id = page.url.split("id=")[1].split("&")[0]
    page.goto("about:blank")
    page.goto(f"/#/live?id={first_id}")
    # The form has the defaults until the settings of the run are copied.
    expect(page.get_by_test_id("setup-runs")).to_have_value("5")
    page.get_by_test_id("again").click()
    expect(page.get_by_test_id("setup-runs")).to_have_value("3")
    expect(page.get_by_test_id("setup-seed")).to_have_value("8")
    expect(page.get_by_test_id("field-name")).to_have_value("mine")
    page.get_by_test_id("setup-seed").fill("9")
    page.get_by_test_id("start").click()
    wait_for(page, lambda: f"id={first_id}" not in page.url)
    expect_state(page, "Done")
    runs = {run["id"]: run for run in get_json(lab_server.address, "live")["runs"]}
    run = next(run for id, run in runs.items() if id in page.url)
    experiment = run["experiment"]
    changed = {name: experiment[name] for name in ("name", "evolution", "lifetime", "world")}
    preset = get_json(lab_server.address, "preset", name="evo+self-taught/A")
    assert experiment == preset | changed
    assert experiment["evolution"]["selection"] == "rank"
    assert experiment["lifetime"]["steps"] == 300
    assert (run["runs"], run["seed"]) == (3, 9)


@pytest.mark.parametrize("width", [390, pytest.param(1280, marks=pytest.mark.nightly)])
def test_the_tab_fits_the_screen(page: Page, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    start_live_run(page, QUICK, pace="0")
    expect_state(page, "Done")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("document.getElementById('view').scrollWidth") <= width


def test_an_unknown_run_shows_a_message(page: Page) -> None:
    page.goto("/#/live?id=0000")
    expect(page.get_by_test_id("live-empty")).to_contain_text("there is no live run '0000'")


@pytest.mark.nightly
def test_the_shown_lifetime_is_downloaded_during_the_run(page: Page, tmp_path: Path) -> None:
    start_live_run(page, LONG)
    expect(page.get_by_test_id("live-caption")).to_contain_text("Generation")
    page.get_by_test_id("share").click()
    with page.expect_download() as download:
        page.get_by_test_id("share-html").click()
    download.value.save_as(tmp_path / "live.html")
    assert "evo+self-taught/A, run 0, generation" in (tmp_path / "live.html").read_text("utf-8")
    page.keyboard.press("Escape")
    page.get_by_test_id("stop").click()
    expect_state(page, "Stopped")
    page.get_by_test_id("tab-results").click()
    expect(page.get_by_test_id("share")).to_have_count(0)
