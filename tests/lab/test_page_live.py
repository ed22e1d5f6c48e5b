"""The Live run tab, in a real browser: what the form says is what lives, and what lives is what is seen."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from baldwinlab.papers.presets import load
from baldwinlab.studies.store import StudyStore
from tests.lab.client import LabServer, get_json

QUICK = {"lifetime.steps": 300, "world.start.x": 400, "evolution.generations": 4}
LONG = QUICK | {"evolution.generations": 300}


def address(changes: dict[str, Any], **more: Any) -> str:
    state = {"preset": "evo+self-taught/A", "runs": 2, "set": json.dumps(changes), **more}
    return "/#/live?" + "&".join(
        f"{name}={quote(str(value), safe='')}" for name, value in state.items()
    )


def begin(page: Page, changes: dict[str, Any], **more: Any) -> None:
    page.goto(address(changes, **more))
    page.get_by_test_id("start").click()
    expect(page.get_by_test_id("live-head")).to_be_visible()


def lived(page: Page) -> int:
    return int((page.get_by_test_id("live-count").text_content() or "").split()[0])


def wait_for(page: Page, what: Callable[[], bool]) -> None:
    for _ in range(400):
        if what():
            return
        page.wait_for_timeout(25)
    pytest.fail("it did not come about")


def state_is(page: Page, word: str) -> None:
    expect(page.get_by_test_id("live-state")).to_have_text(word, timeout=20_000)


def test_a_live_run_is_started_watched_paused_resumed_stopped_kept_and_opened(
    page: Page, lab_server: LabServer
) -> None:
    begin(page, LONG)
    wait_for(page, lambda: lived(page) >= 3)
    expect(page.get_by_test_id("live-caption")).to_have_text(
        re.compile(r"Generation \d+"), timeout=60_000
    )
    page.get_by_test_id("pause").click()
    state_is(page, "Paused")
    page.wait_for_timeout(200)
    before = lived(page)
    page.wait_for_timeout(400)
    assert lived(page) == before
    page.get_by_test_id("pause").click()
    wait_for(page, lambda: lived(page) > before)
    page.get_by_test_id("stop").click()
    state_is(page, "Stopped")
    page.get_by_test_id("keep").click()
    page.get_by_test_id("keep-name").fill("kept/mine")
    page.get_by_test_id("keep-do").click()
    page.get_by_test_id("open-saved").click()
    expect(page.get_by_test_id("results")).to_be_visible()
    assert "study=kept" in page.url
    expect(page.get_by_test_id("curves")).to_contain_text("evo+self-taught/A")
    study = StudyStore(lab_server.root / "kept/mine")
    assert study.runs("evo+self-taught/A") == [0, 1]
    generations = study.experiment("evo+self-taught/A").evolution.generations
    asked = load("evo+self-taught/A").replace(lifetime={"steps": 300}, world={"start": {"x": 400}})
    assert study.experiment("evo+self-taught/A") == asked.replace(
        evolution={"generations": generations}
    )


def test_a_value_out_of_range_shows_the_configs_sentence_beside_its_field(page: Page) -> None:
    page.goto(address({}))
    start = page.get_by_test_id("start")
    page.get_by_test_id("group-learning").locator("summary").click()
    rate = page.get_by_test_id("field-learning.rate")
    rate.fill("11")
    sentence, why = (
        "learning.rate = 11: input should be less than or equal to 10",
        page.get_by_test_id("setup-fault"),
    )
    expect(page.get_by_test_id("group-learning")).to_contain_text(sentence)
    expect(rate).to_have_attribute("aria-invalid", "true")
    expect(start).to_be_disabled()
    expect(why).to_contain_text(sentence)  # beside the button
    page.get_by_test_id("group-learning").locator("summary").click()
    page.get_by_test_id("setup-show").click()
    expect(rate).to_be_focused()
    rate.fill("0.5")
    expect(page.get_by_text(sentence)).to_have_count(0)
    expect(start).to_be_enabled()
    expect(why).to_be_empty()


def test_runs_that_are_too_few_are_noted_below_their_number(page: Page) -> None:
    page.goto(address({}))
    runs, note = page.get_by_test_id("setup-runs"), page.get_by_test_id("setup-note")
    runs.fill("4")
    expect(note).to_contain_text("At least 5 runs are needed.")
    expect(page.get_by_test_id("start")).to_be_enabled()
    runs.fill("5")
    expect(note).to_be_hidden()


def test_a_fault_of_a_whole_part_opens_its_group(page: Page) -> None:
    page.goto(address({"world.start.x": 700}))
    group = page.get_by_test_id("group-world").first
    expect(group).to_have_attribute("open", "")
    expect(group).to_contain_text("world.start.x = 700: must be less than world.width = 640")


def test_what_is_too_large_is_refused_beside_the_button_until_it_is_mended(page: Page) -> None:
    page.goto(address({}))
    why, runs = page.get_by_test_id("setup-fault"), page.get_by_test_id("setup-runs")
    for wrong, sentence in (
        ("51", "runs = 51 must be at least 1 and at most 50 for a live run"),
        ("", "runs = '' must be a whole number"),
    ):
        runs.fill(wrong)
        expect(why).to_have_text(f"{sentence}.")
        expect(runs).to_have_attribute("aria-invalid", "true")
        expect(page.get_by_test_id("start")).to_be_disabled()
        runs.fill("2")
        expect(why).to_be_empty()
        expect(page.get_by_test_id("start")).to_be_enabled()
    page.get_by_test_id("setup-seed").fill("-1")
    expect(why).to_contain_text("seed = -1 must be at least 0")


def test_a_name_that_is_taken_can_be_chosen_again(page: Page) -> None:
    other = page.context.new_page()
    begin(other, QUICK, pace="0")
    other.get_by_test_id("keep").click()
    other.get_by_test_id("keep-name").fill("small")
    other.get_by_test_id("keep-do").click()
    expect(other.get_by_test_id("keep-fault")).to_contain_text("small exists already")
    other.get_by_test_id("keep-name").fill("another")
    other.get_by_test_id("keep-do").click()
    expect(other.get_by_test_id("open-saved")).to_be_visible()
    other.reload()
    expect(other.get_by_test_id("open-saved")).to_be_visible()


def test_every_kind_of_field_changes_the_experiment_that_lives(
    page: Page, lab_server: LabServer
) -> None:
    page.goto(address(QUICK))
    for group in ("network", "learning", "evolution", "world"):
        page.get_by_test_id(f"group-{group}").locator("summary").first.click()
    page.get_by_test_id("field-name").fill("mine")
    page.get_by_test_id("add-network.hidden").click()
    page.get_by_test_id("field-network.hidden.1").fill("7")
    page.get_by_test_id("remove-network.hidden.0").click()
    page.get_by_test_id("field-network.biases").check()
    page.get_by_test_id("field-evolution.selection").select_option("rank")
    page.get_by_label("rate, slider", exact=True).fill("0.03")
    expect(page.get_by_test_id("field-learning.steps")).to_have_value("")  # for life
    page.get_by_test_id("field-learning.steps").fill("250")
    page.get_by_test_id("add-world.food").click()
    page.get_by_test_id("field-world.food.1.count").fill("3")
    page.get_by_test_id("remove-world.food.0").click()
    page.get_by_test_id("start").click()
    state_is(page, "Done")
    found = next(
        run for run in get_json(lab_server.address, "live")["runs"] if run["id"] in page.url
    )["experiment"]
    assert found["name"] == "mine"
    assert found["network"] == {"kind": "feed-forward", "hidden": [7], "biases": True}
    assert found["evolution"]["selection"] == "rank"
    assert (found["learning"]["rate"], found["learning"]["steps"]) == (0.03, 250)
    assert [region["count"] for region in found["world"]["food"]] == [3]
    page.reload()  # the address says it all
    expect(page.get_by_test_id("field-network.hidden.0")).to_have_value("7")
    state_is(page, "Done")


def test_a_page_that_was_cut_off_gets_all_generations_again(page: Page) -> None:
    sockets: list[WebSocketRoute] = []
    noticed: list[bool] = []

    def pass_on(socket: WebSocketRoute) -> None:
        if sockets and not noticed:
            socket.close()  # the page tries again, and says so
            return
        socket.connect_to_server()
        sockets.append(socket)

    page.route_web_socket("**/api/live/*", pass_on)
    begin(page, LONG)
    wait_for(page, lambda: lived(page) >= 3)
    sockets[0].close()
    expect(page.get_by_test_id("connection")).to_be_visible()
    noticed.append(True)
    before = lived(page)
    wait_for(page, lambda: len(sockets) == 2 and lived(page) > before)
    expect(page.get_by_test_id("connection")).to_be_hidden()
    page.get_by_test_id("stop").click()
    state_is(page, "Stopped")


def test_another_view_does_not_end_a_live_run_and_two_pages_share_it(page: Page) -> None:
    begin(page, LONG)
    wait_for(page, lambda: lived(page) >= 2)
    where, before = page.url, lived(page)
    page.get_by_test_id("tab-results").click()
    expect(page.get_by_test_id("results")).to_be_visible()
    page.goto(where)
    wait_for(page, lambda: lived(page) > before)
    other = page.context.new_page()
    other.goto(where)
    wait_for(other, lambda: lived(other) > before)
    other.get_by_test_id("stop").click()
    state_is(page, "Stopped")
    wait_for(page, lambda: lived(page) == lived(other))


def test_the_pace_can_be_changed_while_it_runs(page: Page) -> None:
    begin(page, LONG, pace="5")
    state_is(page, "Running")
    page.get_by_test_id("pace").select_option("0")
    state_is(page, "Done")


def test_a_click_on_a_curve_shows_the_world_of_that_generation(page: Page) -> None:
    begin(page, QUICK | {"evolution.generations": 2, "lifetime.steps": 1500}, pace="0", speed="20")
    state_is(page, "Done")
    plot = page.get_by_test_id("live-fitness").locator(".u-over")
    for x, generation in ((2, 0), (-3, 1), (2, 0)):
        box = plot.bounding_box()
        assert box
        plot.click(position={"x": x % box["width"], "y": box["height"] / 2})
        expect(page.get_by_test_id("live-caption")).to_have_text(
            f"Generation {generation}", timeout=60_000
        )


def shown(page: Page) -> int:
    """The generation whose world is shown."""
    return int(re.sub(r"\D", "", page.get_by_test_id("live-caption").text_content() or "") or -1)


def test_the_world_is_that_of_the_newest_generation_until_the_reader_looks_closer(
    page: Page,
) -> None:
    """Lives of 2000 steps at 5x take 40 s each, and generations come ten times a second."""
    begin(page, LONG | {"lifetime.steps": 2000}, pace="0.1", speed="5")
    wait_for(page, lambda: shown(page) >= 5)
    newest, step = page.get_by_test_id("live-newest"), page.get_by_test_id("live-step")
    expect(newest).to_have_attribute("aria-pressed", "true")
    page.get_by_test_id("live-play").click()
    expect(newest).to_have_attribute("aria-pressed", "false")
    held, at = shown(page), step.text_content()
    wait_for(page, lambda: lived(page) >= held + 12)
    assert (shown(page), step.text_content()) == (held, at)
    number = int((at or "").split()[1].replace(",", ""))
    page.get_by_test_id("live-on").click()
    expect(step).to_have_text(f"step {number + 1:,} of 2,000")
    page.get_by_test_id("live-canvas").press("ArrowLeft")
    expect(step).to_have_text(at or "")
    page.get_by_test_id("timeline").fill("1500")
    expect(step).to_have_text("step 1,500 of 2,000")
    assert shown(page) == held
    newest.click()
    wait_for(page, lambda: shown(page) > held)
    page.get_by_test_id("stop").click()
    state_is(page, "Stopped")
    wait_for(page, lambda: shown(page) == lived(page) - 1)


def test_an_agent_of_a_live_world_is_opened_and_the_address_opens_it_again(page: Page) -> None:
    begin(page, QUICK, pace="0", speed="1")
    state_is(page, "Done")
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 3")
    page.get_by_test_id("live-canvas-agent").select_option("7")
    inside = page.get_by_test_id("agent")
    expect(inside).to_have_text("Agent 7")
    expect(page.get_by_test_id("responses").get_by_role("row")).to_have_count(1 + 2**3)
    expect(page.get_by_role("row", name="left, front, right")).to_have_text(
        re.compile("(left|forward|right){2}$")
    )
    expect(page.get_by_test_id("live-newest")).to_have_attribute("aria-pressed", "false")
    page.get_by_test_id("live-play").click()
    page.get_by_test_id("timeline").fill("40")
    expect(page.get_by_test_id("live-step")).to_have_text("step 40 of 300")
    page.wait_for_timeout(500)  # until the address has followed
    assert "generation=3&step=40&agent=7" in page.url
    page.reload()
    expect(inside).to_have_text("Agent 7")
    expect(page.get_by_test_id("live-step")).to_have_text("step 40 of 300")
    page.get_by_test_id("parent").first.click()
    expect(page.get_by_test_id("live-caption")).to_have_text("Generation 2")
    expect(inside).to_be_visible()
    page.get_by_test_id("live-canvas").press("Escape")
    expect(inside).to_be_hidden()


def test_a_run_is_changed_and_run_again_from_its_own_values(
    page: Page, lab_server: LabServer
) -> None:
    begin(page, QUICK | {"evolution.selection": "rank", "name": "mine"}, pace="0", runs=3, seed=8)
    state_is(page, "Done")
    first = page.url.split("id=")[1].split("&")[0]
    page.goto("about:blank")
    page.goto(f"/#/live?id={first}")
    expect(page.get_by_test_id("setup-runs")).to_have_value("5")  # not this run's
    page.get_by_test_id("again").click()
    expect(page.get_by_test_id("setup-runs")).to_have_value("3")
    expect(page.get_by_test_id("setup-seed")).to_have_value("8")
    expect(page.get_by_test_id("field-name")).to_have_value("mine")
    page.get_by_test_id("setup-seed").fill("9")
    page.get_by_test_id("start").click()
    wait_for(page, lambda: f"id={first}" not in page.url)
    state_is(page, "Done")
    runs = {run["id"]: run for run in get_json(lab_server.address, "live")["runs"]}
    again = next(run for id, run in runs.items() if id in page.url)
    assert again["experiment"] == get_json(
        lab_server.address, "preset", name="evo+self-taught/A"
    ) | {name: again["experiment"][name] for name in ("name", "evolution", "lifetime", "world")}
    assert (
        again["experiment"]["evolution"]["selection"],
        again["experiment"]["lifetime"]["steps"],
    ) == ("rank", 300)
    assert (again["runs"], again["seed"]) == (3, 9)


@pytest.mark.parametrize("width", [390, 1280])
def test_the_tab_fits_the_screen(page: Page, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    begin(page, QUICK, pace="0")
    state_is(page, "Done")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("document.getElementById('view').scrollWidth") <= width


def test_a_run_that_is_gone_is_named(page: Page) -> None:
    page.goto("/#/live?id=0000")
    expect(page.get_by_test_id("live-empty")).to_contain_text("there is no live run '0000'")


def test_what_plays_can_be_taken_along_while_the_run_goes_on(page: Page, tmp_path: Path) -> None:
    begin(page, LONG)
    expect(page.get_by_test_id("live-caption")).to_contain_text("Generation", timeout=60_000)
    page.get_by_test_id("share").click()
    with page.expect_download() as saved:
        page.get_by_test_id("share-html").click()
    saved.value.save_as(tmp_path / "live.html")
    assert "evo+self-taught/A, run 0, generation" in (tmp_path / "live.html").read_text("utf-8")
    page.keyboard.press("Escape")
    page.get_by_test_id("stop").click()
    state_is(page, "Stopped")
    page.get_by_test_id("tab-results").click()
    expect(page.get_by_test_id("share")).to_have_count(0)
